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

from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

_TINY = 1e-12
_MOST_NATS = 200.0  # of decays that are put off: their inverse stays finite
_BLOCK = 64  # questions that are followed together: what a look reads stays in the cache

# The five rows that a look reads of each thing, see `_State`.
_WHOLE, _TAKEN, _ROOM, _ROOM_TAKEN, _PLACE = range(5)
_NUM_READ = 5


class Destinations(NamedTuple):
    """Where Q things go when they move.

    Arrays are of places or rooms first, so that what belongs to one of them lies together, and
    have one entry for all filters last.

    Attributes:
        place: probability of each place, sums to one, (P, Q, 1).
        room: number of the room of each place, (P, Q); what is no place is in the last one.
        room_row: row of each place's room in what is made of rooms, room Q + thing, (P, Q).
        room_total: probability of each room, (R, Q, 1).
        share: of each place in its room, (P, Q, 1).
    """

    place: np.ndarray
    room: np.ndarray
    room_row: np.ndarray
    room_total: np.ndarray
    share: np.ndarray

    @classmethod
    def of(cls, place: np.ndarray, room: np.ndarray, num_rooms: int) -> Destinations:
        """Sum up the rooms.

        Args:
            place: probability of each place, (P, Q).
            room: of each place, -1 for what is none, (P, Q).
            num_rooms: room numbers are below it.
        """
        place = np.ascontiguousarray(place)[..., None]
        room = np.where(room >= 0, room, num_rooms)
        room_row = room * room.shape[1] + np.arange(room.shape[1])
        total = _sum_rooms(place, room_row, num_rooms + 1)
        share = place / np.maximum(_take_rows(total, room_row), _TINY)
        return cls(place=place, room=room, room_row=room_row, room_total=total, share=share)

    def take(self, chosen: slice) -> Destinations:
        """Take some of the things."""
        room = self.room[:, chosen]
        room_row = room * room.shape[1] + np.arange(room.shape[1])
        place, total, share = (
            np.ascontiguousarray(each[:, chosen])
            for each in (self.place, self.room_total, self.share)
        )
        return Destinations(
            place=place, room=room, room_row=room_row, room_total=total, share=share
        )

    def sum_rooms(self, values: np.ndarray) -> np.ndarray:
        """Sum over the places of each room, (P, Q, K) -> (R, Q, K)."""
        return _sum_rooms(values, self.room_row, len(self.room_total))

    def at_places(self, values: np.ndarray) -> np.ndarray:
        """Return what belongs to the room of each place, (R, Q, K) -> (P, Q, K)."""
        return _take_rows(values, self.room_row)


def _sum_rooms(values: np.ndarray, room_row: np.ndarray, num_rooms: int) -> np.ndarray:
    _, num_queries, num_filters = values.shape
    number = room_row[..., None] * num_filters + np.arange(num_filters)
    size = num_rooms * num_queries * num_filters
    summed = np.bincount(number.ravel(), values.ravel(), minlength=size)
    return summed.reshape(num_rooms, num_queries, num_filters)


def _take_rows(values: np.ndarray, rows: np.ndarray) -> np.ndarray:
    return values.reshape(-1, values.shape[2]).take(rows, axis=0)


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
            belief[:, block],
            goes.take(block),
            where[:, block],
            detection[:, block],
            hours[:, block],
            rate[block],
            crossing[block],
        )
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

    Beside W, z and y, which decays do not reach, there is what looks took away since, as a number
    below zero: of all places for each of z, and of the places of each room for each of y. All lie
    in one matrix, so that a look reads and writes five of its rows at once. With p and q of the
    place g that is looked at in room s, and the decays D of z and E of y that are put off, these
    five add up to what the look misses; it takes m, divided by the decay, away from each:

    | row           | of      | what it holds                          | adds to m | less by |
    | ------------- | ------- | -------------------------------------- | --------- | ------- |
    | `_WHOLE`      | home    | W                                      | d p       | m       |
    | `_TAKEN`      | home    | minus m / D of looks since z decayed   | -d p D    | m / D   |
    | `_ROOM`       | room s  | z_s                                    | d q D     | m / D   |
    | `_ROOM_TAKEN` | room s  | minus m / E of those since y decayed   | -d q E    | m / E   |
    | `_PLACE`      | place g | y_g                                    | d E       | m / E   |

    Attributes:
        rows: of K numbers, in the order of the table: of the home, the home, R rooms, R rooms and
            P places, those of Q things each, ((2 + 2 R + P) Q, K).
    """

    def __init__(self, belief: np.ndarray, goes: Destinations) -> None:
        """Start with beliefs, (P, Q, K)."""
        self._goes = goes
        num_rooms = len(goes.room_total)
        lengths = [1, 1, num_rooms, num_rooms, len(belief)]  # in the order of the table
        self._begin = tuple(accumulate(lengths, initial=0))  # of each of them, in `parts`
        parts = np.zeros((self._begin[-1], *belief.shape[1:]))
        self.rows = parts.reshape(-1, belief.shape[2])
        whole, taken, self._z, self._room_taken, self._y = (
            parts[begin:end] for begin, end in pairwise(self._begin)
        )
        self._whole, self._taken = whole[0], taken[0]
        in_room = goes.sum_rooms(belief)
        self._whole[:] = np.add.accumulate(in_room)[-1]
        self._z[:] = in_room - goes.room_total * self._whole
        self._y[:] = belief - goes.share * goes.at_places(in_room)

    def find(self, where: np.ndarray) -> np.ndarray:
        """Return the five rows that looks at places read, of all things, (n, Q) -> (n, 5 Q)."""
        num_queries = where.shape[1]
        query = np.arange(num_queries)
        room_row = self._goes.room_row.ravel()[where * num_queries + query]
        index = np.empty((len(where), _NUM_READ, num_queries), dtype=np.int64)
        index[:, _WHOLE] = query + self._begin[_WHOLE] * num_queries
        index[:, _TAKEN] = query + self._begin[_TAKEN] * num_queries
        index[:, _ROOM] = room_row + self._begin[_ROOM] * num_queries
        index[:, _ROOM_TAKEN] = room_row + self._begin[_ROOM_TAKEN] * num_queries
        index[:, _PLACE] = query + (where + self._begin[_PLACE]) * num_queries
        return index.reshape(len(where), _NUM_READ * num_queries)

    def decay(self, decay: _Decay, chosen: np.ndarray) -> None:
        """Let the z and y of some beliefs decay, no longer put off, bool (Q, K)."""
        z, y = self._compute_parts(decay)
        self._z[:, chosen], self._y[:, chosen] = z[:, chosen], y[:, chosen]
        self._taken[chosen], self._room_taken[:, chosen] = 0, 0

    def read(self, decay: _Decay) -> np.ndarray:
        """Return the beliefs, (P, Q, K)."""
        z, belief = self._compute_parts(decay)
        belief += self._goes.share * self._goes.at_places(z)
        belief += self._goes.place * self._whole
        return np.maximum(belief, 0, out=belief)  # what is left may be less than sums can hold

    def _compute_parts(self, decay: _Decay) -> tuple[np.ndarray, np.ndarray]:
        goes = self._goes
        z = decay.z * (self._z - goes.room_total * self._taken)
        return z, decay.y * (self._y - goes.share * goes.at_places(self._room_taken))


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
    """Return what each row that looks read adds to what they miss, and how much less it gets.

    Both (n, 5, Q, K), the latter as a share of what is missed; see the table of `_State`.
    """
    look_row = where * where.shape[1] + np.arange(where.shape[1])
    place, share = (
        values.reshape(-1, values.shape[2]).take(look_row, axis=0) * detection
        for values in (goes.place, goes.share)
    )
    z_decay, y_decay = decay.z[:-1], decay.y[:-1]
    shape = (len(where), _NUM_READ, *z_decay.shape[1:])
    weight, inverse = np.empty(shape), np.empty(shape)
    weight[:, _WHOLE] = place
    np.multiply(-place, z_decay, out=weight[:, _TAKEN])
    np.multiply(share, z_decay, out=weight[:, _ROOM])
    np.multiply(-share, y_decay, out=weight[:, _ROOM_TAKEN])
    np.multiply(detection, y_decay, out=weight[:, _PLACE])
    inverse[:, _WHOLE] = 1
    inverse[:, _TAKEN] = inverse[:, _ROOM] = 1 / z_decay
    inverse[:, _ROOM_TAKEN] = inverse[:, _PLACE] = 1 / y_decay
    return weight, inverse


def _subtract(rows: np.ndarray, index: np.ndarray, weight: np.ndarray, inverse: np.ndarray) -> None:
    """Take away what n looks miss; see `_State` and `_weigh_looks`.

    For few questions the time goes into calls, so that there are few: both rows of the room are
    added to both of the home at once. What is missed is added up in one order, whatever the shapes:
    (whole + room) + (taken + room taken) + place.
    """
    read = np.empty(weight.shape[1:])
    read_rows, changed = read.reshape(-1, rows.shape[1]), np.empty_like(read)
    changed_rows, missed = changed.reshape(read_rows.shape), np.empty_like(read[0])
    of_home, of_room, of_place = changed[:_ROOM], changed[_ROOM:_PLACE], changed[_PLACE]
    whole, taken = changed[_WHOLE], changed[_TAKEN]
    for index_now, weight_now, inverse_now in zip(index, weight, inverse, strict=True):
        rows.take(index_now, 0, read_rows, "clip")
        np.multiply(read, weight_now, changed)
        np.add(of_home, of_room, of_home)
        np.add(whole, taken, whole)
        np.add(whole, of_place, missed)
        np.multiply(inverse_now, missed, changed)
        np.subtract(read, changed, changed)
        rows[index_now] = changed_rows


def move_once(
    belief: np.ndarray, goes: Destinations, crossing: np.ndarray, probability: np.ndarray
) -> np.ndarray:
    """Let things move to another place with a probability, (P, Q, K), (Q, K) -> (P, Q, K).

    `crossing` is the share of the moves that lead anywhere, (Q, K).
    """
    if not probability.any():
        return belief
    away = belief / np.maximum(1 - goes.place, 1e-6)
    came = goes.place * (np.add.accumulate(away)[-1] - away)
    others = goes.at_places(goes.room_total) - goes.place  # in the room
    has_others = others > 1e-9
    away_inside = np.divide(belief, others, out=np.zeros_like(belief), where=has_others)
    came_inside = goes.at_places(goes.sum_rooms(away_inside)) - away_inside
    came_inside = np.where(has_others, came_inside * goes.place, belief)
    after = crossing * came + (1 - crossing) * came_inside
    return (1 - probability) * belief + probability * after
