"""Households in the three published formats, written here, come back as traces."""

import json

import numpy as np
import pytest
import torch

from nep.importers.homer import read_homer
from simulator.trace import load_trace
from simulator.trace.__main__ import main

# node, category
NODES = [
    ("kitchen", "Rooms"),
    ("bedroom", "Rooms"),
    ("table", "Furniture"),
    ("fridge", "Appliances"),
    ("table", "Furniture"),
    ("lamp", "Decor"),  # never holds anything
    ("cup", "placable_objects"),
    ("food_apple", "placable_objects"),
    ("bowl", "placable_objects"),
    ("remote_control", "Props"),  # an object because it moves
]
KITCHEN, BEDROOM, TABLE, FRIDGE, BED_TABLE, LAMP, CUP, APPLE, BOWL, REMOTE = range(10)
ROOMS = {TABLE: KITCHEN, FRIDGE: KITCHEN, BED_TABLE: BEDROOM, LAMP: BEDROOM}
# (minutes, where everything is) of two days
DAYS = [
    [
        (380, {CUP: TABLE, APPLE: BOWL, BOWL: FRIDGE, REMOTE: BEDROOM}),
        (390, {CUP: BED_TABLE, APPLE: BOWL, BOWL: TABLE, REMOTE: BEDROOM}),
        (400, {CUP: BED_TABLE, APPLE: TABLE, BOWL: TABLE, REMOTE: BED_TABLE}),
    ],
    [
        (370, {CUP: TABLE, APPLE: TABLE, BOWL: TABLE, REMOTE: BEDROOM}),
        (1000, {CUP: TABLE, APPLE: FRIDGE, BOWL: TABLE, REMOTE: BEDROOM}),
    ],
]


def make_edges(day, rooms=ROOMS, num_nodes=10, shift=0):
    edges = torch.zeros(len(day), num_nodes, num_nodes)
    for step, (_, places) in enumerate(day):
        for child, parent in {**rooms, **places}.items():
            edges[step, child + shift, parent + shift] = 1
    return edges


def write_common(folder):
    names, categories = zip(*NODES, strict=True)
    common = {
        "node_ids": list(range(10)),
        "node_classes": names,
        "node_categories": categories,
        "activities": ["idle"],
        "info": {"dt": 10},
    }
    (folder / "train").mkdir(parents=True)
    (folder / "test").mkdir()
    (folder / "common_data.json").write_text(json.dumps(common))


def write_homer(folder):
    write_common(folder)
    for part, day in zip(("train", "test"), DAYS, strict=True):
        minutes = torch.tensor([minute for minute, _ in day])
        nodes, activity = torch.eye(10).expand(len(day), 10, 10), torch.zeros(len(day))
        torch.save([make_edges(day), nodes, activity, minutes], folder / part / "000.pt")
    return folder


def write_homer_samples(folder):
    """As the paper's reader writes a day: samples of ten minutes, which share their tensors."""
    write_common(folder)
    for part, day in zip(("train", "test"), DAYS, strict=True):
        minutes = [minute for minute, _ in day]
        edges, nodes = make_edges(day), torch.eye(10).repeat(len(day), 1, 1)
        samples, now = [], 0
        for time in range(minutes[0] + 10, minutes[-1] + 10, 10):
            before, now = now, sum(minute <= time for minute in minutes) - 1
            about = {
                "prev_edges": edges[before],
                "prev_nodes": nodes[before],
                "time": time,
                "edges": edges[now],
                "nodes": nodes[now],
                "obj_in_use": [],
                "change_type": (edges[now] - edges[before]).abs().sum(-1).to(torch.int64),
            }
            samples.append(about)
        torch.save(samples, folder / part / "000.pt")
    return folder


def write_homer_plus(folder):
    names = ["home", *(name for name, _ in NODES)]
    for part, day in zip(("train", "test"), DAYS, strict=True):
        (folder / part).mkdir(parents=True)
        edges = make_edges(day, num_nodes=11, shift=1)
        edges[:, [0, 1, 2], 0] = 1  # rooms hang on the home, and it on itself
        torch.save(
            {
                "edges": edges,
                "times": torch.tensor([minute for minute, _ in day]),
                "activity": torch.zeros(len(day)),
                "node_ids": list(range(11)),
                "class_names": names,
            },
            folder / part / "000.pt",
        )
    return folder


def list_events(trace):
    names = [row.name for row in trace.layout.furniture.values()]
    return {(event.time_s, event.object, names[event.furniture]) for event in trace.events}


DAY = 86_400.0
EXPECTED = {
    # The first snapshot, 6:20, is what the home is like at time 0; the apple is in the bowl.
    (0.0, "cup", "table 1"),
    (0.0, "apple", "fridge"),
    (0.0, "bowl", "fridge"),
    (0.0, "remote control", "bedroom floor"),
    # 6:30: the bowl goes to the table, the apple in it too.
    (390 * 60.0, "cup", "table 2"),
    (390 * 60.0, "bowl", "table 1"),
    (390 * 60.0, "apple", "table 1"),
    (400 * 60.0, "remote control", "table 2"),
    # The second day begins at 6:10 as its own first snapshot says.
    (DAY + 370 * 60.0, "cup", "table 1"),
    (DAY + 370 * 60.0, "remote control", "bedroom floor"),
    (DAY + 1000 * 60.0, "apple", "fridge"),
}


@pytest.mark.parametrize("write", [write_homer, write_homer_samples, write_homer_plus])
def test_a_household_becomes_a_trace(tmp_path, write):
    trace, summary = read_homer(write(tmp_path / "household"))
    assert [room.label for room in trace.layout.rooms.values()] == ["kitchen", "bedroom"]
    furniture = [(row.name, row.label, row.room) for row in trace.layout.furniture.values()]
    assert furniture == [
        ("table 1", "table", 0),
        ("fridge", "fridge", 0),
        ("bedroom floor", "floor", 1),
        ("table 2", "table", 1),
    ]
    assert list_events(trace) == EXPECTED
    # What is on a table is "onTop", what is in a fridge "in": the source does not say.
    relations = {trace.layout.furniture[e.furniture].label: e.relation for e in trace.events}
    assert relations == {"table": 1, "fridge": 0, "floor": 1}
    assert trace.end_s == 2 * DAY
    assert trace.start.weekday() == 0
    assert summary.summarise() == "placed: 4 objects at 4 places, 2 days"


@pytest.mark.parametrize("has_categories", [True, False])
def test_furniture_on_furniture_holds_things_by_its_category(tmp_path, has_categories):
    """Without categories the tree says no more than that it stands on something."""
    folder = write_homer_plus(tmp_path / "household")
    for part in ("train", "test"):
        day = torch.load(folder / part / "000.pt")
        day["edges"][:, FRIDGE + 1] = 0
        day["edges"][:, FRIDGE + 1, TABLE + 1] = 1  # a small one, on the table
        torch.save(day, folder / part / "000.pt")
    if has_categories:
        names, categories = zip(("home", "Home"), *NODES, strict=True)
        common = {"node_classes": names, "node_categories": categories}
        (folder / "common_data.json").write_text(json.dumps(common))
    trace, _summary = read_homer(folder)
    places = {row.name for row in trace.layout.furniture.values()}
    assert ("fridge" in places) == has_categories
    assert list_events(trace) == EXPECTED or not has_categories
    assert ("fridge" in {event.object for event in trace.events}) != has_categories


def test_the_command_line_writes_a_trace_that_loads(tmp_path, capsys):
    folder = write_homer(tmp_path / "household")
    assert main(["import", "homer", str(folder), "--out", str(tmp_path / "trace")]) == 0
    assert "4 objects" in capsys.readouterr().out
    assert list_events(load_trace(tmp_path / "trace")) == EXPECTED


def test_objects_in_a_circle_are_nowhere(tmp_path):
    folder = write_homer(tmp_path / "household")
    day = [(380, {CUP: TABLE, APPLE: BOWL, BOWL: APPLE, REMOTE: BEDROOM})] * 2
    for part in ("train", "test"):
        torch.save(
            [make_edges(day), torch.zeros(2), torch.zeros(2), torch.tensor([380, 390])],
            folder / part / "000.pt",
        )
    trace, summary = read_homer(folder)
    assert {event.object for event in trace.events} == {"cup"}
    assert "never at a place: apple x 1, bowl x 1" in summary.summarise()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            lambda f: [p.unlink() for p in f.glob("*/*.pt")],
            r"train/\*\.pt or test/\*\.pt, got none",
        ),
        (lambda f: (f / "common_data.json").unlink(), "common data must be JSON"),
        (lambda f: (f / "train" / "000.pt").write_bytes(b"nothing"), r"file of tensors.*000\.pt"),
        (lambda f: torch.save([1, 2], f / "train" / "000.pt"), r"list of four tensors.*000\.pt"),
        (lambda f: torch.save([], f / "train" / "000.pt"), r"samples with .*, got list in"),
        (
            lambda f: torch.save([{"edges": torch.eye(10)}], f / "train" / "000.pt"),
            r"samples with prev_edges, edges and time, got 'time' in",
        ),
        (
            lambda f: torch.save(
                [{"edges": torch.eye(9), "time": 390}] * 3, f / "train" / "000.pt"
            ),
            "got 'prev_edges' in",
        ),
        (
            lambda f: torch.save([{"edges": torch.eye(9), "time": 390}], f / "train" / "000.pt"),
            r"edges must be times x nodes x nodes, \(1, 10, 10\), got \(1, 9, 9\)",
        ),
        (
            lambda f: torch.save(
                [torch.zeros(2, 3, 3), 0, 0, torch.tensor([1, 2])], f / "train" / "000.pt"
            ),
            r"edges must be times x nodes x nodes, \(2, 10, 10\), got \(2, 3, 3\)",
        ),
    ],
)
def test_broken_households_are_refused(tmp_path, damage, message):
    folder = write_homer(tmp_path / "household")
    damage(folder)
    with pytest.raises(ValueError, match=message):
        read_homer(folder)


def test_a_file_with_code_is_refused(tmp_path):
    folder = write_homer(tmp_path / "household")
    torch.save([np.array], folder / "train" / "000.pt")  # a pickled function
    with pytest.raises(ValueError, match="file of tensors"):
        read_homer(folder)


def test_days_of_other_nodes_are_refused(tmp_path):
    folder = write_homer_plus(tmp_path / "household")
    day = torch.load(folder / "test" / "000.pt")
    torch.save({**day, "class_names": ["home", *"abcdefghij"]}, folder / "test" / "000.pt")
    with pytest.raises(ValueError, match="equal class_names"):
        read_homer(folder)
    del day["edges"]
    torch.save(day, folder / "train" / "000.pt")
    with pytest.raises(ValueError, match="edges, times and class_names"):
        read_homer(folder)
