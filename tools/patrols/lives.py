"""Robots that patrol one home, each choosing where to look, and are asked after a week."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from sgm.arrays.week import DAY_SECONDS
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph
from simulator.story.past_memory import PastMemory
from simulator.story.run_recorder import record_run
from simulator.story.story import TruePlaces
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource

STEP_SECONDS = 1800.0
STEPS_PER_DAY = int(DAY_SECONDS / STEP_SECONDS)
ROUND = 4  # time steps between rounds of a patrol; half way a look at random, as on an errand
ASKED = 8  # time steps between questions of the day after, so that they come at all hours
_LEAST = 1e-6  # of a probability

# Says at which k places to look, of a memory; they are ids of furniture.
Patrol = Callable[[SceneGraphMemory, int], Sequence[int]]


def make_source(seed: int, number: int) -> SampledSource:
    """Draw the rules of a home: its size, its detector, how much its people carry about."""
    rng = np.random.default_rng([71, seed, number])
    dynamics = RoutineDynamics(
        step_seconds=STEP_SECONDS,
        carry_share=float(rng.choice([0.0, 0.3, 0.6])),
        static_share=float(rng.choice([0.05, 0.3])),
    )
    config = HomeConfig(
        furniture_per_room=int(rng.choice([3, 4, 6])),
        objects_per_furniture=int(rng.choice([1, 2])),
        detection_error=float(rng.choice([0.02, 0.1, 0.2])),
        looks="random",
        looks_per_step=1,
        dynamics=dynamics,
    )
    return SampledSource(PriorGraph.household(), config)


def make_patrols(finder: Finder, seed: int) -> dict[str, Patrol]:
    """Make the patrols that are compared, by name; each is for one life."""
    rng = np.random.default_rng([72, seed])
    return {
        "next_looks": partial(_look_where_most_is_learnt, finder),
        "round_robin": _RoundRobin(),
        "longest_not_seen": _look_where_longest_not_seen,
        "random": lambda memory, k: rng.choice(memory.furniture_ids, k, replace=False).tolist(),
    }


def _look_where_most_is_learnt(finder: Finder, memory: SceneGraphMemory, k: int) -> list[int]:
    return [look.furniture for look in finder.next_looks(memory, k)]


def _look_where_longest_not_seen(memory: SceneGraphMemory, k: int) -> list[int]:
    looked = {place: -1 if at is None else at for place, (_, at) in memory.count_things().items()}
    return sorted(looked, key=lambda place: (looked[place], place))[:k]


class _RoundRobin:
    """Goes around all places, in the order of their ids."""

    def __init__(self) -> None:
        self._next = 0

    def __call__(self, memory: SceneGraphMemory, k: int) -> list[int]:
        ids = memory.furniture_ids
        places = [ids[(self._next + number) % len(ids)] for number in range(k)]
        self._next += k
        return places


@dataclass(frozen=True, slots=True)
class PatrolledHome:
    """A home as it is, and what a robot on a patrol sees of it.

    Attributes:
        run: the truth, and the looks that are no part of a patrol.
        miss: share of the things that a look misses.
        seed: of what looks miss: a look at a place at a time step misses the same on every patrol.
    """

    run: PastMemory
    miss: float
    seed: int

    @classmethod
    def make(cls, seed: int, number: int, days: int) -> PatrolledHome:
        """Make a home for some days of patrols and one with questions."""
        source = make_source(seed, number)
        steps = (days + 1) * STEPS_PER_DAY
        run = record_run(source, steps, home=number, seed=seed, policy="random")
        return cls(run, source.home.detection_error, seed)

    @property
    def truth(self) -> TruePlaces:
        """Where everything was."""
        assert self.run.truth is not None, "a run has a truth"
        return self.run.truth

    def look(self, step: int, place: int) -> list[Sighting]:
        """Return what a look shows."""
        there = self.truth.list_there(step, place)
        rng = np.random.default_rng([73, self.seed, step, place])
        is_shown = rng.random(len(there)) >= self.miss
        return [Sighting(name) for name, shown in zip(there, is_shown, strict=True) if shown]

    def patrol(self, patrol: Patrol, looks: int, finder: Finder) -> tuple[float, float]:
        """Let a robot patrol; return the nats and the share of right answers of the last day.

        Args:
            patrol: says where to look.
            looks: in each round.
            finder: is asked for all things that are in the home at some time of the last day.
        """
        clock, steps = self.run.clock, self.run.num_steps
        assert clock is not None
        errands = {
            look.step: look.furniture for look in self.run.looks if look.step % ROUND == ROUND // 2
        }
        memory = self.run.memory_at(0).copy()
        scores = []
        for step in range(1, steps + 1):
            memory.step_to(clock.get_time(step))
            if step > steps - STEPS_PER_DAY and not step % ASKED:
                scores += self._ask(finder, memory, step)
            places = [errands[step]] if step in errands else []
            if step % ROUND == 0:
                places = [*patrol(memory, min(looks, memory.num_furniture))]
            for place in places:
                memory.observe(place, self.look(step, place))
        nats, right = np.mean(scores, axis=0).tolist()
        return nats, right

    def _ask(
        self, finder: Finder, memory: SceneGraphMemory, step: int
    ) -> list[tuple[float, float]]:
        """Ask where each thing is; return nats and whether the first answer is right, of each."""
        truth, scores = self.truth, []
        there: dict[str, set[int]] = {}
        for name in np.unique(truth.code[truth.furniture >= 0]).tolist():
            there[truth.descriptions[name]] = set()
        for place in memory.furniture_ids:
            for name in truth.list_there(step, place):
                there[name].add(place)
        for name, places in there.items():
            ranking = finder.rank(memory, name, exactly=True)
            first = ranking[0]
            chance = max((p.probability for p in ranking if p.furniture in places), default=0.0)
            if places:
                is_right = first.furniture in places and first.probability >= ranking.elsewhere
            else:
                chance, is_right = ranking.elsewhere, ranking.elsewhere > first.probability
            scores.append((-float(np.log(max(chance, _LEAST))), float(is_right)))
        return scores
