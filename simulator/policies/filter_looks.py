"""What filters keep of the past: the looks of a stretch of time, what they saw, what was asked."""

from __future__ import annotations

import numpy as np

from sgm.arrays.table import Table
from simulator.policies.filter_kernel import ChainArrays


class Chains:
    """Entries in the order they came; each knows the one before it that has the same key.

    What an entry says is `value`, a whole number, and `share`, a number in [0, 1]. Entries are
    numbered from 0 and keep their number when older ones are dropped.
    """

    def __init__(self, num_keys: int) -> None:
        """Start without entries; keys are 0..num_keys - 1, and more with `fit`."""
        self._newest = np.full(num_keys, -1, dtype=np.int64)
        self._first = 0
        self._entries = _make_entries()

    def __len__(self) -> int:
        return self._entries.num_rows

    @property
    def arrays(self) -> ChainArrays:
        """What compiled functions read, see `simulator.policies.filter_kernel`."""
        entries = self._entries
        return ChainArrays(
            newest=self._newest,
            first=self._first,
            moment=entries["moment"],
            value=entries["value"],
            share=entries["share"],
            previous=entries["previous"],
        )

    def fit(self, num_keys: int) -> None:
        """Make room for keys 0..num_keys - 1."""
        self._newest = fit_keys(self._newest, num_keys)

    def append(
        self,
        keys: np.ndarray,
        moment: int,
        value: np.ndarray | int = 0,
        share: np.ndarray | int = 1,
    ) -> None:
        """Add an entry for each key (n,); a key that stands there twice counts once.

        `moment` is no less than that of the entries before; `value` and `share` are (n,).
        """
        previous = self._newest[keys]
        rows = self._entries.append(
            len(keys), moment=moment, value=value, share=share, previous=previous
        )
        self._newest[keys] = self._first + rows

    def drop(self, until: int) -> None:
        """Forget the entries with `moment` < until."""
        kept = self._entries
        num_dropped = int(np.searchsorted(kept["moment"], until))
        self._entries = _make_entries()
        columns = {name: kept[name][num_dropped:] for name in kept}
        self._entries.append(kept.num_rows - num_dropped, **columns)
        self._first += num_dropped


def fit_keys(rows: np.ndarray, num_keys: int) -> np.ndarray:
    """Return the rows of keys with room for keys 0..num_keys - 1; -1 of those without a row."""
    missing = num_keys - len(rows)
    if missing <= 0:
        return rows
    return np.pad(rows, (0, max(missing, len(rows))), constant_values=-1)


def _make_entries() -> Table:
    return Table({"moment": np.int64, "value": np.int64, "share": np.float64, "previous": np.int64})


class FilterLooks:
    """The looks at H homes since `start`, what they saw, and what was asked for.

    A round is one call of `add_looks`: at most one look in each home. Rounds are numbered from 0
    and keep their numbers when older ones are dropped.

    Attributes:
        start: what has happened up to this time is not in the log any more.
        num_rounds: rounds so far, those dropped as well.
        looks: by home: round, furniture, and the share of it that was in view.
        sightings: by object row: round.
        type_sightings: by home * num_types + type: round.
        questions: by object row: time.
    """

    max_length = 2048  # rounds or steps in the log; then the older half is dropped

    def __init__(self, num_homes: int, num_types: int) -> None:
        """Start at t = 0; unknown types of objects count as one more."""
        self.start = 0
        self.num_rounds = 0
        self.looks = Chains(num_homes)
        self.sightings = Chains(64)
        self.type_sightings = Chains(num_homes * num_types)
        self.questions = Chains(64)
        self._rounds = Table({"time": np.int64})

    @property
    def first_round(self) -> int:
        """Number of the oldest round that is kept."""
        return self.num_rounds - self._rounds.num_rows

    @property
    def round_time(self) -> np.ndarray:
        """Time of every round that is kept, (R,)."""
        return self._rounds["time"]

    def add_looks(
        self,
        time: int,
        homes: np.ndarray,
        furniture: np.ndarray,
        coverage: np.ndarray,
        objects: np.ndarray,
        type_keys: np.ndarray,
    ) -> None:
        """Note a round of looks: in which homes, each once, where, and how much was in view, (n,).

        `objects` (m,) are the rows of those that were seen, `type_keys` home * num_types + type.
        """
        self._rounds.append(1, time=time)
        self.looks.append(homes, self.num_rounds, furniture, coverage)
        self.sightings.fit(int(objects.max(initial=-1)) + 1)
        self.sightings.append(objects, self.num_rounds)
        self.type_sightings.append(type_keys, self.num_rounds)
        self.num_rounds += 1

    def add_questions(self, time: int, objects: np.ndarray) -> None:
        """Note which objects (n,) are asked for; those of the same step count once."""
        self.questions.fit(int(objects.max(initial=-1)) + 1)
        asked = self.questions.arrays
        rows = asked.newest[objects] - asked.first
        is_new = rows < 0
        is_new[~is_new] = asked.moment[rows[~is_new]] != time
        self.questions.append(objects[is_new], time)

    def fit(self, num_objects: int) -> None:
        """Make room for object rows 0..num_objects - 1."""
        self.sightings.fit(num_objects)
        self.questions.fit(num_objects)

    def find_cutoff(self, time: int) -> int | None:
        """Return up to what time the log should be dropped at `time`; None while it is short."""
        if max(self._rounds.num_rows, time - self.start) < self.max_length:
            return None
        kept = self.max_length // 2
        cutoff = time - kept
        if self._rounds.num_rows > kept:
            cutoff = max(cutoff, int(self.round_time[-kept - 1]))
        cutoff = min(cutoff, time - 1)  # what is asked in this step is not known yet
        return cutoff if cutoff > self.start else None

    def drop(self, cutoff: int) -> None:
        """Forget what happened up to a time."""
        num_dropped = self.count_rounds(cutoff) - self.first_round
        first_kept = self.first_round + num_dropped
        for chains in (self.looks, self.sightings, self.type_sightings):
            chains.drop(first_kept)
        self.questions.drop(cutoff + 1)
        times = self.round_time[num_dropped:].copy()
        self._rounds = Table({"time": np.int64})
        self._rounds.append(len(times), time=times)
        self.start = cutoff

    def count_rounds(self, time: int) -> int:
        """Return the number of rounds up to a time, those dropped as well."""
        return self.first_round + int(np.searchsorted(self.round_time, time, side="right"))
