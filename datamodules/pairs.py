"""All nodes of a batch of snapshots and all pairs of them that edges join."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from datamodules.batch import EDGE_TYPES, MAX_ENTERING, NODE_TYPES
from datamodules.object_edges import ObjectEdges
from simulator.snapshots.snapshots import Snapshots

# (whether the edge leads from the child to the parent, group of pairs) of each of `EDGE_TYPES`
DIRECTIONS = (
    (False, 0), (True, 0), (False, 1), (True, 1), (False, 2), (True, 2), (False, 3), (True, 3),
    (True, 4), (False, 4),
)  # fmt: skip
# The first edge type that joins objects.
FIRST_OBJECT_TYPE = 6
# The edge types that lead from an object up to furniture: the query edges are among them.
OBJECT_UP = slice(7, 9)


@dataclass(frozen=True, slots=True)
class Pairs:
    """Nodes of all types in one row of ids, and P pairs of a child and its parent.

    An edge joins each pair in either direction, so both are in one graph or neither. Pairs lie in
    five groups: floor and house, room and floor, furniture and room, object "in" furniture,
    object "onTop" furniture. The nodes of a type lie snapshot by snapshot, and so do the pairs of a
    group, those remembered before the hypothetical ones.

    Attributes:
        first_node: first id of each of `NODE_TYPES` and, last, N: 6 of them.
        first_pair: first pair of each group and, last, P: 6 of them.
        label: label of every node, (N,).
        snapshot: the snapshot of every node, (N,).
        child, parent: node ids, (P,).
        object_edge: number among `ObjectEdges` of each pair of the last two groups, (M,).
    """

    first_node: np.ndarray
    first_pair: np.ndarray
    label: np.ndarray
    snapshot: np.ndarray
    child: np.ndarray
    parent: np.ndarray
    object_edge: np.ndarray

    @classmethod
    def from_snapshots(cls, snapshots: Snapshots, edges: ObjectEdges) -> Pairs:
        """Number the nodes of snapshots and list their pairs."""
        batch, num_rooms = snapshots.num_snapshots, len(snapshots.room_label)
        house, floor = (snapshots.labels.index(label) for label in ("house", "floor"))
        layout_counts = [batch, batch, num_rooms, len(snapshots.furniture_label)]
        first_node = np.cumsum([0, *layout_counts, len(snapshots.object_label)])
        _, floors, rooms, furniture, objects, _ = first_node.tolist()
        snapshot, room_snapshot = np.arange(batch), snapshots.room_snapshot
        order = np.argsort(edges.snapshot, kind="stable")  # two ascending runs: a merge
        is_on_top = edges.relation[order].astype(bool)
        inside, on_top = order[~is_on_top], order[is_on_top]
        object_edge = np.concatenate([inside, on_top])
        return cls(
            first_node=first_node,
            first_pair=np.cumsum([0, *layout_counts[1:], len(inside), len(on_top)]),
            label=np.concatenate(
                [
                    np.full(batch, house),
                    np.full(batch, floor),
                    snapshots.room_label,
                    snapshots.furniture_label,
                    snapshots.object_label,
                ]
            ),
            snapshot=np.concatenate(
                [
                    snapshot,
                    snapshot,
                    room_snapshot,
                    snapshots.furniture_snapshot,
                    snapshots.object_snapshot,
                ]
            ),
            child=np.concatenate([np.arange(floors, objects), objects + edges.object[object_edge]]),
            parent=np.concatenate(
                [
                    snapshot,
                    floors + room_snapshot,
                    rooms + snapshots.furniture_room,
                    furniture + edges.furniture[object_edge],
                ]
            ),
            object_edge=object_edge,
        )

    @property
    def num_nodes(self) -> int:
        """N."""
        return len(self.label)

    @property
    def num_layout(self) -> int:
        """Number of pairs of the layout; those with an object follow."""
        return len(self.child) - len(self.object_edge)

    def compute_degrees(self) -> np.ndarray:
        """Count the edges that enter each node, by edge type, float32 (N, 3).

        The columns of a node are the types of `ENTERING` for its own type, in their order.
        """
        degrees = np.zeros((self.num_nodes, MAX_ENTERING), dtype=np.float32)
        num_entering = [0] * len(NODE_TYPES)
        for (is_up, group), (_, _, ntype) in zip(DIRECTIONS, EDGE_TYPES, strict=True):
            kind = NODE_TYPES.index(ntype)
            rows = slice(*self.first_pair[group : group + 2])
            start, end = self.first_node[kind : kind + 2]
            entered = (self.parent if is_up else self.child)[rows] - start
            degrees[start:end, num_entering[kind]] = np.bincount(entered, minlength=end - start)
            num_entering[kind] += 1
        return degrees

    def keep_all(self) -> Kept:
        """Keep every edge."""
        rows = np.arange(len(self.child))
        return Kept(np.ones(self.num_nodes, dtype=bool), rows, rows)

    def keep_hops(self, edges: ObjectEdges, num_hops: int) -> Kept:
        """Keep what a model with so many convolutions can read.

        The query edges and the edges that enter the `num_hops - 1`-hop in-neighbourhood of their
        ends. With no hops, the query edges alone, without those back to the object.
        """
        query = self.num_layout + np.flatnonzero(edges.is_query[self.object_edge])
        keep = np.zeros(self.num_nodes, dtype=bool)
        keep[self.child[query]] = keep[self.parent[query]] = True
        up, down = query, query[:0]
        for _ in range(num_hops):
            up, down = np.flatnonzero(keep[self.parent]), np.flatnonzero(keep[self.child])
            keep[self.child[up]] = keep[self.parent[down]] = True
        return Kept(keep, up, down)

    def list_edges(self, kept: Kept) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """List edges in the order of `EDGE_TYPES`, E of them.

        Returns:
            Source and destination nodes (E,), the pair of each edge (E,), and the first edge of
            each type and, last, E, (11,).
        """
        rows = (kept.down, kept.up)
        ends = [np.searchsorted(part, self.first_pair).tolist() for part in rows]
        parts = [rows[is_up][slice(*ends[is_up][group : group + 2])] for is_up, group in DIRECTIONS]
        counts = [len(part) for part in parts]
        pair = np.concatenate(parts)
        is_up = np.repeat([is_up for is_up, _ in DIRECTIONS], counts)
        child, parent = self.child[pair], self.parent[pair]
        src, dst = np.where(is_up, child, parent), np.where(is_up, parent, child)
        return src, dst, pair, np.cumsum([0, *counts])


@dataclass(frozen=True, slots=True)
class Kept:
    """Which part of the graph is built.

    Attributes:
        nodes: bool (N,).
        up, down: pairs whose edge to the parent, and to the child, is built, ascending.
    """

    nodes: np.ndarray
    up: np.ndarray
    down: np.ndarray
