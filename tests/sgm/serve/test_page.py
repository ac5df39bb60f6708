"""docs/serve.md: the code that it shows; docs/reference/calls.md: the schema of every call."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from sgm.serve.documents import make_tables

from .conftest import open_service, run_server

DOCS = Path(__file__).parents[3] / "docs"
PAGE = (DOCS / "serve.md").read_text("utf-8")
CALLS = (DOCS / "reference" / "calls.md").read_text("utf-8")


def find_code(language):
    """The blocks of code in a language."""
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_page_has_the_schema_of_every_call():
    shown = CALLS.partition("<!-- calls -->\n")[2].partition("<!-- end -->")[0]
    assert shown == f"\n{make_tables()}", "Write it again: python -m sgm.serve.documents"


def test_the_lines_of_python_run(capsys):
    (lines,) = find_code("python")
    exec(lines, {})
    assert capsys.readouterr().out == "table in kitchen\n"


def test_the_lines_of_javascript_run(tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not installed")
    (lines,) = find_code("javascript")
    assert len(lines.splitlines()) <= 22
    (tmp_path / "ask.mjs").write_text(lines)
    home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, home, tools=False) as running:
        done = subprocess.run(
            [node, tmp_path / "ask.mjs"],
            env={**os.environ, "SGM_SERVER": f"http://127.0.0.1:{running.port}"},
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
    assert done.returncode == 0, done.stderr
    assert "look at desk in study" in done.stdout
    assert service.where_is("mug").places[0].name == "desk in study"


def test_the_lines_of_cpp_name_calls_that_there_are():
    (lines,) = find_code("cpp")
    assert len(lines.splitlines()) <= 24
    assert set(re.findall(r'call\("(\w+)"', lines)) == {"observe", "where_is"}
