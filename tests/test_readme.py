"""The README is short, and its results are those stored."""

import configparser
import re
from pathlib import Path

import pytest

from nep.players.contestants import Checkpoint
from sgm.files import read_json
from tools.headlines import main

README = Path(__file__).resolve().parents[1] / "README.md"


def test_the_twenty_lines_are_twenty():
    """That they print what stands below them is in tests/docs/test_blocks.py."""
    (block,) = re.findall(r"```python\n(.*?)```", README.read_text("utf-8"), re.DOTALL)
    assert len([line for line in block.splitlines() if line]) <= 20


def test_what_is_said_of_results_is_what_the_command_prints(capsys):
    """All that `tools.headlines` prints stands in results/headlines.md, but its end in README."""
    results = README.parent / "results"
    main(["--results", str(results)])
    parts = capsys.readouterr().out.strip().split("\n\n")
    assert len(parts) == 8
    for page, shown in ((results / "headlines.md", parts[:6]), (README, parts[6:])):
        text = " ".join(page.read_text("utf-8").split())  # lines may be broken otherwise
        for part in shown:
            assert " ".join(part.split()) in text, f"{page.name} must have what is printed:\n{part}"


@pytest.mark.parametrize("page", ["any_home", "kitchens"])
def test_what_the_table_is_of_is_the_network_that_ships(page):
    scores = read_json(README.parent / "results" / f"{page}.json", allow_nan=True)
    assert scores["networks"]["any_home"] == Checkpoint.parse("any_home").compute_checksum()


def test_the_table_has_four_rows_of_single_figures():
    rows = re.search(r"\| homes \|.*\n\| --- .*\n((?:\|.*\n)+)", README.read_text("utf-8"))[1]
    assert len(rows.splitlines()) == 4
    assert " / " not in rows
    for word in ("Holm", "NLL", "comparisons"):
        assert word not in README.read_text("utf-8")


def test_other_numbers_are_those_of_the_results():
    results = README.parent / "results"
    claims = (results / "claims.md").read_text("utf-8")
    found = re.search(r"\| 32 places, on \| informed \| 0(\.\d+) \|", claims)
    assert found is not None
    assert f"(`informed`, {found[1]})" in (results / "headlines.md").read_text("utf-8")


def test_the_readme_is_a_screen_longer_than_its_twenty_lines():
    text = README.read_text("utf-8").partition("## Cite")[0]
    twenty = re.search(r"## In twenty lines.*?\n## ", text, re.DOTALL)[0]
    assert len(text.splitlines()) - len(twenty.splitlines()) <= 60


@pytest.mark.parametrize("page", ["README.md", "docs/index.md"])
def test_a_reader_meets_at_most_four_links(page):
    text = (README.parent / page).read_text("utf-8")
    rows = re.search(r"\| you are \|.*\n\| --- .*\n((?:\|.*\n)+)", text)[1].splitlines()
    assert len(rows) >= 3
    assert {row: row.count("](") for row in rows if row.count("](") > 4} == {}


@pytest.mark.parametrize("page", ["robot", "researcher", "benchmark"])
def test_a_first_page_ends_with_at_most_four_next_ones(page):
    text = (README.parent / "docs" / "start" / f"{page}.md").read_text("utf-8")
    rows = text.partition("## Next\n\n| to | read |\n| --- | --- |\n")[2].splitlines()
    assert 1 <= len(rows) <= 4
    assert all(row.startswith("| ") for row in rows)


def test_the_guides_are_in_proportion():
    """One reader and one question a page; figures are in results/, tables of code in the site."""
    sizes = [path.stat().st_size for path in (README.parent / "docs").rglob("*.md")]
    assert sum(sizes) <= 345_000
    assert max(sizes) <= 30_000


def test_make_installs_extras_that_there_are():
    """pip warns of one that is unknown, and goes on without it."""
    settings = configparser.ConfigParser()
    settings.read(README.parent / "setup.cfg", encoding="utf-8")
    made = re.findall(r"'\.\[([\w,]+)\]'", (README.parent / "Makefile").read_text(encoding="utf-8"))
    named = {extra for text in made for extra in text.split(",")}
    assert named
    assert named <= set(settings["options.extras_require"])
