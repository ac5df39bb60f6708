"""Snapshots as one graph: nodes of all types in one row of ids, and what edges join."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sgm.schema import EDGE_TYPES, NODE_TYPES, QUERY_EDGE_TYPES, PlaceCode

if TYPE_CHECKING:
    from simulator.snapshots.snapshots import Snapshots


# The edge types that enter each node type: the columns of its `degrees`.
ENTERING = {
    ntype: tuple(etype for etype in EDGE_TYPES if etype[2] == ntype) for ntype in NODE_TYPES
}
MAX_ENTERING = 3
HOUSE, FLOOR, ROOM, FURNITURE, OBJECT = range(len(NODE_TYPES))
# The first of the edge types that join objects.
FIRST_OBJECT_TYPE = EDGE_TYPES.index(("furniture", "contains", "object"))
# The edge types that lead from an object up to furniture: the query edges are among them.
OBJECT_UP = slice(EDGE_TYPES.index(QUERY_EDGE_TYPES[0]), EDGE_TYPES.index(QUERY_EDGE_TYPES[1]) + 1)
# (whether the edge leads from the child to the parent, group of pairs) of each of `EDGE_TYPES`
_DIRECTIONS = (
    (False, 0), (True, 0), (False, 1), (True, 1), (False, 2), (True, 2), (False, 3), (True, 3),
    (True, 4), (False, 4),
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class SnapshotGraph:
    """B scene graph memories, with the hypothetical edges of their queries, as one graph.

    An edge joins each pair of a child and its parent in either direction. The P pairs lie in five
    groups: floor and house, room and floor, furniture and room, object "in" furniture, object
    "onTop" furniture. The nodes of a type lie snapshot by snapshot, and so do the pairs of a group,
    those remembered before the hypothetical ones.

    Attributes:
        first_node: first id of each of `NODE_TYPES` and, last, N: 6 of them.
        first_pair: first pair of each group and, last, P: 6 of them.
        label: label of every node, (N,).
        snapshot: the snapshot of every node, (N,).
        child, parent: node ids, (P,).
        remembered: edge of `Snapshots` of each pair of an object and furniture, -1 if it is
            hypothetical, (M,), M the pairs of the last two groups.
        furniture: furniture node among those of `Snapshots`, (M,).
        is_query: whether it is a query edge: its object is the snapshot's query object, bool (M,).
    """

    first_node: np.ndarray
    first_pair: np.ndarray
    label: np.ndarray
    snapshot: np.ndarray
    child: np.ndarray
    parent: np.ndarray
    remembered: np.ndarray
    furniture: np.ndarray
    is_query: np.ndarray

    @classmethod
    def from_snapshots(
        cls, snapshots: Snapshots, proposed: np.ndarray, one_each: bool = False
    ) -> SnapshotGraph:
        """Number the nodes of snapshots and list their pairs.

        Args:
            snapshots: the snapshots.
            proposed: places that the query object may be at, bool (NF, 2); a remembered one
                gets no hypothetical edge beside it.
            one_each: whether a furniture node has at most one query edge: of those remembered,
                "in" and "onTop", the one that was true more often.
        """
        own = np.arange(snapshots.num_snapshots)
        tables = snapshots.rooms, snapshots.furniture, snapshots.objects
        owners = [own, own, *(table["snapshot"] for table in tables)]
        house, floor = (np.full(len(own), snapshots.labels.index(name)) for name in NODE_TYPES[:2])
        first_node = np.cumsum([0, *map(len, owners)])
        _, floors, rooms, furniture, objects, _ = first_node.tolist()
        remembered, item, place, is_query, num_inside = _join_objects(snapshots, proposed, one_each)
        return cls(
            first_node=first_node,
            first_pair=np.cumsum(
                [0, *map(len, owners[1:OBJECT]), num_inside, len(item) - num_inside]
            ),
            label=np.concatenate([house, floor, *(table["label"] for table in tables)]),
            snapshot=np.concatenate(owners),
            child=np.concatenate([np.arange(floors, objects), objects + item]),
            parent=np.concatenate(
                [own, floors + owners[ROOM], rooms + snapshots.furniture["room"], furniture + place]
            ),
            remembered=remembered,
            furniture=place,
            is_query=is_query,
        )

    @property
    def num_layout(self) -> int:
        """Number of pairs of the layout; those with an object follow."""
        return len(self.child) - len(self.furniture)

    @property
    def is_on_top(self) -> np.ndarray:
        """Whether each object of a pair is on top, not in its furniture, bool (M,)."""
        return np.arange(self.num_layout, len(self.child)) >= self.first_pair[-2]

    def compute_degrees(self) -> np.ndarray:
        """Count the edges that enter each node, by edge type, float32 (N, 3).

        The columns of a node are the types of `ENTERING` for its own type, in their order.
        """
        degrees = np.zeros((len(self.label), MAX_ENTERING), dtype=np.float32)
        num_entering = [0] * len(NODE_TYPES)
        for (is_up, group), (_, _, ntype) in zip(_DIRECTIONS, EDGE_TYPES, strict=True):
            kind = NODE_TYPES.index(ntype)
            rows = slice(*self.first_pair[group : group + 2])
            start, end = self.first_node[kind : kind + 2]
            entered = (self.parent if is_up else self.child)[rows] - start
            degrees[start:end, num_entering[kind]] = np.bincount(entered, minlength=end - start)
            num_entering[kind] += 1
        return degrees

    def list_edges(
        self, num_hops: int | None = None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """List edges in the order of `EDGE_TYPES`, E of them, and the nodes that they leave.

        Args:
            num_hops: list what a model with so many convolutions can read: the query edges, and the
                edges that enter the `num_hops - 1`-hop in-neighbourhood of their ends. With no
                hops, the query edges alone, without those back to the object. None for all edges.

        Returns:
            Whether each node is kept, bool (N,); the pair of each edge and whether it leads to the
            parent, (E,); and the first edge of each type and, last, E, (11,).
        """
        keep = np.ones(len(self.label), dtype=bool)
        down = up = np.arange(len(self.child))
        if num_hops is not None:
            query = self.num_layout + np.flatnonzero(self.is_query)
            keep = np.zeros(len(self.label), dtype=bool)
            keep[self.child[query]] = keep[self.parent[query]] = True
            down, up = query[:0], query
            for _ in range(num_hops):
                up, down = np.flatnonzero(keep[self.parent]), np.flatnonzero(keep[self.child])
                keep[self.child[up]] = keep[self.parent[down]] = True
        ends = [np.searchsorted(pairs, self.first_pair).tolist() for pairs in (down, up)]
        parts = [
            (up if is_up else down)[slice(*ends[is_up][group : group + 2])]
            for is_up, group in _DIRECTIONS
        ]
        counts = [len(part) for part in parts]
        is_up = np.repeat([is_up for is_up, _ in _DIRECTIONS], counts)
        return keep, np.concatenate(parts), is_up, np.cumsum([0, *counts])


def _join_objects(
    snapshots: Snapshots, proposed: np.ndarray, one_each: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, int]:
    """List the pairs of objects and furniture, M of them, those inside before those on top.

    `remembered`, object node of `Snapshots`, `furniture`, `is_query`, (M,); how many are inside.
    """
    edges = snapshots.edges
    num_remembered = len(edges["object"])
    snapshot = edges["snapshot"]
    is_own = snapshots.query_object[snapshot] == edges["object"]
    places = PlaceCode.of(edges["furniture"], edges["relation"])
    is_hypothetical = proposed.ravel()
    is_hypothetical[places[is_own]] = False
    is_asked = is_own
    if one_each:
        own = np.flatnonzero(is_own)
        is_hypothetical.reshape(-1, 2)[edges["furniture"][own]] = False
        num_true = np.full(proposed.shape, -1)
        num_true.ravel()[places[own]] = edges["num_true"][own]
        best = num_true.argmax(axis=1)[edges["furniture"][own]]
        is_asked = is_own.copy()
        is_asked[own] = edges["relation"][own] == best
    furniture, relation = PlaceCode.split(np.flatnonzero(is_hypothetical))
    of_query = snapshots.furniture["snapshot"][furniture]
    # Two ascending runs, those remembered first: a merge.
    order = np.argsort(np.concatenate([snapshot, of_query]), kind="stable")
    is_on_top = np.concatenate([edges["relation"], relation])[order].astype(bool)
    order = np.concatenate([order[~is_on_top], order[is_on_top]])
    is_query = np.ones(len(order), dtype=bool)
    is_query[:num_remembered] = is_asked
    return (
        np.where(order < num_remembered, order, -1),
        np.concatenate([edges["object"], snapshots.query_object[of_query]])[order],
        np.concatenate([edges["furniture"], furniture])[order],
        is_query[order],
        len(order) - int(is_on_top.sum()),
    )
