"""A home with habits, for searches."""

from __future__ import annotations

from copy import copy, deepcopy
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

ROOMS = {
    "kitchen": ("fridge", "counter top", "dining table", "cabinet", "sink"),
    "living room": ("sofa", "coffee table", "tv stand", "shelf"),
    "bedroom": ("bed", "dresser", "desk", "side table"),
    "bathroom": ("washbasin", "toilet", "shelf"),
    "hall": ("shoe rack", "chest of drawers"),
}
THINGS = (
    "milk",
    "butter",
    "large red mug",
    "small blue mug",
    "kettle",
    "plate",
    "bowl",
    "fork",
    "spatula",
    "apple",
    "bread",
    "remote control",
    "book",
    "magazine",
    "pillow",
    "laptop",
    "cell phone",
    "keys",
    "wallet",
    "umbrella",
    "sneakers",
    "jacket",
    "towel",
    "soap bar",
    "toothbrush",
    "toilet paper",
    "scissors",
    "pen",
)


class Home:
    """18 pieces of furniture and 28 things: each at its usual place or, sometimes, at another.

    Attributes:
        memory: what the robot remembers.
        furniture: ids, in order of the usual places.
        at: where each thing is, as a position in `furniture`.
    """

    def __init__(
        self,
        seed: int,
        miss_rate: float,
        log: Path | None = None,
        clock: Clock | None = None,
    ) -> None:
        self.memory = SceneGraphMemory(path=log, clock=clock)
        self.furniture = []
        for room, labels in ROOMS.items():
            number = self.memory.add_room(room)
            self.furniture += [self.memory.add_furniture(label, number) for label in labels]
        self._rng = np.random.default_rng(seed)
        self._miss_rate = miss_rate
        self._usual = {
            thing: self._rng.choice(len(self.furniture), 2, replace=False) for thing in THINGS
        }
        self.at = {thing: int(usual[0]) for thing, usual in self._usual.items()}

    def pass_time(self) -> None:
        """Put some things at their other place or back, and a few anywhere."""
        for thing, usual in self._usual.items():
            draw = self._rng.random()
            if draw < 0.1:
                self.at[thing] = int(usual[int(self._rng.random() < 0.4)])
            elif draw < 0.12:
                self.at[thing] = int(self._rng.integers(len(self.furniture)))
        self.memory.step()

    def look(self, furniture: int) -> list[Sighting]:
        """Return what the detector sees there."""
        return [
            Sighting(thing)
            for thing, place in self.at.items()
            if self.furniture[place] == furniture and self._rng.random() >= self._miss_rate
        ]

    def live(self, num_looks: int) -> None:
        """Look at three places a step, at random."""
        for _ in range(num_looks // 3):
            self.pass_time()
            for furniture in self.choose(3):
                self.memory.observe(furniture, self.look(furniture))

    def copy(self) -> Home:
        """Return a home that goes on by itself from here on."""
        home = copy(self)
        home.memory = self.memory.copy()
        home.at, home._rng = {**self.at}, deepcopy(self._rng)
        return home

    def choose(self, count: int) -> list[int]:
        """Choose furniture to look at, at random."""
        return self._rng.choice(self.furniture, count, replace=False).tolist()


@pytest.fixture(scope="session")
def make_home():
    """What makes a home that was lived in for a fortnight of 252 looks."""

    @cache  # lived in once, and copied for each test
    def live(seed: int, miss_rate: float, clock: Clock | None) -> Home:
        home = Home(seed, miss_rate, clock=clock)
        home.live(252)
        return home

    def make(seed: int = 0, miss_rate: float = 0.0, clock: Clock | None = None) -> Home:
        return live(seed, miss_rate, clock).copy()

    return make
