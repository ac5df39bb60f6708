"""All that is gathered once for a question, and read by its features."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from sgm.evidence.adaptive_filter import (
    TASKS_ASK_MOVED,
    FilterSettings,
    Rates,
    compute_beliefs,
    compute_destinations,
    weigh_hour,
)
from sgm.evidence.companions import Companions
from sgm.evidence.expected_places import Expected
from sgm.evidence.home_sums import HomeSums
from sgm.evidence.lately import Lately
from sgm.evidence.name_likeness import compare_names
from sgm.evidence.object_counts import ObjectCounts, compute_hour, compute_hours_per_step
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

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
_RANKING = "asked"  # the filter whose belief ranks the places
_LEAST_SHARE = 0.02  # times the number of places, in logarithms
_OF_OBJECTS = ("num_moved", "num_sought", "num_still")
_OF_HOMES = ("num_found", "num_last_right", "num_common_right", "num_prior_right")


@dataclass(frozen=True, slots=True)
class QuestionArrays:
    """What is known of Q questions at F furniture nodes, beside counts, rates and sums.

    Arrays are zero where a home has no furniture node.

    Attributes:
        home: that is asked, (Q,).
        is_place: which columns are furniture, bool (Q, F).
        num_places: of the home, (Q,).
        room: of each furniture node, -1 beyond, (Q, F).
        is_in_last_room: which furniture is in the room where it was last seen, bool (Q, F).
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
    """

    home: np.ndarray
    is_place: np.ndarray
    num_places: np.ndarray
    room: np.ndarray
    is_in_last_room: np.ndarray
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

    def log_share(self, share: np.ndarray) -> np.ndarray:
        """Return the logarithm of shares of places, (Q, F), 0 for an even one."""
        return np.log(share * self.num_places[:, None] + _LEAST_SHARE)


@dataclass(frozen=True, slots=True)
class QuestionCounters:
    """What is counted of Q questions, whatever the place; see `QuestionArrays`.

    Attributes:
        num_rooms: of the home, (Q,).
        hours_since_seen: since the last sighting, 0 for none, (Q,).
        num_moved, num_sought, num_still: counters of the object, (Q,).
        num_asked, num_found: counters of the home, (Q,).
        num_last_right, num_common_right, num_prior_right: how often the last, the commonest and
            the likeliest place were right, (Q,).
        any_moved: how likely any object has moved, as far as questions are about that, (Q,).
    """

    num_rooms: np.ndarray
    hours_since_seen: np.ndarray
    num_moved: np.ndarray
    num_sought: np.ndarray
    num_still: np.ndarray
    num_asked: np.ndarray
    num_found: np.ndarray
    num_last_right: np.ndarray
    num_common_right: np.ndarray
    num_prior_right: np.ndarray
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
        lately: what has changed in the homes.
        likeness: how much each label of the memory is like the name of each thing, (Q, L).
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
    lately: Lately
    likeness: np.ndarray

    @classmethod
    def gather(
        cls, memory: MemoryBatch, queries: Queries, asks_moved: float = TASKS_ASK_MOVED
    ) -> Question:
        """Gather what the memory holds about the objects asked for.

        `asks_moved` is the share of the questions that are about what has just moved.
        """
        home, row, history = queries.home, queries.object, memory.history
        counts = ObjectCounts.gather(memory, queries)
        sums = HomeSums.of(memory)
        rates = Rates.estimate(memory, queries, counts, sums)
        expected = Expected.by_words(memory, queries)
        goes = compute_destinations(memory, queries, counts, expected)
        hours = compute_hours_per_step(memory, home)
        is_place = memory.is_furniture[home]
        room, num_seen = memory.furniture_room[home], counts.num_true.sum(axis=1)
        last, was_seen = memory.objects["last_furniture"][row], num_seen > 0
        before = np.maximum(last, 0)
        last_room = np.where(was_seen, room[np.arange(len(row)), before], -1)
        num_asked = history.counters["num_asked"][home].astype(np.int64)
        if queries.more_asked is not None:
            num_asked += queries.more_asked
        wide, narrow, stray_hours = _gather_hours(memory, home)
        arrays = QuestionArrays(
            home=home,
            is_place=is_place,
            num_places=is_place.sum(axis=1),
            room=room,
            is_in_last_room=(room == last_room[:, None]) & is_place,
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
            num_seen=num_seen,
            onward=history.moves[home, before],
            back=history.moves[home, :, before],
            goes=goes,
            belief=compute_beliefs(memory, queries, rates, goes, _list_filters(asks_moved)),
        )
        since_seen = (memory.time - memory.objects["last_observed"][row]) * hours
        counters = QuestionCounters(
            num_rooms=memory.home_num_rooms[home],
            hours_since_seen=since_seen * was_seen,
            num_asked=num_asked,
            any_moved=rates.any_moved * (asks_moved / TASKS_ASK_MOVED),
            **{name: memory.objects[name][row] for name in _OF_OBJECTS},
            **{name: history.counters[name][home] for name in _OF_HOMES},
        )
        likeness = compare_names(memory, queries)
        return cls(
            memory=memory,
            queries=queries,
            asks_moved=asks_moved,
            arrays=arrays,
            counters=counters,
            counts=counts,
            rates=rates,
            expected=expected,
            companions=Companions.gather(
                memory, queries, counts, rates.home * hours, sums, likeness
            ),
            sums=sums,
            lately=Lately.gather(memory, queries),
            likeness=likeness,
        )

    def get_belief(self, name: str) -> np.ndarray:
        """Return what a filter believes about the places, (Q, F)."""
        return self.arrays.belief[:, list(FILTERS).index(name), :-1]

    @property
    def ranking_belief(self) -> np.ndarray:
        """What the filter believes that ranks the places, the last one elsewhere, (Q, F + 1)."""
        return self.arrays.belief[:, list(FILTERS).index(_RANKING)]

    def get_elsewhere(self, name: str) -> np.ndarray:
        """Return what a filter believes about elsewhere, (Q,)."""
        return self.arrays.belief[:, list(FILTERS).index(name), -1]


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
    most = np.zeros(memory.objects.num_rows, dtype=np.int32)
    np.maximum.at(most, edges["object"], edges["num_true"])
    rows = np.flatnonzero((edges["num_true"] > 0) & (edges["num_true"] < most[edges["object"]]))
    home = edges["home"][rows]
    weight = weigh_hour(memory, np.arange(num_homes))[home]
    seen = (memory.history.get_edge_hours(rows)[0] * weight).sum(axis=1)
    place = home * num_places + edges["furniture"][rows]
    counts = np.bincount(place, seen, minlength=num_homes * num_places)
    return counts.reshape(num_homes, num_places)
