"""Whether objects have left a home, given where they were last seen and every look since."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel

_SAME = 0.97  # probability that what was seen is the object that is asked for
_TINY = 1e-12
# A look that does not show what is still in the home counts for a little less than a look: what
# hides a thing once may hide it again.
_LOOKS_COUNTED = 0.85
_CARRIED_OFF = 0.005  # right after it was seen, whatever the rate at which things leave
_SMALL = 1e-100  # of factors that are put off


@kernel
def follow_left(
    seen: np.ndarray,
    prior: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    look_times: np.ndarray,
    look_row: np.ndarray,
    last_place: np.ndarray,
    last_time: np.ndarray,
    now: int,
    hours: np.ndarray,
    rate: np.ndarray,
    crossing: np.ndarray,
    miss: np.ndarray,
    leaving: np.ndarray,
) -> np.ndarray:
    """Follow whether Q objects have left the home at J rates; see `sgm.evidence.leaving`.

    The belief is that of `follow_looks` for one filter, in another form. A place holds

        b_f = B_r q_f + D c_f

    with q_f its share in the destinations of its room r. While time passes, the masses of rooms, B
    and D change; a look changes c of its place and the mass of its room. So a look costs as much in
    a home of many places as in one of few.

    Args:
        seen: sightings of each object at each place, (Q, F).
        prior: what is expected of each place, in proportion, zeros where nothing is, (Q, F).
        room: of each place, -1 where there is none, (Q, F).
        num_rooms: room numbers are below it.
        look_times: of the latest looks at each place, -1 for none, (n, F, L).
        look_row: which row of these are the looks for each object, (Q,).
        last_place: where it was last seen, -1 for never, (Q,).
        last_time: when, (Q,).
        now: the present time step.
        hours: length of a step, (Q,).
        rate: at which it moves, per hour, (Q,).
        crossing: share of its ways that lead anywhere, not within the room, (Q,).
        miss: probability that a look misses it, (Q,).
        leaving: rates at which it may leave the home for good, per hour, (Q, J).

    Returns:
        Probability that it has left at each of the rates, (Q, J).
    """
    num_queries, num_places = seen.shape
    num_kept = look_times.shape[2]
    gone = np.full(leaving.shape, _CARRIED_OFF)
    when = np.empty(num_places * num_kept, dtype=np.int64)
    where = np.empty(len(when), dtype=np.int64)
    all_when = np.empty(len(when), dtype=np.int64)  # of a whole row, in order
    all_where = np.empty(len(when), dtype=np.int64)
    num_all, row = 0, -1
    goes, own = np.empty(num_places), np.empty(num_places)  # q, c
    total, mass, base = np.empty(num_rooms), np.empty(num_rooms), np.empty(num_rooms)
    remains = np.empty(leaving.shape[1])
    for query in range(num_queries):
        if look_row[query] != row:
            row, num_all = look_row[query], 0
            for place in range(num_places):
                for kept in range(num_kept):
                    if look_times[row, place, kept] >= 0:
                        when[num_all] = look_times[row, place, kept]
                        where[num_all] = place
                        num_all += 1
            order = np.argsort(when[:num_all], kind="mergesort")
            for position in range(num_all):
                all_when[position] = when[order[position]]
                all_where[position] = where[order[position]]
        left, last = gone[query], last_place[query]
        # Destinations: where it was seen, one sighting more of what is expected, a little anywhere.
        expected, num_own, weight = 0.0, 0, 0.0
        for place in range(num_places):
            expected += prior[query, place]
            num_own += room[query, place] >= 0
        trust = 1.0 if expected > 1e-9 else 0.0
        scale = max(expected, 1e-9)
        anywhere = (1.3 - trust) / num_own
        for place in range(num_places):
            goes[place] = 0.0
            if room[query, place] >= 0:
                goes[place] = seen[query, place] + trust * prior[query, place] / scale + anywhere
                weight += goes[place]
        total[:] = 0.0
        for place in range(num_places):
            goes[place] /= weight
            if room[query, place] >= 0:
                total[room[query, place]] += goes[place]
        start = last_time[query] if last >= 0 else -1
        first = np.searchsorted(all_when[:num_all], start)
        base[:], own[:] = total, 0.0
        time = start
        if last >= 0:
            base *= 1 - _SAME
            own[last] = _SAME
        else:
            time = all_when[first] if first < num_all else now
        mass[:] = base
        if last >= 0:
            mass[room[query, last]] += _SAME
        for place in range(num_places):
            if room[query, place] >= 0:
                goes[place] /= max(total[room[query, place]], _TINY)
        decay, whole, elapsed = 1.0, 1.0, -1.0  # D, and what all masses sum up to
        stays, stays_in_room = 1.0, 1.0
        for position in range(first, num_all + 1):
            is_end = position == num_all
            next_time = now if is_end else all_when[position]
            place = -1 if is_end else all_where[position]
            if not is_end and next_time == start and place == last:
                continue
            if next_time > time:
                if elapsed != (next_time - time) * hours[query]:  # mostly one step again
                    elapsed = (next_time - time) * hours[query]
                    stays = math.exp(-rate[query] * elapsed)
                    stays_in_room = math.exp(-rate[query] * crossing[query] * elapsed)
                    for other in range(len(remains)):
                        remains[other] = math.exp(-leaving[query, other] * elapsed)
                for inside in range(num_rooms):
                    usual = total[inside] * whole
                    later = usual + stays_in_room * (mass[inside] - usual)
                    base[inside] = later + stays * (base[inside] - mass[inside])
                    mass[inside] = later
                decay *= stays
                for other in range(len(left)):
                    left[other] = 1 - (1 - left[other]) * remains[other]
                time = next_time
            if decay < _SMALL or whole < _SMALL:
                own *= decay / whole
                base /= whole
                mass /= whole
                decay, whole = 1.0, 1.0
            if not is_end:
                inside = room[query, place]
                missed = base[inside] * goes[place] + decay * own[place]
                missed *= 1 - miss[query]
                own[place] -= missed / decay
                mass[inside] -= missed
                unseen = max(1 - missed / whole, _TINY)
                whole *= unseen
                weight = unseen**_LOOKS_COUNTED
                for other in range(len(left)):
                    left[other] /= left[other] + (1 - left[other]) * weight + _TINY
    return gone
