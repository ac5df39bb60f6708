"""At which hours of the week a home was looked at, and things were seen, counted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.arrays.read_numbers import read_sparse, write_sparse
from sgm.arrays.table import clone
from sgm.arrays.week import NUM_WEEK_HOURS

_MOST = 2**16 - 1  # of a count


class WeekHours:
    """Counts of H homes with F furniture nodes and O objects; empty without a clock.

    Attributes:
        looks: at each furniture node by hour, uint16 (H, F, NUM_WEEK_HOURS).
        seen: looks that showed each object, wherever, uint16 (O', NUM_WEEK_HOURS); rows of objects
            beyond O', which were not seen yet, are left out.
    """

    def __init__(self, num_homes: int, num_furniture: int) -> None:
        """Start with nothing counted, which takes no memory."""
        self.looks = _make_none(num_homes, num_furniture)
        self.seen = np.zeros((0, NUM_WEEK_HOURS), dtype=np.uint16)

    @property
    def is_counted(self) -> bool:
        """Whether any look was counted, of what there is."""
        return self.looks.flags.writeable

    def add_furniture(self, num_added: int) -> None:
        """Add columns of furniture that was never looked at."""
        num_homes, before, _ = self.looks.shape
        if self.is_counted:
            self.looks = np.pad(self.looks, ((0, 0), (0, num_added), (0, 0)))
        else:
            self.looks = _make_none(num_homes, before + num_added)

    def copy(self) -> WeekHours:
        """Return the same counts, which can be changed alone."""
        copied = clone(self)
        if self.is_counted:
            copied.looks = self.looks.copy()
        copied.seen = self.seen.copy()
        return copied

    def take(self, furniture: np.ndarray, objects: np.ndarray) -> WeekHours:
        """Return a copy that keeps some furniture (F,) and objects (O,), bool."""
        kept = WeekHours(len(self.looks), int(furniture.sum()))
        looks = self.looks[:, furniture]
        if self.is_counted and looks.any():
            kept.looks = looks
        num_known = min(len(self.seen), len(objects))  # beyond these are rows to spare
        kept.seen = self.seen[:num_known][objects[:num_known]]
        return kept

    def merge_furniture(self, kept: int, gone: int) -> None:
        """Count for one furniture node of a home what was counted of another, by position."""
        if self.is_counted:
            total = self.looks[0, kept].astype(np.int64) + self.looks[0, gone]
            self.looks[0, kept], self.looks[0, gone] = np.minimum(total, _MOST), 0

    def note_look(
        self,
        hour: np.ndarray,
        home: np.ndarray,
        furniture: np.ndarray,
        seen: np.ndarray,
        object_home: np.ndarray,
    ) -> None:
        """Count a look in each of some homes (n,) and the objects seen (m,).

        `hour` is the hour of the week in each home, -1 where it is unknown, (H,); `object_home` the
        home of every object, (O,).
        """
        is_known = hour[home] >= 0
        home, furniture = home[is_known], furniture[is_known]
        if not len(home) and not (len(seen) and self.is_counted):
            return
        if not self.is_counted:
            self.looks = np.zeros(self.looks.shape, dtype=np.uint16)
        counter = (home, furniture, hour[home])
        self.looks[counter] += self.looks[counter] < _MOST
        num_objects = len(object_home)
        if num_objects > len(self.seen):
            added = max(num_objects, 2 * len(self.seen)) - len(self.seen)
            self.seen = np.pad(self.seen, ((0, added), (0, 0)))
        seen_hour = hour[object_home[seen]]
        sighted = (seen[seen_hour >= 0], seen_hour[seen_hour >= 0])
        self.seen[sighted] += self.seen[sighted] < _MOST

    def get_seen(self, objects: np.ndarray) -> np.ndarray:
        """Return `seen` of any objects, (n,) -> (n, NUM_WEEK_HOURS)."""
        if len(self.seen) == 0:
            return np.zeros((len(objects), NUM_WEEK_HOURS), dtype=np.uint16)
        is_counted = objects < len(self.seen)
        return self.seen[np.where(is_counted, objects, 0)] * is_counted[:, None].astype(np.uint16)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values of one home, from which `from_json` makes the same counts."""
        return {
            name: write_sparse(counts)
            for name, counts in (("looks", self.looks[0]), ("seen", self.seen))
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any], num_furniture: int, num_objects: int) -> WeekHours:
        """Read JSON values; raises ValueError, KeyError or TypeError if they fit no such home."""
        hours, read = cls(1, num_furniture), []
        for name, num_rows in (("looks", num_furniture), ("seen", num_objects)):
            limits = (num_rows, NUM_WEEK_HOURS, _MOST + 1)
            number, hour, count = read_sparse(f"week hours {name}", data[name], limits)
            read.append(np.zeros(limits[:2], dtype=np.uint16))
            read[-1][number, hour] = count
        if read[0].any():
            hours.looks = read[0][None]
        hours.seen = read[1]
        return hours


def _make_none(num_homes: int, num_furniture: int) -> np.ndarray:
    return np.broadcast_to(np.uint16(0), (num_homes, num_furniture, NUM_WEEK_HOURS))
