"""Snapshots as one graph: nodes of all types in one row of ids, and the pairs that edges join."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.schema import (
    EDGE_TYPES,
    LAYOUT_EDGE_TYPES,
    LAYOUT_PAIRS,
    NODE_TYPES,
    NUM_RELATIONS,
    OPPOSITES,
    QUERY_EDGE_TYPES,
    RELATIONS,
    Columns,
    PlaceCode,
)
from simulator.snapshots.snapshots import Selection, Snapshots
from simulator.snapshots.type_numbers import FURNITURE, MAX_ENTERING, OBJECT

_NUM_LAYOUT_PAIRS = len(LAYOUT_PAIRS)


def _find_direction(etype: tuple[str, str, str]) -> tuple[bool, int]:
    """Tell of an edge type whether it leads from child to parent, and its group of pairs."""
    source, relation, target = etype
    if etype in LAYOUT_EDGE_TYPES:
        is_up = (source, target) in LAYOUT_PAIRS
        return is_up, LAYOUT_PAIRS.index((source, target) if is_up else (target, source))
    of_object = [name for name in RELATIONS if relation in (name, OPPOSITES[name])]
    return etype in QUERY_EDGE_TYPES, _NUM_LAYOUT_PAIRS + RELATIONS.index(of_object[0])


_DIRECTIONS = tuple(map(_find_direction, EDGE_TYPES))


def join_nodes(snapshots: Snapshots) -> tuple[Columns, np.ndarray]:
    """Number the nodes of all types, which lie type by type and snapshot by snapshot.

    Returns:
        `label` and `snapshot` of every node, (N,); and the first id of each of `NODE_TYPES` and,
        last, N.
    """
    tables = [snapshots.get_nodes(ntype) for ntype in NODE_TYPES]
    nodes = {
        name: np.concatenate([table[name] for table in tables]) for name in ("label", "snapshot")
    }
    return nodes, np.cumsum([0, *(len(table["label"]) for table in tables)])


def propose_edges(snapshots: Snapshots, proposed: np.ndarray, one_each: bool = False) -> Selection:
    """Select the remembered edges and, with row -1, the hypothetical ones of the queries.

    They lie relation by relation, and those of one snapshot by snapshot, remembered ones first.
    `is_query` says of each whether it is a query edge: its object is the snapshot's query object.

    Args:
        snapshots: the snapshots.
        proposed: places that the query object may be at, bool (NF, relations); a remembered one
            gets no hypothetical edge beside it.
        one_each: whether a furniture node has at most one query edge: of those remembered, the
            one that was true more often.
    """
    edges = snapshots.edges
    is_asked = snapshots.query_object[edges["snapshot"]] == edges["object"]
    place = PlaceCode.of(edges["furniture"], edges["relation"])
    is_hypothetical = proposed.ravel()
    is_hypothetical[place[is_asked]] = False
    if one_each:
        asked = np.flatnonzero(is_asked)
        furniture = edges["furniture"][asked]
        is_hypothetical.reshape(proposed.shape)[furniture] = False
        num_true = np.full(proposed.shape, -1)
        num_true.ravel()[place[asked]] = edges["num_true"][asked]
        best = num_true.argmax(axis=1)[furniture]
        is_asked[asked] = edges["relation"][asked] == best
    furniture, relation = PlaceCode.split(np.flatnonzero(is_hypothetical))
    snapshot = snapshots.furniture["snapshot"][furniture]
    hypothetical = {
        "snapshot": snapshot,
        "object": snapshots.query_object[snapshot],
        "furniture": furniture,
        "relation": relation,
        "prior": snapshots.query_prior[furniture, relation],
    }
    columns = {name: np.concatenate([edges[name], new]) for name, new in hypothetical.items()}
    # Two ascending runs, those remembered first: a merge.
    order = np.argsort(columns["snapshot"], kind="stable")
    relation = columns["relation"][order]
    order = np.concatenate([order[relation == number] for number in range(NUM_RELATIONS)])
    columns["is_query"] = np.append(is_asked, np.ones(len(furniture), dtype=bool))
    return snapshots.select(
        "edges",
        np.where(order < len(is_asked), order, -1),
        **{name: column[order] for name, column in columns.items()},
    )


class Pairs(NamedTuple):
    """The P pairs of a child and its parent, which an edge joins in either direction.

    They lie in groups: those of `LAYOUT_PAIRS`, and object and furniture, one for each of
    `RELATIONS`; those of a group snapshot by snapshot.

    Attributes:
        first_node: first id of each of `NODE_TYPES` and, last, N.
        first: first pair of each group and, last, P.
        child, parent: node ids, (P,).
    """

    first_node: np.ndarray
    first: np.ndarray
    child: np.ndarray
    parent: np.ndarray

    @classmethod
    def list(cls, snapshots: Snapshots, edges: Selection, first_node: np.ndarray) -> Pairs:
        """List them, those of objects as `propose_edges` has them; `join_nodes` numbers nodes."""
        num_of_relation = np.bincount(edges["relation"], minlength=NUM_RELATIONS)
        of_layout = [snapshots.list_held(*pair) for pair in LAYOUT_PAIRS]
        ends = [*map(NODE_TYPES.index, sum(LAYOUT_PAIRS, ())), OBJECT, FURNITURE]
        rows = [*(row for pair in of_layout for row in pair), edges["object"], edges["furniture"]]
        nodes = [first_node[ntype] + row for ntype, row in zip(ends, rows, strict=True)]
        return cls(
            first_node=first_node,
            first=np.cumsum([0, *(len(child) for child, _ in of_layout), *num_of_relation]),
            child=np.concatenate(nodes[::2]),
            parent=np.concatenate(nodes[1::2]),
        )

    @property
    def num_layout(self) -> int:
        """Number of pairs of the layout; those that looks update follow."""
        return int(self.first[_NUM_LAYOUT_PAIRS])

    @property
    def of_furniture(self) -> slice:
        """The pairs of furniture and its room, which lie as the furniture of the snapshots."""
        group = LAYOUT_PAIRS.index(("furniture", "room"))
        return slice(*self.first[group : group + 2].tolist())

    def compute_degrees(self) -> np.ndarray:
        """Count the edges that enter each node, by edge type, float32 (N, `MAX_ENTERING`).

        The columns of a node are the types of `ENTERING` for its own type, in their order.
        """
        degrees = np.zeros((self.first_node[-1], MAX_ENTERING), dtype=np.float32)
        num_entering = [0] * len(NODE_TYPES)
        for (is_up, group), (_, _, ntype) in zip(_DIRECTIONS, EDGE_TYPES, strict=True):
            node_type = NODE_TYPES.index(ntype)
            rows = slice(*self.first[group : group + 2])
            start, end = self.first_node[node_type : node_type + 2]
            entered = (self.parent if is_up else self.child)[rows] - start
            degrees[start:end, num_entering[node_type]] = np.bincount(
                entered, minlength=end - start
            )
            num_entering[node_type] += 1
        return degrees

    def list_edges(
        self, down: np.ndarray, up: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """List edges in the order of `EDGE_TYPES`, E of them.

        Args:
            down: pairs of which there is an edge to the child, ascending.
            up: pairs of which there is one to the parent, ascending.

        Returns:
            The pair of each edge and whether it leads to the parent, (E,); and the first edge of
            each type and, last, E.
        """
        ends = [np.searchsorted(pairs, self.first).tolist() for pairs in (down, up)]
        parts = [
            (up if is_up else down)[slice(*ends[is_up][group : group + 2])]
            for is_up, group in _DIRECTIONS
        ]
        counts = [len(part) for part in parts]
        is_up = np.repeat([is_up for is_up, _ in _DIRECTIONS], counts)
        return np.concatenate(parts), is_up, np.cumsum([0, *counts])
