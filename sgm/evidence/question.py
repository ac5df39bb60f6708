"""All that is gathered once for a question, and read by its features."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sgm.arrays.grouped import compute_starts
from sgm.evidence.adaptive_filter import (
    TASKS_ASK_MOVED,
    FilterSettings,
    Rates,
    compute_beliefs,
    compute_destinations,
)
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts, compute_hours_per_step
from sgm.kernel import kernel
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.text.vectors import compare

# Filters that the features show, by name; the network weighs them.
FILTERS = {
    "anywhere": FilterSettings(crossing=1.0),
    "in_room": FilterSettings(crossing=0.0),
    "learnt": FilterSettings(),
    "slow": FilterSettings(rate=0.02, crossing=1.0),
    "fast": FilterSettings(rate=0.15, crossing=1.0),
    "moved": FilterSettings(asks_moved=None),
    "moved_in_room": FilterSettings(asks_moved=None, crossing=0.0),
    "asked": FilterSettings(asks_moved=TASKS_ASK_MOVED),
    "left": FilterSettings(counts_left=True),
    "left_asked": FilterSettings(counts_left=True, asks_moved=TASKS_ASK_MOVED),
}
ASKED = list(FILTERS).index("asked")
_WIDTH = 0.1  # of cosines by which the names of two things are alike
_LATELY = 10  # times as fast as a sighting of a companion, one out of place loses its weight
_ALIKE = 0.3  # cosine of the sightings by place from which an object counts as a companion


@dataclass(frozen=True, slots=True)
class Question:
    """Q questions at F furniture nodes; arrays are zero where a home has no furniture node.

    Attributes:
        memory: the memory that is asked.
        queries: what is asked.
        is_place: which columns are furniture, bool (Q, F).
        num_places: furniture nodes of the home, (Q, 1).
        counts: sightings by place.
        rates: how objects move.
        asks_moved: share of the questions that are about what has just moved.
        goes: where it goes when it moves, (Q, F).
        belief: of each of `FILTERS`, float64 (Q, K, F + 1), the last place is elsewhere.
        hours: length of a time step, (Q, 1).
        expected: where it is expected before it is seen.
        last: where it was last seen, -1 for never, (Q,).
        num_seen: its sightings, (Q, 1).
        room: of each furniture node, -1 beyond, (Q, F).
        num_known: how many objects were ever seen, (Q, 1).
        sums: over all objects and edges.
        same, fresh, often, similar, strays: from `_gather_others`, (Q, F).
        most_similar: likewise, (Q,).
    """

    memory: MemoryBatch
    queries: Queries
    is_place: np.ndarray
    num_places: np.ndarray
    counts: ObjectCounts
    rates: Rates
    asks_moved: float
    goes: np.ndarray
    belief: np.ndarray
    hours: np.ndarray
    expected: Expected
    last: np.ndarray
    num_seen: np.ndarray
    room: np.ndarray
    num_known: np.ndarray
    sums: HomeSums
    same: np.ndarray
    fresh: np.ndarray
    often: np.ndarray
    similar: np.ndarray
    most_similar: np.ndarray
    strays: np.ndarray

    @classmethod
    def gather(
        cls, memory: MemoryBatch, queries: Queries, asks_moved: float = TASKS_ASK_MOVED
    ) -> Question:
        """Gather what the memory holds about the objects asked for.

        `asks_moved` is the share of the questions that are about what has just moved.
        """
        home, objects, edges = queries.home, memory.objects, memory.edges
        counts = ObjectCounts.gather(memory, queries)
        rates = Rates.estimate(memory, queries, counts)
        expected = Expected.by_words(memory, queries)
        destinations = compute_destinations(memory, queries, counts, expected)
        hours = compute_hours_per_step(memory, home)
        is_place = memory.is_furniture[home]
        num_seen = counts.num_true.sum(axis=1, keepdims=True)
        sums = HomeSums.of(memory)
        asked = [memory.labels[label] for label in objects["label"][queries.object]]
        cosine = compare(asked, memory.labels)
        edge_order = np.arange(len(edges))
        if memory.num_homes > 1:
            edge_order = np.argsort(edges["home"], kind="stable")
        same, fresh, often, similar, most_similar, strays = _gather_others(
            home.astype(np.int64), queries.object.astype(np.int64), counts.num_true.astype(float),
            rates.home * hours, memory.time,
            objects["label"], objects["last_furniture"], objects["last_observed"],
            edge_order, compute_starts(sums.num_edges),
            edges["object"], edges["furniture"], edges["num_true"], np.exp((cosine - 1) / _WIDTH),
        )  # fmt: skip
        return cls(
            memory=memory,
            queries=queries,
            is_place=is_place,
            num_places=is_place.sum(axis=1, keepdims=True),
            counts=counts,
            rates=rates,
            asks_moved=asks_moved,
            goes=destinations[:, :-1],
            belief=compute_beliefs(memory, queries, rates, destinations, _list_filters(asks_moved)),
            hours=hours[:, None],
            expected=expected,
            last=objects["last_furniture"][queries.object],
            num_seen=num_seen,
            room=memory.furniture_room[home],
            num_known=sums.num_known[home][:, None],
            sums=sums,
            same=same,
            fresh=fresh,
            often=often,
            similar=similar,
            most_similar=most_similar,
            strays=strays,
        )

    def get_belief(self, name: str) -> np.ndarray:
        """Return what a filter believes about the places, (Q, F)."""
        return self.belief[:, list(FILTERS).index(name), :-1]


@lru_cache(maxsize=16)
def _list_filters(asks_moved: float) -> tuple[FilterSettings, ...]:
    """Return `FILTERS`, those of the questions of tasks for such questions instead."""
    return tuple(
        replace(own, asks_moved=asks_moved) if own.asks_moved == TASKS_ASK_MOVED else own
        for own in FILTERS.values()
    )


@kernel
def _gather_others(
    query_home: np.ndarray,
    query_object: np.ndarray,
    seen: np.ndarray,
    age_rate: np.ndarray,
    now: int,
    object_label: np.ndarray,
    object_last_place: np.ndarray,
    object_last_time: np.ndarray,
    edge_order: np.ndarray,
    edge_start: np.ndarray,
    edge_object: np.ndarray,
    edge_place: np.ndarray,
    edge_num_true: np.ndarray,
    likeness: np.ndarray,
) -> tuple[np.ndarray, ...]:
    """Gather, for Q questions, where things of the same name and companions were seen.

    What begins with `object` are columns of objects, (O,), with `edge` those of edges, (E,).
    `edge_order` has the rows of edges home by home, (E,), and `edge_start` the first entry of each
    home there, and the end, (H + 1,). `seen` are sightings of the object asked for by place,
    float64 (Q, F); `age_rate` says at which rate a sighting of a companion loses its weight, per
    step, (Q,), and `likeness` how much each label is like that of the object, 0 to 1, (Q, L).

    Returns:
        Sightings of objects of the same name, (Q, F); companions that were seen last at a place,
        weighted by likeness and by how fresh that is, (Q, F); share of the sightings of companions
        by place, weighted by likeness, (Q, F); share of the sightings of all other objects by
        place, weighted by how much their names are alike, (Q, F); the greatest of these
        weights, (Q,); and other objects that were seen last where they are not usually, weighted
        by how lately that was, (Q, F).
    """
    num_queries, num_places = seen.shape
    same = np.zeros((num_queries, num_places))
    fresh = np.zeros((num_queries, num_places))
    often = np.zeros((num_queries, num_places))
    similar = np.zeros((num_queries, num_places))
    most = np.zeros(num_queries)
    strays = np.zeros((num_queries, num_places))
    num_objects = len(object_label)
    total = np.zeros(num_objects)
    square = np.zeros(num_objects)
    product = np.zeros(num_objects)
    usual = np.zeros(num_objects)
    for query in range(num_queries):
        home, asked = query_home[query], query_object[query]
        own_square = 0.0
        for place in range(num_places):
            own_square += seen[query, place] ** 2
        begin, end = edge_start[home], edge_start[home + 1]
        for position in range(begin, end):
            row = edge_object[edge_order[position]]
            total[row] = square[row] = product[row] = usual[row] = 0.0
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            total[row] += count
            square[row] += count * count
            usual[row] = max(usual[row], count)
            product[row] += count * seen[query, place]
            if row != asked and object_label[row] == object_label[asked]:
                same[query, place] += count
        for position in range(begin, end):
            edge = edge_order[position]
            row, place, count = edge_object[edge], edge_place[edge], edge_num_true[edge]
            if row == asked or count == 0:
                continue
            name = likeness[query, object_label[row]]
            similar[query, place] += name * count / total[row]
            most[query] = max(most[query], name)
            age = age_rate[query] * (now - object_last_time[row])
            is_last = place == object_last_place[row]
            if is_last and count < usual[row]:
                strays[query, place] += math.exp(-_LATELY * age)
            if own_square == 0:
                continue
            alike = product[row] / math.sqrt(square[row] * own_square)
            if alike > _ALIKE:
                often[query, place] += alike * count / total[row]
                if is_last:
                    fresh[query, place] += alike * math.exp(-age)
    return same, fresh, often, similar, most, strays
