"""All that is gathered once for a question, and read by its features."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import compute_starts
from sgm.evidence.adaptive_filter import (
    TASKS_ASK_MOVED,
    FilterSettings,
    Rates,
    compute_beliefs,
    compute_destinations,
    weigh_hour,
)
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.object_counts import ObjectCounts, compute_hour, compute_hours_per_step
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
_WIDTH = 0.1  # of cosines by which the names of two things are alike
_LATELY = 10  # times as fast as a sighting of a companion, one out of place loses its weight
_ALIKE = 0.3  # cosine of the sightings by place from which an object counts as a companion
_OF_OBJECTS = ("last_observed", "num_moved", "num_sought", "num_still")
_RIGHT = ("num_last_right", "num_common_right", "num_prior_right")


class Companions(NamedTuple):
    """Where things of the same name, companions and strays were seen; see `_gather_companions`.

    Attributes:
        same, fresh, often, similar: by place, (Q, F).
        most_similar: greatest weight of a name in `similar`, (Q,).
        strays: by place, (Q, F).
    """

    same: np.ndarray
    fresh: np.ndarray
    often: np.ndarray
    similar: np.ndarray
    most_similar: np.ndarray
    strays: np.ndarray


class QuestionArrays(NamedTuple):
    """What kernels read of Q questions at F furniture nodes, beside counts, rates and sums.

    Arrays are zero where a home has no furniture node. Kernels of two files read fields by their
    number: delete `__pycache__` after a change of the order.

    Attributes:
        home: that is asked, (Q,).
        is_place: which columns are furniture, bool (Q, F).
        num_places: of the home, (Q,).
        room: of each furniture node, -1 beyond, (Q, F).
        label: of each furniture node, (Q, F).
        looks, last_look: at each furniture node, how many and when the last one was, (Q, F).
        crowding: how much of all that is expected is at each place, (Q, F).
        now: time step.
        hours: length of a time step, (Q,).
        hour: of the day, nan where it is unknown, (Q,).
        wide, narrow: how much each bin of the day counts at this hour, (Q, NUM_HOURS).
        stray_hours: sightings of things out of their usual places at about this hour, (Q, F).
        last: where it was last seen, -1 for never, (Q,).
        num_seen: its sightings, (Q,).
        onward, back: moves from where it was last seen to each place, and from there, (Q, F).
        goes: where it goes when it moves, (Q, F + 1).
        belief: of each of `FILTERS`, float64 (Q, K, F + 1); the last place is elsewhere.
        ranking: number of the filter whose belief ranks the places.
    """

    home: np.ndarray
    is_place: np.ndarray
    num_places: np.ndarray
    room: np.ndarray
    label: np.ndarray
    looks: np.ndarray
    last_look: np.ndarray
    crowding: np.ndarray
    now: int
    hours: np.ndarray
    hour: np.ndarray
    wide: np.ndarray
    narrow: np.ndarray
    stray_hours: np.ndarray
    last: np.ndarray
    num_seen: np.ndarray
    onward: np.ndarray
    back: np.ndarray
    goes: np.ndarray
    belief: np.ndarray
    ranking: int


class QuestionCounters(NamedTuple):
    """What is counted of Q questions, whatever the place; see `QuestionArrays`.

    Attributes:
        num_rooms: of the home, (Q,).
        last_observed: when it was last seen, (Q,).
        num_moved, num_sought, num_still: counters of the object, (Q,).
        num_asked, num_found: counters of the home, (Q,).
        num_right: how often the last, the commonest and the likeliest place were right, (3, Q).
        any_moved: how likely any object has moved, as far as questions are about that, (Q,).
    """

    num_rooms: np.ndarray
    last_observed: np.ndarray
    num_moved: np.ndarray
    num_sought: np.ndarray
    num_still: np.ndarray
    num_asked: np.ndarray
    num_found: np.ndarray
    num_right: np.ndarray
    any_moved: np.ndarray


@dataclass(frozen=True, slots=True)
class Question:
    """All that is gathered for Q questions.

    Attributes:
        memory: the memory that is asked.
        queries: what is asked.
        asks_moved: share of the questions that are about what has just moved.
        arrays: what is known of the questions and their homes.
        counters: likewise, whatever the place.
        counts: sightings by place.
        rates: how objects move.
        expected: where it is expected before it is seen.
        companions: where things like it were seen.
        sums: over all objects and edges.
    """

    memory: MemoryBatch
    queries: Queries
    asks_moved: float
    arrays: QuestionArrays
    counters: QuestionCounters
    counts: ObjectCounts
    rates: Rates
    expected: Expected
    companions: Companions
    sums: HomeSums

    @classmethod
    def gather(
        cls, memory: MemoryBatch, queries: Queries, asks_moved: float = TASKS_ASK_MOVED
    ) -> Question:
        """Gather what the memory holds about the objects asked for.

        `asks_moved` is the share of the questions that are about what has just moved.
        """
        home, row, history = queries.home, queries.object, memory.history
        counts = ObjectCounts.gather(memory, queries)
        rates = Rates.estimate(memory, queries, counts)
        expected = Expected.by_words(memory, queries)
        goes = compute_destinations(memory, queries, counts, expected)
        hours = compute_hours_per_step(memory, home)
        is_place = memory.is_furniture[home]
        last = memory.objects["last_furniture"][row]
        before = np.maximum(last, 0)
        num_asked = history.counters["num_asked"][home].astype(np.int64)
        if queries.more_asked is not None:
            num_asked += queries.more_asked
        wide, narrow, stray_hours = _gather_hours(memory, home)
        arrays = QuestionArrays(
            home=home.astype(np.int64),
            is_place=is_place,
            num_places=is_place.sum(axis=1),
            room=memory.furniture_room[home],
            label=memory.furniture_label[home],
            looks=memory.furniture_num_observed[home],
            last_look=memory.furniture_last_observed[home],
            crowding=memory.place_prior.crowding[home],
            now=memory.time,
            hours=hours,
            hour=compute_hour(memory, home),
            wide=wide,
            narrow=narrow,
            stray_hours=stray_hours,
            last=last,
            num_seen=counts.num_true.sum(axis=1),
            onward=history.moves[home, before],
            back=np.ascontiguousarray(history.moves[home, :, before]),
            goes=goes,
            belief=compute_beliefs(memory, queries, rates, goes, _list_filters(asks_moved)),
            ranking=list(FILTERS).index("asked"),
        )
        counters = QuestionCounters(
            num_rooms=memory.home_num_rooms[home],
            num_asked=num_asked,
            num_found=history.counters["num_found"][home],
            num_right=np.stack([history.counters[name][home] for name in _RIGHT]),
            any_moved=rates.any_moved * (asks_moved / TASKS_ASK_MOVED),
            **{name: memory.objects[name][row] for name in _OF_OBJECTS},
        )
        sums = HomeSums.of(memory)
        companions = _find_companions(memory, queries, counts, rates.home * hours, sums)
        return cls(
            memory, queries, asks_moved, arrays, counters, counts, rates, expected, companions, sums
        )

    def get_belief(self, name: str) -> np.ndarray:
        """Return what a filter believes about the places, (Q, F)."""
        return self.arrays.belief[:, list(FILTERS).index(name), :-1]


@lru_cache(maxsize=16)
def _list_filters(asks_moved: float) -> tuple[FilterSettings, ...]:
    """Return `FILTERS`, those of the questions of tasks for such questions instead."""
    return tuple(
        replace(own, asks_moved=asks_moved) if own.asks_moved == TASKS_ASK_MOVED else own
        for own in FILTERS.values()
    )


def _gather_hours(
    memory: MemoryBatch, home: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return `wide`, `narrow` and `stray_hours` of `QuestionArrays`; empty without a clock."""
    if memory.clock is None:
        return (np.zeros((len(home), 0)),) * 3
    strays = _count_strays(memory)[home]
    return weigh_hour(memory, home, 3.0), weigh_hour(memory, home, 8.0), strays


def _count_strays(memory: MemoryBatch) -> np.ndarray:
    """Count the sightings of things out of their usual places at about this hour of day, (H, F)."""
    edges, num_homes, num_places = memory.edges, memory.num_homes, memory.num_furniture
    most = np.zeros(len(memory.objects), dtype=np.int32)
    np.maximum.at(most, edges["object"], edges["num_true"])
    rows = np.flatnonzero((edges["num_true"] > 0) & (edges["num_true"] < most[edges["object"]]))
    home = edges["home"][rows]
    weight = weigh_hour(memory, np.arange(num_homes))[home]
    seen = (memory.history.get_edge_hours(rows)[0] * weight).sum(axis=1)
    place = home * num_places + edges["furniture"][rows]
    counts = np.bincount(place, seen, minlength=num_homes * num_places)
    return counts.reshape(num_homes, num_places)


def _find_companions(
    memory: MemoryBatch,
    queries: Queries,
    counts: ObjectCounts,
    age_rate: np.ndarray,
    sums: HomeSums,
) -> Companions:
    """Gather what was seen of other things; `age_rate` is that of `_gather_companions`."""
    objects, edges = memory.objects, memory.edges
    asked = [memory.labels[label] for label in objects["label"][queries.object]]
    likeness = np.exp((compare(asked, memory.labels) - 1) / _WIDTH)
    edge_order = np.arange(len(edges))
    if memory.num_homes > 1:
        edge_order = np.argsort(edges["home"], kind="stable")
    found = _gather_companions(
        queries.home.astype(np.int64), queries.object.astype(np.int64),
        counts.num_true.astype(float), age_rate, memory.time,
        objects["label"], objects["last_furniture"], objects["last_observed"],
        edge_order, compute_starts(sums.num_edges),
        edges["object"], edges["furniture"], edges["num_true"], likeness,
    )  # fmt: skip
    return Companions(*found)


@kernel
def _gather_companions(
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
