import json
from dataclasses import asdict, replace

import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.test_sets.__main__ import main
from simulator.test_sets.test_sets import TestSet, find_test_set, load_test_sets, name_test_set
from simulator.world.config import HomeConfig
from simulator.world.source import PaperSource, SampledSource
from simulator.world.streams import Streams


def shrink(row: TestSet) -> TestSet:
    """Three homes, five steps."""
    row = replace(row, num_homes=3, steps=5)
    return replace(row, **row.compute_checksums())


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """A file of one small set in the place of the one that ships."""
    path = tmp_path / "test_sets.json"
    small = shrink(find_test_set("paper-24-on-v1"))
    path.write_text(json.dumps([asdict(small)]))
    for function in (load_test_sets, find_test_set):
        monkeypatch.setattr(function, "__defaults__", (path,))
    return path


def test_the_shipped_homes_are_those_of_the_sources():
    sets = load_test_sets()
    for places, make in (32, SampledSource), (24, PaperSource):
        for nodes in ("on", "off"):
            home = make(home=HomeConfig(dynamic_nodes=nodes == "on")).home
            row = sets[f"paper-{places}-{nodes}-v1"]
            assert HomeConfig.from_json(row.home) == home
            assert sum(home.room_sizes) == places
    assert len({row.life for row in sets.values()}) == len(sets)


def test_this_machine_makes_the_homes_that_were_frozen():
    row = find_test_set("paper-24-on-v1")
    assert row.compute_checksums() == row.checksums


def test_homes_are_named_by_what_they_are():
    for places, make in (32, SampledSource), (24, PaperSource):
        for nodes in ("on", "off"):
            source = make(home=HomeConfig(dynamic_nodes=nodes == "on"))
            streams = Streams(0, "test", range(100))
            assert name_test_set(source, streams, 100) == f"paper-{places}-{nodes}-v1"
            for other in (
                Streams(1, "test", range(100)),
                Streams(0, "val", range(100)),
                Streams(0, "test", range(99)),
            ):
                assert name_test_set(source, other, 100) is None
            assert name_test_set(source, streams, 99) is None
    more = Streams(0, "test", range(200))
    assert name_test_set(SampledSource(), more, 100) == "paper-32-on-200-v1"
    assert name_test_set(SampledSource(home=HomeConfig(move_share=0.1)), streams, 100) is None
    assert name_test_set(SampledSource(PriorGraph.household()), streams, 100) is None


@pytest.mark.parametrize(
    ("changed", "wrong"),
    [
        ({"seed": 1}, {"layout", "life"}),
        ({"steps": 6}, {"life"}),
        ({"split": "val"}, {"layout", "life"}),
    ],
)
def test_other_homes_have_other_checksums(changed, wrong):
    row = shrink(find_test_set("paper-32-off-v1"))
    found = replace(row, **changed).compute_checksums()
    assert {what for what, value in row.checksums.items() if found[what] != value} == wrong


def test_other_rules_have_other_checksums():
    row = shrink(find_test_set("paper-32-off-v1"))
    found = replace(row, home={**row.home, "move_share": 0.5}).compute_checksums()
    assert (found["layout"], found["life"] == row.life) == (row.layout, False)


def test_commands(shipped, capsys):
    assert main(["list"]) == 0
    assert main(["check", "paper-24-on-v1"]) == 0
    assert "paper-24-on-v1: the same homes" in capsys.readouterr().out
    assert main(["show", "paper-24-on-v1"]) == 0
    (row,) = json.loads(shipped.read_text())
    assert json.loads(capsys.readouterr().out) == row
    shipped.write_text(json.dumps([{**row, "life": "0" * 64}]))
    assert main(["check"]) == 1
    captured = capsys.readouterr()
    assert "paper-24-on-v1: differs in life" in captured.out
    assert "homes must be those of the set" in captured.err


def test_bad_input(shipped, capsys):
    assert main(["show", "paper"]) == 1
    assert "test set must be one of paper-24-on-v1, got 'paper'." in capsys.readouterr().err
    shipped.write_text("[{}]")
    assert main(["list"]) == 1
    assert "test sets must be a list of what `TestSet` says" in capsys.readouterr().err
