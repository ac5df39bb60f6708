"""A memory as a 3D scene graph of spark_dsg, the format of Hydra."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import numpy as np

from sgm.layout.box import LEAST_METRES, Box
from sgm.layout.furniture import Furniture
from sgm.layout.layout import Layout
from sgm.messages import needed_to

_SPACING = 3.0  # metres between what has no position
_BESIDE = 0.3  # metres from the middle of furniture to what lies on it

# Names in the metadata of edges, and of nodes.
RELATION = "relation"
FURNITURE, HAS_POSITION = "is_furniture", "has_position"
INTERIOR, OPEN_COST = "interior", "open_cost"


def import_spark_dsg() -> Any:
    """Return the package.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    with needed_to("read and write scene graphs", extra="spark"):
        return import_module("spark_dsg")


def read_box(node: Any, usual: str = "none") -> Box | None:
    """Return the bounding box of a node, upright, in metres of its graph; None if it has none.

    Its interior is that of the metadata, else the `usual` one.

    Raises:
        ValueError: if it is no box of a home.
    """
    bounds = node.attributes.bounding_box
    if bounds is None or not bounds.is_valid():
        return None
    turned = np.asarray(bounds.world_R_center, dtype=float)
    yaw = float(np.arctan2(turned[1, 0], turned[0, 0]))
    at_yaw = Box((0, 0, 0), (1, 1, 1), yaw)
    corners = at_yaw.to_own(np.asarray(bounds.corners(), dtype=float))  # (8, 3)
    size, middle = np.ptp(corners, axis=0), (corners.min(axis=0) + corners.max(axis=0)) / 2
    if size.min() < LEAST_METRES:
        return None
    interior = node.attributes.metadata.get().get(INTERIOR, usual)
    return Box(tuple(at_yaw.to_map(middle)), tuple(size), yaw, interior)


def find_label(graph: Any, node: Any, layer: str, names: Mapping[int, str]) -> str | None:
    """Return what a node is: its semantic label in `names` or the label space, else its name."""
    number: int | None = getattr(node.attributes, "semantic_label", None)
    if number is not None and number in names:
        return names[number]
    key = graph.get_layer_key(layer)
    space = graph.get_labelspace(key.layer, key.partition)
    known = {} if space is None else dict(space.labels_to_names)
    return str(known[number]) if number in known else find_name(node)


def find_name(node: Any) -> str | None:
    """Return what a node is called, None where that is its symbol."""
    name = str(getattr(node.attributes, "name", "")).strip()
    is_symbol = not name or name == str(node.id) or name == node.id.str(True)
    return None if is_symbol else name


def make_spark_graph(home: Mapping[str, Any], layout: Layout, labels: Mapping[str, str]) -> Any:
    """Return what a memory holds as a `spark_dsg.DynamicSceneGraph`.

    Rooms are of the layer of rooms; furniture, and every object that the last look at its place
    showed, of that of objects, with the label space of the graph. Objects are where they were seen
    last, if that is known. Links lead from rooms to
    furniture, and from furniture to what is there, with "relation" in their metadata; what counts
    sightings is in the metadata of the objects. What has no position stands in rows, and its
    metadata say so.

    Args:
        home: what `list_home` gives.
        layout: rooms and furniture.
        labels: what each object is, by its description.

    Raises:
        ModuleNotFoundError: if spark_dsg is not installed.
    """
    writer = _GraphWriter(import_spark_dsg())
    for number, room in enumerate(home["rooms"]):
        nodes = [layout.furniture[listed["id"]] for listed in room["furniture"]]
        known = [node.position for node in nodes if node.position is not None]
        middle = np.mean(known, axis=0) if known else np.array([_SPACING * number, 0.0])
        room_node = writer.add_room(room["id"], room["label"], middle)
        for turn, (listed, node) in enumerate(zip(room["furniture"], nodes, strict=True)):
            position = node.position or (None if node.box is None else node.box.center[:2])
            place = (
                middle + np.array([0.0, _SPACING * turn])
                if position is None
                else np.array(position)
            )
            about = _describe_furniture(node)
            holder = writer.add_object(
                listed["label"], listed["description"], place, about, node.box
            )
            writer.link(room_node, holder)
            present = [seen for seen in listed["objects"] if seen["is_there"]]
            for angle, seen in zip(np.arange(len(present)) * 2.4, present, strict=True):
                beside = place + _BESIDE * np.array([np.cos(angle), np.sin(angle)])
                about = {name: seen[name] for name in ("last_seen", "times_seen", "times_looked")}
                about |= {FURNITURE: False, HAS_POSITION: "position" in seen}
                where = np.array(seen.get("position", beside))
                name = seen["description"]
                item = writer.add_object(labels[name], name, where, about)
                writer.link(holder, item, seen["relation"])
    return writer.finish()


def _describe_furniture(furniture: Furniture) -> dict[str, Any]:
    """Return the metadata of a furniture node."""
    about: dict[str, Any] = {FURNITURE: True, HAS_POSITION: furniture.position is not None}
    if furniture.box is not None:
        about[INTERIOR] = furniture.box.interior
    if furniture.open_cost is not None:
        about[OPEN_COST] = furniture.open_cost
    return about


class _GraphWriter:
    """Adds nodes to a graph; labels are numbered as they come."""

    def __init__(self, spark_dsg: Any) -> None:
        self._package = spark_dsg
        self._graph = spark_dsg.DynamicSceneGraph()
        self._numbers: dict[str, int] = {}
        self._num_objects = 0

    def add_room(self, number: int, label: str, position: np.ndarray) -> Any:
        """Add a room and return its symbol."""
        attributes = self._package.RoomNodeAttributes()
        attributes.name, attributes.position = label, np.append(position, 0.0)
        return self._add(self._package.DsgLayers.ROOMS, "R", number, attributes)

    def add_object(
        self,
        label: str,
        description: str,
        position: np.ndarray,  # x and y, or x, y and z
        metadata: dict[str, Any],
        box: Box | None = None,
    ) -> Any:
        """Add furniture or an object and return its symbol."""
        attributes = self._package.ObjectNodeAttributes()
        attributes.name = description
        attributes.position = np.append(position, 0.0) if len(position) == 2 else position
        attributes.semantic_label = self._numbers.setdefault(label, len(self._numbers) + 1)
        attributes.metadata.set(metadata)
        if box is not None:
            attributes.bounding_box = self._package.BoundingBox(box.size, box.center, box.yaw)
        self._num_objects += 1
        return self._add(self._package.DsgLayers.OBJECTS, "O", self._num_objects, attributes)

    def link(self, above: Any, below: Any, relation: str | None = None) -> None:
        """Link two nodes."""
        attributes = self._package.EdgeAttributes()
        if relation is not None:
            attributes.metadata.set({RELATION: relation})
        self._graph.insert_edge(above, below, attributes)

    def finish(self) -> Any:
        """Return the graph, with its label space."""
        names = {number: label for label, number in self._numbers.items()}
        key = self._graph.get_layer_key(self._package.DsgLayers.OBJECTS)
        space = self._package.Labelspace(names)
        self._graph.set_labelspace(space, key.layer, key.partition)
        return self._graph

    def _add(self, layer: str, category: str, number: int, attributes: Any) -> Any:
        symbol = self._package.NodeSymbol(category, number)
        self._graph.add_node(layer, symbol, attributes)
        return symbol
