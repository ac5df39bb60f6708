"""Features of places from the counters of the object that is asked for.

Each function fills the columns of a group, in the order of `sgm.evidence.columns`: `out` is float32
(Q, F, columns of the group), and holds zeros where a home has no place. What the arguments are is
said in `sgm.evidence.question`.
"""

from __future__ import annotations

import math

import numpy as np

from sgm.evidence.rank_kernel import rank_row
from sgm.kernel import kernel

_MOST = 1 - 1e-3  # of a presence: odds stay finite
LEAST = 0.02  # of a share times the number of places, in logarithms


@kernel
def fill_sightings(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    last_true: np.ndarray,
    looks: np.ndarray,
    last: np.ndarray,
) -> None:
    """Where the object was seen, how often and in which order."""
    by_count, by_time = np.empty(is_place.shape[1]), np.empty(is_place.shape[1])
    for query in range(len(out)):
        total, usual = 0, 0
        for place in range(is_place.shape[1]):
            total += num_true[query, place]
            if num_true[query, place] > num_true[query, usual]:
                usual = place
        rank_row(num_true[query].astype(np.float64), by_count)
        rank_row(last_true[query].astype(np.float64), by_time)
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, count = out[query, place], num_true[query, place]
            is_usual = place == usual and total > 0
            row[0] = math.log1p(count)
            row[1] = count / max(total, 1)
            row[2] = count / (looks[query, place] + 1)
            row[3] = (count + 0.2) / (looks[query, place] + 1)
            row[4] = place == last[query]
            row[5] = count > 0
            row[6] = by_count[place] if count > 0 else 0
            row[7] = by_time[place] if count > 0 else 0
            row[8] = is_usual
            row[9] = is_usual and usual != last[query]


@kernel
def fill_looks(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    last_true: np.ndarray,
    num_absent: np.ndarray,
    looks: np.ndarray,
    last_look: np.ndarray,
    num_places: np.ndarray,
) -> None:
    """Looks at the place, and those that missed the object since it was there."""
    for query in range(len(out)):
        total = max(looks[query].sum(), 1)
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, seen = out[query, place], num_true[query, place] > 0
            absent = math.log1p(num_absent[query, place])
            row[0] = absent if seen else 0
            row[1] = 0 if seen else absent
            row[2] = math.log1p(looks[query, place])
            row[3] = looks[query, place] > 0
            row[4] = looks[query, place] / total * num_places[query, 0] / 4
            row[5] = seen and last_look[query, place] > last_true[query, place]


@kernel
def fill_times(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    last_true: np.ndarray,
    last_look: np.ndarray,
    now: int,
    hours: np.ndarray,
    of_home: np.ndarray,
    own: np.ndarray,
) -> None:
    """Time since the object was there and since the place was looked at, in hours and in moves."""
    for query in range(len(out)):
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, since_seen, since_look = out[query, place], 0.0, 0.0
            if num_true[query, place] > 0:
                since_seen = (now - last_true[query, place]) * hours[query, 0]
            if last_look[query, place] >= 0:
                since_look = (now - last_look[query, place]) * hours[query, 0]
            row[0] = math.log1p(since_seen)
            row[1] = -math.expm1(-of_home[query] * since_seen)
            row[2] = -math.expm1(-own[query] * since_seen)
            row[3] = math.log1p(since_look)
            row[4] = -math.expm1(-of_home[query] * since_look)
            row[5] = -math.expm1(-own[query] * since_look)


@kernel
def fill_stays(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    last_true: np.ndarray,
    num_left: np.ndarray,
    time_true: np.ndarray,
    num_known: np.ndarray,
    last_known: np.ndarray,
    is_true: np.ndarray,
    looks: np.ndarray,
    last_look: np.ndarray,
    goes: np.ndarray,
    num_places: np.ndarray,
    now: int,
    hours: np.ndarray,
    rate_left: np.ndarray,
) -> None:
    """How long the object stays at the place, and whether it is there by that alone.

    Presence is that of two states, there and not. They are left at a rate from the looks that
    found it gone, and balance at the share of the looks that found it. Places are independent.
    """
    odds = np.empty(is_place.shape[1])
    for query in range(len(out)):
        length, total = hours[query, 0], 0.0
        for place in range(is_place.shape[1]):
            if not is_place[query, place]:
                continue
            row, count = out[query, place], num_true[query, place]
            left = num_left[query, place] + 1
            left /= time_true[query, place] * length + 1 / rate_left[query]
            since_true, last, known = 0.0, last_look[query, place], looks[query, place]
            if count > 0:
                since_true = (now - last_true[query, place]) * length
                last, known = last_known[query, place], num_known[query, place]
            usually = (count + goes[query, place]) / (known + 1)
            was_there = usually
            if last >= 0:
                was_there = 1.0 if is_true[query, place] else 0.0
            remains = math.exp(-left / (1 - usually + LEAST) * (now - max(last, 0)) * length)
            presence = min(usually + (was_there - usually) * remains, _MOST)
            odds[place] = presence / (1 - presence)
            total += odds[place]
            row[0] = math.log1p(num_left[query, place])
            row[1] = -math.expm1(-left * since_true)
            row[2] = count / max(num_known[query, place], 1)
            row[3] = presence
        for place in range(is_place.shape[1]):
            if is_place[query, place]:
                share = odds[place] / total
                out[query, place, 4] = math.log(share * num_places[query, 0] + LEAST)


@kernel
def fill_hours(
    out: np.ndarray,
    is_place: np.ndarray,
    num_true: np.ndarray,
    num_known: np.ndarray,
    hours: np.ndarray,
    wide: np.ndarray,
    narrow: np.ndarray,
    has_clock: np.ndarray,
    strays: np.ndarray,
    num_places: np.ndarray,
) -> None:
    """Where the object was seen at this hour of the day, and where others that are out of place.

    Its presence is the share of the looks at about this hour that showed it; `wide` and `narrow`
    are how much each hour counts, (Q, bins of the day).
    """
    sums = np.zeros(is_place.shape[1])
    for query in range(len(out)):
        first = 0
        for weight in (wide[query], narrow[query]):
            total = 0.0
            for place in range(is_place.shape[1]):
                if not is_place[query, place]:
                    continue
                row, seen, gone = out[query, place], 0.0, 0.0
                for hour in range(len(weight)):
                    seen += hours[0, query, place, hour] * weight[hour]
                    gone += hours[1, query, place, hour] * weight[hour]
                sums[place] = seen
                total += seen
                usually = num_true[query, place] / max(num_known[query, place], 1)
                row[first + 1] = math.log1p(seen)
                row[first + 2] = (seen + usually) / (seen + gone + 1) if has_clock[query] else 0
            for place in range(is_place.shape[1]):
                if is_place[query, place]:
                    out[query, place, first] = sums[place] / max(total, 0.3)
            first += 3
        total = strays[query].sum() + 0.5
        for place in range(is_place.shape[1]):
            if is_place[query, place]:
                share = strays[query, place] / total
                out[query, place, 6] = share
                if has_clock[query]:
                    out[query, place, 7] = math.log(share * num_places[query, 0] + LEAST)
