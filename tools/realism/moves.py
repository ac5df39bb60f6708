"""What is measured of moves by the minute: how many, in bursts or not, back when, where to."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tools.realism.measures import NOT_THERE, OUT, find_mode

_WINDOW = 10.0  # minutes
_HOUR = 60.0  # minutes

# What is reported of a home, by attribute of `Moves`.
MOVE_MEASURES: Mapping[str, str] = {
    "per_hour": "moves per hour, all things",
    "per_busy_hour": "moves per hour, in ten-minute windows with a move",
    "busy": "ten-minute windows with a move",
    "burstiness": "burstiness of the gaps between moves, -1 to 1",
    "again": "moves after which the same thing moves again within ten minutes",
    "away": "time away from the usual place",
    "returned": "moves away from the usual place that come back there in that time",
    "return_minutes": "minutes until they do, median",
    "returned_in_hour": "moves away from it that come back within an hour",
    "next_place": "next place is the first guess of counts from place to place",
    "most_used": "next place is the place where most was put so far",
    "from_elsewhere": "moves that neither begin nor end at the thing's usual place",
    "gone": "things that are out of the home at an average minute",
}


@dataclass(frozen=True, slots=True)
class Moves:
    """What was measured of one home; see `MOVE_MEASURES`."""

    per_hour: float
    per_busy_hour: float
    busy: float
    burstiness: float
    again: float
    away: float
    returned: float
    return_minutes: float
    returned_in_hour: float
    next_place: float
    most_used: float
    from_elsewhere: float
    gone: float


def measure_moves(whereabouts: np.ndarray, types: np.ndarray, step_minutes: float = 1.0) -> Moves:
    """Measure one home; nan where nothing of a kind happens.

    Args:
        whereabouts: furniture index of every thing at every step, `OUT` or `NOT_THERE`, (N, T + 1).
        types: type of every thing, (N,).
        step_minutes: length of a step; the other measures are the rougher the longer it is.

    Source: Goh and Barabasi, "Burstiness and memory in complex systems" (2008), for the burstiness
    (s - m) / (s + m) of gaps with mean m and standard deviation s: 0 where moves come at random.
    """
    is_there = whereabouts != NOT_THERE
    moved = (whereabouts[:, 1:] != whereabouts[:, :-1]) & is_there[:, 1:] & is_there[:, :-1]
    step, thing = np.nonzero(moved.T)  # in the order of time
    before, after = whereabouts[thing, step], whereabouts[thing, step + 1]
    hours = moved.shape[1] * step_minutes / _HOUR
    window = (step * step_minutes // _WINDOW).astype(int)
    num_windows = math.ceil(moved.shape[1] * step_minutes / _WINDOW)
    num_busy = len(np.unique(window))
    gaps = np.diff(step) * step_minutes
    usual = np.array([find_mode(path[path != NOT_THERE]) for path in whereabouts])
    is_away = (whereabouts != usual[:, None]) & is_there
    leaves = np.flatnonzero(before == usual[thing])
    waits = _measure_absences(whereabouts, usual, thing[leaves], step[leaves]) * step_minutes
    is_back = np.isfinite(waits)
    next_right, most_right = _guess_next(types[thing], before, after)
    most = _WINDOW / step_minutes
    middle = (before != usual[thing]) & (after != usual[thing])
    return Moves(
        per_hour=len(step) / hours,
        per_busy_hour=len(step) / max(num_busy * _WINDOW / _HOUR, 1e-9),
        busy=num_busy / num_windows,
        burstiness=_compute_burstiness(gaps),
        again=_average(_measure_waits(thing, step)[step < moved.shape[1] - most] <= most),
        away=is_away.sum() / is_there.sum(),
        returned=_average(is_back),
        return_minutes=float(np.median(waits[is_back])) if is_back.any() else float("nan"),
        returned_in_hour=_average(waits <= _HOUR),
        next_place=_average(next_right),
        most_used=_average(most_right),
        from_elsewhere=_average(middle),
        gone=(whereabouts == OUT).sum() / is_there.sum(),
    )


def _average(values: np.ndarray) -> float:
    return float(np.mean(values)) if len(values) else float("nan")


def _compute_burstiness(gaps: np.ndarray) -> float:
    total = gaps.std() + gaps.mean() if len(gaps) else 0.0
    return float((gaps.std() - gaps.mean()) / total) if total else float("nan")


def _measure_waits(thing: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Return the steps until the thing of each move (n,) moves again, inf for never; by time."""
    waits = np.full(len(thing), np.inf)
    order = np.argsort(thing, kind="stable")
    is_same = thing[order][1:] == thing[order][:-1]
    waits[order[:-1][is_same]] = np.diff(step[order])[is_same]
    return waits


def _measure_absences(
    whereabouts: np.ndarray, usual: np.ndarray, thing: np.ndarray, step: np.ndarray
) -> np.ndarray:
    """Return the steps until each thing (n,) that left its usual place is back, inf for never."""
    waits = np.full(len(thing), np.inf)
    for number, (moved_thing, left) in enumerate(zip(thing.tolist(), step.tolist(), strict=True)):
        back = np.flatnonzero(whereabouts[moved_thing, left + 1 :] == usual[moved_thing])
        if len(back):
            waits[number] = back[0]
    return waits


def _guess_next(
    types: np.ndarray, before: np.ndarray, after: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Guess where each move leads, in the order of time, by the moves before it, bool (n,) twice.

    By counts of its type from that place, else of all things from there, else of all moves; and by
    the counts of all moves alone. Moves out of the home and into it count for neither.
    """
    by_type: dict[tuple[int, int], Counter[int]] = defaultdict(Counter)
    by_place: dict[int, Counter[int]] = defaultdict(Counter)
    overall: Counter[int] = Counter()
    right, most_right = [], []
    for thing_type, start, end in zip(types.tolist(), before.tolist(), after.tolist(), strict=True):
        if start < 0 or end < 0:
            continue
        counts = by_type[thing_type, start] or by_place[start] or overall
        right.append(bool(counts) and counts.most_common(1)[0][0] == end)
        most_right.append(bool(overall) and overall.most_common(1)[0][0] == end)
        for counter in (by_type[thing_type, start], by_place[start], overall):
            counter[end] += 1
    return np.array(right, dtype=bool), np.array(most_right, dtype=bool)
