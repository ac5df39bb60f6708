"""How the cost of a step grows with the length of a life: memory, filters, network, file."""

from __future__ import annotations

import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from curves import Point

from sgm.memory.queries import Change
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import NUM_RELATIONS, RELATIONS
from simulator.policies import make_policy
from simulator.tasks.rollout import Rollout, sample_query
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.sensing import observe
from simulator.world.streams import Streams

POLICIES = ("bayesian", "adaptive", "persistence", "prior_filter", "home_filter")


def measure_life(sizes: Sequence[int], repeats: int) -> Iterator[Point]:
    """One home of the paper: a look and a question per step, for as many steps as the last size.

    A time is the mean over the steps since the size before. The policies share one memory and look
    at the same random places; the network is asked, and the file saved, at each size.
    """
    from nep import ObjectFinder

    life, finder = _Life(), ObjectFinder.load("heat")
    for _ in range(5):  # compiled functions are loaded
        life.step(defaultdict(float))
    life = _Life()
    start = 0
    for size in sizes:
        seconds: dict[str, float] = defaultdict(float)
        for _ in range(size - start):
            life.step(seconds)
        start_of_mean, start = start, size
        for name, total in seconds.items():
            yield Point(f"{name}, by steps of a life", size, total / (size - start_of_mean))
        robot = life.robot
        timed = []
        for number in range(repeats):
            text = robot.descriptions[number % len(robot.descriptions)]
            begin = time.process_time()
            finder.rank(robot, text, k=5)
            timed.append(time.process_time() - begin)
        yield Point("network asked where, by steps of a life", size, min(timed))
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "home.sgm"
            robot.save(path)
            yield Point("memory file in MB, by steps of a life", size, path.stat().st_size / 1e6)
        edges = life.rollout.memory.edges.num_rows
        yield Point("edges remembered in number, by steps of a life", size, edges)


class _Life:
    """A home, the memory of who plays there and of a robot, and policies that are asked."""

    def __init__(self) -> None:
        self.homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "train", [0]))
        self.policies = {name: make_policy(name, self.homes) for name in POLICIES}
        self.rollout = Rollout(self.homes, make_policy("random", self.homes))
        for policy in self.policies.values():
            policy.reset(self.rollout.memory)
        self.rollout.on_change = self._note
        self._seconds: dict[str, float] = {}
        self._rng = np.random.default_rng(0)
        self.robot = SceneGraphMemory(self.homes.prior)
        rooms = [self.robot.add_room(label) for label in self.homes.room_labels[0]]
        self._ids = [
            self.robot.add_furniture(label, rooms[room], f"{label} {number}")
            for number, (label, room) in enumerate(
                zip(self.homes.furniture_labels[0], self.homes.furniture_room[0], strict=True)
            )
        ]

    def step(self, seconds: dict[str, float]) -> None:
        """Let a step pass; add what each part of it takes to `seconds`."""
        self._seconds = seconds
        rollout = self.rollout
        rollout.evolve()
        _, queries = rollout.ask_for(np.array([0]), sample_query(self.homes))
        for name, policy in self.policies.items():
            begin = time.process_time()
            policy.scores(rollout.memory, queries)
            seconds[f"{name} asked and told"] += time.process_time() - begin
        furniture = self._rng.integers(0, self.homes.num_furniture, 1)
        seen = observe(self.homes, furniture)
        told = sum(seconds[f"{name} asked and told"] for name in self.policies)
        begin = time.process_time()
        rollout.look(furniture)
        passed = time.process_time() - begin
        told = sum(seconds[f"{name} asked and told"] for name in self.policies) - told
        seconds["look"] += passed - told
        texts = [self.homes.object_descriptions.text(int(code)) for code in seen.seen_code]
        relations = [RELATIONS[relation % NUM_RELATIONS] for relation in seen.seen_relation]
        self.robot.observe(
            self._ids[furniture[0]],
            [Sighting(*pair) for pair in zip(texts, relations, strict=True)],
        )
        self.robot.step()

    def _note(self, change: Change) -> None:
        for name, policy in self.policies.items():
            begin = time.process_time()
            policy.observe(self.rollout.memory, change)
            self._seconds[f"{name} asked and told"] += time.process_time() - begin
