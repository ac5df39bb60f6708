"""Nodes that are one thing: told so, remembered apart, and read as one.

What looks show of each node is kept under its own name, so that a merge is undone by taking the
link away. Readers get a copy of the memory in which the nodes are one (`MemoryBatch.fuse`).
"""

from __future__ import annotations

import numpy as np

from sgm.arrays.table import Table, make_table
from sgm.schema import EDGES, NEVER, PlaceCode

_HIGHEST_COUNT = 2**16 - 1  # of `HomeHistory.edge_hours`


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
    for root in np.unique(roots[roots != np.arange(len(roots))]):
        group = np.flatnonzero(roots == root)
        own = {name: objects[name][group].copy() for name in objects}
        seen = own["first_observed"][own["first_observed"] != NEVER]
        for name in ("num_observed", "num_moved", "num_sought", "num_still"):
            objects[name][root] = own[name].sum()
        for name in ("last_observed", "last_moved", "num_at_once", "carried_since"):
            objects[name][root] = own[name].max()
        objects["first_observed"][root] = seen.min() if len(seen) else NEVER
        objects["last_furniture"][root] = own["last_furniture"][own["last_observed"].argmax()]


def fuse_edges(
    edges: Table, roots: np.ndarray, num_furniture: int, hours: np.ndarray | None
) -> tuple[Table, np.ndarray | None]:
    """Return the edges of nodes that are one, those at one place as one.

    A look there was one look for all of them, so that they are not added up: it was looked at as
    often as for the node that was looked for most often, and seen as often as all were together,
    but not more often.

    Args:
        edges: of all nodes.
        roots: the node that each stands for, (O,).
        num_furniture: F.
        hours: `HomeHistory.edge_hours` of the edges, (2, E, hours); None without any.

    Returns:
        The edges, without prior weights, and their hours.
    """
    owner = roots[edges["object"]]
    key = PlaceCode.of(owner * num_furniture + edges["furniture"], edges["relation"])
    _, first, group = np.unique(key, return_index=True, return_inverse=True)
    order = np.argsort(first)  # edges stay in the order in which they came up
    place = np.empty(len(order), dtype=np.int64)
    place[order] = np.arange(len(order))
    group, first = place[group], first[order]
    own = {column.name: edges[column.name].copy() for column in EDGES}
    new = {name: values[first] for name, values in own.items()}
    new["object"] = owner[first]
    latest = ("num_observed", "num_changed", "last_observed", "last_changed", "last_true",
              "is_true", "time_true")  # fmt: skip
    for name in latest:
        np.maximum.at(new[name], group, own[name])
    for name in ("num_absent", "missed"):
        np.minimum.at(new[name], group, own[name])
    is_latest = own["last_true"] == new["last_true"][group]
    new["confidence"] = np.zeros(len(first), dtype=np.float32)
    np.maximum.at(new["confidence"], group[is_latest], own["confidence"][is_latest])
    seen = np.bincount(group, own["num_true"], minlength=len(first)).astype(np.int64)
    new["num_true"] = np.minimum(seen, new["num_observed"])
    joined = make_table(EDGES)
    joined.append(len(first), **new)
    if hours is None:
        return joined, None
    summed = np.zeros((2, len(first), hours.shape[2]), dtype=np.int64)
    for which in range(2):
        np.add.at(summed[which], group, hours[which].astype(np.int64))
    return joined, np.minimum(summed, _HIGHEST_COUNT).astype(np.uint16)
