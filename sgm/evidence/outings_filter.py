"""Whether things that leave and come back are out, given the looks since the last sighting."""

from __future__ import annotations

import math

import numpy as np

_SAME = 0.97  # probability that what was seen is the object that is asked for
_TICK = 0.5  # hours: in between, the share of the time at home is taken for linear
_LONGEST = 168.0  # hours of what is followed: a week later nothing is left of a sighting
_LEAST = 1e-6
# A look that does not show what is in the home counts for a little less than a look: what hides a
# thing once may hide it again.
_LOOKS_COUNTED = 0.85


def follow_outings(
    home_share: np.ndarray,
    usual: np.ndarray,
    look_times: np.ndarray,
    last_place: np.ndarray,
    last_time: np.ndarray,
    now: int,
    clock: np.ndarray,
    rate: np.ndarray,
    miss: np.ndarray,
    mixing: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Follow whether Q things are in or out; see `sgm.evidence.outings`.

    Args:
        home_share: how likely each is at home by hour of working days and of the weekend, (Q, 48).
        usual: where it is when it comes back or has moved, sums to one, (Q, F).
        look_times: of the latest looks at each place, -1 for none, (Q, F, L).
        last_place: where it was last seen, int64 (Q,).
        last_time: when, int64 (Q,).
        now: the present time step.
        clock: of the home of each: seconds of the week at step 0, and of a step, (Q, 2).
        rate: at which it moves in the home, per hour, (Q,).
        miss: probability that a look misses it, (Q,).
        mixing: rate at which it is forgotten whether it was in or out, per hour.

    Returns:
        How likely each is out, (Q,), and the logarithm of how much likelier the looks since are if
        it may go out than if it stays, (Q,).
    """
    num_queries, num_places = usual.shape
    num_kept = look_times.shape[2]
    out_share = np.zeros(num_queries)
    gain = np.zeros(num_queries)
    when = np.empty(num_places * num_kept, dtype=np.int64)
    where = np.empty(len(when), dtype=np.int64)
    inside = np.empty(num_places)
    staying = np.empty(num_places)
    for query in range(num_queries):
        hours_per_step = clock[query, 1] / 3600.0
        start = last_time[query]
        first_step = start
        if (now - start) * hours_per_step > _LONGEST:
            first_step = now - int(_LONGEST / hours_per_step)
        num_looks = 0
        for place in range(num_places):
            for kept in range(num_kept):
                time = look_times[query, place, kept]
                if time >= first_step and (
                    time > start or (time == start and time >= 0 and place != last_place[query])
                ):
                    when[num_looks] = time
                    where[num_looks] = place
                    num_looks += 1
        order = np.argsort(when[:num_looks], kind="mergesort")
        share = _read_share(home_share[query], clock[query], float(first_step))
        if first_step > start or last_place[query] < 0:
            inside[:] = usual[query] * share
            staying[:] = usual[query]
            out = 1 - share
        else:
            inside[:] = usual[query] * (1 - _SAME)
            inside[last_place[query]] += _SAME
            staying[:] = inside
            out = 0.0
        time = first_step
        log_gain = 0.0
        for position in range(num_looks + 1):
            is_end = position == num_looks
            next_time = now if is_end else when[order[position]]
            elapsed = (next_time - time) * hours_per_step
            if elapsed > 0:
                num_ticks = math.ceil(elapsed / _TICK)
                at_home = inside.sum()
                kept_share = 1.0
                came = 0.0
                forgets = 1 - math.exp(-mixing * elapsed / num_ticks)
                for tick in range(num_ticks):
                    step = time + (next_time - time) * (tick + 1) / num_ticks
                    after = _read_share(home_share[query], clock[query], step)
                    remains = (1 - forgets) * min(after / share, 1.0) + forgets * after
                    returns = forgets * after
                    if after > share:
                        returns += (1 - forgets) * (after - share) / (1 - share)
                    came = came * remains + out * returns
                    kept_share *= remains
                    out = 1 - at_home * kept_share - came
                    share = after
                stays = math.exp(-rate[query] * elapsed)
                total = staying.sum()
                for place in range(num_places):
                    moved = stays * inside[place] + (1 - stays) * at_home * usual[query, place]
                    inside[place] = kept_share * moved + came * usual[query, place]
                    staying[place] = (
                        stays * staying[place] + (1 - stays) * total * usual[query, place]
                    )
                out = max(out, 0.0)
                time = next_time
            if not is_end:
                place = where[order[position]]
                at_home = max(inside.sum(), _LEAST)
                unseen = 1 - inside[place] * (1 - miss[query]) / at_home
                weight = max(unseen, _LEAST) ** _LOOKS_COUNTED
                inside[place] *= miss[query]
                inside *= weight / max(unseen, _LEAST)
                total = at_home * weight + out
                inside /= total
                out /= total
                unseen = max(1 - staying[place] * (1 - miss[query]), _LEAST)
                staying[place] *= miss[query]
                staying /= unseen
                log_gain += math.log(total) - _LOOKS_COUNTED * math.log(unseen)
        out_share[query] = out
        gain[query] = log_gain
    return out_share, gain


def _read_share(share: np.ndarray, clock: np.ndarray, step: float) -> float:
    """Return a share of (48,) at a time step, linear between the middles of hours."""
    hour = ((clock[0] + step * clock[1]) / 3600.0 - 0.5) % 168.0
    first = int(hour)
    part = hour - first
    found = (1 - part) * share[_find_bin(first)] + part * share[_find_bin((first + 1) % 168)]
    return min(max(found, _LEAST), 1 - _LEAST)


def _find_bin(hour: int) -> int:
    """Return which of the 48 an hour of the week is."""
    return hour % 24 + (24 if hour >= 120 else 0)
