"""Where things can be by filters, given the last sighting of each and the looks since."""

from __future__ import annotations

import numpy as np

from sgm.evidence.destinations import Destinations
from sgm.evidence.look_filter import follow
from sgm.evidence.looks_since import LooksSince

_SAME = 0.97  # probability that what is seen is the object that is asked for
_TINY = 1e-12


def follow_looks(
    *,
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
    goes = Destinations.of(destination.T, room.T, num_rooms)
    looks = LooksSince.list(look_times, look_row, last_place, last_time)
    is_now = looks.when == now
    since = looks.take(~is_now)
    steps = since.count_steps(since.start(last_place, last_time, now), now)
    filters, number = _find_twins(rate, crossing)
    before = follow(
        _start(goes.place, last_place),
        goes,
        since.where,
        since.compute_detection(miss),
        steps * hours,
        rate[:, filters],
        crossing[:, filters],
    )
    # Nothing moved since it was seen in this step.
    was_seen_now = (last_place >= 0) & (last_time == now)
    moved = np.where(was_seen_now[:, None], 0.0, moved)
    belief = _move_once(before[..., number], goes, crossing, moved)
    if is_now.any():
        num_missed = np.zeros(goes.room.shape, dtype=np.int64)
        look, query = np.nonzero(is_now)
        np.add.at(num_missed, (looks.where[look, query], query), looks.number[look, query])
        belief *= (miss**num_missed)[..., None]
    belief /= np.maximum(_add_places(belief), _TINY)
    return np.ascontiguousarray(belief.transpose(1, 2, 0))


def _start(place: np.ndarray, last_place: np.ndarray) -> np.ndarray:
    """Return the belief at the last sighting, or before the first look.

    Args:
        place: probability of each in the destinations, (P, Q, 1).
        last_place: where each thing was last seen, -1 for never, (Q,).

    Returns:
        Probability of each place, (P, Q, 1).
    """
    was_seen = np.flatnonzero(last_place >= 0)
    belief = place.copy()
    belief[:, was_seen] *= 1 - _SAME
    belief[last_place[was_seen], was_seen] += _SAME
    return belief


def _add_places(values: np.ndarray) -> np.ndarray:
    """Sum over places in their order, (P, Q, K) -> (Q, K)."""
    summed: np.ndarray = np.add.accumulate(values)[-1]
    return summed


def _find_twins(rate: np.ndarray, crossing: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return filters that differ in rate or crossing, (k,), and for each filter which, (K,).

    The others differ in the move just before the question alone.
    """
    both = np.concatenate([rate, crossing])  # (2 Q, K)
    is_twin = (both[:, :, None] == both[:, None]).all(axis=0)
    first = is_twin.argmax(axis=1)
    is_first = first == np.arange(len(first))
    return np.flatnonzero(is_first), (np.cumsum(is_first) - 1)[first]


def _move_once(
    belief: np.ndarray, goes: Destinations, crossing: np.ndarray, probability: np.ndarray
) -> np.ndarray:
    """Let things move to another place with a probability, (P, Q, K), (Q, K) -> (P, Q, K).

    `crossing` is the share of the moves that lead anywhere, (Q, K).
    """
    if not probability.any():
        return belief
    away = belief / np.maximum(1 - goes.place, 1e-6)
    came = goes.place * (_add_places(away) - away)
    others = goes.at_places(goes.room_total) - goes.place  # in the room
    has_others = others > 1e-9
    away_inside = np.divide(belief, others, out=np.zeros_like(belief), where=has_others)
    came_inside = goes.at_places(goes.sum_rooms(away_inside)) - away_inside
    came_inside = np.where(has_others, came_inside * goes.place, belief)
    after = crossing * came + (1 - crossing) * came_inside
    return (1 - probability) * belief + probability * after
