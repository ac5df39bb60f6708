"""The events of many homes as they happen, and the latest ones of every node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

MESSAGE_DIM = 4  # is_seen, is on top, coverage, confidence
NUM_KEPT = 32  # latest events of a node that are kept


@dataclass(frozen=True, slots=True)
class NewEvents:
    """Events of one look in each of some homes, in their order.

    Attributes:
        home: (n,).
        thing: row of the memory's objects, (n,).
        furniture: index in its home, (n,).
        relation: by number in `RELATIONS`, (n,).
        is_seen: bool (n,).
        coverage, confidence: (n,).
    """

    home: np.ndarray
    thing: np.ndarray
    furniture: np.ndarray
    relation: np.ndarray
    is_seen: np.ndarray
    coverage: np.ndarray
    confidence: np.ndarray

    def take(self, chosen: np.ndarray) -> NewEvents:
        """Return some of them."""
        columns = (getattr(self, name)[chosen] for name in self.__slots__)
        return NewEvents(*columns)


@dataclass(frozen=True, slots=True)
class StreamQuestions:
    """Q questions, each with all places of its home as candidates.

    Attributes:
        home: (Q,).
        thing: row of the memory's objects, (Q,).
        prior: prior weight of each place, relations added up, float32 (Q, F).
        is_place: which columns are places of the home, bool (Q, F).
        time: time step, one for all.
    """

    home: np.ndarray
    thing: np.ndarray
    prior: np.ndarray
    is_place: np.ndarray
    time: int


@dataclass(frozen=True, slots=True)
class PairNodes:
    """P pairs of a thing and a place of its home, without the columns that are no place.

    Attributes:
        things: node of each question's thing, (Q,).
        query, column: question and column of each pair, (P,).
        places: node of each pair's place, (P,).
        shape: (Q, F).
    """

    things: np.ndarray
    query: np.ndarray
    column: np.ndarray
    places: np.ndarray
    shape: tuple[int, ...]

    def spread(self, values: Tensor) -> Tensor:
        """Return what belongs to pairs, (P, ...), in the shape of questions, (Q, F, ...).

        Zeros stand in the columns that are no place.
        """
        if len(values) == self.shape[0] * self.shape[1]:
            return values.reshape(*self.shape, *values.shape[1:])
        rows = torch.from_numpy(self.query * self.shape[1] + self.column)
        empty = values.new_zeros(self.shape[0] * self.shape[1], *values.shape[1:])
        return empty.index_copy(0, rows, values).reshape(*self.shape, *values.shape[1:])


class EventStream:
    """Events of H homes so far. Places are the first H x F nodes, things follow by their rows.

    Attributes:
        num_homes, num_places: H and F.
        node_label: index of its label, of every known node, (N,).
        node_number: number of a node in its home, by which its random features are found: of places
            from 0 on, of things from -1 down, so that no other home's size shows, (N,).
        src, dst, time: things, places and time steps of events, (E,).
        message: `MESSAGE_DIM` columns of events, float32 (E, 4).
    """

    def __init__(self, furniture_label: np.ndarray, sightings_alone: bool) -> None:
        """Start without events.

        Args:
            furniture_label: label of every place, -1 for none, (H, F).
            sightings_alone: whether to drop that things were not seen.
        """
        self.num_homes, self.num_places = furniture_label.shape
        self.sightings_alone = sightings_alone
        self._num_things = np.zeros(self.num_homes, dtype=np.int64)
        self.node_label = np.maximum(furniture_label, 0).ravel().astype(np.int64)
        self.node_number = np.tile(np.arange(self.num_places), self.num_homes)
        self._ids = np.zeros((3, 1024), dtype=np.int64)
        self._message = np.zeros((1024, MESSAGE_DIM), dtype=np.float32)
        self._show(0)
        self._latest = np.full((len(self.node_label), NUM_KEPT), -1, dtype=np.int64)

    @property
    def num_nodes(self) -> int:
        """Known nodes, N."""
        return len(self.node_label)

    def know_things(self, home: np.ndarray, label: np.ndarray) -> None:
        """Take note of new things; rows of all that are known, home and label of each, (O,)."""
        first = self.num_nodes - self.num_homes * self.num_places
        if len(home) <= first:
            return
        home, label = home[first:], label[first:]
        order = np.argsort(home, kind="stable")
        number = np.empty(len(home), dtype=np.int64)
        in_group = np.arange(len(home)) - np.searchsorted(home[order], home[order])
        number[order] = self._num_things[home[order]] + in_group
        self._num_things += np.bincount(home, minlength=self.num_homes)
        self.node_label = np.concatenate([self.node_label, label.astype(np.int64)])
        self.node_number = np.concatenate([self.node_number, -1 - number])
        empty = np.full((len(home), NUM_KEPT), -1, dtype=np.int64)
        self._latest = np.concatenate([self._latest, empty])

    def find_things(self, rows: np.ndarray) -> np.ndarray:
        """Return the nodes of things by their rows."""
        return self.num_homes * self.num_places + rows.astype(np.int64)

    def find_places(self, home: np.ndarray) -> np.ndarray:
        """Return the nodes of all places of homes (Q,), one row each, (Q, F)."""
        return home[:, None].astype(np.int64) * self.num_places + np.arange(self.num_places)

    def find_pairs(self, asked: StreamQuestions) -> PairNodes:
        """Return the nodes of questions, and of the places that their homes have."""
        query, column = np.nonzero(asked.is_place)
        return PairNodes(
            self.find_things(asked.thing),
            query,
            column,
            self.find_places(asked.home)[query, column],
            asked.is_place.shape,
        )

    def append(self, new: NewEvents, time: int) -> np.ndarray:
        """Add events; returns their numbers, of those that are not dropped, (n,)."""
        if self.sightings_alone:
            new = new.take(np.flatnonzero(new.is_seen))
        numbers = len(self.time) + np.arange(len(new.home))
        size = len(self.time) + len(numbers)
        while size > len(self._message):
            self._ids = np.concatenate([self._ids, np.zeros_like(self._ids)], axis=1)
            self._message = np.concatenate([self._message, np.zeros_like(self._message)])
        things = self.find_things(new.thing)
        places = new.home.astype(np.int64) * self.num_places + new.furniture
        self._ids[:, numbers] = things, places, np.full(len(numbers), time)
        columns = [new.is_seen, new.relation, new.coverage, new.confidence]
        self._message[numbers] = np.column_stack(columns)
        self._show(size)
        self._note_latest(things, numbers)
        self._note_latest(places, numbers)
        return numbers

    def _show(self, size: int) -> None:
        self.src, self.dst, self.time = self._ids[:, :size]
        self.message = self._message[:size]

    def find_latest(self, nodes: np.ndarray, count: int) -> np.ndarray:
        """Return the numbers of the latest K events of nodes, the last one last, -1 for none.

        (n,) or (n, m) -> (n, K) or (n, m, K), with K at most `NUM_KEPT`.
        """
        return self._latest[nodes][..., NUM_KEPT - count :]

    def find_other_ends(self, nodes: np.ndarray, events: np.ndarray) -> np.ndarray:
        """Return the other end of events of nodes, (n,) and (n,), or of lists, (n, 1) and (n, K).

        Of -1, for no event, it is any node.
        """
        if not len(self.time):
            return np.zeros_like(events)
        is_thing = nodes >= self.num_homes * self.num_places
        return np.where(is_thing, self.dst[events], self.src[events])

    def _note_latest(self, nodes: np.ndarray, numbers: np.ndarray) -> None:
        order = np.argsort(nodes, kind="stable")
        nodes, numbers = nodes[order], numbers[order]
        names, first, counts = np.unique(nodes, return_index=True, return_counts=True)
        kept = np.minimum(counts, NUM_KEPT)
        end = first + counts
        for size in np.unique(kept):
            group = np.flatnonzero(kept == size)
            rows = end[group, None] - size + np.arange(size)
            old = self._latest[names[group], size:]
            self._latest[names[group]] = np.concatenate([old, numbers[rows]], axis=1)
