"""`python -m simulator.priors`: show, check."""

import json

import pytest

from simulator.priors.__main__ import main
from tests.prior_table import TABLE, build_prior
from tools.priors.__main__ import main as build


@pytest.fixture
def built(tmp_path):
    return build_prior(tmp_path)


def test_check_lists_every_problem(built, capsys):
    assert main(["check", str(built)]) == 0
    assert "2 rooms" in capsys.readouterr().out
    data = json.loads(built.read_text())
    data["placements"][1]["prob"] = -1
    data["objects"][0]["max_count"] = 0
    built.write_text(json.dumps(data))
    assert main(["check", str(built)]) == 1
    printed = capsys.readouterr()
    assert "placements[1].prob must be a finite number" in printed.out
    assert "objects[0].max_count must be a whole number" in printed.out
    assert "2 problems" in printed.err


def test_check_notes_a_file_edited_by_hand(built, capsys):
    data = json.loads(built.read_text())
    data["placements"][0]["prob"] = 0.123
    built.write_text(json.dumps(data))
    assert main(["check", str(built)]) == 0
    assert "edited since it was built" in capsys.readouterr().out
    assert main(["check", str(built.with_name("none.json"))]) == 1


@pytest.mark.parametrize("options", [[], ["--room", "kitchen"], ["--object", "egg"]])
def test_show_prints_and_draws(built, tmp_path, capsys, options):
    picture = tmp_path / "graph.png"
    assert main(["show", str(built), "--out", str(picture), *options]) == 0
    printed = capsys.readouterr().out
    assert "fridge" in printed
    assert ("bed" in printed) == (not options)
    for path in (picture, tmp_path / "graph-heat.png"):
        assert path.read_bytes().startswith(b"\x89PNG")


def test_as_many_rows_as_there_are_at_least_one(capsys):
    assert main(["show", "--top=-1"]) == 1
    assert capsys.readouterr().err == "error: top must be at least 1, got -1. Raise it.\n"


def test_show_draws_a_coarse_prior(tmp_path):
    table = tmp_path / "mine.csv"
    table.write_text(TABLE)
    path = tmp_path / "coarse.json"
    arguments = ["build", "--source", f"table={table}", "--out", str(path), "--min-edges", "1"]
    assert build([*arguments, "--coarse"]) == 0
    assert main(["show", str(path), "--out", str(tmp_path / "coarse.png")]) == 0
    assert (tmp_path / "coarse.png").exists()


def test_show_names_what_there_is(built, capsys):
    assert main(["show", str(built), "--room", "attic"]) == 1
    assert "room must be one of kitchen, bedroom, got 'attic'" in capsys.readouterr().err
    assert main(["show", str(built), "--object", "egs"]) == 1
    assert "object must be in the prior, got 'egs'" in capsys.readouterr().err
