"""Days in a home with people: robots patrol it and fetch things, side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import cycle, islice
from pathlib import Path
from typing import Any

import numpy as np

from sgm.checks import check_at_least
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies.adaptive import Adaptive
from simulator.box_world.robot_body import BodyRules, RobotBody
from simulator.box_world.robots import (
    Errand,
    HomeRobot,
    MappingRobot,
    PerfectRobot,
    SeeingRobot,
    ShownRobot,
    make_memory,
)
from simulator.box_world.world import BoxWorld
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


@dataclass(frozen=True, slots=True)
class WeekRules:
    """What the robots do.

    Attributes:
        steps: time steps; 168 hours are a week.
        looks_per_step: places that they look at in each step, in turn.
        errands_per_step: things that they are asked for in each step.
        most_looks: of one errand.
        rounds: times that robots are led to all furniture before, a time step apart.
    """

    steps: int = 168
    looks_per_step: int = 2
    errands_per_step: int = 1
    most_looks: int = 10
    rounds: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError if a number is too small."""
        check_at_least(
            1, steps=self.steps, errands_per_step=self.errands_per_step, most_looks=self.most_looks
        )
        check_at_least(0, looks_per_step=self.looks_per_step, rounds=self.rounds)


@dataclass(slots=True)
class Tally:
    """The errands of a robot, in order."""

    name: str
    errands: list[Errand] = field(default_factory=list)

    @property
    def found(self) -> float:
        """Share of the errands on which the thing was found."""
        return float(np.mean([errand.is_found for errand in self.errands]))

    def compute_looks(self, most_looks: int) -> float:
        """Return the mean looks of an errand; what was not found counts `most_looks` + 1."""
        return float(
            np.mean(
                [errand.num_looks if errand.is_found else most_looks + 1 for errand in self.errands]
            )
        )

    @property
    def metres(self) -> float:
        """Mean way of an errand."""
        return float(np.mean([errand.metres for errand in self.errands]))


Kind = type[HomeRobot]
# Robots by the name of their row.
ROBOTS: Mapping[str, Kind] = {
    "eyes": SeeingRobot,
    "all that shows": ShownRobot,
    "perfect looks": PerfectRobot,
    "own map": MappingRobot,
}


class Week:
    """One home in copies, which live alike, with a robot in each.

    Attributes:
        robots: by their names in `ROBOTS`.
        tallies: of all of them, in this order.
    """

    def __init__(
        self,
        source: HomeSource,
        home: int,
        seed: int,
        rules: WeekRules,
        body: BodyRules,
        path: Path | None = None,
        names: Sequence[str] = tuple(ROBOTS),
    ) -> None:
        """Make the home of this number for each robot; `path` is of the memory of the first one."""
        self._rules = rules
        self.robots: dict[str, HomeRobot] = {}
        for name in names:
            world = BoxWorld(source.make(Streams(seed, "test", [home])))
            options: dict[str, Any] = {"clock": world.homes.make_clock(), "path": path}
            maps = ROBOTS[name] is MappingRobot
            memory = (
                SceneGraphMemory(world.homes.prior, **options)
                if maps
                else make_memory(world, **options)
            )
            robot_body = RobotBody(world, replace(body, names_furniture=maps))
            self.robots[name] = ROBOTS[name](
                robot_body, memory, Finder(Adaptive()), rules.most_looks
            )
            path = None
        self.tallies = tuple(Tally(name) for name in names)
        self._world = next(iter(self.robots.values())).world
        self._choices = self._world.homes.streams.generator("box errands", 0)

    def live(self) -> Iterator[int]:
        """Play; yields the number of each step that is over."""
        for _ in range(self._rules.rounds):
            self._evolve()
            for robot in self.robots.values():
                for place in range(self._world.num_furniture):
                    robot.patrol(place)
        turns = cycle(range(self._world.num_furniture))
        for step in range(self._rules.steps):
            self._evolve()
            places = list(islice(turns, self._rules.looks_per_step))
            wanted = self._choose_things()
            for robot, tally in zip(self.robots.values(), self.tallies, strict=True):
                for place in places:
                    robot.patrol(place)
                tally.errands += [robot.fetch(description) for description in wanted]
            yield step

    def _evolve(self) -> None:
        """Let a time step pass in all copies of the home."""
        for robot in self.robots.values():
            robot.world.evolve()
            robot.memory.step()

    def _choose_things(self) -> list[str]:
        """Choose what is fetched in a step: of all that is in the home, each alike."""
        world = self._world
        present = np.flatnonzero(world.things.place >= 0)
        slots = self._choices.choice(present, size=self._rules.errands_per_step)
        return [world.describe_thing(int(slot)) for slot in slots]
