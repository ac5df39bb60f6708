"""Robots that live in simulated homes with routines for a month, and what they are asked."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.arrays.week import DAY_SECONDS
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph
from simulator.story.run_recorder import record_run
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource

_STEP_SECONDS = 1800.0
STEPS_PER_DAY = int(DAY_SECONDS / _STEP_SECONDS)
NUM_DAYS = 30
EVERY = 5  # time steps between questions, so that they come at all hours
NUM_ASKED = 2  # things at a time
LATER = (0, 0, 0, 2, 6, 16, 48)  # time steps ahead for which is asked


@dataclass(frozen=True, slots=True)
class LifeQuestion:
    """A question to a robot's memory before the looks of a time step.

    Attributes:
        memory: to be read, not changed.
        thing: what is asked for.
        at: time step for which it is asked.
        place: id of the furniture where it is then, None for elsewhere.
    """

    memory: SceneGraphMemory
    thing: str
    at: int
    place: int | None


def make_source(rng: np.random.Generator) -> SampledSource:
    """Draw the rules of a home: its size, its detector, how strict its people's habits are."""
    is_strict = rng.random() < 0.5
    dynamics = RoutineDynamics(
        step_seconds=_STEP_SECONDS,
        carry_share=float(rng.choice([0.0, 0.3, 0.6, 0.9])),
        static_share=float(rng.choice([0.05, 0.3])),
        omission_spread=0.05 if is_strict else 0.2,
        min_use=0.8 if is_strict else 0.5,
        drift_hours=0.2 if is_strict else 0.5,
        extra_share=0.05 if is_strict else 0.2,
    )
    config = HomeConfig(
        furniture_per_room=int(rng.choice([3, 4, 6])),
        objects_per_furniture=int(rng.choice([1, 2, 3])),
        detection_error=float(rng.choice([0.02, 0.1, 0.2])),
        looks="random",
        looks_per_step=6,
        dynamics=dynamics,
    )
    return SampledSource(PriorGraph.household(), config)


def live(number: int) -> Iterator[LifeQuestion]:
    """Let a robot live in home `number`, and ask it.

    Half of the robots look at one to six places each half hour, the others only at some hours of
    the day.
    """
    rng = np.random.default_rng([63, number])
    run = record_run(make_source(rng), NUM_DAYS * STEPS_PER_DAY, home=number, policy="random")
    clock, truth = run.clock, run.truth
    assert clock is not None
    assert truth is not None
    most = int(rng.choice([1, 2, 3, 6]))
    hours: Sequence[int] = range(24)
    if rng.random() < 0.5:
        num_hours = int(rng.integers(2, 6))
        most, hours = 6, rng.choice(np.arange(6, 24), num_hours, replace=False).tolist()
    looks: dict[int, list[tuple[int, tuple[str, ...]]]] = {}
    for look in run.looks:
        looks.setdefault(look.step, []).append((look.furniture, look.seen))
    memory = run.memory_at(0).copy()
    furniture = range(len(memory.layout.furniture))
    known: dict[str, None] = {}
    for step in range(1, run.num_steps):
        memory.step_to(clock.get_time(step))
        if step % EVERY == 0 and step > 2 * STEPS_PER_DAY and known:
            names = rng.choice([*known], min(NUM_ASKED, len(known)), replace=False)
            for name in names.tolist():
                at = step + int(rng.choice(LATER))
                if at < run.num_steps:
                    there = [id_ for id_ in furniture if name in truth.list_there(at, id_)]
                    if len(there) < 2:
                        yield LifeQuestion(memory, name, at, there[0] if there else None)
        now: datetime = clock.get_time(step)
        if now.hour in hours:
            for place, seen in looks.get(step, [])[:most]:
                memory.observe(place, [Sighting(name) for name in seen])
                known |= dict.fromkeys(seen)
