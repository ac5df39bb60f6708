"""Where an object can be, and whether it has left, given its last sighting and all looks since."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel

_SAME = 0.97  # probability that what is seen is the object that is asked for
_TINY = 1e-12
# A look that does not show what is still in the home counts for a little less than a look: what
# hides a thing once may hide it again.
_LOOKS_COUNTED = 0.85
_CARRIED_OFF = 0.005  # right after it was seen, whatever the rate at which things leave
_SMALL = 1e-100  # of factors that are put off


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
    belief = np.empty((num_queries, rate.shape[1], num_places))
    when = np.empty((num_places - 1) * look_times.shape[2], dtype=np.int64)
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
            row = look_row[query]
            num_all = _order_looks(look_times[row], all_when, all_where)
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
def _order_looks(look_times: np.ndarray, when: np.ndarray, where: np.ndarray) -> int:
    """Write time and place of looks, (F, L), in the order of time; return how many there are."""
    num_looks = 0
    times, places = np.empty_like(when), np.empty_like(where)
    for place in range(look_times.shape[0]):
        for kept in range(look_times.shape[1]):
            if look_times[place, kept] >= 0:
                times[num_looks], places[num_looks] = look_times[place, kept], place
                num_looks += 1
    order = np.argsort(times[:num_looks], kind="mergesort")
    for position in range(num_looks):
        when[position], where[position] = times[order[position]], places[order[position]]
    return num_looks


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

    Density, destinations and room are of the places, (P,), `total` is of the destinations in each
    room, and `cross` the share of the moves that lead anywhere.
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

    The arguments are those of `follow_looks` without the place elsewhere, but for: `seen`,
    sightings of each object at each place, (Q, F); `prior`, what is expected of each place, in
    proportion, zeros where nothing is, (Q, F); `rate` and `crossing`, of one filter, (Q,); and
    `leaving`, rates at which it may leave the home for good, per hour, (Q, J).

    Returns:
        Probability that it has left at each of the rates, (Q, J).
    """
    num_queries, num_places = seen.shape
    gone = np.full(leaving.shape, _CARRIED_OFF)
    all_when = np.empty(num_places * look_times.shape[2], dtype=np.int64)  # of a row, in order
    all_where = np.empty(len(all_when), dtype=np.int64)
    num_all, row = 0, -1
    goes, own = np.empty(num_places), np.empty(num_places)  # q, c
    total, mass, base = np.empty(num_rooms), np.empty(num_rooms), np.empty(num_rooms)
    remains = np.empty(leaving.shape[1])
    for query in range(num_queries):
        if look_row[query] != row:
            row = look_row[query]
            num_all = _order_looks(look_times[row], all_when, all_where)
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
