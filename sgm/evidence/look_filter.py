"""Where an object can be, given its last sighting and all looks since.

Loops are over looks alone: each step is that of all questions, filters and places, (Q, K, P).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_SAME = 0.97  # probability that what is seen is the object that is asked for
_TINY = 1e-12
_FEW = 8  # rows: how a product is rounded depends on how many it has


class LooksSince(NamedTuple):
    """The looks since Q objects were last seen, aligned at their ends; `counts` says which are any.

    Attributes:
        when, where: time, that of the sighting or 0 before it, and place, (Q, n).
        counts: bool (Q, n).
    """

    when: np.ndarray
    where: np.ndarray
    counts: np.ndarray

    @classmethod
    def list(
        cls,
        look_times: np.ndarray,
        look_row: np.ndarray,
        last_place: np.ndarray,
        last_time: np.ndarray,
    ) -> LooksSince:
        """List looks but for the one that saw the object; see `follow_looks`."""
        times = look_times.reshape(len(look_times), -1)
        order = np.argsort(times, axis=1, kind="stable")
        when = np.take_along_axis(times, order, axis=1)[look_row].astype(np.int64)
        where = (order // look_times.shape[2])[look_row]
        start = np.where(last_place >= 0, last_time, -1)[:, None]
        counts = (when >= np.maximum(start, 0)) & ((when > start) | (where != last_place[:, None]))
        is_used = counts.any(axis=0)
        used = slice(is_used.argmax() if is_used.any() else -1, None)
        return cls(when[:, used], where[:, used], counts[:, used])

    def take(self, chosen: np.ndarray) -> LooksSince:
        """Leave some of the looks out."""
        return self._replace(counts=self.counts & chosen)

    def start(self, last_place: np.ndarray, last_time: np.ndarray, now: int) -> np.ndarray:
        """Return when each belief starts: at the last sighting, else at the first look, (Q,)."""
        first = self.when[np.arange(len(self.when)), self.counts.argmax(axis=1)]
        first = np.where(self.counts.any(axis=1), first, now)
        return np.where(last_place >= 0, last_time, first)

    def elapsed(self, start: np.ndarray, now: int) -> np.ndarray:
        """Return the steps before each look, and from the last one to now, (Q, n + 1)."""
        time = np.where(self.counts, self.when, start[:, None])
        time = np.column_stack([start, time, np.full(len(start), now)])
        return np.diff(np.maximum.accumulate(time, axis=1), axis=1)


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
    looks = LooksSince.list(look_times, look_row, last_place, last_time)
    is_now = looks.when == now
    # Filters of one rate and crossing differ in the move just before the question alone.
    twin = ((rate[:, :, None] == rate[:, None]) & (crossing[:, :, None] == crossing[:, None])).all(
        0
    )
    first, number = np.unique(twin.argmax(axis=1), return_inverse=True)
    first = np.resize(first, -(-len(first) // _FEW) * _FEW)
    since = looks.take(~is_now)
    steps = since.elapsed(since.start(last_place, last_time, now), now)
    before = _follow(
        _start(destination, last_place)[:, None].repeat(len(first), axis=1), destination[:, None],
        room, num_rooms, since.where, np.where(since.counts, 1 - miss[:, None], 0.0)[:, None],
        (steps * hours[:, None])[:, None], rate[:, first], crossing[:, first],
    )  # fmt: skip
    belief = before[:, number]
    # Nothing moved since it was seen in this step.
    moved = np.where(((last_place >= 0) & (last_time == now))[:, None], 0.0, moved)
    for filters in np.flatnonzero(moved.any(axis=0)):
        belief[:, filters] = _move_once(
            belief[:, filters],
            destination,
            room,
            num_rooms,
            crossing[:, filters],
            moved[:, filters],
        )
    query, look = np.nonzero(looks.counts & is_now)
    seen_not = np.zeros(destination.shape)
    np.add.at(seen_not, (query, looks.where[query, look]), 1)
    belief *= (miss[:, None] ** seen_not)[:, None]
    return belief / np.maximum(_add_up(belief), _TINY)


def _start(goes: np.ndarray, last_place: np.ndarray) -> np.ndarray:
    """Return the belief at the last sighting, or before the first look, (Q, P)."""
    was_seen = np.flatnonzero(last_place >= 0)
    belief = goes.copy()
    belief[was_seen] *= 1 - _SAME
    belief[was_seen, last_place[was_seen]] += _SAME
    return belief


def _follow(
    belief: np.ndarray,
    goes: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    where: np.ndarray,
    found: np.ndarray,
    hours: np.ndarray,
    rate: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """Follow N filters in each of G homes over n looks at the same places.

    Args:
        belief: at first, sums to one, (G, N, P); it is changed.
        goes: destinations, (G, N or 1, P).
        room: of each place, (G, P).
        num_rooms: room numbers are below it.
        where: the looks were, (G, n).
        found: how likely each shows what is there, 0 for those that do not count, (G, N or 1, n).
        hours: before each look and after the last one, (G, N or 1, n + 1).
        rate: at which they leave, per hour, (G, N).
        crossing: share of their ways that lead anywhere, (G, N).

    Returns:
        The belief at the end, up to a factor, (G, N, P).
    """
    is_in = (room[:, :, None] == np.arange(num_rooms)).astype(float)
    places_of = np.ascontiguousarray(is_in.swapaxes(1, 2))
    total = goes @ is_in
    share = goes / np.maximum(total @ places_of, _TINY)
    # Looks first, since each step reads those of one.
    found, hours = (np.ascontiguousarray(np.moveaxis(each, 2, 0)) for each in (found, hours))
    stays, in_room = np.exp(-rate * hours), np.exp(-rate * crossing * hours)
    inwards, anywhere = (in_room - stays)[..., None], (1 - in_room)[..., None]
    stays, passes, home = stays[..., None], np.any(hours, axis=(1, 2)), np.arange(len(belief))
    mass = np.ones(rate.shape)  # what the belief sums up to
    for look in range(len(hours)):
        if passes[look]:
            flow = belief @ is_in
            flow *= inwards[look]
            flow += total * (anywhere[look] * mass[..., None])
            came = flow @ places_of
            came *= share
            belief *= stays[look]
            belief += came
        if look < len(found):
            here = found[look] * belief[home, :, where[:, look]]
            belief[home, :, where[:, look]] -= here
            mass -= here
    return belief


def _move_once(
    density: np.ndarray,
    goes: np.ndarray,
    room: np.ndarray,
    num_rooms: int,
    cross: np.ndarray,
    probability: np.ndarray,
) -> np.ndarray:
    """Let objects move to another place with a probability, (Q,).

    Density and destinations are of the places, (Q, P), and `cross` is the share of the moves that
    lead anywhere, (Q,).
    """
    is_in = (room[:, :, None] == np.arange(num_rooms)).astype(float)

    def sum_room(values: np.ndarray) -> np.ndarray:
        return np.einsum("qpr,qr->qp", is_in, np.einsum("qp,qpr->qr", values, is_in))

    away = density / np.maximum(1 - goes, 1e-6)
    others = sum_room(goes) - goes
    has_others = others > 1e-9
    away_inside = np.divide(density, others, out=np.zeros_like(density), where=has_others)
    came = goes * (_add_up(away) - away)
    inside = np.where(has_others, (sum_room(away_inside) - away_inside) * goes, density)
    cross, probability = cross[:, None], probability[:, None]
    after = cross * came + (1 - cross) * inside
    return (1 - probability) * density + probability * after


def _add_up(values: np.ndarray) -> np.ndarray:
    """Sum rows, (..., F) -> (..., 1), from first to last: zeros beyond the end change no bit."""
    return np.add.accumulate(values, axis=-1)[..., -1:]
