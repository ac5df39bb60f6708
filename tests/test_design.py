"""docs/design.md: what the code cites is there, and its figures are what its script prints."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.imports import PACKAGES

ROOT = Path(__file__).resolve().parents[1]
PAGE = (ROOT / "docs" / "design.md").read_text(encoding="utf-8")
RULING = re.compile(r"rulings? +((?:\d+(?:-\d+)?(?:,| and|, and)? *)+)", re.IGNORECASE)
SOURCES = sorted(
    path
    for folder in (*PACKAGES, "benchmarks", "docs", "tests", "notebooks")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".py", ".md", ".yaml", ".ipynb")
    and path.name not in ("design.md", Path(__file__).name)
)


def list_rulings(text: str) -> set[int]:
    """Numbers of all rulings that a text cites; "rulings 3-5 and 7" cites four."""
    numbers: set[int] = set()
    for cited in RULING.findall(text):
        for first, last in re.findall(r"(\d+)(?:-(\d+))?", cited):
            numbers |= set(range(int(first), int(last or first) + 1))
    return numbers


def list_cited() -> dict[str, set[int]]:
    """Rulings that each file cites."""
    cited = {
        str(path.relative_to(ROOT)): list_rulings(path.read_text(encoding="utf-8"))
        for path in SOURCES
    }
    return {name: numbers for name, numbers in cited.items() if numbers}


@pytest.mark.parametrize(
    ("text", "numbers"),
    [
        ("Source: docs/design.md, rulings 3-5 and 7.", {3, 4, 5, 7}),
        ("see ruling 12).", {12}),
        ("rulings 2, 7 and 8", {2, 7, 8}),
        ("a ruling of 5 judges", set()),
    ],
)
def test_citations_are_understood(text, numbers):
    assert list_rulings(text) == numbers


def test_every_cited_ruling_is_on_the_page():
    rulings = [int(number) for number in re.findall(r"^\| (\d+) \|", PAGE, re.MULTILINE)]
    assert rulings == list(range(1, len(rulings) + 1))
    cited = list_cited()
    assert len(cited) > 10
    unknown = {name: numbers - set(rulings) for name, numbers in cited.items()}
    assert {name: numbers for name, numbers in unknown.items() if numbers} == {}


def test_citations_in_code_name_the_page():
    lost = [
        name
        for name in list_cited()
        if name.endswith(".py") and "docs/design.md" not in (ROOT / name).read_text("utf-8")
    ]
    assert lost == []


def test_every_page_that_is_named_exists():
    named = {
        (str(path.relative_to(ROOT)), page)
        for path in SOURCES
        if path.suffix == ".py"
        for page in re.findall(r"\b(?:docs|results)/[\w/]+\.md", path.read_text(encoding="utf-8"))
    }
    assert len(named) > 10
    assert [pair for pair in sorted(named) if not (ROOT / pair[1]).is_file()] == []


@pytest.mark.slow
def test_the_figures_are_those_that_the_script_prints():
    done = subprocess.run(
        [sys.executable, "-m", "tools.measure_design"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    lines = dict(line.split(": ", 1) for line in done.stdout.splitlines())
    assert lines.keys() == {"moves", "class noise", "prior feature", "scaled times"}
    page = " ".join(PAGE.replace(" %", "%").split())
    missing = [line for line in lines.values() if line.replace(" %", "%") not in page]
    assert missing == []
