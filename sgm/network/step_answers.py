"""What was answered in a time step, and what looks have shown since."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from sgm.arrays.grouped import mark_rows
from sgm.belief import compute_miss
from sgm.belief.corrections import CORRECTIONS
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.prior.place_prior import PlacePrior


class StepAnswers:
    """The answers of one time step, which negative looks change by Bayes' rule.

    Nothing moves within a step. So a look at a place that does not show a thing says of this step
    that it is not there, or was missed, and nothing else: the odds of the place are multiplied by
    the share of things that such a look misses (`sgm.belief.compute_miss`), those of all others
    stay. What was seen is no longer known here.

    Answers are of one memory, and hold for as long as every look at it is noted (`note_look`).
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Start without answers; the looks at the memory, which counts `history`, are noted."""
        self.memory = memory
        self._clear()

    def _clear(self) -> None:
        self._state = self._read_state()
        self._objects = np.zeros(0, dtype=np.int64)  # that were asked for, (n,)
        self._looked = np.zeros((self.memory.num_homes, self.memory.num_furniture))
        self._logits = np.zeros((0, self.memory.num_furniture))  # (n, F)

    def _read_state(self) -> tuple[int, int, int, PlacePrior]:
        """Return what differs after a step, a look, or a change of the furniture."""
        memory = self.memory
        num_looks = int(memory.furniture_num_observed.sum())
        return memory.time, num_looks, len(memory.edges), memory.place_prior

    def answer(self, queries: Queries, ask: Callable[[Queries], np.ndarray]) -> np.ndarray:
        """Return logits, (Q, F), of what is known, and of what `ask` says of the others."""
        if self._state != self._read_state():
            self._clear()
        row = np.full(len(self.memory.objects), -1)
        row[self._objects] = np.arange(len(self._objects))
        new = np.flatnonzero(row[queries.object] < 0)
        if len(new):
            objects, first = np.unique(queries.object[new], return_index=True)  # each once
            row[objects] = np.arange(len(objects)) + len(self._objects)
            self._objects = np.append(self._objects, objects)
            self._logits = np.concatenate([self._logits, ask(queries.take(new[first]))])
        return self._logits[row[queries.object]]

    def note_look(self, change: Change) -> None:
        """Use a look that the memory has just folded in."""
        memory = self.memory
        if self._state[0] != memory.time:
            self._clear()
            return
        seen = memory.edges["object"][change.edges[change.is_seen]]
        rest = ~mark_rows(seen, len(memory.objects))[self._objects]
        self._objects, self._logits = self._objects[rest], self._logits[rest]
        place, missed = np.full(memory.num_homes, -1), np.ones(memory.num_homes)
        place[change.home] = change.furniture
        before = self._looked[change.home, change.furniture]
        miss_rate = memory.history.compute_miss_rate()[change.home]
        repeated = CORRECTIONS.repeated_share
        missed[change.home] = compute_miss(before + change.coverage, miss_rate, repeated)
        missed[change.home] /= compute_miss(before, miss_rate, repeated)
        self._looked[change.home, change.furniture] += change.coverage
        home = memory.objects["home"][self._objects]
        rows = np.flatnonzero(place[home] >= 0)
        self._logits[rows, place[home[rows]]] += np.log(missed[home[rows]])
        self._state = self._read_state()
