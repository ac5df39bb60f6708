"""What Bayes filters believe, about what, and by which rules."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np


@dataclass(frozen=True, slots=True)
class Subjects:
    """What beliefs are about: an object, or whatever of a type was neither seen nor asked for.

    Attributes:
        home: (Q,).
        object: row of `MemoryBatch.objects`, -1 for what was neither seen nor asked for, (Q,).
        type: the prior's object type, or -1, (Q,).
        moves: weight of each furniture node when it moves, zeros if they are unknown, (Q, F).
    """

    home: np.ndarray
    object: np.ndarray
    type: np.ndarray
    moves: np.ndarray

    def __len__(self) -> int:
        return len(self.home)

    def take(self, rows: np.ndarray) -> Subjects:
        """Return rows (n,)."""
        return Subjects(self.home[rows], self.object[rows], self.type[rows], self.moves[rows])


@dataclass(frozen=True, slots=True)
class Rules:
    """What the filter takes for the dynamics of each subject.

    Attributes:
        moves: weight of each furniture node when the object moves, sums to one, (Q, F).
        initial: expected number of such objects at each furniture node at t = 0, (Q, F).
        move_rate: probability that one moves in a step, (Q,).
        asked_move_rate: the same, given that the object is asked for in that step, (Q,).
        remove_rate: probability that one leaves in a step, (Q,).
        add_rate: expected number that appear in a step, (Q,).
        miss_rate: probability that a look misses one, (Q,).
    """

    moves: np.ndarray
    initial: np.ndarray
    move_rate: np.ndarray
    asked_move_rate: np.ndarray
    remove_rate: np.ndarray
    add_rate: np.ndarray
    miss_rate: np.ndarray

    def take(self, rows: np.ndarray) -> Rules:
        """Return rows (n,)."""
        return Rules(*(getattr(self, field.name)[rows] for field in fields(self)))


@dataclass(slots=True)
class FilterBelief:
    """What a filter believes about each subject.

    Attributes:
        last: probability that the instance that was seen last is at each furniture node, (Q, F).
        others: expected number of other instances at each furniture node, (Q, F).
    """

    last: np.ndarray
    others: np.ndarray

    @classmethod
    def get_names(cls) -> tuple[str, ...]:
        """Return the names of the columns."""
        return tuple(field.name for field in fields(cls))

    @property
    def noise(self) -> tuple[np.ndarray, np.ndarray, np.ndarray] | None:
        """What a filter that learns of noise believes about it; None for others."""
        return None

    @property
    def columns(self) -> dict[str, np.ndarray]:
        """Every column by its name, (Q, F) each."""
        return {name: getattr(self, name) for name in self.get_names()}

    def take(self, rows: np.ndarray) -> FilterBelief:
        """Return a copy of rows (n,)."""
        return type(self)(**{name: column[rows] for name, column in self.columns.items()})

    def put(self, rows: np.ndarray, some: FilterBelief) -> None:
        """Replace rows (n,) by those of another belief."""
        for name, column in some.columns.items():
            getattr(self, name)[rows] = column


@dataclass(slots=True)
class AsOf:
    """Up to where each belief knows what happened.

    Attributes:
        time: (Q,).
        num_rounds: rounds of looks, (Q,).
    """

    time: np.ndarray
    num_rounds: np.ndarray
