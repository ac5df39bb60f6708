"""A 3D scene graph of spark_dsg, such as Hydra writes, as a trace."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sgm.layout.box import Box
from sgm.memory.sighting import Point
from sgm.memory.spark_graph import (
    FURNITURE,
    HAS_POSITION,
    OPEN_COST,
    RELATION,
    find_label,
    find_name,
    import_spark_dsg,
    read_box,
)
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.schema import MOST_METRES
from simulator.priors.types import load_names
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.trace import Trace
from simulator.yaml_text import load_yaml

MAX_DISTANCE = 1.0
"""Metres from furniture beyond which an object is not taken to be on it."""
MAX_PLACE_DISTANCE = 3.0
"""Metres from a place beyond which furniture is not taken to be in its room."""
_NO_NODE = -1  # of the room for all that is in none
_HINT = " (give --room home)"


def read_scene_graph(
    path: Path,
    furniture_labels: Collection[str] = (),
    labels: Path | None = None,
    room: str | None = None,
) -> tuple[Trace, HomeBuilder]:
    """Read rooms and objects of a scene graph; objects are assigned to the nearest parent.

    A node of the object layer is furniture if the type table, the names of the household, or
    `furniture_labels` have its label: a "refrigerator" is a fridge.
    Its room is the nearest one above it in the graph, else the one whose box holds it, else that of
    the nearest place of a room within `MAX_PLACE_DISTANCE`. Any other object belongs to the
    furniture that it is linked to, over places and objects, by the fewest links; else to the
    nearest furniture of its room within `MAX_DISTANCE`; else it is left out. Where a `room` is
    given, nothing is left out for want of a place: furniture without a room stands in that one, and
    an object without furniture lies on the floor of its room.

    Args:
        path: JSON or binary, written by `DynamicSceneGraph.save`.
        furniture_labels: labels that are furniture besides those of the type table.
        labels: file with the names of the numbers of objects, see `load_label_names`; None for the
            label space of the graph.
        room: name of one room for all that is in none; None to leave it out.

    Raises:
        ValueError: if it is no such file, or nothing of it can be placed.
        ModuleNotFoundError: if spark_dsg is not installed.
    """
    spark_dsg = import_spark_dsg()
    names = {} if labels is None else load_label_names(labels)
    if not path.is_file():
        raise ValueError(
            f"scene graph must be a file that exists, got none at {path}. Check the path."
        )
    try:
        with _without_output():  # an older encoding is announced on the console
            graph = spark_dsg.DynamicSceneGraph.load(str(path))
    except (RuntimeError, ValueError, IndexError) as error:
        raise ValueError(
            f"scene graph must be one that spark_dsg saved, got {shorten(str(error)[:80])} for "
            f"{path}. Save it again with DynamicSceneGraph.save."
        ) from None
    reader = _GraphReader(spark_dsg, graph, HomeBuilder(furniture_labels), names, room)
    reader.read()
    return reader.builder.build(path.stem), reader.builder


@contextmanager
def _without_output() -> Iterator[None]:
    """Let compiled code print nothing."""
    sys.stdout.flush()
    kept = os.dup(1)
    try:
        with open(os.devnull, "wb") as nowhere:
            os.dup2(nowhere.fileno(), 1)
        yield
    finally:
        os.dup2(kept, 1)
        os.close(kept)


class _GraphReader:
    """Reads one scene graph into a builder."""

    def __init__(
        self,
        spark_dsg: Any,
        graph: Any,
        builder: HomeBuilder,
        names: Mapping[int, str],
        room: str | None,
    ) -> None:
        self.builder = builder
        self._usual_room = room
        self._floors: dict[int, int] = {}  # index of the furniture by that of the room
        self._names = names
        self._graph = graph
        self._layers = spark_dsg.DsgLayers
        self._extents: dict[int, np.ndarray] = {}  # low and high x, y, z of each node, (2, 3)
        self._rooms: dict[int, int] = {}  # index by node id
        self._furniture: dict[int, int] = {}
        self._room_of_furniture: dict[int, int] = {}

    def read(self) -> None:
        """Read rooms, then furniture, then what is on it."""
        for node in self._list_nodes(self._layers.ROOMS):
            room_type = self._find_label(node, self._layers.ROOMS) or "room"
            self._rooms[node.id.value] = self.builder.add_room(
                load_names("procthor").find_room(room_type) or room_type
            )
        objects = []
        for node in self._list_nodes(self._layers.OBJECTS):
            label = self._find_label(node, self._layers.OBJECTS)
            says_furniture: bool | None = node.attributes.metadata.get().get(FURNITURE)
            if label is None:
                number = node.attributes.semantic_label
                if number == node.attributes.NO_SEMANTIC_LABEL:
                    self.builder.leave_out("neither a semantic label nor a name", str(node.id))
                else:
                    reason = "no name for the number of its label (give --labels)"
                    self.builder.leave_out(reason, str(number))
                continue
            known = self.builder.find_furniture(label) if says_furniture is None else label
            if known is None or says_furniture is False:
                objects.append((node, label))
            else:
                self._add_furniture(node, known, label)
        for node, label in objects:
            self._add_object(node, label)

    def _add_furniture(self, node: Any, label: str, called: str) -> None:
        room = self._find_room(node)
        if room is None:
            self.builder.leave_out(f"in no room{_HINT}", called)
            return
        x, y, _ = (float(value) for value in node.attributes.position)
        position = (x, y) if node.attributes.metadata.get().get(HAS_POSITION, True) else None
        box, cost = self._find_extents(node, label)
        name = find_name(node) or read_words("furniture label", called)
        index = self.builder.add_furniture(label, room, name, position, box, cost)
        self._furniture[node.id.value] = index
        self._room_of_furniture[index] = room

    def _find_extents(self, node: Any, label: str) -> tuple[Box | None, float | None]:
        """Return the box of furniture, upright, and what it costs to open it; None if unknown."""
        usual = "open" if self.builder.get_relation(label) == "in" else "none"
        return read_box(node, usual), node.attributes.metadata.get().get(OPEN_COST)

    def _add_object(self, node: Any, label: str) -> None:
        found, relation = self._search(node, self._furniture, climbs_only=False), None
        if found is not None:
            link = self._graph.find_edge(node.id.value, found[0])
            relation = None if link is None else link.info.metadata.get().get(RELATION)
        else:
            room = self._find_own_room(node)
            distances = {
                holder: self._compute_distance(node, holder)
                for holder, index in self._furniture.items()
                if room is None or self._room_of_furniture[index] == room
            }
            nearest = min(distances, key=lambda holder: distances[holder], default=None)
            if nearest is None or distances[nearest] > MAX_DISTANCE:
                room = self._find_room(node)
                if room is not None and self._usual_room is not None:
                    name = find_name(node)
                    self.builder.add_object(
                        label,
                        self._ensure_floor(room),
                        description=name,
                        position=_find_position(node),
                    )
                    return
                reason = "in its room" if nearest is None else f"within {MAX_DISTANCE:g} m"
                self.builder.leave_out(f"no furniture {reason}{_HINT}", label)
                return
            found = nearest, 1
        holder, num_links = found
        inside, name = self._compute_distance(node, holder) == 0, find_name(node)
        self.builder.add_object(
            label,
            self._furniture[holder],
            inside,
            num_links > 1,
            name,
            relation,
            _find_position(node),
        )

    def _ensure_floor(self, room: int) -> int:
        """Return the index of the floor of a room, which is furniture."""
        if room not in self._floors:
            self._floors[room] = self.builder.add_furniture("floor", room)
        return self._floors[room]

    def _find_room(self, node: Any) -> int | None:
        """Index of the room of a node; what is in none is in the usual one, where there is any."""
        room = self._find_own_room(node)
        if room is None and self._usual_room is not None:
            if _NO_NODE not in self._rooms:
                self._rooms[_NO_NODE] = self.builder.add_room(self._usual_room)
            room = self._rooms[_NO_NODE]
        return room

    def _find_own_room(self, node: Any) -> int | None:
        """Index of the room above a node, else of the room whose box holds it."""
        found = self._search(node, self._rooms, climbs_only=True)
        if found is not None:
            return self._rooms[found[0]]
        for room, index in self._rooms.items():
            if room == _NO_NODE:
                continue
            has_extent = np.ptp(self._extents[room], axis=0).any()
            if has_extent and self._compute_distance(node, room) == 0:
                return index
        points, rooms = self._places
        if not len(points):
            return None
        distance = np.linalg.norm(points - node.attributes.position, axis=1)
        nearest = int(distance.argmin())
        return rooms[nearest] if distance[nearest] <= MAX_PLACE_DISTANCE else None

    @cached_property
    def _places(self) -> tuple[np.ndarray, list[int]]:
        """Positions of the places of rooms, (P, 3), and index of the room of each."""
        points, rooms = [], []
        for node in self._list_nodes(self._layers.PLACES):
            found = self._search(node, self._rooms, climbs_only=True)
            if found is not None:
                points.append(node.attributes.position)
                rooms.append(self._rooms[found[0]])
        return np.array(points, dtype=float).reshape(-1, 3), rooms

    def _search(
        self, node: Any, targets: Collection[int], climbs_only: bool
    ) -> tuple[int, int] | None:
        """Find the target linked to a node by the fewest links, and how many there are.

        Links lead to parents, and to objects beside the node unless `climbs_only`; rooms end the
        search, because everything of a room is linked through it.
        """
        reached = {node.id.value}
        edge = [node.id.value]
        num_links = 0
        objects = None if climbs_only else self._graph.get_layer_key(self._layers.OBJECTS).layer
        while edge:
            num_links += 1
            following: list[int] = []
            for name in edge:
                current = self._graph.get_node(name)
                links = set(current.parents())
                if current.layer.layer == objects:
                    links |= set(current.siblings())
                following += sorted(links - reached)
                reached |= links
            hits = [name for name in following if name in targets]
            if hits:
                return min(hits, key=lambda name: self._compute_distance(node, name)), num_links
            edge = [name for name in following if name not in self._rooms]
        return None

    def _compute_distance(self, node: Any, other: int) -> float:
        """Metres from the position of a node to the extents of another one, 0 inside."""
        low, high = self._extents[other]
        point = np.asarray(node.attributes.position, dtype=float)
        return float(np.linalg.norm(np.maximum(np.maximum(low - point, point - high), 0)))

    def _list_nodes(self, layer: str) -> Iterator[Any]:
        """Nodes of a layer in order of id; extents are kept, points of those without a box."""
        if not self._graph.has_layer(layer):
            return
        for node in sorted(self._graph.get_layer(layer).nodes, key=lambda node: node.id.value):
            box = getattr(node.attributes, "bounding_box", None)
            points = np.array([node.attributes.position], dtype=float)
            if box is not None and box.is_valid():
                points = np.asarray(box.corners(), dtype=float)  # (8, 3); it may be rotated
            self._extents[node.id.value] = np.stack([points.min(axis=0), points.max(axis=0)])
            yield node

    def _find_label(self, node: Any, layer: str) -> str | None:
        """What a node is: by its semantic label, else by its name."""
        names = self._names if layer == self._layers.OBJECTS else {}
        label = find_label(self._graph, node, layer, names)
        number: int | None = getattr(node.attributes, "semantic_label", None)
        if number is not None and label is not None and label != find_name(node):
            self.builder.taken_for[number, label] += 1
        return label


def _find_position(node: Any) -> Point | None:
    """Return where the middle of an object is; None where it only stands in a row."""
    x, y, z = (float(value) for value in node.attributes.position)
    has_position = node.attributes.metadata.get().get(HAS_POSITION, True)
    is_in_home = max(abs(x), abs(y), abs(z)) <= MOST_METRES  # nan is not
    return (x, y, z) if has_position and is_in_home else None


def load_label_names(path: Path) -> dict[int, str]:
    """Read a label space: YAML with `label_names`, a list of entries with `label` and `name`.

    Raises:
        ValueError: if it cannot be read, or an entry is broken or there twice.
    """
    content = load_yaml("labels", path)
    rows = content.get("label_names") if isinstance(content, dict) else None
    if not isinstance(rows, list) or not rows:
        raise ValueError(
            f"labels must have a list label_names, got {shorten(rows, 60)} in {path}. Write "
            "entries like {label: 5, name: chair}."
        )
    names: dict[int, str] = {}
    for index, entry in enumerate(rows):
        number, name = (
            (entry.get("label"), entry.get("name")) if isinstance(entry, dict) else (None, entry)
        )
        is_named = isinstance(name, str) and name.strip()
        if type(number) is not int or not is_named or number in names:
            raise ValueError(
                f"label_names[{index}] must have a label, a number of its own, and a name, got "
                f"{shorten(entry, 60)} in {path}. Write entries like {{label: 5, name: chair}}."
            )
        names[number] = str(name)
    return names
