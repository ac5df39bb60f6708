"""docs/serve.md names calls that there are; the page of calls has every argument and field."""

import re
from pathlib import Path

from sgm.serve.calls import CALLS
from sgm.serve.documents import make_tables

PAGE = (Path(__file__).parents[3] / "docs" / "serve.md").read_text("utf-8")


def find_code(language):
    """The blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_of_calls_has_every_argument_and_every_field_of_an_answer():
    parts = dict(part.split("\n", 1) for part in make_tables().split("\n### ")[1:])
    for call in CALLS:
        assert call.about in parts[call.name]
        shown = re.findall(r"^\| `(\w+)` \|", parts[call.name], re.MULTILINE)
        assert shown == [argument.name for argument in call.arguments]
        answer = call.make_output_schema()
        fields = re.findall(r"^\| `(\w+)` \|", parts[answer["title"]], re.MULTILINE)
        assert fields == [*answer["properties"]]


def test_the_lines_of_cpp_name_calls_that_there_are():
    (lines,) = find_code("cpp")
    assert len(lines.splitlines()) <= 24
    assert set(re.findall(r'call\("(\w+)"', lines)) == {"observe", "where_is"}
