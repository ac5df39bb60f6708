"""The tables of results/paper_homes.md are those of its stored scores."""

import subprocess
import sys

import pytest

from tests.imports import ROOT


@pytest.mark.slow
def test_the_page_has_the_tables_of_its_scores():
    done = subprocess.run(
        [sys.executable, "-m", "tools.make_paper_homes", "results/paper_homes.json"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    page = (ROOT / "results" / "paper_homes.md").read_text("utf-8")
    tables = done.stdout.strip().split("\n\n")
    assert len(tables) == 2
    assert [table for table in tables if table not in page] == []
