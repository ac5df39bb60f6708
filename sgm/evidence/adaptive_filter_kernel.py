"""Where an object can be, given where it was last seen and every look since."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel

_SAME = 0.97  # probability that what is seen is the object that is asked for
_TINY = 1e-12


@kernel
def follow_looks(
    destination: np.ndarray,
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
    moved: np.ndarray,
    miss: np.ndarray,
) -> np.ndarray:
    """Follow K filters over the looks at Q objects; see `sgm.evidence.adaptive_filter`.

    Args:
        destination: where each object goes, sums to one, float64 (Q, P); the last place is
            elsewhere.
        room: of each place, -1 where there is none, int64 (Q, P).
        num_rooms: room numbers are below it.
        look_times: of the latest looks at each place but elsewhere, -1 for none, (n, P - 1, L).
        look_row: which row of these are the looks for each object, (Q,).
        last_place: where it was last seen, -1 for never, int64 (Q,).
        last_time: when, int64 (Q,).
        now: the present time step.
        hours: length of a step, (Q,).
        rate: at which it leaves, per hour, (Q, K).
        crossing: share of its ways that lead anywhere, not within the room, (Q, K).
        moved: how likely it has just moved, since it is asked for, (Q, K).
        miss: probability that a look misses it, (Q,).

    Returns:
        Probabilities of the places, (Q, K, P).
    """
    num_queries, num_places = destination.shape
    num_kept = look_times.shape[2]
    belief = np.empty((num_queries, rate.shape[1], num_places))
    when = np.empty((num_places - 1) * num_kept, dtype=np.int64)
    where = np.empty(len(when), dtype=np.int64)
    all_when = np.empty(len(when), dtype=np.int64)  # the same, of a whole row, in order
    all_where = np.empty(len(when), dtype=np.int64)
    num_all, row = 0, -1
    mass = np.empty(num_rooms)
    total = np.empty(num_rooms)
    later = np.empty(num_rooms)
    share = np.zeros(num_places)  # of a place in the destinations of its room
    # Runs of neighbouring places of one room, within which no loop looks up the room.
    run_start = np.empty(num_places + 1, dtype=np.int64)
    run_room = np.empty(num_places, dtype=np.int64)
    # Filters of one rate and crossing differ in the move just before the question alone: the
    # others start from the first one's belief before it, at the look where it was.
    before = np.empty((rate.shape[1], num_places))
    reached = np.empty(rate.shape[1], dtype=np.int64)
    for query in range(num_queries):
        goes = destination[query]
        in_room = room[query]
        last = last_place[query]
        start = last_time[query] if last >= 0 else -1
        if look_row[query] != row:
            row, num_all = look_row[query], 0
            for place in range(num_places - 1):
                for kept in range(num_kept):
                    if look_times[row, place, kept] >= 0:
                        when[num_all] = look_times[row, place, kept]
                        where[num_all] = place
                        num_all += 1
            order = np.argsort(when[:num_all], kind="mergesort")
            for position in range(num_all):
                all_when[position] = when[order[position]]
                all_where[position] = where[order[position]]
        num_looks = 0
        for position in range(np.searchsorted(all_when[:num_all], start), num_all):
            if all_when[position] > start or all_where[position] != last:
                when[num_looks] = all_when[position]
                where[num_looks] = all_where[position]
                num_looks += 1
        num_runs = 0
        for place in range(num_places):
            if place == 0 or in_room[place] != in_room[place - 1]:
                run_start[num_runs], run_room[num_runs] = place, in_room[place]
                num_runs += 1
        run_start[num_runs] = num_places
        total[:] = 0
        for place in range(num_places):
            if in_room[place] >= 0:
                total[in_room[place]] += goes[place]
        for place in range(num_places):
            if in_room[place] >= 0:
                share[place] = goes[place] / max(total[in_room[place]], _TINY)
        for number in range(rate.shape[1]):
            density = belief[query, number]
            leaves, cross = rate[query, number], crossing[query, number]
            time, first = start, 0
            twin = _find_twin(rate[query], crossing[query], number)
            if twin < number:
                density[:] = before[twin]
                time, first = now, reached[twin]
            elif last >= 0:
                density[:] = (1 - _SAME) * goes
                density[last] += _SAME
            else:
                density[:] = goes
                time = when[0] if num_looks else now
            has_moved = start == now and last >= 0  # seen in this step: nothing moved since
            before[number] = density
            reached[number] = first
            elapsed = -1.0  # mostly it is one step, again and again
            for position in range(first, num_looks + 1):
                is_end = position == num_looks
                next_time = now if is_end else when[position]
                if next_time > time:
                    if elapsed != (next_time - time) * hours[query]:
                        elapsed = (next_time - time) * hours[query]
                        stays = math.exp(-leaves * elapsed)
                        stays_in_room = math.exp(-leaves * cross * elapsed)
                    mass[:] = 0
                    for run in range(num_runs):
                        own = run_room[run]
                        if own >= 0:
                            inside = mass[own]
                            for place in range(run_start[run], run_start[run + 1]):
                                inside += density[place]
                            mass[own] = inside
                    for own in range(num_rooms):
                        later[own] = total[own] + stays_in_room * (mass[own] - total[own])
                    for run in range(num_runs):
                        own = run_room[run]
                        if own < 0:
                            continue
                        inside, then = mass[own], later[own]
                        for place in range(run_start[run], run_start[run + 1]):
                            density[place] = then * share[place] + stays * (
                                density[place] - inside * share[place]
                            )
                    time = next_time
                if time == now and not has_moved:
                    has_moved = True
                    before[number] = density
                    reached[number] = position
                    _move_once(density, goes, in_room, total, cross, moved[query, number])
                if not is_end:
                    place = where[position]
                    missed = density[place] * (1 - miss[query])
                    density[place] *= miss[query]
                    density /= max(1 - missed, _TINY)
    return belief


@kernel
def _find_twin(rate: np.ndarray, crossing: np.ndarray, number: int) -> int:
    """Return the first filter with the rate and crossing of one, itself if there is none before."""
    for other in range(number):
        if rate[other] == rate[number] and crossing[other] == crossing[number]:
            return other
    return number


@kernel
def _move_once(
    density: np.ndarray,
    goes: np.ndarray,
    room: np.ndarray,
    total: np.ndarray,
    cross: float,
    probability: float,
) -> None:
    """Let the object move to another place with a probability, in place.

    Args:
        density: (P,).
        goes: destinations, (P,).
        room: (P,).
        total: of the destinations in each room.
        cross: share of the moves that lead anywhere.
        probability: that it moves.
    """
    if probability <= 0:
        return
    anywhere = 0.0
    inside = np.zeros(len(total))
    for place in range(len(density)):
        own = room[place]
        if own < 0:
            continue
        anywhere += density[place] / max(1 - goes[place], 1e-6)
        if total[own] - goes[place] > 1e-9:
            inside[own] += density[place] / (total[own] - goes[place])
    for place in range(len(density)):
        own = room[place]
        if own < 0:
            continue
        came = goes[place] * (anywhere - density[place] / max(1 - goes[place], 1e-6))
        if total[own] - goes[place] > 1e-9:
            came_inside = inside[own] - density[place] / (total[own] - goes[place])
            came_inside *= goes[place]
        else:
            came_inside = density[place]  # no other place in the room
        after = cross * came + (1 - cross) * came_inside
        density[place] = (1 - probability) * density[place] + probability * after
