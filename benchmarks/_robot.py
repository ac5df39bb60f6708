"""A robot in a simulated home, with the memory and the names that its owner would use."""

from __future__ import annotations

import numpy as np

from simulator.config import HouseConfig
from simulator.houses import Houses
from simulator.memory.scene_graph_memory import SceneGraphMemory
from simulator.memory.sighting import RELATIONS, Sighting
from simulator.prior_graph import PriorGraph
from simulator.sensing import observe
from simulator.streams import Streams
from simulator.tasks.predict_location import sample_query


class Robot:
    """Looks around a home of full size: 32 furniture nodes, some 192 objects.

    Attributes:
        memory: what it remembers.
        furniture: ids of the furniture nodes, by their index in the home.
    """

    def __init__(self) -> None:
        """Enter the home."""
        self._houses = Houses(PriorGraph.default(), HouseConfig(), Streams(0, "val", [0]))
        self.memory = SceneGraphMemory()
        rooms = [self.memory.add_room(label) for label in self._houses.room_labels]
        labels = self._houses.furniture_labels[0].tolist()
        places = zip(labels, self._houses.furniture_room.tolist(), strict=True)
        self.furniture = [self.memory.add_furniture(label, rooms[room]) for label, room in places]

    def remember(self, num_objects: int) -> None:
        """Look at one furniture node after the other until so many objects are remembered."""
        index = 0
        while len(self.memory.descriptions) < num_objects:
            self.evolve()
            self.memory.observe(self.furniture[index], self.see(index))
            index = (index + 1) % len(self.furniture)

    def evolve(self) -> None:
        """Let one step pass."""
        self._houses.evolve()
        self.memory.step()

    def see(self, index: int) -> list[Sighting]:
        """Detect what is at the furniture node of an index."""
        seen = observe(self._houses, np.array([index]))
        names = self._houses.object_descriptions
        return [
            Sighting(names.text(code), RELATIONS[relation])
            for code, relation in zip(seen.seen_code, seen.seen_relation, strict=True)
        ]

    def get_wish(self) -> str:
        """Say what is asked for next."""
        slot = sample_query(self._houses)[0]
        return self._houses.object_descriptions.text(self._houses.object_code[0, slot])
