"""Homes of other programs: what is placed, what is not, and why."""

import json
from pathlib import Path

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Bayesian
from simulator.trace import load_trace
from simulator.trace.__main__ import main
from simulator.trace.episode import split_days
from simulator.trace.importers import read_procthor, read_scene_graph
from simulator.trace.importers.procthor import find_asset_type
from simulator.trace.trace import remember_trace

SQUARE = [{"x": x, "y": 0, "z": z} for x, z in ((0, 0), (0, 4), (4, 4), (4, 0))]
HOUSE = {
    "rooms": [
        {"id": "room|2", "roomType": "Kitchen", "floorPolygon": SQUARE},
        {"id": "room|3", "roomType": "Bedroom"},
        {"id": "room|4", "roomType": "Bedroom"},
        {"id": "room|5", "roomType": "WineCellar"},
        7,
    ],
    "objects": [
        {
            "id": "DiningTable|2|0",
            "children": [
                {"id": "Plate|surface|2|0", "children": [{"id": "Apple|surface|2|1"}]},
                {"id": "Mug|surface|2|2"},
                {"id": "Chair|2|3", "children": [{"id": "Book|surface|2|4"}]},
                {"id": "0|1"},
            ],
        },
        {"id": "Fridge|9|0", "position": {"x": 1, "y": 0, "z": 3}, "children": [{"id": "Egg|9|1"}]},
        {"id": "Bed|3|0"},
        {"id": "Bed|4|0"},
        {"id": "GarbageCan|5|0", "children": [{"id": "WineBottle|5|1"}]},
        {"id": "GarbageCan|5|1"},
        {"id": "Sofa|8|0", "children": [{"id": "Pillow|8|1"}]},
        {"id": "1|2"},
    ],
}


def list_objects(trace):
    return [
        (
            event.object,
            trace.layout.furniture[event.furniture].name,
            ("in", "onTop")[event.relation],
        )
        for event in trace.events
    ]


@pytest.fixture
def home_file(tmp_path) -> Path:
    path = tmp_path / "house.json"
    path.write_text(json.dumps(HOUSE))
    return path


def test_a_procthor_house(home_file):
    trace, builder = read_procthor(home_file)
    rooms = [room.name for room in trace.layout.rooms.values()]
    assert rooms == ["kitchen", "bedroom 1", "bedroom 2", "wine cellar"]
    assert [(row.name, rooms[row.room]) for row in trace.layout.furniture.values()] == [
        ("dining table", "kitchen"),
        ("chair", "kitchen"),
        ("fridge", "kitchen"),  # room 9 does not exist: the floor polygon holds it
        ("bed 1", "bedroom 1"),
        ("bed 2", "bedroom 2"),
        ("garbage can", "wine cellar"),  # it holds something; the other one does not
        ("floor", "wine cellar"),
    ]
    assert list_objects(trace) == [
        ("plate", "dining table", "onTop"),
        ("apple", "dining table", "onTop"),  # out of the plate
        ("mug", "dining table", "onTop"),
        ("book", "chair", "onTop"),  # its nearest parent
        ("egg", "fridge", "in"),
        ("wine bottle", "garbage can", "onTop"),
        ("garbage can", "floor", "onTop"),
    ]
    assert builder.num_nested == 1
    assert dict(builder.left_out) == {
        "a room without id and roomType": ["7"],
        "no type in id, assetId or objectType": ["{'id': '0|1'}", "{'id': '1|2'}"],
        "in no room of the house": ["sofa"],
        "on furniture in no room": ["pillow"],
    }
    assert "7 objects, 1 of them taken out of other objects" in builder.summarise()
    assert "not placed, in no room of the house: sofa" in builder.summarise()
    trace, _ = read_procthor(home_file, ["garbage can"])
    assert "floor" not in {row.label for row in trace.layout.furniture.values()}


def at(x, y, z):
    return {"position": {"x": x, "y": y, "z": z}}


PLACED = {
    "rooms": [
        {"id": "room|2", "roomType": "Kitchen", "floorPolygon": SQUARE},
        {"id": "room|3", "roomType": "Bedroom", "floorPolygon": SQUARE[:2]},
    ],
    "objects": [
        {
            "id": "Dresser|2|0",
            **at(1.0, 0.4, 2.0),  # 80 cm high
            "children": [
                {"id": "Vase|2|1", **at(1.0, 0.9, 2.1)},
                {"id": "Watch|2|2", **at(1.1, 0.55, 2.0)},
                {"id": "Book|2|3", **at(1.1, 0.78, 2.0)},  # flat on it
                {"id": "Pen|2|4"},
            ],
        },
        {
            "id": "Fridge|2|1",
            **at(3.0, 0.9, 3.0),
            "children": [{"id": "Egg|2|5", **at(3, 1.1, 3)}, {"id": "Box|2|6", **at(3, 1.9, 3)}],
        },
        {
            "id": "Sofa|2|2",
            **at(3.0, 0.45, 1.0),
            "children": [{"id": "Pillow|2|7", **at(3.0, 0.55, 1.0)}],
        },
        {"id": "BasketBall|2|8", **at(2.5, 0.12, 0.5)},
        {"id": "Painting|2|9", **at(2.5, 1.6, 0.0)},
        {"id": "BaseballBat|3|1", **at(9.0, 0.4, 9.0)},
        {"id": "Boots|3|2", "position": {"x": 1e9, "y": 0, "z": None}},
    ],
}


def test_procthor_keeps_positions_floors_and_what_is_inside(tmp_path):
    path, file = tmp_path / "house.json", tmp_path / "home.sgm"
    path.write_text(json.dumps(PLACED))
    assert main(["import", "procthor", str(path), "--memory", str(file)]) == 0
    trace, builder = read_procthor(path)
    assert [(name, relation) for name, _, relation in list_objects(trace)] == [
        ("vase", "onTop"),
        ("watch", "in"),
        ("book", "onTop"),
        ("pen", "onTop"),
        ("egg", "in"),
        ("box", "onTop"),
        ("pillow", "onTop"),  # the back of the sofa is higher than its seat
        ("basket ball", "onTop"),
        ("baseball bat", "onTop"),
        ("boots", "onTop"),
    ]
    assert dict(builder.left_out) == {"on a wall": ["painting"]}
    memory = SceneGraphMemory.load(file)
    assert memory.last_seen("watch").position == (1.1, 2.0, 0.55)
    assert memory.last_seen("boots").position is None
    assert memory.get_position(0) == (1.0, 2.0)
    floors = [piece for piece in memory.layout.furniture.values() if piece.label == "floor"]
    assert [memory.layout.rooms[floor.room].label for floor in floors] == ["kitchen", "bedroom"]
    assert floors[0].box.top == 0.0
    assert floors[0].box.contains(np.array([[0.1, 0.1, 0.0], [3.9, 3.9, 0.0]])).all()
    assert floors[1].box is None  # two corners are no polygon
    ball = Finder(Bayesian()).rank(memory, "basket ball")[0]
    assert (ball.name, ball.position) == ("floor 1 in kitchen", (2.5, 0.5, 0.12))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{", "house must be one JSON object"),
        ("[]", r"house must have the lists 'rooms' and 'objects'"),
        ('{"rooms": [], "objects": []}', "home must have a room that can be placed, got none"),
    ],
)
def test_bad_homes(tmp_path, text, message):
    path = tmp_path / "house.json"
    path.write_text(text)
    with pytest.raises(ValueError, match=message):
        read_procthor(path)


def test_import_makes_a_trace_and_a_memory(home_file, tmp_path, capsys):
    out, file = tmp_path / "trace", tmp_path / "home.sgm"
    assert (
        main(["import", "procthor", str(home_file), "--out", str(out), "--memory", str(file)]) == 0
    )
    assert "placed: 4 rooms, 7 furniture nodes, 7 objects" in capsys.readouterr().out
    memory = SceneGraphMemory.load(file)
    place = memory.last_seen("apple")
    assert memory.describe(place.furniture) == "dining table in kitchen"
    assert memory.describe(4) == "bed 2 in bedroom"
    # A trace goes on: append what happens next.
    with (out / "events.csv").open("a") as events:
        events.write("7200,apple,fridge,in,\n")
    assert main(["check", str(out)]) == 0
    assert "1 homes of at least 2 steps" in capsys.readouterr().out
    later = remember_trace(load_trace(out))
    assert later.describe(later.last_seen("apple").furniture) == "fridge in kitchen"


def make_scene_graph(path, spark_dsg):
    """A kitchen and a room without a name; z is up."""
    graph, layers, symbol = spark_dsg.DynamicSceneGraph(), spark_dsg.DsgLayers, spark_dsg.NodeSymbol

    def add(attributes, layer, name, position, size=None, label=None, text=""):
        attributes.position = np.array(position, dtype=float)
        attributes.name = text
        if label is not None:
            attributes.semantic_label = label
        if size is not None:
            box = spark_dsg.BoundingBox(np.array(size, float), np.array(position, float))
            attributes.bounding_box = box
        graph.add_node(layer, symbol(*name), attributes)

    def add_object(number, label, position, size=(0.1, 0.1, 0.1), text=""):
        attributes = spark_dsg.ObjectNodeAttributes()
        add(attributes, layers.OBJECTS, ("O", number), position, size, label, text)

    def link(one, other):
        graph.insert_edge(symbol(*one), symbol(*other))

    rooms = [((2, 2, 1), "kitchen"), ((6, 2, 1), "R(1)")]
    for number, (position, text) in enumerate(rooms):
        attributes = spark_dsg.RoomNodeAttributes()
        add(attributes, layers.ROOMS, ("R", number), position, (4, 4, 2), text=text)
        add(spark_dsg.PlaceNodeAttributes(), layers.PLACES, ("p", number), position)
        link(("R", number), ("p", number))
    add_object(0, 1, (1, 1, 0.4), (1, 1, 0.8))  # dining table, over its place
    add_object(1, 2, (1, 1, 0.9))  # a mug, linked to the same place only: nearest furniture
    add_object(2, 3, (3, 3, 1), (0.6, 0.6, 2))  # a fridge without links: the box of the kitchen
    add_object(3, 4, (3, 3, 1))  # milk inside it
    add_object(4, 5, (6, 2, 0.3), (2, 1, 0.6))  # a bed in the other room
    add_object(5, 6, (6, 2, 0.65))  # a book linked to the bed
    add_object(6, 2, (9, 9, 9))  # a mug linked to the book, wherever it is
    add_object(7, 6, (4.5, 0.2, 0))  # a book too far from everything
    add_object(8, 99, (1, 1, 1))  # nothing is known of it
    add_object(9, 7, (20, 20, 0), (1, 1, 1))  # a desk outside
    add_object(10, 99, (3, 1, 0.5), (1, 1, 1), text="workbench")
    for number in (0, 1):
        link(("p", 0), ("O", number))
    for number in (4, 7):
        link(("p", 1), ("O", number))
    link(("O", 4), ("O", 5))
    link(("O", 5), ("O", 6))
    names = ["dining_table", "mug", "fridge", "milk", "bed", "book", "desk"]
    graph.set_labelspace(spark_dsg.Labelspace(dict(enumerate(names, start=1))), 2, 0)
    graph.save(str(path))


def test_a_scene_graph_of_spark_dsg(tmp_path):
    spark_dsg = pytest.importorskip("spark_dsg", reason="spark_dsg is not installed: extra spark")
    path = tmp_path / "graph.json"
    make_scene_graph(path, spark_dsg)
    trace, builder = read_scene_graph(path)
    assert trace.layout.room_labels == ("kitchen", "room")
    assert [(row.name, row.room) for row in trace.layout.furniture.values()] == [
        ("dining table", 0),
        ("fridge", 0),
        ("bed", 1),
    ]
    assert list_objects(trace) == [
        ("mug 1", "dining table", "onTop"),
        ("milk", "fridge", "in"),
        ("book", "bed", "onTop"),
        ("mug 2", "bed", "onTop"),
    ]
    assert builder.num_nested == 1
    assert dict(builder.left_out) == {
        "no name for the number of its label (give --labels)": ["99"],
        "in no room (give --room home)": ["desk"],
        "no furniture within 1 m (give --room home)": ["book", "workbench"],
    }
    trace, builder = read_scene_graph(path, room="hall")
    assert trace.layout.room_labels == ("kitchen", "room", "hall")
    desk = next(row for row in trace.layout.furniture.values() if row.label == "desk")
    assert trace.layout.rooms[desk.room].label == "hall"
    floors = [row.name for row in trace.layout.furniture.values() if row.label == "floor"]
    assert {("book", floor, "onTop") for floor in floors} & {
        (name.split()[0], place, relation) for name, place, relation in list_objects(trace)
    }
    assert list(builder.left_out) == ["no name for the number of its label (give --labels)"]
    trace, _ = read_scene_graph(path, ["workbench"])
    assert "workbench" in trace.layout.furniture_labels
    path.write_text("{")
    with pytest.raises(ValueError, match="scene graph must be one that spark_dsg saved"):
        read_scene_graph(path)
    with pytest.raises(ValueError, match="scene graph must be a file that exists"):
        read_scene_graph(tmp_path / "none.json")


def test_without_spark_dsg_the_error_says_what_to_install(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(__import__("sys").modules, "spark_dsg", None)
    assert main(["import", "spark-dsg", "graph.json", "--out", str(tmp_path / "x")]) == 1
    assert "pip install './core[spark]'" in capsys.readouterr().err


@pytest.mark.parametrize("word", ["a", "Bed", "Qx", "Toilet_Paper_"])
def test_a_long_asset_id_is_read_at_once(word):
    """It was cubic in the words of the id: a minute for 8,000 characters."""
    find_asset_type(word * (200_000 // len(word)))
    assert find_asset_type("RoboTHOR_office_chair_jules") == "Chair"


MAP = '{"rooms": [{"id": "room|1", "roomType": "Kitchen"}], "objects": [{"id": "Fridge|1|0"}]}'


def test_a_map_without_things_is_where_a_robot_starts(tmp_path, capsys):
    """It is kept and remembered, with no look at anything; only playing needs a thing."""
    path, out, file = tmp_path / "house.json", tmp_path / "trace", tmp_path / "home.sgm"
    path.write_text(MAP)
    arguments = ["import", "procthor", str(path), "--out", str(out), "--memory", str(file)]
    assert main(arguments) == 0
    assert "placed: 1 rooms, 1 furniture nodes, 0 objects" in capsys.readouterr().out
    memory = SceneGraphMemory.load(file)
    assert memory.describe(0) == "fridge in kitchen"
    assert memory.last_seen("apple") is None
    ranking = Finder(Bayesian()).rank(memory, "apple")
    assert "not seen here" not in str(ranking)  # nothing was looked at
    trace = load_trace(out)
    assert (trace.events, trace.start_s, trace.end_s) == ((), 0.0, 0.0)
    assert remember_trace(trace).describe(0) == "fridge in kitchen"
    assert main(["check", str(out)]) == 1
    assert "home must hold an object to be played, got none in trace" in capsys.readouterr().err
    with pytest.raises(ValueError, match="home must hold an object to be played"):
        split_days(trace, 3600)
    with (out / "events.csv").open("a") as events:  # the robot has seen something
        events.write("0,apple,fridge,in,\n7200,apple,fridge,onTop,\n")
    assert main(["check", str(out)]) == 0
