"""Furniture of a scene graph that Hydra publishes while it draws it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from sgm.eyes.look_builder import LookBuilder
from sgm.layout.areas import Areas
from sgm.layout.box import Box
from sgm.layout.footprints import compute_overlap, get_area
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.spark_graph import find_label, import_spark_dsg, read_box
from sgm.messages import shorten

_LEAST_CHANGE = 0.1  # metres by which a box changes before it is taken over anew
_LEAST_OVERLAP = 0.4  # share of the smaller footprint that is in both, of two that are one
_MOST_FURNITURE = 1000


class GraphFurniture:
    """Takes furniture over from the messages `hydra_msgs/DsgUpdate`, each with a whole graph.

    A node of the layer of objects is furniture if its label is (`FurnitureLabels`) and it has a
    bounding box. Boxes are drawn anew as those of the graph change. A node that is in the graph no
    longer is merged with furniture of its label that stands there, as Hydra does; where none does,
    it stays, with what is remembered there. What the memory had before is left as it is.
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        *,
        labels: FurnitureLabels | None = None,
        names: Mapping[int, str] | None = None,
        areas: Areas | None = None,
    ) -> None:
        """Begin with the furniture that the memory has.

        Args:
            memory: that gets the furniture.
            labels: what furniture may be called; None for those of the household.
            names: of the numbers of labels; None for the label space that is in the graph.
            areas: rooms as polygons; None for the rooms of the graph that have a label, and one
                room "home" for the rest.

        Raises:
            ModuleNotFoundError: if spark_dsg is not installed.
        """
        self._package = import_spark_dsg()
        self.memory = memory
        self._labels = FurnitureLabels() if labels is None else labels
        self._names = {} if names is None else names
        self._areas = areas
        self._ids: dict[int, int] = {}  # in the memory, by the number of the node
        self._counts: Counter[str] = Counter()

    @property
    def counts(self) -> dict[str, int]:
        """How often the map was changed in which way, and what of graphs was left out."""
        return dict(self._counts)

    def take(self, message: Any, builder: LookBuilder | None = None) -> bool:
        """Take the furniture of a graph, and return whether anything has changed.

        Args:
            message: a `hydra_msgs/DsgUpdate`, with `layer_contents` and `full_update`.
            builder: goes on with the furniture; its visits end where something has changed.

        Raises:
            ValueError: if it holds no whole graph.
        """
        found = self._find_furniture(self._read(message))
        memory = self.memory
        new = [node for node in found if node not in self._ids]
        redrawn = [node for node in self._ids if self._differs(node, found)]
        merged = self._find_merged(found)
        taken = [node for node in new if not self._is_on_map(found[node][1])]
        if not (taken or redrawn or merged):
            return False
        if builder is not None:
            builder.set_furniture(memory.layout.furniture)  # looks at what is there until now
        for node in taken:
            label, box, room = found[node]
            self._ids[node] = self._add(label, box, room)
        for node in redrawn:
            furniture, box = self._ids[node], found[node][1]
            known = memory.layout.furniture[furniture].box
            if known is not None:
                box = replace(box, interior=known.interior)
            memory.move_furniture(furniture, box=box)
        for node, kept in merged.items():
            memory.merge_furniture(self._ids[kept], self._ids.pop(node))
        for change, nodes in (
            ("furniture found", taken),
            ("furniture drawn anew", redrawn),
            ("furniture merged", merged),
        ):
            if nodes:
                self._counts[change] += len(nodes)
        if builder is not None:
            builder.set_furniture(memory.layout.furniture)
        return True

    def _read(self, message: Any) -> Any:
        if not message.full_update:
            raise ValueError(
                "DsgUpdate must hold a whole graph, got a part of one. Read the topic of Hydra on "
                "which full_update is true."
            )
        content = bytes(message.layer_contents)
        try:
            return self._package.DynamicSceneGraph.from_binary(content)
        except (RuntimeError, ValueError, IndexError) as error:
            raise ValueError(
                f"DsgUpdate must hold a graph of spark_dsg, got {shorten(str(error)[:80])} in "
                f"{len(content)} bytes. Install the version of spark_dsg that Hydra was built with."
            ) from None

    def _find_furniture(self, graph: Any) -> dict[int, tuple[str, Box, str]]:
        """Return label, box and room of each node that is furniture, by its number."""
        layers = self._package.DsgLayers
        found: dict[int, tuple[str, Box, str]] = {}
        if not graph.has_layer(layers.OBJECTS):
            return found
        for node in sorted(graph.get_layer(layers.OBJECTS).nodes, key=lambda node: node.id.value):
            name = find_label(graph, node, layers.OBJECTS, self._names)
            label = None if name is None else self._labels.find_label(name)
            if label is None:
                continue
            try:
                box = read_box(node)
            except ValueError:  # not of any home
                box = None
            if box is None or len(found) >= _MOST_FURNITURE:
                self._counts["furniture without a box, or beyond what is kept"] += 1
                continue
            found[node.id.value] = label, box, self._find_room(graph, node, box)
        return found

    def _find_room(self, graph: Any, node: Any, box: Box) -> str:
        if self._areas is not None:
            return self._areas.find(box.center)
        layer = self._package.DsgLayers.ROOMS
        rooms = graph.get_layer_key(layer).layer
        ancestor, seen = node, {node.id.value}
        while ancestor is not None and ancestor.layer.layer != rooms:
            above = [number for number in ancestor.parents() if number not in seen]
            seen.update(above)
            ancestor = graph.get_node(above[0]) if above else None
        label = None if ancestor is None else find_label(graph, ancestor, layer, {})
        return label or "home"

    def _differs(self, node: int, found: Mapping[int, tuple[str, Box, str]]) -> bool:
        """Tell whether the graph draws furniture otherwise than the memory has it."""
        furniture = self.memory.layout.furniture.get(self._ids[node])
        if node not in found or furniture is None or furniture.box is None:
            return False
        new, known = found[node][1], furniture.box
        sides = zip((*new.center, *new.size), (*known.center, *known.size), strict=True)
        turned = abs(math.remainder(new.yaw - known.yaw, 2 * math.pi)) * max(new.size[:2]) / 2
        return max(turned, *(abs(side - other) for side, other in sides)) >= _LEAST_CHANGE

    def _find_merged(self, found: Mapping[int, tuple[str, Box, str]]) -> dict[int, int]:
        """Return the nodes that are in the graph no longer, with those that they are part of."""
        merged = {}
        for node, furniture in self._ids.items():
            known = self.memory.layout.furniture.get(furniture)
            if node in found or known is None or known.box is None:
                continue
            for other, (label, box, _) in found.items():
                is_there = self._labels.are_same(known.label, label) and _are_one(known.box, box)
                if is_there and other in self._ids:
                    merged[node] = other
                    break
        return merged

    def _is_on_map(self, box: Box) -> bool:
        """Tell whether the memory has furniture at a place that is not of the graph."""
        of_graph = {*self._ids.values()}
        return any(
            known.box is not None and number not in of_graph and _are_one(known.box, box)
            for number, known in self.memory.layout.furniture.items()
        )

    def _add(self, label: str, box: Box, room: str) -> int:
        memory = self.memory
        rooms = (
            number for number, known_room in memory.layout.rooms.items() if str(known_room) == room
        )
        number = next(rooms, None)
        if number is None:
            number = memory.add_room(room)
        count = sum(known.label == label for known in memory.layout.furniture.values()) + 1
        name = label if count == 1 else f"{label} {count}"
        return memory.add_furniture(label, number, name, box=box)


def _are_one(box: Box, other: Box) -> bool:
    both, _ = compute_overlap(box, other)
    return both > _LEAST_OVERLAP * min(get_area(box), get_area(other))
