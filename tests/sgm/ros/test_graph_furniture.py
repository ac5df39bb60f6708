"""Furniture of scene graphs that Hydra publishes."""

import sys
from types import SimpleNamespace as Message

import numpy as np
import pytest

from sgm import Adaptive, Finder, SceneGraphMemory
from sgm.eyes import Box
from sgm.memory.sighting import Sighting
from sgm.ros import GraphFurniture, LiveMemory

SPARK = pytest.importorskip("spark_dsg", reason="spark_dsg is not installed: extra spark")
NAMES = {1: "table", 2: "mug", 3: "Couches"}


def publish(objects, rooms=(), **about):
    """A DsgUpdate of objects: number, label, middle, size; rooms: number, name, its objects."""
    graph, layers = SPARK.DynamicSceneGraph(), SPARK.DsgLayers
    for number, label, at, size in objects:
        attributes = SPARK.ObjectNodeAttributes()
        attributes.semantic_label, attributes.position = label, np.array(at, float)
        if size is not None:
            attributes.bounding_box = SPARK.BoundingBox(np.array(size, float), np.array(at, float))
        graph.add_node(layers.OBJECTS, SPARK.NodeSymbol("O", number), attributes)
    for number, name, own in rooms:
        attributes = SPARK.RoomNodeAttributes()
        attributes.name = name
        graph.add_node(layers.ROOMS, SPARK.NodeSymbol("R", number), attributes)
        place = SPARK.PlaceNodeAttributes()
        graph.add_node(layers.PLACES, SPARK.NodeSymbol("p", number), place)
        graph.insert_edge(SPARK.NodeSymbol("R", number), SPARK.NodeSymbol("p", number))
        for one in own:
            graph.insert_edge(SPARK.NodeSymbol("p", number), SPARK.NodeSymbol("O", one))
    graph.set_labelspace(SPARK.Labelspace(NAMES), 2, 0)
    content = np.frombuffer(graph.to_binary(), np.uint8)
    return Message(**{"layer_contents": content, "full_update": True, **about})


TABLE, SOFA = (0, 1, (1, 2, 0.4), (0.8, 1.2, 0.8)), (1, 3, (4, 2, 0.4), (0.9, 2.0, 0.8))
MUG = (2, 2, (1, 2, 0.85), (0.1, 0.1, 0.1))


@pytest.fixture
def memory():
    return SceneGraphMemory()


def test_furniture_of_a_graph_is_that_of_the_memory(memory):
    graph = GraphFurniture(memory)
    assert graph.take(publish([TABLE, SOFA, MUG], [(0, "kitchen", [0]), (1, "R(1)", [1])]))
    rows = [*memory.layout.furniture.values()]
    assert [row.label for row in rows] == ["table", "sofa"]
    assert [str(memory.layout.rooms[row.room]) for row in rows] == ["kitchen", "home"]
    assert rows[0].box.center == pytest.approx((1, 2, 0.4), abs=1e-6)
    assert rows[0].box.size == pytest.approx((0.8, 1.2, 0.8), abs=1e-6)
    assert not graph.take(publish([TABLE, SOFA, MUG]))
    assert graph.counts == {"furniture found": 2}


def test_what_the_graph_draws_anew_keeps_what_lies_there(memory):
    graph = GraphFurniture(memory)
    graph.take(publish([TABLE]))
    (table,) = memory.furniture_ids
    memory.observe(table, [Sighting("mug", position=(1, 2, 0.85))])
    assert not graph.take(publish([(0, 1, (1.05, 2, 0.4), (0.8, 1.2, 0.8))]))  # 5 cm
    assert graph.take(publish([(0, 1, (1.2, 2, 0.4), (0.9, 1.2, 0.8))]))
    assert memory.boxes[table].center[0] == pytest.approx(1.2)
    assert memory.last_seen("mug").position == (1, 2, 0.85)


def test_nodes_that_hydra_merges_are_one_and_others_that_are_gone_stay(memory):
    graph = GraphFurniture(memory)
    graph.take(publish([TABLE, SOFA, (5, 1, (1.0, 2.5, 0.4), (0.8, 1.2, 0.8))]))
    first, _, second = memory.furniture_ids
    memory.observe(second, [Sighting("mug")])
    assert graph.take(publish([TABLE]))
    assert len(memory.furniture_ids) == 2
    assert memory.last_seen("mug").furniture == first
    assert graph.counts["furniture merged"] == 1


def test_furniture_that_people_have_drawn_is_left_as_it_is(memory):
    box = Box((1.1, 2.0, 0.4), (0.8, 1.2, 0.8))
    memory.add_furniture("desk", memory.add_room("study"), box=box)
    assert not GraphFurniture(memory).take(publish([TABLE]))
    assert [*memory.boxes.values()] == [box]


def test_boxes_of_no_size_and_of_no_home_are_counted(memory):
    graph = GraphFurniture(memory)
    none = [(0, 1, (1, 2, 0), None), (1, 1, (1e9, 0, 0), (1, 1, 1)), (2, 1, (0, 0, 0), (1, 1, 0))]
    assert not graph.take(publish(none))
    assert graph.counts == {"furniture without a box, or beyond what is kept": 3}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"full_update": False}, "DsgUpdate must hold a whole graph, got a part of one. Read the"),
        ({"layer_contents": b""}, "DsgUpdate must hold a graph of spark_dsg, got .* in 0 bytes"),
        ({"layer_contents": b"abc" * 9}, "DsgUpdate must hold a graph of spark_dsg"),
    ],
)
def test_what_is_no_whole_graph_is_refused(memory, change, message):
    with pytest.raises(ValueError, match=message):
        GraphFurniture(memory).take(publish([TABLE], **change))


def test_without_spark_dsg_one_line_says_what_to_install(memory, monkeypatch):
    monkeypatch.setitem(sys.modules, "spark_dsg", None)
    with pytest.raises(
        ModuleNotFoundError, match=r"package spark_dsg .* pip install './core\[spark\]'"
    ):
        GraphFurniture(memory)


def test_a_live_memory_looks_at_furniture_of_the_graph(memory):
    with pytest.raises(ValueError, match="memory must have furniture with boxes to see it"):
        LiveMemory(memory, Finder(Adaptive()))
    live = LiveMemory(memory, Finder(Adaptive()), graph=GraphFurniture(memory))
    live.take_graph(publish([TABLE]))
    (table,) = memory.furniture_ids
    assert [marker.furniture for marker in live.list_markers("mug")] == [table]
    known = LiveMemory(memory, Finder(Adaptive()))
    with pytest.raises(ValueError, match="scene graphs must be taken by a GraphFurniture"):
        known.take_graph(publish([TABLE]))
