"""A robot that looks around in one home, and what finders know of that home afterwards."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from nep.games.game import Game
from sgm.arrays.week import DAY_SECONDS
from sgm.memory.clock import DEFAULT_STEP_SECONDS
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.story.past_memory import PastMemory
from simulator.story.run_recorder import record_run
from simulator.world.source import HomeSource


@dataclass(frozen=True, slots=True)
class FinderQuestion:
    """A question to a robot's memory, before the looks of the time step.

    The memory is to be read, not changed. Places are ids of furniture where such a thing is.
    """

    memory: SceneGraphMemory
    description: str
    places: frozenset[int]


@dataclass(frozen=True, slots=True)
class LivedHome:
    """A home that a robot lives in.

    Attributes:
        name: in the file of scores.
        source: of the home.
        number: its number there.
        seed: of everything random.
        unit: what it is a play of; all plays of a recording count as one.
        group: of homes in the table that it is in.
    """

    name: str
    source: HomeSource
    number: int
    seed: int
    unit: str
    group: str = ""


@dataclass(frozen=True)
class LifeGame(Game):
    """A home in which a robot looks around, and finders are asked for things afterwards.

    Attributes:
        home: the home.
        asked: options that a score depends on, by name; "days": of looks before any question.
        steps_per_day: time steps.
    """

    home: LivedHome
    asked: Mapping[str, Any]
    steps_per_day: int = int(DAY_SECONDS / DEFAULT_STEP_SECONDS)

    plays_together: ClassVar[bool] = True

    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player, as JSON values."""
        home = self.home
        where = {"source": home.source.describe(), "home": home.number, "seed": home.seed}
        return {**where, **self.asked}

    def tell(self) -> dict[str, Any]:
        """Return title, unit and group."""
        home = self.home
        return {
            "title": home.name,
            "units": [home.unit],
            **({"group": home.group} if home.group else {}),
        }

    def live(self, num_asked: int) -> RobotLife:
        """Let a robot live there for the days without questions, and further steps."""
        home = self.home
        num_learnt = self.asked["days"] * self.steps_per_day
        return RobotLife.record(
            home.source, num_learnt, num_asked, home=home.number, seed=home.seed
        )


@dataclass(frozen=True, slots=True)
class RobotLife:
    """What a robot saw in one home while it learnt, and afterwards.

    Attributes:
        run: looks at random places, whatever is answered, and the truth.
        num_learnt: time steps to learn from; questions are asked in the later ones.
        seed: of the questions.
    """

    run: PastMemory
    num_learnt: int
    seed: int

    @classmethod
    def record(
        cls, source: HomeSource, num_learnt: int, num_asked: int, *, home: int, seed: int
    ) -> RobotLife:
        """Let a robot live in a home.

        Args:
            source: of the home; its rules say how often the robot looks.
            num_learnt: time steps to learn from.
            num_asked: time steps with questions, after these.
            home: number of the home.
            seed: of the home, of what the detector misses, and of the questions.

        Raises:
            ValueError: if there is no such home, or it was recorded for fewer steps.
        """
        run = record_run(source, num_learnt + num_asked, home=home, seed=seed, policy="random")
        return cls(run, num_learnt, seed)

    def ask(self, per_step: int, asks_moved: float) -> Iterator[FinderQuestion]:
        """Yield the questions; only things at a place are asked for, seen before or not.

        Args:
            per_step: questions in each time step.
            asks_moved: share of them that are about what moved in the step, if anything did; half
                of them in the tasks.
        """
        truth, rng = self.run.truth, np.random.default_rng(self.seed)
        assert truth is not None, "a run has a truth"
        for step in range(self.num_learnt + 1, self.run.num_steps + 1):
            memory = self.run.memory_at(step - 1).copy()
            memory.step()
            furniture, before = truth.furniture[step], truth.furniture[step - 1]
            present = np.flatnonzero(furniture >= 0)
            moved = present[furniture[present] != before[present]]
            for _ in range(per_step):
                slots = moved if len(moved) and rng.random() < asks_moved else present
                if not len(slots):
                    continue
                code = truth.code[step, rng.choice(slots)]
                ids = memory.furniture_ids
                places = furniture[present[truth.code[step, present] == code]]
                yield FinderQuestion(
                    memory, truth.descriptions[code], frozenset(ids[place] for place in places)
                )
