"""Edges between objects and furniture: those remembered, and those that a query supposes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.snapshots.snapshots import Snapshots


@dataclass(frozen=True, slots=True)
class ObjectEdges:
    """Remembered edges and after them the hypothetical ones, M in all, of B snapshots.

    Attributes:
        snapshot: the snapshot of each edge, (M,).
        object: object node among those of `Snapshots`, (M,).
        furniture: furniture node among those of `Snapshots`, (M,).
        relation: 0 "in", 1 "onTop", (M,).
        is_query: whether it is a query edge: it leads from the snapshot's query object, bool (M,).
        num_remembered: how many of them are remembered.
    """

    snapshot: np.ndarray
    object: np.ndarray
    furniture: np.ndarray
    relation: np.ndarray
    is_query: np.ndarray
    num_remembered: int

    @classmethod
    def from_snapshots(
        cls, snapshots: Snapshots, proposed: np.ndarray, one_each: bool = False
    ) -> ObjectEdges:
        """List the edges of snapshots.

        Args:
            snapshots: the snapshots.
            proposed: places that the query object may be at, bool (NF, 2); a remembered one
                gets no hypothetical edge beside it.
            one_each: whether a furniture node has at most one query edge: of those remembered,
                "in" and "onTop", the one that was true more often.
        """
        remembered = snapshots.object_snapshot[snapshots.edge_object]
        is_own = snapshots.query_object[remembered] == snapshots.edge_object
        places = snapshots.edge_furniture * 2 + snapshots.edge_relation
        is_hypothetical = proposed.ravel()
        is_hypothetical[places[is_own]] = False
        is_asked = is_own
        if one_each:
            own = np.flatnonzero(is_own)
            is_hypothetical.reshape(-1, 2)[snapshots.edge_furniture[own]] = False
            num_true = np.full(proposed.shape, -1)
            num_true.ravel()[places[own]] = snapshots.edge_num_true[own]
            best = num_true.argmax(axis=1)[snapshots.edge_furniture[own]]
            is_asked = is_own.copy()
            is_asked[own] = snapshots.edge_relation[own] == best
        furniture, relation = np.divmod(np.flatnonzero(is_hypothetical), 2)
        snapshot = snapshots.furniture_snapshot[furniture]
        is_query = np.ones(len(is_own) + len(furniture), dtype=bool)
        is_query[: len(is_own)] = is_asked
        return cls(
            snapshot=np.concatenate([remembered, snapshot]),
            object=np.concatenate([snapshots.edge_object, snapshots.query_object[snapshot]]),
            furniture=np.concatenate([snapshots.edge_furniture, furniture]),
            relation=np.concatenate([snapshots.edge_relation, relation]),
            is_query=is_query,
            num_remembered=len(is_own),
        )
