"""Ways that things go: to which places they were moved from where this one was seen last."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sgm.arrays.rows import add_in_order, sum_equal
from sgm.evidence.question import Question
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_LEAST = 0.02  # of a share times the number of places, in logarithms


class Ways(NamedTuple):
    """Moves from the place where each of Q things was last seen; zeros for what never was.

    Attributes:
        own: whether the thing itself came to a place from there, the last time it did, (Q, F).
        alike: how many other things did, weighted by how much their names are alike, (Q, F).
        labels: moves between furniture of the same labels as that place and each, (Q, F).
    """

    own: np.ndarray
    alike: np.ndarray
    labels: np.ndarray

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries, likeness: np.ndarray) -> Ways:
        """Gather the ways of the homes that are asked; `likeness` is that of `compare_names`."""
        own, alike = _count_arrivals(memory, queries, likeness)
        return cls(own=own, alike=alike, labels=_count_by_label(memory, queries))


def compute_ways(asked: Question) -> dict[str, np.ndarray]:
    """To which places things were moved from where this one was seen last."""
    ways = Ways.gather(asked.memory, asked.queries, asked.likeness)
    columns = {"own": ways.own}
    for name, counts in (("alike", ways.alike), ("label", ways.labels)):
        share = counts / np.maximum(add_in_order(counts), 1)
        columns[name] = share
        columns[f"log_{name}"] = np.log(share * asked.arrays.num_places[:, None] + _LEAST)
    return columns


def _count_arrivals(
    memory: MemoryBatch, queries: Queries, likeness: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return `own` and `alike` of `Ways`."""
    objects, edges = memory.objects, memory.edges
    num_queries, num_places = len(queries.home), memory.num_furniture
    own = np.zeros((num_queries, num_places))
    alike = np.zeros((num_queries, num_places))
    rows = np.flatnonzero(edges["came_from"] >= 0)
    if not len(rows):
        return own, alike
    last = objects["last_furniture"][queries.object]
    # Edges by the place that a thing came from, and questions by that where it was last seen.
    key = edges["home"][rows].astype(np.int64) * num_places + edges["came_from"][rows]
    order = np.argsort(key, kind="stable")
    rows, key = rows[order], key[order]
    wanted = np.where(last >= 0, queries.home.astype(np.int64) * num_places + last, -1)
    first, end = np.searchsorted(key, wanted), np.searchsorted(key, wanted, side="right")
    count = end - first
    query = np.repeat(np.arange(num_queries), count)
    within = np.arange(len(query)) - np.repeat(np.cumsum(count) - count, count)
    edge = rows[np.repeat(first, count) + within]
    place, thing = edges["furniture"][edge], edges["object"][edge]
    is_own = thing == queries.object[query]
    own[query[is_own], place[is_own]] = 1
    weight = likeness[query, objects["label"][thing]] * ~is_own
    np.add.at(alike, (query, place), weight)
    return own, alike


def _count_by_label(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return `labels` of `Ways`."""
    history, label = memory.history, memory.furniture_label  # (H, F)
    last = memory.objects["last_furniture"][queries.object]
    home = queries.home
    if not history.counts_moves:
        return np.zeros((len(home), memory.num_furniture))
    own_label = label[home, np.maximum(last, 0)]
    is_from = (label[home] == own_label[:, None]) & (last >= 0)[:, None]  # (Q, F)
    moves = history.moves[home] if memory.num_homes > 1 else history.moves[0]  # (Q, F, F) or (F, F)
    onward = np.matmul(is_from[:, None].astype(float), moves)[:, 0]  # (Q, F), whole numbers
    return sum_equal(label[home], onward)
