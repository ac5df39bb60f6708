"""Nodes that are one thing: told so, remembered apart, and read as one.

What looks show of each node is kept under its own name, so that a merge is undone by taking the
link away. Readers get a copy of the memory in which the nodes are one (`MemoryBatch.fuse`).
"""

from __future__ import annotations

import numpy as np

from sgm.arrays.table import Table, make_table
from sgm.memory.merged_rows import Groups, group_places, merge_rows
from sgm.schema import EDGES, OBJECTS


def find_roots(same_as: np.ndarray) -> np.ndarray:
    """Return the node that each stands for, itself where it was not merged, (O,) of (O,)."""
    roots = np.where(same_as >= 0, same_as, np.arange(len(same_as)))
    for _ in range(len(roots)):  # links lead to links where things were merged again and again
        further = roots[roots]
        if (further == roots).all():
            break
        roots = further
    return roots


def fuse_objects(objects: Table, roots: np.ndarray) -> None:
    """Let the nodes that stand for others, (O,), have what was counted of all of them."""
    kept, group = np.unique(roots, return_inverse=True)
    for name, values in merge_rows(OBJECTS, objects, Groups(group, kept)).items():
        objects[name][kept] = values


def fuse_edges(edges: Table, roots: np.ndarray) -> tuple[Table, Groups]:
    """Return the edges of nodes that are one, those at one place as one.

    A look there was one look for all of them, so that looks are not added up. The place was looked
    at as often as for the node with most looks. It was seen as often as all nodes together, and no
    more often than looked at.

    Args:
        edges: of all nodes.
        roots: the node that each stands for, (O,).

    Returns:
        The edges, without prior weights, and which of them became one.
    """
    columns = {**edges, "object": roots[edges["object"]]}
    groups = group_places(columns)
    joined = make_table(EDGES)
    joined.append(len(groups.kept), **merge_rows(EDGES, columns, groups, same_looks=True))
    return joined, groups


def split_counts(objects: Table, edges: Table, object_row: int, other: int) -> None:
    """Share what is counted of an object with another, which was split off with some edges.

    Where one of the two was never seen then, the other one has all.
    """
    is_seen = np.isin([object_row, other], edges["object"][edges["num_true"] > 0])
    if not is_seen.all():
        for column in OBJECTS if is_seen[1] else ():
            if column.splits:
                values = objects[column.name]
                values[other], values[object_row] = values[object_row], column.default
        return
    names = {column.name for column in EDGES}
    counted = [column for column in OBJECTS if column.splits in names]
    for column in OBJECTS:
        values = objects[column.name]
        if column.splits == "both":
            values[other] = values[object_row]
        elif column.splits == "one":
            values[other], values[object_row] = 1, max(int(values[object_row]) - 1, 1)
    for number in (object_row, other):
        true = np.flatnonzero((edges["object"] == number) & (edges["num_true"] > 0))
        seen = {column.name: edges[column.splits][true] for column in counted}
        together = Groups(np.zeros(len(true), dtype=np.int64), np.zeros(1, dtype=np.int64))
        for name, value in merge_rows(counted, seen, together).items():
            objects[name][number] = value[0]
