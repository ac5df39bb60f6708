"""`python -m tools.priors build`, from a table."""

import pytest

from sgm.prior.prior_graph import PriorGraph
from tests.prior_table import TABLE, build_prior
from tools.priors.__main__ import main


@pytest.fixture
def built(tmp_path):
    return build_prior(tmp_path)


def test_build_says_what_it_left_out(tmp_path, capsys, built):
    printed = capsys.readouterr().out
    assert "outside the objects table: 1 (unicorn 1)" in printed
    assert "dropped objects: apple, box," in printed
    assert "2 rooms, 5 furniture nodes" in printed
    probs = {(row.furniture, row.object): row.prob for row in PriorGraph.load(built).placements}
    assert probs["fridge", "egg"] == 0.75


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("nothing", "source must be one of procthor, behavior"),
        ("igibson", "source 'igibson' must have a path"),
        ("table=missing.csv", "source 'table' must exist, got missing.csv"),
    ],
)
def test_build_refuses_unknown_sources(tmp_path, capsys, source, message):
    out = tmp_path / "prior.json"
    assert main(["build", "--source", source, "--out", str(out)]) == 1
    assert message in capsys.readouterr().err
    assert not out.exists()


def test_bad_rows_stop_the_build_unless_skipped(tmp_path, capsys):
    table = tmp_path / "mine.csv"
    table.write_text(f"{TABLE}kitchen,fridge,egg,under,1\n")
    arguments = ["build", "--source", f"table={table}", "--out", str(tmp_path / "p.json")]
    assert main([*arguments, "--min-edges", "1"]) == 1
    assert "mine.csv:9" in capsys.readouterr().err
    assert main([*arguments, "--min-edges", "1", "--skip-bad"]) == 0
    assert "bad rows skipped: 1; first: relation must be onTop or in" in capsys.readouterr().out
