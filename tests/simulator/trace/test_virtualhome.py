"""Graphs of VirtualHome: what is placed where, from a file in its form."""

import json

import pytest

from simulator.trace.__main__ import main
from simulator.trace.importers.virtualhome import read_virtualhome, split_name
from simulator.trace.trace import load_trace


def node(number, name, category, properties=(), box=None):
    row = {
        "id": number, "class_name": name, "category": category, "properties": list(properties),
        "states": [], "prefab_name": f"PRE_{name}", "obj_transform": {"position": [0, 0, 0]},
    }  # fmt: skip
    return row if box is None else {**row, "bounding_box": {"center": box[0], "size": box[1]}}


def edge(child, relation, parent):
    return {"from_id": child, "relation_type": relation, "to_id": parent}


GRAPH = {
    "nodes": [
        node(1, "kitchen", "Rooms"),
        node(2, "livingroom", "Rooms"),
        node(3, "floor", "Floors"),
        node(4, "character", "Characters"),
        node(5, "kitchencabinet", "Furniture", ["CONTAINERS", "CAN_OPEN"],
             ([1, 1.5, 3], [0.8, 0.6, 0.4])),
        node(6, "fridge", "Appliances", ["CONTAINERS", "CAN_OPEN"], ([2, 0.9, 3], [0.7, 1.8, 0.6])),
        node(7, "coffeetable", "Furniture", ["SURFACES"]),
        node(8, "box", "Props", ["CONTAINERS", "GRABBABLE"]),
        node(9, "waterglass", "Props", ["GRABBABLE"], ([1, 1.4, 3], [0.1, 0.1, 0.1])),
        node(10, "milk", "Food", ["GRABBABLE"]),
        node(11, "remotecontrol", "Electronics", ["GRABBABLE"]),
        node(12, "slippers", "Props", ["GRABBABLE"]),
        node(13, "wall", "Walls"),
        node(14, "poster", "Decor"),
        node(15, "lamp", "Lamps"),
        {"class_name": "no id"},
    ],
    "edges": [
        edge(3, "INSIDE", 1), edge(4, "INSIDE", 1), edge(13, "INSIDE", 2), edge(14, "INSIDE", 2),
        edge(5, "INSIDE", 1), edge(6, "INSIDE", 1), edge(7, "INSIDE", 2), edge(7, "CLOSE", 5),
        # All that holds it, and the room: the glass is in the box in the cabinet.
        edge(8, "INSIDE", 5), edge(8, "INSIDE", 1),
        edge(9, "INSIDE", 5), edge(9, "INSIDE", 8), edge(9, "INSIDE", 1),
        edge(10, "INSIDE", 6), edge(11, "ON", 7), edge(11, "INSIDE", 2),
        edge(12, "ON", 3), edge(12, "INSIDE", 1), edge(14, "ON", 13), edge(15, "INSIDE", 2),
        edge(10, "HOLDS_RH", 4), {"from_id": 1},
    ],
}  # fmt: skip


@pytest.fixture
def graph_file(tmp_path):
    path = tmp_path / "graph.json"
    path.write_text(json.dumps(GRAPH))
    return path


def test_furniture_and_things_are_placed(graph_file):
    trace, builder = read_virtualhome(graph_file)
    rooms = {number: room.label for number, room in trace.layout.rooms.items()}
    furniture = [
        (piece.label, piece.description, rooms[piece.room])
        for piece in trace.layout.furniture.values()
    ]
    assert furniture == [
        ("cabinet", "kitchen cabinet", "kitchen"),
        ("fridge", "fridge", "kitchen"),
        ("coffee table", "coffee table", "living room"),
        ("floor", "floor", "kitchen"),
    ]
    placed = {
        event.object: (event.furniture, ("in", "onTop")[event.relation], event.position)
        for event in trace.events
    }
    assert placed == {
        "box": (0, "in", None),
        "water glass": (0, "in", (1.0, 3.0, 1.4)),  # y of Unity is up
        "milk": (1, "in", None),
        "remote control": (2, "onTop", None),
        "slippers": (3, "onTop", None),
    }
    assert dict(builder.left_out) == {
        "a node without id and class_name": ["{'class_name': 'no id'}"],
        "an edge without ids and relation_type": ["{'from_id': 1}"],
        "on no furniture and no floor": ["poster", "lamp"],
    }
    cabinet, _, table, _ = trace.layout.furniture.values()
    assert (cabinet.box.center, cabinet.box.size) == ((1, 3, 1.5), (0.8, 0.4, 0.6))
    assert cabinet.box.interior == "door"
    assert table.box is None


def test_what_is_left_out_is_counted_once(tmp_path):
    """Furniture in no room is no object besides, wherever it stands."""
    path = tmp_path / "graph.json"
    edges = [row for row in GRAPH["edges"] if row.get("from_id") != 7]  # the coffee table's room
    path.write_text(json.dumps({**GRAPH, "edges": edges}))
    _, builder = read_virtualhome(path)
    assert dict(builder.left_out)["in no room"] == ["coffee table"]


def test_clothes_are_things_though_their_category_is_furniture(tmp_path):
    """As in the published scenes: shirts hang in a closet, trousers lie on the floor."""
    clothes = ["GRABBABLE", "HANGABLE", "CLOTHES"]
    graph = {
        "nodes": [
            node(1, "bedroom", "Rooms"),
            node(2, "floor", "Floors", ["SURFACES"]),
            node(3, "closet", "Furniture", ["CAN_OPEN", "CONTAINERS"]),
            node(4, "hanger", "Furniture"),
            node(5, "clothesshirt", "Furniture", clothes),
            node(6, "clothespants", "Furniture", clothes),
            node(7, "clothespile", "Furniture", clothes),
            node(8, "wallshelf", "Furniture", ["SURFACES"]),
        ],
        "edges": [
            *(edge(number, "INSIDE", 1) for number in range(2, 9)), edge(4, "INSIDE", 3),
            edge(5, "INSIDE", 3), edge(5, "ON", 4), edge(6, "ON", 2),
        ],
    }  # fmt: skip
    path = tmp_path / "graph.json"
    path.write_text(json.dumps(graph))
    trace, builder = read_virtualhome(path)
    furniture = [piece.description for piece in trace.layout.furniture.values()]
    assert furniture == ["closet", "wall shelf", "floor"]
    placed = [(event.object, furniture[event.furniture]) for event in trace.events]
    assert placed == [
        ("hanger", "closet"), ("clothes shirt", "closet"), ("clothes pants", "floor"),
    ]  # fmt: skip
    assert dict(builder.left_out) == {"on no furniture and no floor": ["clothes pile"]}


@pytest.mark.parametrize("name", ["init_graph", "environment_graph"])
def test_a_graph_may_be_wrapped(graph_file, name):
    whole, _ = read_virtualhome(graph_file)
    graph_file.write_text(json.dumps({name: GRAPH, "preconds": []}))
    assert read_virtualhome(graph_file)[0].layout == whole.layout


def test_names_are_split_into_words():
    names = {
        "coffeetable": "coffee table", "home_office": "home office", "toiletpaper": "toilet paper",
        "wallpictureframe": "wall picture frame", "sofa": "sofa", "cupcake": "cupcake",
        "Xyzzy": "xyzzy", "hairproduct": "hairproduct", "coffeepot": "coffeepot",
        "clothespile": "clothes pile", "cpuscreen": "cpu screen", "pancake": "pancake",
        "condimentshaker": "condiment shaker",
    }  # fmt: skip
    assert {name: split_name(name) for name in names} == names


def test_the_command_makes_a_trace_and_a_memory(graph_file, tmp_path, capsys):
    out, memory = tmp_path / "trace", tmp_path / "home.sgm"
    arguments = ["import", "virtualhome", str(graph_file), "--out", str(out)]
    assert main([*arguments, "--memory", str(memory)]) == 0
    assert "placed: 2 rooms, 4 furniture nodes, 5 objects, 1 of them" in capsys.readouterr().out
    assert len(load_trace(out).events) == 5
    assert memory.exists()


@pytest.mark.parametrize(
    "content", ["", "[]", "{}", '{"nodes": [], "edges": 3}', '{"nodes": [], "edges": []}', "nodes"]
)
def test_a_bad_graph_ends_in_one_line(tmp_path, capsys, content):
    path = tmp_path / "graph.json"
    path.write_text(content)
    assert main(["import", "virtualhome", str(path), "--out", str(tmp_path / "out")]) == 1
    said = capsys.readouterr()
    assert (said.out, said.err.count("\n")) == ("", 1)
    assert str(path) in said.err or "in graph" in said.err


def test_of_many_nodes_that_are_none_few_are_named(tmp_path):
    path = tmp_path / "graph.json"
    path.write_text(json.dumps({"nodes": [{"id": i} for i in range(5000)], "edges": []}))
    with pytest.raises(ValueError, match=r"must have a room .* and 4980 others$") as raised:
        read_virtualhome(path)
    assert "\n" not in str(raised.value)
    assert len(str(raised.value)) < 1000


def test_what_the_simulator_answers_may_be_saved_as_it_is(graph_file):
    """environment_graph() returns whether it could, and the graph."""
    whole, _ = read_virtualhome(graph_file)
    graph_file.write_text(json.dumps([True, GRAPH]))
    assert read_virtualhome(graph_file)[0].layout == whole.layout
