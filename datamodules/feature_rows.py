"""What features are computed from: some nodes, edges or questions of snapshots."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from sgm.schema import NEVER, Columns

if TYPE_CHECKING:
    from simulator.snapshots.snapshots import Snapshots


@dataclass(frozen=True)
class NodeRows:
    """Nodes of one type.

    Attributes:
        snapshots: the snapshots.
        ntype: their type.
        rows: which of those of `Snapshots`, (n,).
    """

    snapshots: Snapshots
    ntype: Literal["furniture", "object"]
    rows: np.ndarray

    @property
    def _counters(self) -> Columns:
        is_furniture = self.ntype == "furniture"
        return self.snapshots.furniture if is_furniture else self.snapshots.objects

    @cached_property
    def snapshot(self) -> np.ndarray:
        """The snapshot of each, (n,)."""
        return self._counters["snapshot"][self.rows]

    @cached_property
    def time(self) -> np.ndarray:
        """Present time step of the snapshot of each, (n,)."""
        return self.snapshots.time[self.snapshot]

    def take(self, name: str) -> np.ndarray | int:
        """Return a counter, (n,), such as "num_observed"; 0 if nodes of the type have none."""
        counter = self._counters.get(name)
        return 0 if counter is None else counter[self.rows]

    def since(self, name: str) -> np.ndarray | int:
        """Return the steps since a time stamp; since the start for what has never happened.

        Of nodes whose type has no such stamp it is 0: furniture does not move.
        """
        stamp = self._counters.get(name)
        return 0 if stamp is None else _count_since(self.time, stamp[self.rows])

    def extra(self, name: str) -> np.ndarray:
        """Return what else was kept of furniture nodes, (n, ...); ValueError if nothing was."""
        return _find_extra(self.snapshots.extras, name)[self.rows]


@dataclass(frozen=True)
class LayoutRows:
    """Edges between house, floor, rooms and furniture: known, and without a history.

    Attributes:
        cosine: of the text vectors of each edge's two nodes, (n,).
        prior: probability of the furniture in its room; 1 for other edges, (n,).
    """

    cosine: np.ndarray
    prior: np.ndarray


@dataclass(frozen=True)
class EdgeRows:
    """Edges between objects and furniture.

    Attributes:
        snapshots: the snapshots.
        edge: which edge of `Snapshots` each is, -1 if it is hypothetical, (n,).
        furniture: row of its furniture node among those of `Snapshots`, (n,).
        is_on_top: its relation, bool (n,).
        cosine: of the text vectors of each edge's two nodes, (n,).
    """

    snapshots: Snapshots
    edge: np.ndarray
    furniture: np.ndarray
    is_on_top: np.ndarray
    cosine: np.ndarray

    @cached_property
    def snapshot(self) -> np.ndarray:
        """The snapshot of each, (n,)."""
        return self.snapshots.furniture["snapshot"][self.furniture]

    @cached_property
    def time(self) -> np.ndarray:
        """Present time step of the snapshot of each, (n,)."""
        return self.snapshots.time[self.snapshot]

    @property
    def prior(self) -> np.ndarray:
        """Prior weight, (n,)."""
        asked = self.snapshots.query_prior[self.furniture, self.is_on_top.astype(np.int64)]
        return np.where(self.edge < 0, asked, self._take(self.snapshots.edges["prior"], 0))

    def take(self, name: str, default: int = 0) -> np.ndarray:
        """Return a counter, (n,), such as "num_observed"; `default` of hypothetical edges."""
        return self._take(self.snapshots.edges[name], default)

    def _take(self, column: np.ndarray, default: int) -> np.ndarray:
        return np.append(column, column.dtype.type(default))[self.edge]  # -1 is the last

    def since(self, name: str) -> np.ndarray:
        """Return the steps since a time stamp; since the start for what has never happened."""
        return _count_since(self.time, self.take(name, NEVER))

    def extra(self, name: str) -> np.ndarray:
        """Return what else was kept of the furniture nodes, (n, ...); ValueError if nothing was."""
        return _find_extra(self.snapshots.extras, name)[self.furniture]

    def select(self, rows: np.ndarray) -> EdgeRows:
        """Return some of them."""
        columns = (self.edge, self.furniture, self.is_on_top, self.cosine)
        return EdgeRows(self.snapshots, *(column[rows] for column in columns))


@dataclass(frozen=True)
class QuestionRows:
    """The questions of snapshots, one each."""

    snapshots: Snapshots

    def extra(self, name: str) -> np.ndarray:
        """Return what else was kept of each question, (B, ...); ValueError if nothing was."""
        return _find_extra(self.snapshots.question_extras, name)


Rows = NodeRows | LayoutRows | EdgeRows | QuestionRows


def _find_extra(extras: Mapping[str, np.ndarray], name: str) -> np.ndarray:
    if name not in extras:
        raise ValueError(
            f"snapshots must hold {name} for `features.{name}`, got none. Collect with "
            f"`--{name} true`, or switch the feature off."
        )
    return extras[name]


def _count_since(time: np.ndarray, stamp: np.ndarray) -> np.ndarray:
    return np.where(stamp == NEVER, time, time - stamp)
