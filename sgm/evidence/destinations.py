"""Where things go when they move: by place, by room, and by place within its room."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

_TINY = 1e-12


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
        row = room * room.shape[1] + np.arange(room.shape[1])
        total = _sum_rooms(place, row, num_rooms + 1)
        share = place / np.maximum(_take_rows(total, row), _TINY)
        return cls(place=place, room=room, room_row=row, room_total=total, share=share)

    def take(self, chosen: slice) -> Destinations:
        """Take some of the things."""
        room = self.room[:, chosen]
        row = room * room.shape[1] + np.arange(room.shape[1])
        place, total, share = (
            np.ascontiguousarray(each[:, chosen])
            for each in (self.place, self.room_total, self.share)
        )
        return Destinations(place=place, room=room, room_row=row, room_total=total, share=share)

    def sum_rooms(self, values: np.ndarray) -> np.ndarray:
        """Sum over the places of each room, (P, Q, K) -> (R, Q, K)."""
        return _sum_rooms(values, self.room_row, len(self.room_total))

    def at_places(self, values: np.ndarray) -> np.ndarray:
        """Return what belongs to the room of each place, (R, Q, K) -> (P, Q, K)."""
        return _take_rows(values, self.room_row)


def _sum_rooms(values: np.ndarray, row: np.ndarray, num_rooms: int) -> np.ndarray:
    _, num_queries, num_filters = values.shape
    number = row[..., None] * num_filters + np.arange(num_filters)
    size = num_rooms * num_queries * num_filters
    summed = np.bincount(number.ravel(), values.ravel(), minlength=size)
    return summed.reshape(num_rooms, num_queries, num_filters)


def _take_rows(values: np.ndarray, row: np.ndarray) -> np.ndarray:
    return values.reshape(-1, values.shape[2]).take(row, axis=0)
