"""docs/serve.md: its C++ names calls; docs/reference/calls.md: the schema of every call."""

import re
from pathlib import Path

from sgm.serve.documents import make_tables

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "serve.md").read_text("utf-8")
CALLS = (DOCS / "reference" / "calls.md").read_text("utf-8")


def find_code(language):
    """The blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_has_the_schema_of_every_call():
    shown = CALLS.partition("<!-- calls -->\n")[2].partition("<!-- end -->")[0]
    assert shown == f"\n{make_tables()}", "Write it again: python -m sgm.serve.documents"


def test_the_lines_of_cpp_name_calls_that_there_are():
    (lines,) = find_code("cpp")
    assert len(lines.splitlines()) <= 24
    assert set(re.findall(r'call\("(\w+)"', lines)) == {"observe", "where_is"}
