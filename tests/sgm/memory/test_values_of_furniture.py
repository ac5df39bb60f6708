"""Furniture says in `to_dict` where it is, as things do."""

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Bayesian


def test_furniture_and_things_have_positions_as_values():
    service = MemoryService(SceneGraphMemory(), Finder(Bayesian()), now=None)
    service.add_room("kitchen")
    service.add_place("table", "kitchen", position=(1, 2))
    service.add_place("shelf", "kitchen")
    service.add_place("bed", "kitchen", center=(5, 5, 0.3), size=(2, 1, 0.6))
    service.observe("bed", [{"thing": "pillow", "position": (5, 5, 0.6)}])
    (room,) = service.memory.to_dict()["rooms"]
    table, shelf, bed = room["furniture"]
    assert table["position"] == [1.0, 2.0, 0.0]
    assert "position" not in shelf
    assert "box" not in table
    assert bed["position"] == [5.0, 5.0, 0.3]
    assert bed["box"] == service.memory.boxes[2].to_json()
    assert bed["objects"][0]["position"] == [5.0, 5.0, 0.6]
