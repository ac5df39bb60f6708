"""What a mapper has changed in a memory: how often, what became one, and what is gone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

from sgm.layout.areas import Areas
from sgm.memory.scene_graph_memory import SceneGraphMemory


@dataclass(slots=True, eq=False)
class MapChanges:
    """The changes of the map of a memory.

    Attributes:
        memory: that has the map.
        areas: rooms as polygons.
        counts: how often the map was changed in which way.
        merged: ids of furniture and spots that are gone, with those that they are part of.
        gone: ids of those that are gone and part of nothing.
    """

    memory: SceneGraphMemory
    areas: Areas
    counts: Counter[str] = field(default_factory=Counter)
    merged: dict[int, int] = field(default_factory=dict)
    gone: set[int] = field(default_factory=set)

    def merge(self, furniture: int, other: int) -> None:
        """Make other furniture a part of furniture."""
        self.memory.merge_furniture(furniture, other)
        self.merged[other] = furniture
        self.counts["furniture merged"] += 1

    def find_room(self, position: Sequence[float]) -> int:
        """Return the id of the room at a position, which is added if the memory has none."""
        name = self.areas.find(position)
        for number, room in self.memory.layout.rooms.items():
            if str(room) == name:
                return number
        return self.memory.add_room(name)
