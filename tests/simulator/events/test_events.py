"""Events are what looks did to the memory: counted, ordered, split, and on disk."""

from __future__ import annotations

import csv
import json
from dataclasses import fields

import numpy as np
import pytest

from simulator.collect.__main__ import main
from simulator.events import EventRecorder, EventTable, collect_events, load_events, save_events
from simulator.events.files import save_tgb
from simulator.events.table import PLACE, EventQuestions, Events, Nodes
from simulator.policies import make_policy
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.sensing import PartialViews
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

SOURCE = SampledSource(home=HomeConfig(furniture_per_room=3, objects_per_furniture=4))


def collect(homes=range(3), steps=8, source=SOURCE, **options) -> EventTable:
    return collect_events(source, Streams(0, "train", homes), steps, **options)


@pytest.fixture(scope="module")
def table() -> EventTable:
    return collect()


def assert_equal(one: EventTable, two: EventTable) -> None:
    for part, rows in (("events", Events), ("nodes", Nodes), ("questions", EventQuestions)):
        for row in fields(rows):
            mine, other = (getattr(getattr(own, part), row.name) for own in (one, two))
            if row.name == "places":
                assert mine == other
            else:
                np.testing.assert_array_equal(mine, other, err_msg=f"{part}.{row.name}")


def test_events_are_what_a_policy_observes_and_what_the_memory_counts():
    """One event for each edge of `Change`; each raises `num_observed` of its edge by one."""
    homes = SOURCE.make(Streams(0, "train", range(3)))
    policy = make_policy("bayesian", homes)
    observed = []
    policy.observe = lambda memory, change: observed.append(
        (memory.time, len(change.edges), int(change.is_seen.sum()))
    )
    game = TASKS["predict_location"](homes, policy)
    recorder = EventRecorder(game, [0, 1, 2])
    for _ in game.run(8):
        pass
    found = recorder.finish()
    assert len(observed) == 8  # a look of all homes at a time
    assert len(found.events.home) == sum(count for _, count, _ in observed)
    assert found.events.is_seen.sum() == sum(seen for _, _, seen in observed)
    edges = game.rollout.memory.edges
    assert edges["num_observed"].sum() == len(found.events.home)
    assert edges["num_true"].sum() == found.events.is_seen.sum()
    for time, count, _ in observed:
        assert (found.events.time == time).sum() == count


def test_the_order_within_a_look_is_that_of_the_detector():
    homes = SOURCE.make(Streams(0, "train", range(2)))
    game = TASKS["predict_location"](homes, make_policy("bayesian", homes))
    recorder = EventRecorder(game, [0, 1])
    looks, note = [], game.rollout.on_look

    def keep(seen):
        note(seen)
        for home in range(2):
            own = seen.seen_home == home
            text = homes.object_descriptions.text
            names = [text(int(code)) for code in seen.seen_code[own]]
            looks.append((home, list(zip(names, seen.seen_relation[own].tolist(), strict=True))))

    game.rollout.on_look = keep
    for _ in game.run(6):
        pass
    table = recorder.finish()
    events = table.events
    for number, (home, listed) in enumerate(looks):
        rows = np.flatnonzero((events.home == home) & (events.look == number // 2))
        assert events.order[rows].tolist() == list(range(len(rows)))
        is_seen = events.is_seen[rows]
        assert not (np.diff(is_seen.astype(int)) > 0).any()  # seen first, then not seen
        names = table.nodes.description[events.thing[rows[is_seen]]]
        got = list(zip(names, events.relation[rows[is_seen]].tolist(), strict=True))
        assert got == list(dict.fromkeys(listed))  # a thing that is there twice is one edge


@pytest.mark.slow
def test_a_home_is_the_same_in_any_company_and_with_any_number_of_workers(table):
    assert_equal(EventTable.join([collect([number]) for number in (2, 0, 1)]), table)
    assert_equal(collect(workers=2), table)
    assert_equal(table.take_homes([1]), collect([1]))


def test_ids_are_of_one_home_alone_and_time_does_not_fall(table):
    events, nodes = table.events, table.nodes
    assert (nodes.home[events.thing] == events.home).all()
    assert (nodes.home[events.place] == events.home).all()
    assert (nodes.kind[events.place] == PLACE).all()
    assert (np.diff(events.time) >= 0).all()
    assert (events.confidence[events.is_seen] == 1).all()
    assert (events.confidence[~events.is_seen] == 0).all()
    assert len(table.list_places(1)) == 12
    asked = table.questions
    assert len(asked.home) == 3 * 8
    for row, places in enumerate(asked.places):
        assert set(places) <= set(table.list_places(asked.home[row]).tolist())
        assert places
        # what is known when it is asked: the looks before it, all of earlier time steps
        own = (events.home == asked.home[row]) & (events.look < asked.look[row])
        assert (events.time[own] < asked.time[row]).all()


def test_splits_share_no_home_and_no_time():
    table = collect(range(4), steps=10)
    parts = table.split_homes(val=0.25, test=0.25)
    assert [np.unique(table.events.home[mask]).tolist() for mask in parts.values()] == [
        [0, 1],
        [2],
        [3],
    ]
    parts = table.split_time(val=0.2, test=0.2)
    times = [np.unique(table.events.time[mask]) for mask in parts.values()]
    assert [(time.min(), time.max()) for time in times] == [(1, 6), (7, 8), (9, 10)]
    for mask in (sum(parts.values()),):
        assert (mask == 1).all()
    with pytest.raises(
        ValueError, match=r"must leave homes for all of train, val, test, got 0\.05"
    ):
        table.split_homes(val=0.05, test=0.25)


def test_partial_views_and_confidences_are_columns():
    rules = HomeConfig(furniture_per_room=3, objects_per_furniture=4, sensing=PartialViews())
    table = collect(source=SampledSource(home=rules))
    assert ((table.events.coverage > 0) & (table.events.coverage < 1)).any()


def test_files_give_the_table_back(table, tmp_path):
    names = save_events(table, tmp_path, {"seed": 0})
    assert {"events.csv", "nodes.csv", "questions.csv", "events.json"} <= set(names)
    assert_equal(load_events(tmp_path), table)
    pyarrow = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    stored = pyarrow.read_table(tmp_path / "events.parquet")
    np.testing.assert_array_equal(stored["thing"].to_numpy(), table.events.thing)
    assert stored["relation"].to_pylist()[0] in ("in", "onTop")
    with (tmp_path / "events.csv").open() as file:
        header = next(csv.reader(file))
    assert header == [row.name for row in fields(Events)]


def add(row):
    return lambda text: text + row + "\n"


def change(one, other):
    return lambda text: text.replace(one, other, 1)


@pytest.mark.parametrize(
    ("name", "edit", "message"),
    [
        ("events.json", lambda text: "{", "events must have a manifest that can be read"),
        ("events.json", change('"version": 1', '"version": 9'), "events version must be 1, got 9"),
        ("events.csv", change("coverage", "cover"), "columns must be home, time"),
        ("events.csv", add("1,2,3"), "must have 10 cells, got 3"),
        ("events.csv", add("0,1,0,0,9999,1,in,1,1,1"), "thing must be a node id"),
        ("events.csv", add("0,1,0,0,14,1,on,1,1,1"), "relation of row .* must be"),
        ("events.csv", add("0,1,0,0,14,1,in,1,2,1"), r"must lie in \[0, 1\], got '2'"),
        ("events.csv", add("-1,1,0,0,14,1,in,1,1,1"), "must be at least 0, got '-1'"),
        ("nodes.csv", change("\n0,0,place", "\n7,0,place"), "node ids must be 0, 1"),
        ("questions.csv", add("0,1,0,14,x"), "places must be node ids"),
    ],
)
def test_damaged_files_are_named(table, tmp_path, name, edit, message):
    save_events(table, tmp_path, {})
    path = tmp_path / name
    path.write_text(edit(path.read_text()))
    with pytest.raises(ValueError, match=message) as caught:
        load_events(tmp_path)
    assert str(path) in str(caught.value)


def test_tgb_columns_by_hand(tmp_path):
    """Relation types are 2 x relation + seen: on top and seen is 3, in and not seen is 0."""
    ints = np.array
    events = Events(
        ints([0, 0]), ints([1, 2]), ints([0, 1]), ints([0, 0]), ints([2, 2]), ints([1, 0]),
        ints([1, 0]), np.array([True, False]), np.ones(2), np.array([1.0, 0.0]),
    )  # fmt: skip
    text = np.array(["shelf", "fridge", "mug"], object)
    nodes = Nodes(np.zeros(3, int), ints([0, 0, 1]), text, text, text)
    table = EventTable(events, nodes, EventQuestions(*(np.zeros(0, int) for _ in range(4)), ()))
    names = save_tgb(table, tmp_path, "thgl-homes")
    assert names == ["thgl-homes_edgelist.csv", "thgl-homes_nodetype.csv"]
    edges, types = ((tmp_path / name).read_text().splitlines() for name in names)
    assert edges == ["timestamp,head,tail,relation_type", "1,2,1,3", "2,2,0,0"]
    assert types == ["node_id,type", "0,0", "1,0", "2,1"]


def test_the_command_writes_once_and_refuses_other_settings(tmp_path, capsys):
    small = (
        "--format events --num_homes 2 --steps 4 --workers 1 --home.furniture_per_room 3 "
        "--home.objects_per_furniture 4"
    ).split()
    out = tmp_path / "events"
    main([*small, "--out", str(out)])
    assert "events.csv, nodes.csv, questions.csv" in capsys.readouterr().out
    assert_equal(load_events(out), collect(range(2), 4))
    before = (out / "events.csv").stat().st_mtime_ns
    main([*small, "--out", str(out)])
    assert (out / "events.csv").stat().st_mtime_ns == before
    with pytest.raises(SystemExit, match="events of the same settings, got seed = 0 instead of 1"):
        main([*small, "--seed", "1", "--out", str(out)])
    with pytest.raises(SystemExit, match="belief must be off for events"):
        main([*small, "--belief", "--out", str(tmp_path / "other")])
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "note.txt").write_text("mine")
    with pytest.raises(SystemExit, match="output folder must be empty, got files"):
        main([*small, "--out", str(tmp_path / "full")])
    settings = json.loads((out / "events.json").read_text())["settings"]
    assert settings["policy"] == "bayesian"
