"""A robot in a simulated home, with the memory and the names that its owner would use."""

from __future__ import annotations

import numpy as np

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import RELATIONS
from simulator.tasks.rollout import sample_query
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import observe
from simulator.world.streams import Streams


class Robot:
    """Looks around a home of full size: 32 furniture nodes, some 192 objects.

    Attributes:
        memory: what it remembers.
        furniture: ids of the furniture nodes, by their index in the home.
    """

    def __init__(self) -> None:
        """Enter the home."""
        self._homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", [0]))
        self.memory = SceneGraphMemory()
        rooms = [self.memory.add_room(label) for label in self._homes.room_labels[0]]
        labels = self._homes.furniture_labels[0].tolist()
        places = zip(labels, self._homes.furniture_room[0].tolist(), strict=True)
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
        self._homes.evolve()
        self.memory.step()

    def see(self, index: int) -> list[Sighting]:
        """Detect what is at the furniture node of an index."""
        seen = observe(self._homes, np.array([index]))
        names = self._homes.object_descriptions
        return [
            Sighting(names.text(code), RELATIONS[relation])
            for code, relation in zip(seen.seen_code, seen.seen_relation, strict=True)
        ]

    def get_wish(self) -> str:
        """Say what is asked for next."""
        slot = sample_query(self._homes)[0]
        return self._homes.object_descriptions.text(self._homes.object_code[0, slot])
