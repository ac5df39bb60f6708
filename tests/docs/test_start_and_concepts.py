"""The first pages of the site: what they say in Python and in commands runs, as it stands there."""

import os
import subprocess

import pytest

from sgm.schema import HOME, TABLES
from tests.guides import DOCS, list_commands, read_page, run_page, write_files

ROOT = DOCS.parent
CONCEPTS = ("memory", "belief", "questions", "priors", "time")
PAGES = [
    "index",
    "start/robot",
    "start/researcher",
    "any_home",
    "priors",
    *(f"concepts/{name}" for name in CONCEPTS),
]


@pytest.mark.parametrize("page", PAGES)
def test_the_code_prints_what_stands_below_it(page, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert len(run_page(read_page(f"{page}.md"), page, capsys)) >= 1


@pytest.mark.parametrize("concept", CONCEPTS)
def test_a_concept_has_one_picture_and_one_equation(concept):
    text = read_page(f"concepts/{concept}.md")
    assert text.count("![") == 1
    assert text.count("\n$$\n") == 2  # before and after
    assert (DOCS / "images" / f"concept-{concept}.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize(("page", "num_commands"), [("researcher", 2), ("benchmark", 4)])
def test_the_commands_run(page, num_commands, tmp_path, python):
    text = read_page(f"start/{page}.md")
    write_files(text, tmp_path)
    commands = list(list_commands(text))
    assert len(commands) == num_commands
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    environment = {**os.environ, "PYTHONPATH": path, "OMP_NUM_THREADS": "1"}
    for arguments in commands:
        done = subprocess.run(
            [python, *arguments],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stdout + done.stderr


def test_the_formats_say_of_every_column_of_a_memory_file_what_the_schema_says():
    text = read_page("reference/files.md")
    rows = [
        f"| `{table}` | `{column.name}` | {column.text} |"
        for table, columns in {**TABLES, "home": HOME}.items()
        for column in columns
        if not column.is_derived
    ]
    assert "\n".join(["| table | column | is |", "| --- | --- | --- |", *rows, ""]) in text
