"""A stretch of a trace in time steps: what changes in which step, slot by slot."""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass
from datetime import datetime, timedelta
from itertools import groupby

import numpy as np

from sgm.arrays.week import DAY_SECONDS
from sgm.memory.clock import Clock
from sgm.schema import PlaceCode
from simulator.trace.events import GONE, Event
from simulator.trace.trace import Trace

MAX_STEPS = 10_000_000  # of an episode: a thousand years of hours
_ROUNDING = 1e-6  # of a step: an event at the very end of a step belongs to it


@dataclass(frozen=True)
class Episode:
    """A recorded home from one time on, in steps of equal length.

    At t = 0 it is as it was at `start_s`; step t is all that happened in the `step_seconds` that
    end at `start_s + t * step_seconds`. What came and went within one step was never there.

    Attributes:
        name: of the trace, with the date or number of the day if it is one day of it.
        trace: the recording.
        start_s: time of t = 0.
        step_seconds: length of a step.
        num_steps: T.
        descriptions: what is called so, in order of appearance; columns point here.
        step, slot, place, description, is_move, is_new: one row per slot that changes in a step,
            in order of step: the place it holds now (-1: empty), what lies there, and whether that
            moved there from other furniture, or was not in the home before. Step 0 fills the
            home. (n,) each.
        num_moves, num_present: objects that move in each step, and that are there after it, (T,).
        is_dynamic: whether objects come or go after t = 0.
        crosses_rooms: whether an object moves to another room.
    """

    name: str
    trace: Trace
    start_s: float
    step_seconds: float
    num_steps: int
    descriptions: tuple[str, ...]
    step: np.ndarray
    slot: np.ndarray
    place: np.ndarray
    description: np.ndarray
    is_move: np.ndarray
    is_new: np.ndarray
    num_moves: np.ndarray
    num_present: np.ndarray
    is_dynamic: bool
    crosses_rooms: bool

    @property
    def clock(self) -> Clock | None:
        """What time it is at every step; None if the layout does not say when it starts."""
        start = self.trace.start
        return None if start is None else Clock(start, self.step_seconds).shift(self.start_s)


def make_episode(
    trace: Trace,
    step_seconds: float,
    start_s: float | None = None,
    num_steps: int | None = None,
    name: str | None = None,
) -> Episode:
    """Cut a trace into steps.

    Args:
        trace: the recording.
        step_seconds: length of a step.
        start_s: time of t = 0; None for the first event.
        num_steps: T; None for as many as there are until the end of the recording.
        name: None for that of the trace.

    Raises:
        ValueError: if there is no whole step, or a step without any object to ask for.
    """
    _check_objects(trace)
    start = trace.start_s if start_s is None else start_s
    if num_steps is None:
        num_steps = _count_steps(trace, start, step_seconds)
    if num_steps < 1:
        raise ValueError(
            f"trace must last at least one step of {step_seconds:g} s, got "
            f"{trace.end_s - start:g} s for {trace.name}. Set end_s in layout.json, or take "
            "shorter steps."
        )
    rows, num_present, descriptions = _follow_slots(trace, start, step_seconds, num_steps)
    step, slot, place, description, is_move, is_new, crosses_rooms = rows.T
    if (num_present == 0).any():
        empty = int(np.argmax(num_present == 0)) + 1
        raise ValueError(
            f"home must hold an object at every step, got none at step {empty} (time "
            f"{start + empty * step_seconds:g} s) of {name or trace.name}. Say in events.csv what "
            "is there."
        )
    return Episode(
        name or trace.name,
        trace,
        start,
        step_seconds,
        num_steps,
        tuple(descriptions),
        step,
        slot,
        place,
        description,
        is_move.astype(bool),
        is_new.astype(bool),
        np.bincount(step[is_move > 0], minlength=num_steps + 1)[1:],
        num_present,
        bool((step[(is_new > 0) | (place < 0)] > 0).any()),
        bool(crosses_rooms.any()),
    )


def split_days(trace: Trace, step_seconds: float) -> tuple[list[Episode], list[str]]:
    """Cut a trace into days from midnight to midnight, each one an episode.

    Returns:
        The episodes, and a line for each day that was left out because the recording covers only
        a part of it.

    Raises:
        ValueError: if a day has no whole number of steps, or no day was recorded from midnight to
            midnight.
    """
    num_steps = round(min(DAY_SECONDS / step_seconds, MAX_STEPS + 1))
    if num_steps > MAX_STEPS or not math.isclose(num_steps * step_seconds, DAY_SECONDS):
        raise ValueError(
            f"step must divide a day of {DAY_SECONDS:g} s, got {step_seconds:g} s. Take 3600 s, or "
            "play all days as one."
        )
    _check_objects(trace)
    _count_steps(trace, trace.start_s, step_seconds)
    date = trace.start
    midnight = 0.0
    if date is not None:
        midnight = -(date - datetime.combine(date.date(), datetime.min.time())).total_seconds()
    episodes, left_out = [], []
    for day in range(math.ceil((trace.end_s - midnight) / DAY_SECONDS)):
        begin, end = midnight + day * DAY_SECONDS, midnight + (day + 1) * DAY_SECONDS
        label = str(day) if date is None else str(date.date() + timedelta(days=day))
        if trace.start_s <= begin and end <= trace.end_s:
            name = f"{trace.name} {label}"
            episodes.append(make_episode(trace, step_seconds, begin, num_steps, name))
        elif end > trace.start_s:
            share = (min(end, trace.end_s) - max(begin, trace.start_s)) / DAY_SECONDS
            left_out.append(f"{trace.name} {label}: only {share:.0%} of the day was recorded")
    if not episodes:
        raise ValueError(
            f"trace must cover a day from midnight to midnight, got {trace.start_s:g} s to "
            f"{trace.end_s:g} s of {trace.name}. Set start and end_s in layout.json, or play all "
            "days as one."
        )
    return episodes, left_out


def _check_objects(trace: Trace) -> None:
    """Raise ValueError for a map of the furniture alone, in which nothing can be asked for."""
    if not trace.events:
        raise ValueError(
            f"home must hold an object to be played, got none in {trace.name}. Say in events.csv "
            "what is where, or start a memory from the map (`import --memory`)."
        )


def _count_steps(trace: Trace, start_s: float, step_seconds: float) -> int:
    """Count the steps from `start_s` to the end of a recording; refuse too many."""
    seconds = trace.end_s - start_s
    if seconds > MAX_STEPS * step_seconds:
        raise ValueError(
            f"trace must last at most {MAX_STEPS} steps, got {seconds:g} s in steps of "
            f"{step_seconds:g} s for {trace.name}. Mend the times of its events or end_s in "
            "layout.json, or take longer steps."
        )
    if trace.start is not None:
        try:
            trace.start + timedelta(seconds=trace.end_s + DAY_SECONDS)
        except OverflowError:
            raise ValueError(
                f"trace must end before the year 9999, got {trace.end_s:g} s after "
                f"{trace.start} for {trace.name}. Mend start in layout.json."
            ) from None
    return math.ceil(seconds / step_seconds - _ROUNDING)


def _follow_slots(
    trace: Trace, start_s: float, step_seconds: float, num_steps: int
) -> tuple[np.ndarray, np.ndarray, dict[str, int]]:
    """Follow objects and slots through the steps.

    A slot is a row of the home's arrays: what leaves frees its own first, then newcomers take the
    lowest free ones, as in the simulator.

    Returns:
        The columns of `Episode`, and whether what is there came from another room, (n, 7); how many
        objects are there after each step, (T,); the number of each description.
    """
    rooms = [furniture.room for furniture in trace.layout.furniture.values()]
    places: dict[str, int] = {}  # of every object that is there
    slots: dict[str, int] = {}
    free = list(range(trace.num_slots))
    descriptions: dict[str, int] = {}
    rows: list[tuple[int, ...]] = []
    steps, counts = [0], [0]  # when objects came or went, and how many there are since

    def find_step(event: Event) -> int:  # 0 for all until the start
        return max(math.ceil((event.time_s - start_s) / step_seconds - _ROUNDING), 0)

    for step, events in groupby(trace.events, find_step):
        if step > num_steps:
            break
        last = {event.object: event for event in events}
        changed: dict[int, tuple[int, ...]] = {}  # by slot; what is emptied may be filled again
        for name in [n for n, e in last.items() if e.furniture == GONE and n in places]:
            del places[name]
            changed[slots[name]] = (-1, 0, False, False, False)
            heapq.heappush(free, slots.pop(name))
        for name, event in last.items():
            place = PlaceCode.of(event.furniture, event.relation)
            before = places.get(name)
            if event.furniture == GONE or before == place:
                continue
            is_move = crosses = False
            if before is None:
                slots[name] = heapq.heappop(free)
            else:
                came_from = PlaceCode.furniture(before)
                is_move = came_from != event.furniture
                crosses = rooms[came_from] != rooms[event.furniture]
            number = descriptions.setdefault(event.description, len(descriptions))
            places[name] = place
            changed[slots[name]] = (place, number, is_move, before is None, crosses)
        # Emptied slots first.
        for slot, change in sorted(changed.items(), key=lambda item: (item[1][0] >= 0, item[0])):
            rows.append((step, slot, *change))
        steps.append(step)
        counts.append(len(places))
    num_present = np.repeat(counts, np.diff([*steps, num_steps + 1]))[1:]
    return np.array(rows, dtype=np.int64).reshape(-1, 7), num_present, descriptions
