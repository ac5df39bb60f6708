"""Scene graphs as Hydra writes them: numbers for labels, rotated boxes, an older encoding, back."""

import json
import math

import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from simulator.trace import load_trace, save_trace
from simulator.trace.__main__ import main
from simulator.trace.importers import IMPORTERS, read_scene_graph
from simulator.trace.importers.scene_graph import load_label_names
from simulator.trace.trace import remember_trace

spark_dsg = pytest.importorskip("spark_dsg", reason="spark_dsg is not installed: extra spark")

LABELS = """---
total_semantic_labels: 21
object_labels: [5, 11, 16]
label_names:
  - {label: 0, name: unknown}
  - {label: 5, name: dining_table}
  - label: 16
    name: cushion
"""
LAYERS = {"O": 2, "p": 3, "R": 4}
KINDS = {"O": "ObjectNodeAttributes", "p": "PlaceNodeAttributes", "R": "RoomNodeAttributes"}
NO_TURN = {"w": 1.0, "x": 0.0, "y": 0.0, "z": 0.0}


def make_node(category, number, position, label=0, size=None, turn=0.0):
    """One node of an old file; without a size its box is invalid."""
    box = {"type": "INVALID", "min": [0.0] * 3, "max": [0.0] * 3, "world_P_center": [0.0] * 3}
    half = math.radians(turn) / 2
    if size is not None:
        box = {
            "type": "RAABB" if turn else "AABB",
            "min": [c - s / 2 for c, s in zip(position, size, strict=True)],
            "max": [c + s / 2 for c, s in zip(position, size, strict=True)],
            "world_P_center": position,
        }
    attributes = {
        "type": KINDS[category],
        "name": f"{category}({number})",
        "position": position,
        "color": [0, 0, 0],
        "semantic_label": label,
        "is_active": True,
        "last_update_time_ns": 1,
        "bounding_box": box
        | {"world_R_center": NO_TURN | {"w": math.cos(half), "z": math.sin(half)}},
        "mesh_connections": [],
        "registered": True,
        "world_R_object": NO_TURN,
        "active_frontier": False,
        "anti_frontier": False,
        "deformation_connections": [],
        "distance": 1.0,
        "frontier_scale": [0.0] * 3,
        "need_cleanup": False,
        "num_basis_points": 1,
        "num_frontier_voxels": 0,
        "orientation": NO_TURN,
        "pcl_mesh_connections": [],
        "real_place": True,
        "voxblox_mesh_connections": [],
        "mesh_vertex_labels": [],
    }
    symbol = (ord(category) << 56) + number
    return {"id": symbol, "layer": LAYERS[category], "attributes": attributes}


def write_graph(path, nodes, edges=()):
    content = {
        "directed": False,
        "multigraph": False,
        "layer_ids": [2, 3, 4, 5],
        "mesh_layer_id": 1,
        "mesh_edges": [],
        "nodes": nodes,
        "edges": edges,
    }
    path.write_text(json.dumps(content))


@pytest.fixture
def apartment(tmp_path):
    """One room without a box, nodes named as their symbols, numbers alone, the first encoding."""
    nodes = [
        make_node("R", 0, [0.0, 0.0, 1.0]),
        make_node("p", 0, [0.0, 0.0, 1.0]),
        make_node("O", 0, [1.0, 0.0, 0.5], 5, [1.0, 1.0, 1.0]),  # linked to the place
        make_node("O", 11, [2.5, 0.0, 0.5], 5, [2.0, 0.2, 1.0], 90),  # 2.5 m from the place
        make_node("O", 24, [2.5, 1.2, 0.9], 16, [0.1] * 3),  # 0.2 m from that turned table
        make_node("O", 33, [9.0, 0.0, 0.5], 5, [1.0] * 3),  # far from every place
        make_node("O", 56, [1.0, 0.0, 1.1], 11, [0.1] * 3),
    ]
    ids = {node["attributes"]["name"]: node["id"] for node in nodes}
    edges = [
        {
            "source": ids[one],
            "target": ids[other],
            "info": {"type": "EdgeAttributes", "weight": 1.0, "weighted": False},
        }
        for one, other in (("R(0)", "p(0)"), ("p(0)", "O(0)"))
    ]
    path = tmp_path / "apartment.json"
    write_graph(path, nodes, edges)
    (tmp_path / "labels.yaml").write_text(LABELS)
    return path


def test_numbers_are_named_by_a_label_space(apartment, capfd):
    memory_file = apartment.with_name("home.sgm")
    labels = str(apartment.with_name("labels.yaml"))
    arguments = ["import", "spark-dsg", str(apartment), "--memory", str(memory_file)]
    assert main(arguments) == 1
    said = capfd.readouterr()
    assert "no name for the number of its label (give --labels): 5 x 3, 16, 11" in said.err
    assert main([*arguments, "--labels", labels]) == 0
    said = capfd.readouterr()
    assert said.out.splitlines() == [
        "placed: 1 rooms, 2 furniture nodes, 1 objects, 0 of them taken out of other objects",
        "labels taken for: 5 dining_table x 3 (furniture), 16 cushion x 1 (object)",
        "not placed, in no room (give --room home): dining_table",
        "not placed, no name for the number of its label (give --labels): 11",
        f"memory: {memory_file}",
    ]
    assert said.err == ""
    memory = SceneGraphMemory.load(memory_file)
    assert memory.get_position(0) == (1, 0)
    assert memory.get_position(1) == (2.5, 0)
    assert memory.last_seen("cushion").furniture == 1


def test_furniture_may_be_called_otherwise_than_in_the_type_table(tmp_path, capfd):
    """Labels as detectors have them: nothing of a kitchen is left lying on its floor."""
    names = {1: "refrigerator", 2: "oven", 3: "bathtub", 4: "bookcase", 5: "cup"}
    rows = "".join(f"  - {{label: {number}, name: {name}}}\n" for number, name in names.items())
    (tmp_path / "labels.yaml").write_text(f"label_names:\n{rows}")
    nodes = [make_node("R", 0, [0.0, 0.0, 1.0], size=[20.0, 20.0, 3.0])]
    nodes += [make_node("O", n, [2.0 * n, 0.0, 0.5], n, [0.9, 0.9, 1.0]) for n in (1, 2, 3, 4)]
    nodes.append(make_node("O", 9, [2.0, 0.0, 0.6], 5, [0.1] * 3))
    write_graph(tmp_path / "graph.json", nodes)
    arguments = ["--memory", str(tmp_path / "home.sgm"), "--labels", str(tmp_path / "labels.yaml")]
    assert main(["import", "spark-dsg", str(tmp_path / "graph.json"), *arguments]) == 0
    said = capfd.readouterr().out.splitlines()
    assert said[0].startswith("placed: 1 rooms, 4 furniture nodes, 1 objects")
    assert "1 refrigerator x 1 (furniture)" in said[1]
    memory = SceneGraphMemory.load(tmp_path / "home.sgm")
    found = [(piece.label, piece.description) for piece in memory.layout.furniture.values()]
    assert found == [
        ("fridge", "refrigerator"), ("oven", "oven"), ("bathtub", "bathtub"),
        ("bookshelf", "bookcase"),
    ]  # fmt: skip
    assert memory.last_seen("cup").furniture == 0


def test_graphs_without_rooms_or_furniture_are_put_into_one_room(tmp_path, capfd):
    """As of Khronos and Clio: nothing above the objects, and perhaps no furniture at all."""
    labels = tmp_path / "labels.yaml"
    labels.write_text(LABELS)
    table = make_node("O", 0, [1.0, 0.0, 0.5], 5, [1.0, 1.0, 1.0])
    cushions = [make_node("O", n, [1.0 + 3 * n, 0.0, 1.1], 16, [0.1] * 3) for n in (1, 2)]
    on_it = make_node("O", 3, [1.0, 0.1, 1.1], 16, [0.1] * 3)
    for nodes, furniture, places in (
        ([table, *cushions, on_it], ["dining table", "floor"], [1, 1, 0]),
        (cushions, ["floor"], [0, 0]),
    ):
        path, memory_file = tmp_path / "graph.json", tmp_path / "home.sgm"
        write_graph(path, nodes)
        arguments = ["import", "spark-dsg", str(path), "--memory", str(memory_file)]
        arguments += ["--labels", str(labels)]
        assert main(arguments) == 1
        said = capfd.readouterr().err
        assert "home must have a room that can be placed, got none" in said
        assert "(give --room home)" in said
        assert main([*arguments, "--room", "home"]) == 0
        memory = SceneGraphMemory.load(memory_file)
        assert list(memory.layout.room_labels) == ["home"]
        assert list(memory.layout.furniture_labels) == furniture
        trace, _ = read_scene_graph(path, (), labels, "home")
        assert [event.furniture for event in trace.events] == places
        capfd.readouterr()


def test_a_broken_label_space_is_one_line(tmp_path):
    path = tmp_path / "labels.yaml"
    for text, message in (
        ("{", "labels must be a file that can be read as YAML"),
        ("names: []", r"labels must have a list label_names, got None"),
        ("label_names: [{label: 1, name: a}, {label: 1, name: b}]", r"label_names\[1\] must have"),
        ("label_names: [{label: x, name: a}]", r"label_names\[0\] must have a label"),
        ("label_names: [chair]", r"label_names\[0\] must have a label"),
    ):
        path.write_text(text)
        with pytest.raises(ValueError, match=message):
            load_label_names(path)
    with pytest.raises(ValueError, match="labels must come with the format spark-dsg"):
        IMPORTERS["procthor"].read(path, labels=path)


@pytest.mark.parametrize("has_positions", [True, False])
def test_a_memory_goes_there_and_back(tmp_path, has_positions):
    memory = SceneGraphMemory()
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    at = iter([(1.5, 2.0), (3.0, 2.0), (8.0, -1.0)]) if has_positions else iter([None] * 3)
    fridge = memory.add_furniture("fridge", kitchen, "white fridge", next(at))
    bench = memory.add_furniture("workbench", study, position=next(at))
    desk = memory.add_furniture("desk", study, position=next(at))
    memory.observe(fridge, [Sighting("milk", "in"), Sighting("apple", "in")])
    memory.observe(bench, [Sighting("large red mug", "in"), Sighting("green apple")])
    memory.observe(desk, [Sighting("laptop")])
    memory.step()
    memory.observe(desk, [])  # the laptop is gone
    graph = memory.to_spark_dsg()
    layer = graph.get_layer(spark_dsg.DsgLayers.OBJECTS)
    assert layer.num_nodes() == 3 + 4
    path = tmp_path / "home.json"
    graph.save(str(path))
    trace, builder = read_scene_graph(path)
    assert builder.left_out == {}
    save_trace(trace, tmp_path / "home")
    again = remember_trace(load_trace(tmp_path / "home"))

    def list_seen(home):
        rows = [
            (room["label"], row["description"], seen["description"], seen["relation"])
            for room in home.to_dict()["rooms"]
            for row in room["furniture"]
            for seen in row["objects"]
            if seen["is_there"]
        ]
        return sorted(rows)

    assert list_seen(again) == list_seen(memory)
    for node in memory.furniture_ids:
        assert again.describe(node) == memory.describe(node)
        assert again.get_position(node) == memory.get_position(node)
