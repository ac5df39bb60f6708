"""Homes in which things keep to habits of their own, stricter ones than those of simulated people.

By the hours of the day, of workdays and of the weekend, or one after the other from an irregular
hour; some leave the home, some habits change for good, some pause for a week.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime

import numpy as np

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph
from tools.rhythm.lives import EVERY, LATER, NUM_ASKED, NUM_DAYS, STEPS_PER_DAY, LifeQuestion

_START = datetime(2024, 5, 6)  # a Monday
_OUT = -1  # of the home


def live_by_habits(number: int) -> Iterator[LifeQuestion]:
    """Let a robot live among the things of home `number`, and ask it from the third day on."""
    return _live(np.random.default_rng([64, number]), range(2, NUM_DAYS), EVERY)


def begin_by_habits(number: int) -> Iterator[LifeQuestion]:
    """Let a robot live in such a home for its first four days, and ask it from the start."""
    return _live(np.random.default_rng([65, number]), range(4), 2)


def _live(rng: np.random.Generator, days: range, every: int) -> Iterator[LifeQuestion]:
    memory = SceneGraphMemory(clock=Clock(_START, 86400 / STEPS_PER_DAY))
    prior = PriorGraph.household()
    labels = rng.choice([each.label for each in prior.furniture], int(rng.integers(6, 16)))
    rooms = [memory.add_room(label) for label in ("kitchen", "living room", "bedroom")]
    names = [f"{label} {row}" for row, label in enumerate(labels.tolist())]
    places = [
        memory.add_furniture(label, rooms[int(rng.integers(3))], description=name)
        for label, name in zip(labels.tolist(), names, strict=True)
    ]
    things = rng.choice([each.label for each in prior.objects], 14, replace=False).tolist()
    at = np.stack([_draw_habit(len(places), rng) for _ in things])  # (things, steps)
    looks_at, miss = _draw_looks(len(places), rng), float(rng.choice([0.0, 0.05, 0.15]))
    known: dict[str, None] = {}
    for step in range(1, days.stop * STEPS_PER_DAY):
        memory.step()
        if step % every == 0 and step > days.start * STEPS_PER_DAY and known:
            for name in rng.choice([*known], min(NUM_ASKED, len(known)), replace=False).tolist():
                when = step + int(rng.choice(LATER))
                if when < at.shape[1]:
                    place = int(at[things.index(name), when])
                    yield LifeQuestion(memory, name, when, None if place == _OUT else place)
        for place in np.flatnonzero(looks_at[step]).tolist():
            there = np.flatnonzero(at[:, step] == place)
            seen = [things[thing] for thing in there.tolist() if rng.random() >= miss]
            memory.observe(places[place], [Sighting(name) for name in seen])
            known |= dict.fromkeys(seen)


def _draw_looks(num_places: int, rng: np.random.Generator) -> np.ndarray:
    """Draw which places are looked at when, bool (steps, places).

    All at some hours of the day, or a few each time, all day.
    """
    steps = np.arange(NUM_DAYS * STEPS_PER_DAY) % STEPS_PER_DAY
    if rng.random() < 0.5:
        times = rng.choice(np.arange(12, 48), int(rng.integers(2, 6)), replace=False)
        is_looked = np.isin(steps, times)[:, None] & np.ones(num_places, dtype=bool)
        return is_looked & (rng.random(is_looked.shape) < rng.choice([0.6, 1.0]))
    share = float(rng.choice([0.1, 0.25, 0.5]))
    return (rng.random((len(steps), num_places)) < share) & (steps >= 12)[:, None]


def _draw_habit(num_places: int, rng: np.random.Generator) -> np.ndarray:
    """Draw where a thing is, position of a place or `_OUT`, (steps,)."""
    first, second = _draw_days(num_places, rng), _draw_days(num_places, rng)
    day = np.arange(NUM_DAYS)
    if rng.random() < 0.2:  # changes for good
        first = np.where((day >= rng.integers(8, 22))[:, None], second, first)
    if rng.random() < 0.2:  # a holiday
        begin = int(rng.integers(7, 21))
        first[begin : begin + 7] = first[begin, 0]
    return first.ravel()


def _draw_days(num_places: int, rng: np.random.Generator) -> np.ndarray:
    """Draw a habit, and where the thing is by it, (days, steps of a day)."""
    kind = rng.choice(
        ["hours", "week", "sequence", "still", "loose"], p=[0.3, 0.2, 0.25, 0.1, 0.15]
    )
    usual = rng.choice(num_places, 4, replace=False)
    strict = float(rng.choice([1.0, 0.95, 0.8]))
    jitter = float(rng.choice([0.0, 0.5, 1.0]))
    table = np.full((NUM_DAYS, STEPS_PER_DAY), usual[0])
    schedules = [_draw_schedule(usual, rng) for _ in range(2)]
    weekend = schedules[int(kind == "week")]
    for day in range(NUM_DAYS):
        if kind == "sequence" and rng.random() < 0.9:
            step = int(rng.integers(14, 40))
            for place in schedules[0][1]:
                length = max(round(float(schedules[1][0][0] % 5 + 1 + rng.normal(0, jitter))), 1)
                table[day, step : step + length] = place
                step += length
        elif kind in ("hours", "week"):
            starts, stays = weekend if day % 7 >= 5 else schedules[0]
            table[day] = stays[-1]
            for start, place in zip(starts, stays, strict=True):
                is_kept = rng.random() < strict
                moment = max(round(float(start + rng.normal(0, jitter))), 0)
                table[day, moment:] = place if is_kept else rng.choice(usual)
        elif kind == "loose":
            for step in np.sort(rng.integers(12, 48, 2)).tolist():
                table[day, step:] = rng.choice(usual, p=[0.55, 0.25, 0.15, 0.05])
    return table


def _draw_schedule(usual: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, list[int]]:
    """Draw two to four steps of a day, and where the thing is from each on."""
    starts = np.sort(rng.choice(np.arange(12, 46), int(rng.integers(2, 5)), replace=False))
    stays = rng.permutation(usual)[: len(starts)].tolist()
    if rng.random() < 0.3:
        stays[int(rng.integers(len(stays)))] = _OUT
    return starts, stays
