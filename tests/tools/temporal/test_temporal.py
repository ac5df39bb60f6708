"""`python -m nep.bench temporal`, shrunk: whole, resumed, partial, written again, refused."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from simulator.command_line import parse
from simulator.policies import make_policy
from simulator.world.streams import Streams
from tools.temporal.plan import (
    TINY,
    Entry,
    Sizes,
    Workshop,
    keep_unit,
    list_kinds,
    play_kind,
)
from tools.temporal.report import NEGATIVES, SIGHTINGS, TableRow, make_report
from tools.temporal.suite import RULES, Temporal, main, make_content, read_sizes

SMALL = ["--tiny", "--trials=0", "--seeds=2", "--kinds=paper_on", "--networks=recurrent"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A whole tiny table."""
    pytest.importorskip("torch_geometric", reason="torch_geometric is not installed")
    folder = tmp_path_factory.mktemp("temporal")
    run(folder)
    return folder


def run(folder: Path, *options: str) -> None:
    main([*SMALL, "--out", str(folder / "out"), "--runs", str(folder / "runs"), *options])


def read_times(folder: Path) -> dict[str, int]:
    files = (path for path in (folder / "runs").rglob("*") if path.suffix in (".json", ".pt"))
    return {str(path): path.stat().st_mtime_ns for path in files}


@pytest.mark.slow
def test_every_row_says_its_trainings(folder):
    content = json.loads((folder / "out" / "temporal.json").read_text())
    assert content["missing"] == []
    rows = content["kinds"]["paper_on"]["rows"]
    assert [row["name"] for row in rows] == [*RULES, "GRU per thing", "GRU per thing"]
    assert [row["reads"] for row in rows[-2:]] == [SIGHTINGS, NEGATIVES]
    assert [len(row["plays"]) for row in rows[-2:]] == [2, 2]
    text = (folder / "out" / "temporal.md").read_text()
    assert f"| GRU per thing | {NEGATIVES} | 2 |" in text
    assert "What negative looks add to first guesses" in text
    assert "Not complete" not in text
    assert str(folder) not in text
    assert content["command"] == (
        "python -m nep.bench temporal --kinds paper_on --networks recurrent --seeds 2 --tiny True "
        "--trials 0"
    )


@pytest.mark.slow
def test_what_is_finished_stays_and_what_was_changed_is_done_again(folder, capsys):
    before = read_times(folder)
    capsys.readouterr()
    run(folder)
    assert read_times(folder) == before
    assert "trained" not in capsys.readouterr().out
    entry = Entry("paper_on", "recurrent", True)
    path = folder / "runs" / entry.key / "seed_1.pt"
    scores = (folder / "out" / "temporal.json").read_text()
    path.write_bytes(path.read_bytes() + b"x")
    run(folder)
    assert "trained paper_on/recurrent-sightings 1" in capsys.readouterr().out
    content, kept = (
        json.loads(text)["kinds"]["paper_on"]["rows"]
        for text in ((folder / "out" / "temporal.json").read_text(), scores)
    )
    for new, old in zip(content, kept, strict=True):  # the same training, to the bit
        for own, other in zip(new["plays"], old["plays"], strict=True):
            assert own["first_guess"] == other["first_guess"]
            assert own["nll"] == other["nll"]


@pytest.mark.slow
def test_a_table_of_what_is_complete_names_what_is_missing(folder, tmp_path):
    out = ["--out", str(tmp_path), "--seeds=3", "--table_only"]
    run(folder, *out)
    text = (tmp_path / "temporal.md").read_text()
    assert "**Not complete**: 2 trainings of the plan" in text
    assert "paper_on/recurrent-sightings seed 2" in text
    assert f"| GRU per thing | {SIGHTINGS} | 2 |" in text
    # asked for one training, the two that there are stay in the table
    run(folder, *out[:2], "--seeds=1", "--table_only")
    fewer = (tmp_path / "temporal.md").read_text()
    assert "Not complete" not in fewer
    assert f"| GRU per thing | {SIGHTINGS} | 2 |" in fewer
    text = fewer
    again = tmp_path / "again"
    main(["--stored", str(tmp_path / "temporal.json"), "--out", str(again)])
    assert (again / "temporal.md").read_text() == text


def test_graph_memories_are_rows_of_every_kind(tmp_path):
    """Of the second kind, too, after the trainings of the first."""
    kinds = {name: list_kinds(TINY)[name] for name in ("paper_on", "paper_off")}
    entry = Entry("paper_on", "recurrent", True)
    for kind in kinds:
        path = tmp_path / kind / "references" / "heat.json"
        keep_unit(path, {"player": "heat", "checksum": "0a"}, lambda: {"nll": [1.0]})
    keep_unit(tmp_path / entry.key / "played_0.json", {}, lambda: {"nll": [2.0]})
    keep_unit(
        tmp_path / entry.key / "seed_0.json", {}, lambda: {"seconds": 3.0, "checkpoint": "0b"}
    )
    workshop = Workshop(tmp_path, TINY, kinds, {})
    content = make_content(workshop, [entry], 1, (), ["heat"], "by hand")["kinds"]
    rows = {
        kind: [(row["reads"], row["checkpoints"]) for row in content[kind]["rows"]]
        for kind in kinds
    }
    memory = ("graph memory", ["0a"])
    assert rows == {"paper_on": [memory, (SIGHTINGS, ["0b"])], "paper_off": [memory]}


def test_differences_and_information_by_hand():
    """Homes .2 and .4 of the rule; the network .4 and .8, .5 and .7: +.3 over both trainings."""

    def play(*first_guess):
        return {
            "first_guess": list(first_guess),
            "mrr": [0.5, 0.5],
            "nll": [1.0, 1.0],
            "looks": [2.0, 2.0],
            "milliseconds": 1.0,
        }

    rows = [
        {"name": "bayesian", "reads": "rule", "plays": [play(0.2, 0.4)]},
        {"name": "any_home", "reads": "graph memory", "plays": [play(0.9, 0.9)]},
        {
            "name": "TGN",
            "reads": SIGHTINGS,
            "plays": [play(0.3, 0.5)],
            "num_trainings": 1,
            "seconds": 3.4,
        },
        {
            "name": "TGN",
            "reads": NEGATIVES,
            "plays": [play(0.4, 0.8), play(0.5, 0.7)],
            "num_trainings": 2,
            "seconds": 5.0,
        },
    ]
    missing = ["k/tgn-negatives seed 1", "k/tgn-negatives seed 2", "k/recurrent-negatives seed 0"]
    content = {
        "command": "python -m nep.bench temporal",
        "made": "by hand",
        "missing": missing,
        "sizes": {name: 1 for name in Sizes.__slots__},
        "kinds": {"k": {"title": "Kind", "units": None, "rows": rows}},
    }
    assert "Trained in 9 homes.\n\n**Not complete**" in make_report(
        {**content, "note": "Trained in 9 homes."}
    )
    text = make_report(content)
    lines = [line for line in text.splitlines() if line.startswith("| ")]
    assert "minus bayesian [95 %]" in lines[0]
    assert [line.split(" | ")[0].strip("| ") for line in lines[2:6]] == [
        "bayesian",
        "TGN",
        "TGN",
        "any_home",
    ]
    assert "| 2 | 0.600 | 0.500 | 1.00 | 2.00 | 1.00 | 5 | +0.300 [" in lines[4]
    # negative looks: the first training of both, .4 - .3 and .8 - .5
    added = next(line for line in lines if line.startswith("| TGN | 1 |"))
    assert "+0.200 [" in added
    assert TableRow(**rows[3]).mean("first_guess") == pytest.approx(0.6)
    assert "Missing: k/tgn-negatives seeds 1, 2; k/recurrent-negatives seed 0." in text
    # the graph memory: .9 - .3 and .9 - .5; .9 - .45 and .9 - .75
    assert f"| TGN | {SIGHTINGS} | 1 | +0.500 [" in text
    assert f"| TGN | {NEGATIVES} | 2 | +0.300 [" in text


def test_a_kind_is_played_home_by_home():
    kind = list_kinds(TINY)["paper_off"]
    assert not kind.sources[0].make(Streams(0, "test", [0])).configs[0].dynamic_nodes
    found = play_kind(kind, lambda homes: make_policy("bayesian", homes))
    assert {len(found[name]) for name in ("first_guess", "mrr", "nll", "looks")} == {2}
    assert np.isfinite(found["milliseconds"])
    assert found["milliseconds"] > 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--kinds=flats"], "kinds must be some of paper_on, paper_off, routine, mixed"),
        (["--networks=gat"], "networks must be some of tgn, graph_mixer, dygformer, recurrent"),
        (["--information=all"], "information must be some of sightings, negatives, got 'all'"),
        (["--seeds=0"], "seeds must be at least 1, got 0"),
        (["--trials=-1"], "trials must be at least 0, got -1"),
        (["--num_homes=0"], "num_homes must be at least 1, got 0"),
        (["--kinds=paper_on", "--recorded=x"], "recorded homes must come with the kind mixed"),
    ],
)
def test_bad_input_is_one_line(options, message, tmp_path, capsys):
    with pytest.raises(SystemExit) as stop:
        main([*options, "--out", str(tmp_path / "out"), "--runs", str(tmp_path / "runs")])
    assert stop.value.code == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "runs").exists()


def test_a_file_that_is_no_table_is_one_line(tmp_path, capsys):
    (tmp_path / "t.json").write_text("{}")
    with pytest.raises(SystemExit):
        main(["--stored", str(tmp_path / "t.json"), "--out", str(tmp_path)])
    assert (
        "stored must be a temporal.json of nep.bench temporal, got KeyError"
        in capsys.readouterr().err
    )


def test_the_page_that_ships_is_what_its_scores_say():
    results = Path(__file__).parents[3] / "results"
    content = json.loads((results / "temporal.json").read_text("utf-8"))
    page = (results / "temporal.md").read_text("utf-8")
    assert make_report(content) == page
    options = parse(Temporal().make_parser(), shlex.split(content["command"])[4:])
    assert list(options.checkpoint) == ["any_home", "heat", "heat_32=FILE"]


def test_every_network_gets_as_many_trials():
    sizes = read_sizes(parse(Temporal().make_parser(), ["--trials=3", "--epochs=2"]))
    assert (sizes.trials, sizes.epochs, sizes.num_homes) == (3, 2, 200)
