"""Filters that follow things over looks: the probability of each place, given that looks missed it.

Between looks a thing leaves its place at a rate, for a place drawn from its destinations: anywhere
with the share `crossing`, else within its room. With W the probability of all places, p_f that of a
place in the destinations, P_r and q_f = p_f / P_r that of its room and its share in it, write

    b_f = p_f W + q_f z_r + y_f

Then time leaves W as it is, multiplies each z_r by exp(-rate crossing t) and each y_f by
exp(-rate t). A look that would show what is at g in room s with probability d, and does not, takes
m = d b_g away:

    W -= m,    y_g -= m,    y_f += q_f m for all f in s,    z_s -= m,    z_r += P_r m for all r

What is done to all of a room or a home is summed up instead, and decays are put off until a sum is
read: a look costs the same in any home.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.evidence.destinations import Destinations

_MOST_NATS = 200.0  # of decays that are put off: their inverse stays finite
_BLOCK = 64  # questions that are followed together: what a look reads stays in the cache


def follow(
    belief: np.ndarray,
    goes: Destinations,
    where: np.ndarray,
    detection: np.ndarray,
    hours: np.ndarray,
    rate: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """Follow K filters for each of Q things over n looks that miss it.

    The answer to a question does not depend on which others are beside it, to the bit.

    Args:
        belief: at first, sums to one, (P, Q, 1).
        goes: destinations.
        where: the looks were, (n, Q).
        detection: how likely each shows what is there, 0 for those that do not count, (n, Q).
        hours: from the start until each look, and until the end, (n + 1, Q).
        rate: at which the things leave, per hour, (Q, K).
        crossing: share of their ways that lead anywhere, (Q, K).

    Returns:
        The belief at the end, up to a factor, (P, Q, K).
    """
    if len(rate) <= _BLOCK:
        return _follow_block(belief, goes, where, detection, hours, rate, crossing)
    after = np.empty((*belief.shape[:2], rate.shape[1]))
    for start in range(0, len(rate), _BLOCK):
        block = slice(start, start + _BLOCK)
        after[:, block] = _follow_block(
            belief[:, block], goes.take(block), where[:, block], detection[:, block],
            hours[:, block], rate[block], crossing[block],
        )  # fmt: skip
    return after


def _follow_block(
    belief: np.ndarray,
    goes: Destinations,
    where: np.ndarray,
    detection: np.ndarray,
    hours: np.ndarray,
    rate: np.ndarray,
    crossing: np.ndarray,
) -> np.ndarray:
    """`follow` for a few things."""
    nats = hours[..., None] * rate  # (n + 1, Q, K)
    base = _list_bases(nats)
    decay = _Decay(z=np.exp(crossing * (base - nats)), y=np.exp(base - nats))
    state = _State(np.broadcast_to(belief, (len(belief), *rate.shape)), goes)
    index = state.find(where)
    weight, inverse = _weigh_looks(goes, where, detection[..., None], decay)
    begin = 0
    before = np.concatenate([np.zeros_like(base[:1]), base[:-1]])
    for end in np.flatnonzero((base != before).any(axis=(1, 2))).tolist():
        _subtract(state.rows, index[begin:end], weight[begin:end], inverse[begin:end])
        passed = before[end] - base[end]
        state.decay(_Decay(z=np.exp(crossing * passed), y=np.exp(passed)), passed < 0)
        begin = end
    _subtract(state.rows, index[begin:], weight[begin:], inverse[begin:])
    return state.read(_Decay(z=decay.z[-1], y=decay.y[-1]))


class _Decay(NamedTuple):
    """By what z and y are to be multiplied, (..., Q, K) each."""

    z: np.ndarray
    y: np.ndarray


class _State:
    """Beliefs about Q things by K filters, with what is put off.

    Beside W, z and y, which decays do not reach, there is what looks took away since: of all
    places for each of z, and of the places of each room for each of y.

    Attributes:
        rows: of K numbers, for W, what was taken of all, z, what was taken in each room, and y,
            those of Q things each, ((2 + 2 R + P) Q, K).
    """

    def __init__(self, belief: np.ndarray, goes: Destinations) -> None:
        """Start with beliefs, (P, Q, K)."""
        self._goes = goes
        num_rooms = len(goes.room_total)
        parts = np.zeros((2 + 2 * num_rooms + len(belief), *belief.shape[1:]))
        self.rows = parts.reshape(-1, belief.shape[2])
        self._whole, self._taken = parts[0], parts[1]
        self._z, self._taken_inside = parts[2 : 2 + num_rooms], parts[2 + num_rooms :][:num_rooms]
        self._y = parts[2 + 2 * num_rooms :]
        in_room = goes.sum_rooms(belief)
        self._whole[:] = np.add.accumulate(in_room)[-1]
        self._z[:] = in_room - goes.room_total * self._whole
        self._y[:] = belief - goes.share * goes.at_places(in_room)

    def find(self, where: np.ndarray) -> np.ndarray:
        """Return the five rows that looks at places read, of all things, (n, Q) -> (n, 5 Q)."""
        num_queries, num_rooms = where.shape[1], len(self._z)
        query = np.arange(num_queries)
        room_row = self._goes.room_row.ravel()[where * num_queries + query]
        index = np.empty((len(where), 5, num_queries), dtype=np.int64)
        index[:, 0], index[:, 1] = query, query + num_queries
        index[:, 2] = room_row + 2 * num_queries
        index[:, 3] = room_row + (2 + num_rooms) * num_queries
        index[:, 4] = (where + 2 + 2 * num_rooms) * num_queries + query
        return index.reshape(len(where), 5 * num_queries)

    def decay(self, decay: _Decay, chosen: np.ndarray) -> None:
        """Let the z and y of some beliefs decay, no longer put off, bool (Q, K)."""
        z, y = self._compute_parts(decay)
        self._z[:, chosen], self._y[:, chosen] = z[:, chosen], y[:, chosen]
        self._taken[chosen], self._taken_inside[:, chosen] = 0, 0

    def read(self, decay: _Decay) -> np.ndarray:
        """Return the beliefs, (P, Q, K)."""
        z, belief = self._compute_parts(decay)
        belief += self._goes.share * self._goes.at_places(z)
        belief += self._goes.place * self._whole
        return np.maximum(belief, 0, out=belief)  # what is left may be less than sums can hold

    def _compute_parts(self, decay: _Decay) -> tuple[np.ndarray, np.ndarray]:
        goes = self._goes
        z = decay.z * (self._z - goes.room_total * self._taken)
        return z, decay.y * (self._y - goes.share * goes.at_places(self._taken_inside))


def _list_bases(nats: np.ndarray) -> np.ndarray:
    """Return from where decays are put off at each look, in nats since the start, (n, Q, K)."""
    count = np.floor(nats / _MOST_NATS)
    if not count.any():
        return np.zeros_like(nats)
    is_new = np.diff(count, axis=0, prepend=0.0) > 0
    return np.maximum.accumulate(np.where(is_new, nats, 0.0), axis=0)


def _weigh_looks(
    goes: Destinations, where: np.ndarray, detection: np.ndarray, decay: _Decay
) -> tuple[np.ndarray, np.ndarray]:
    """Return how much of each row that a look reads it misses, and how much it takes of it.

    Both (n, 5, Q, K), the latter of what it misses.
    """
    row = where * where.shape[1] + np.arange(where.shape[1])
    place, share = (
        values.reshape(-1, values.shape[2]).take(row, axis=0) * detection
        for values in (goes.place, goes.share)
    )
    z_decay, y_decay = decay.z[:-1], decay.y[:-1]
    shape = (len(where), 5, *z_decay.shape[1:])
    weight, inverse = np.empty(shape), np.empty(shape)
    weight[:, 0] = place
    np.multiply(-place, z_decay, out=weight[:, 1])
    np.multiply(share, z_decay, out=weight[:, 2])
    np.multiply(-share, y_decay, out=weight[:, 3])
    np.multiply(detection, y_decay, out=weight[:, 4])
    inverse[:, 0] = 1
    inverse[:, 1:3] = 1 / z_decay[:, None]
    inverse[:, 3:] = 1 / y_decay[:, None]
    return weight, inverse


def _subtract(rows: np.ndarray, index: np.ndarray, weight: np.ndarray, inverse: np.ndarray) -> None:
    """Take away what n looks miss; see `_State` and `_weigh_looks`.

    For few questions the time goes into calls, so that there are few. What is missed is added up in
    one order, whatever the shapes.
    """
    read = np.empty(weight.shape[1:])
    read_rows, changed = read.reshape(-1, rows.shape[1]), np.empty_like(read)
    changed_rows = changed.reshape(read_rows.shape)
    first, second, missed = changed[:2], changed[2:4], np.empty_like(read[0])
    left, right, last = first[0], first[1], changed[4]
    for index_now, weight_now, inverse_now in zip(index, weight, inverse, strict=True):
        rows.take(index_now, 0, read_rows, "clip")
        np.multiply(read, weight_now, changed)
        np.add(first, second, first)
        np.add(left, right, left)
        np.add(left, last, missed)
        np.multiply(inverse_now, missed, changed)
        np.subtract(read, changed, changed)
        rows[index_now] = changed_rows
