"""Furniture with boxes and doors: in the memory, its files, its log, and what is made of them."""

import json

import pytest

from sgm.layout.box import Box
from sgm.memory.memory_event import parse_rows, read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.replay.replay import replay
from sgm.store.home_reader import HomeReader
from simulator.trace.from_log import make_trace
from simulator.trace.layout import load_layout, make_layout_json
from simulator.trace.trace import remember_trace

FRIDGE = Box((1, 0.3, 0.9), (0.6, 0.7, 1.8), 1.5, "door")
_AROUND = [(2.6, 2.4), (3.4, 2.4), (3.4, 3.6), (3.0, 3.6), (3.0, 3.0), (2.6, 3.0)]
TABLE = Box.of_polygon(_AROUND, 0.0, 0.7)


def make_memory(**more):
    memory = SceneGraphMemory(**more)
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("floor", kitchen, box=Box.of_floor((0, 0), (5, 4)))
    memory.add_furniture("fridge", kitchen, box=FRIDGE, open_cost=3.5)
    memory.add_furniture("table", kitchen, position=(1, 2), box=TABLE)
    memory.add_furniture("shelf", kitchen)
    memory.observe(1, [Sighting("milk", "in")])
    return memory


def dump(memory):
    return json.dumps(memory._state.get_content_to_save().to_json())


def test_positions_are_found_where_none_is_given():
    memory = make_memory()
    assert memory.get_position(2) == (1.0, 2.0)
    assert memory.get_position(3) is None
    assert 0.6 < memory.get_position(1)[1] < 1.5  # before it
    assert set(memory.boxes) == {0, 1, 2}
    row = memory.layout.furniture[1]
    assert (row.open_cost, row.must_open, row.position) == (3.5, True, None)
    assert not memory.layout.furniture[3].must_open


def test_saved_loaded_copied_and_replayed(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    memory.move_furniture(2, box=FRIDGE)
    memory.save(tmp_path / "home.sgm")
    loaded = SceneGraphMemory.load(tmp_path / "home.sgm")
    lines = read_events(tmp_path / "looks.sgm")
    *_, (again, _, _) = replay(lines)
    for other in (loaded, memory.copy(), again):
        assert other.layout == memory.layout
        assert dump(other) == dump(memory)
    layout = lines[0].values["layout"]
    assert not layout.furniture
    loaded.save(tmp_path / "more.sgm")
    assert read_events(tmp_path / "more.sgm")[0].values["layout"].furniture[1].box == FRIDGE


def test_files_without_boxes_are_as_before(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", kitchen, position=(1, 2))
    memory.add_furniture("table", kitchen)
    memory.move_furniture(1, position=(2, 2))
    content = memory._state.get_content_to_save().to_json()
    assert content["furniture"] == [[0, "fridge", 0, "fridge", [1.0, 2.0]],
                                    [1, "table", 0, "table", [2.0, 2.0]]]  # fmt: skip
    with HomeReader(tmp_path / "looks.sgm") as reader:
        text = str(reader.read(from_first=True))
    assert "box" not in text
    assert "open_cost" not in text


def test_furniture_that_was_moved():
    memory = make_memory()
    hall = memory.add_room("hall")
    memory.move_furniture(2, position=(0, 0))
    assert memory.boxes[2] == TABLE
    memory.move_furniture(2, box=FRIDGE)
    assert memory.boxes[2] == FRIDGE
    assert memory.layout.furniture[2].position is None  # found anew
    memory.move_furniture(1, room=hall)
    assert 1 not in memory.boxes
    assert memory.layout.furniture[1].open_cost == 3.5
    memory.move_furniture(1, room=hall, position=(4, 4), box=TABLE)
    assert (memory.boxes[1], memory.get_position(1)) == (TABLE, (4.0, 4.0))


def test_traces_carry_them(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    trace = make_trace(read_events(tmp_path / "looks.sgm"))
    assert [row.box for row in trace.layout.furniture.values()] == [
        *memory.boxes.values(),
        None,
    ]
    (tmp_path / "layout.json").write_text(make_layout_json(trace.layout, None, None))
    again, _, _ = load_layout(tmp_path / "layout.json")
    assert again == trace.layout
    remembered = remember_trace(trace)
    assert remembered.boxes == memory.boxes
    assert remembered.layout.furniture[1].open_cost == 3.5


@pytest.mark.parametrize(
    ("box", "message"),
    [
        ({"center": [0, 0, 0]}, r"furniture\[0\].box must have the field size"),
        ({"center": [0, 0, 0], "size": [1, 1, 0]}, "size of a box must be at least"),
        ({"center": [0, 0, 0], "size": [1, 1, 1], "door": 1}, "box must have the fields center"),
        ([1, 2], r"furniture\[0\].box must be a JSON object"),
    ],
)
def test_bad_boxes_of_a_layout(tmp_path, box, message):
    row = {"name": "fridge", "room": "kitchen", "box": box}
    data = {"rooms": ["kitchen"], "furniture": [row]}
    (tmp_path / "layout.json").write_text(json.dumps(data))
    with pytest.raises(ValueError, match=message):
        load_layout(tmp_path / "layout.json")


def test_a_scene_graph_and_back(tmp_path):
    pytest.importorskip("spark_dsg", reason="spark_dsg is not installed")
    from simulator.trace.importers.scene_graph import read_scene_graph

    memory = make_memory()
    memory.to_spark_dsg().save(str(tmp_path / "home.json"))
    trace, _ = read_scene_graph(tmp_path / "home.json")
    by_label = {row.label: row for row in trace.layout.furniture.values()}
    for number in (0, 1, 2):
        row = memory.layout.furniture[number]
        box, same = row.box, by_label[row.label].box
        assert same.center == pytest.approx(box.center, abs=1e-5)
        assert same.size == pytest.approx(box.size, abs=1e-5)
        assert same.yaw == pytest.approx(box.yaw, abs=1e-5)
        assert same.interior == box.interior
        assert by_label[row.label].open_cost == row.open_cost
        assert by_label[row.label].position == row.position
    assert by_label["shelf"].box is None


def test_positions_of_things_go_to_a_scene_graph_and_back(tmp_path):
    pytest.importorskip("spark_dsg", reason="spark_dsg is not installed")
    from simulator.trace.importers.scene_graph import read_scene_graph

    memory = SceneGraphMemory()
    table = memory.add_furniture(
        "table", memory.add_room("kitchen"), box=Box((1, 2, 0.4), (1, 2, 0.8))
    )
    memory.observe(table, [Sighting("mug", position=(1.2, 2.5, 0.85)), Sighting("cup")])
    graph = memory.to_spark_dsg()
    graph.save(str(tmp_path / "home.json"))
    trace, _ = read_scene_graph(tmp_path / "home.json")
    positions = {event.object: event.position for event in trace.events}
    assert positions == {"mug": pytest.approx((1.2, 2.5, 0.85), abs=1e-6), "cup": None}


@pytest.mark.parametrize(
    ("more", "kind", "message"),
    [
        ({"box": (1, 2, 3)}, TypeError, r"box must be a Box, got \(1, 2, 3\)"),
        ({"open_cost": -1}, ValueError, "open_cost must be a finite number, 0 or more, got -1"),
        ({"open_cost": float("nan")}, ValueError, "open_cost must be a finite number"),
    ],
)
def test_bad_arguments_change_nothing(more, kind, message):
    memory = make_memory()
    before = dump(memory)
    with pytest.raises(kind, match=message):
        memory.add_furniture("desk", 0, **more)
    assert dump(memory) == before


def test_a_broken_box_in_a_file_is_refused(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    with HomeReader(tmp_path / "looks.sgm") as reader:
        _, rows = reader.read(from_first=True)
    assert memory.boxes
    broken = [row._replace(arguments=row.arguments.replace('"door"', '"window"')) for row in rows]
    with pytest.raises(ValueError, match=r"event 3 of a memory file must .*interior of a box must"):
        parse_rows(broken, tmp_path / "broken.sgm")
