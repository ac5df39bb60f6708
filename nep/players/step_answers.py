"""What was answered in a time step, and what looks have shown since."""

from __future__ import annotations

import numpy as np

from simulator.memory.change import Change
from simulator.memory.memory_batch import MemoryBatch
from simulator.memory.place_prior import PlacePrior
from simulator.memory.queries import Queries


class StepAnswers:
    """The answers of one time step, which looks in vain change as Bayes' rule says.

    Nothing moves within a step. So a look at a place that does not show a thing says of this step
    that it is not there, or was missed, and nothing else: the odds of the place are multiplied by
    the share of things that such a look misses, those of all others stay. What was seen is no
    longer known here.

    Answers are of one memory, and hold for as long as every look at it is told (`note_look`).
    """

    def __init__(self, memory: MemoryBatch) -> None:
        """Start without answers.

        Args:
            memory: whose looks are told; it counts `history`.
        """
        self.memory = memory
        self._clear()

    def _clear(self) -> None:
        memory = self.memory
        self._state = self._read_state()
        self._objects = np.zeros(0, dtype=np.int64)  # (n,)
        self._homes = np.zeros(0, dtype=np.int64)  # (n,)
        self._logits = np.zeros((0, memory.num_furniture))  # (n, F)

    def _read_state(self) -> tuple[int, int, int, PlacePrior]:
        """Return what differs after a step, a look, or a change of the furniture."""
        memory = self.memory
        num_looks = int(memory.furniture_num_observed.sum())
        return memory.time, num_looks, len(memory.edges), memory.place_prior

    def find(self, queries: Queries) -> np.ndarray:
        """Return the number of the answer to each query, -1 where there is none, (Q,)."""
        if self._state != self._read_state():
            self._clear()
        row = np.full(len(self.memory.objects), -1)
        row[self._objects] = np.arange(len(self._objects))
        return row[queries.object]

    def get(self, rows: np.ndarray) -> np.ndarray:
        """Return the logits of answers, (n,) -> (n, F)."""
        return self._logits[rows]

    def add(self, queries: Queries, logits: np.ndarray) -> None:
        """Keep answers, (Q, F), to what has none."""
        objects, first = np.unique(queries.object, return_index=True)
        self._objects = np.append(self._objects, objects)
        self._homes = np.append(self._homes, queries.home[first])
        self._logits = np.concatenate([self._logits, logits[first]])

    def note_look(self, change: Change) -> None:
        """Heed a look that the memory has just folded in."""
        memory = self.memory
        if self._state[0] != memory.time or len(self._objects) == 0:
            self._clear()
            return
        seen = np.zeros(len(memory.objects), dtype=bool)
        seen[memory.edges["object"][change.edges[change.is_seen]]] = True
        rest = ~seen[self._objects]
        self._objects, self._homes = self._objects[rest], self._homes[rest]
        self._logits = self._logits[rest]
        place, missed = np.full(memory.num_homes, -1), np.ones(memory.num_homes)
        place[change.home] = change.furniture
        miss_rate = memory.history.compute_miss_rate()[change.home]
        missed[change.home] = 1 - change.coverage * (1 - miss_rate)
        rows = np.flatnonzero(place[self._homes] >= 0)
        homes = self._homes[rows]
        self._logits[rows, place[homes]] += np.log(missed[homes])
        self._state = self._read_state()
