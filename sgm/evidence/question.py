"""What is asked of a memory, and what the memory has counted of it and of its home."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sgm.arrays.grouped import choose_relations
from sgm.memory.home_history import NUM_HOURS, HomeHistory
from sgm.memory.lone_looks import LoneLooks
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.schema import NUM_RELATIONS

_HOUR_WIDTH = 4.0  # concentration of the hours that count as alike: about three to each side


class ObjectCounts(NamedTuple):
    """What was seen of Q objects at F furniture nodes, all relations taken together.

    Attributes:
        num_true: how often it was seen there, (Q, F).
        last_true: when last, -1 for never, (Q, F).
        num_absent: looks since then, all of them where it was never seen, (Q, F); of a look that
            had a part of the furniture in view, that part.
        num_left: looks that found it gone from there, (Q, F).
        time_true: time steps for which it was known to be there, (Q, F).
        num_known: looks since it was first seen there, (Q, F).
        last_known: when the latest of them was, -1 for none, (Q, F).
        is_true: whether it showed the object, bool (Q, F).
        hours: by hour of day how often it was seen there, and looks since it was first seen there
            that did not show it, (2, Q, F, NUM_HOURS); no hours if no home has a clock.
    """

    num_true: np.ndarray
    last_true: np.ndarray
    num_absent: np.ndarray
    num_left: np.ndarray
    time_true: np.ndarray
    num_known: np.ndarray
    last_known: np.ndarray
    is_true: np.ndarray
    hours: np.ndarray

    @classmethod
    def gather(
        cls, memory: MemoryBatch, query: np.ndarray, edge: np.ndarray, looks: np.ndarray
    ) -> ObjectCounts:
        """Gather the counters of Q query objects, one of which may be asked for twice.

        Args:
            memory: that is asked.
            query: for each edge of one of them, which question it is about, (k,).
            edge: row of it, (k,).
            looks: at each place, (Q, F).
        """
        shape, edges = looks.shape, memory.edges
        was_true = edges["num_true"][edge] > 0
        query, edge = query[was_true], edge[was_true]
        cell = query * shape[1] + edges["furniture"][edge]  # of a table of questions and places
        is_true = edges["is_true"][edge]

        def gather(ufunc: np.ufunc, value: np.ndarray, empty: float = 0) -> np.ndarray:
            """Reduce the values of edges by place, (k,) -> (Q, F)."""
            reduced = np.full(shape[0] * shape[1], empty, dtype=value.dtype)
            ufunc.at(reduced, cell, value)
            return reduced.reshape(shape)

        num_missed = gather(np.minimum, edges["missed"][edge].astype(float), np.inf)
        num_known = gather(np.maximum, edges["num_observed"][edge])
        return cls(
            num_true=gather(np.add, edges["num_true"][edge]),
            last_true=gather(np.maximum, edges["last_true"][edge], -1),
            num_absent=np.minimum(num_missed, np.maximum(looks, num_known)),
            num_left=gather(np.add, _count_left(edges["num_changed"][edge], is_true)),
            time_true=gather(np.add, edges["time_true"][edge]),
            num_known=num_known,
            last_known=gather(np.maximum, edges["last_observed"][edge], -1),
            is_true=gather(np.logical_or, is_true, False),
            hours=_gather_hours(memory, edge, cell, shape),
        )


def _count_left(num_changed: np.ndarray, is_true: np.ndarray) -> np.ndarray:
    """Count the looks that found edges false which had been true, (k,), (k,) -> (k,).

    Edges become true and false in turn: half of their changes were of this kind.
    """
    left: np.ndarray = (num_changed + ~is_true) // 2
    return left


def _gather_hours(
    memory: MemoryBatch, edge: np.ndarray, cell: np.ndarray, shape: tuple[int, int]
) -> np.ndarray:
    """Return `ObjectCounts.hours` of edges, (k,), that belong to so many questions and places.

    `cell` is the number of question and place of each, in 0..Q F - 1, (k,).
    """
    if memory.clock is None:
        return np.zeros((2, *shape, 0), dtype=np.float32)
    hours = np.zeros((2, shape[0] * shape[1], NUM_HOURS), dtype=np.float32)
    seen, gone = memory.history.get_edge_hours(edge)
    np.add.at(hours[0], cell, seen)
    np.maximum.at(hours[1], cell, gone)
    return hours.reshape(2, *shape, NUM_HOURS)


class HomeSums(NamedTuple):
    """Sums over the objects and edges of H homes, whatever the time step.

    Attributes:
        num_seen: objects that were ever seen, (H,).
        sightings: of all objects, (H,).
        num_typed: objects that were seen and whose type the prior knows, (H,).
        num_known: objects that were last seen at furniture that there is, (H,).
        popularity: how many of them at each place, float64 (H, F).
        num_edges: edges, (H,).
        num_left: looks that found an object gone from where it had been seen, (H,).
        time_true: time steps for which objects were known to be where they are, (H,).
        num_placed: places at which an object of a known type was seen, (H,).
        lift: by how much the prior gives these more than an even guess does, nats in sum, (H,).
        arrivals: moves to each place, (H, F); none where they are not counted.
        num_crossing: moves that led to another room, (H,).
    """

    num_seen: np.ndarray
    sightings: np.ndarray
    num_typed: np.ndarray
    num_known: np.ndarray
    popularity: np.ndarray
    num_edges: np.ndarray
    num_left: np.ndarray
    time_true: np.ndarray
    num_placed: np.ndarray
    lift: np.ndarray
    arrivals: np.ndarray
    num_crossing: np.ndarray

    @classmethod
    def of(cls, memory: MemoryBatch, history: HomeHistory) -> HomeSums:
        """Sum up what a memory holds; once, of a memory whose content does not change."""
        kept = memory.derived
        if kept is None:
            return cls._compute(memory, history)
        if cls not in kept:
            kept[cls] = cls._compute(memory, history)
        sums: HomeSums = kept[cls]
        return sums

    @classmethod
    def _compute(cls, memory: MemoryBatch, history: HomeHistory) -> HomeSums:
        objects, edges = memory.objects, memory.edges
        home, was_seen = objects["home"], objects["num_observed"] > 0
        is_typed, is_known = objects["type"] >= 0, objects["last_furniture"] >= 0
        shape = memory.num_homes, memory.num_furniture
        last_place = (
            home[is_known].astype(np.int64) * shape[1] + objects["last_furniture"][is_known]
        )
        popularity = np.bincount(last_place, minlength=shape[0] * shape[1]).reshape(shape)
        is_placed = (edges["num_true"] > 0) & is_typed[edges["object"]]
        placed_home = edges["home"][is_placed]
        even = edges["prior"][is_placed].astype(float) * memory.home_num_furniture[placed_home]
        num_left = _count_left(edges["num_changed"], edges["is_true"])
        arrivals = history.moves.sum(axis=1)
        num_crossing = np.zeros(shape[0], dtype=np.int64)
        if arrivals.any():
            room = memory.furniture_room
            crosses = room[:, :, None] != room[:, None, :]
            num_crossing = (history.moves * crosses).sum(axis=(1, 2))

        def count(homes: np.ndarray, number: np.ndarray | None = None) -> np.ndarray:
            """Sum whole numbers by home, (n,), (n,) -> (H,)."""
            return np.bincount(homes, number, minlength=shape[0]).astype(np.int64)

        return cls(
            num_seen=count(home[was_seen]),
            sightings=count(home, objects["num_observed"]),
            num_typed=count(home[was_seen & is_typed]),
            num_known=count(home[is_known]),
            popularity=popularity.astype(float),
            num_edges=count(edges["home"]),
            num_left=count(edges["home"], num_left),
            time_true=count(edges["home"], edges["time_true"]),
            num_placed=count(placed_home),
            lift=np.bincount(placed_home, np.log(even * 0.9 + 0.1), minlength=shape[0]),
            arrivals=arrivals,
            num_crossing=num_crossing,
        )


@dataclass(frozen=True, slots=True)
class Question:
    """Q questions to memories of homes of F furniture nodes, and what was counted of each.

    Arrays are zero where a home has no furniture node.

    Attributes:
        memory: the memory that is asked.
        queries: what is asked.
        history: of the memory.
        home: that is asked, (Q,).
        thing: row of the object that is asked for, (Q,).
        query, edge: for each edge of such an object, which question is about it, and its row, (k,).
        is_place: which columns are furniture that is asked about, bool (Q, F).
        num_places: how many are, (Q,).
        num_columns: furniture of the home, which the first columns are, (Q,).
        num_rooms: of the home, but for those of which no place is asked about, (Q,).
        room: of each furniture node, -1 beyond, (Q, F).
        looks, last_look: at each furniture node, how many and when the last one was, (Q, F); with
            those for what is asked for alone.
        lone: looks for what is asked for alone; None if there are none.
        look_times: of the latest looks at each, -1 for none, (m, F, n).
        look_row: which of these m are about what is asked for, (Q,).
        step_hours: length of a time step of each home, (H,).
        hours: the same of the homes that are asked, (Q,).
        last: where the thing was last seen, -1 for never, (Q,).
        is_in_last_room: which furniture is in the room where it was last seen, bool (Q, F).
        num_seen: its sightings, (Q,).
        counts: its sightings by place.
        sums: over all objects and edges.
    """

    memory: MemoryBatch
    queries: Queries
    history: HomeHistory
    home: np.ndarray
    thing: np.ndarray
    query: np.ndarray
    edge: np.ndarray
    is_place: np.ndarray
    num_places: np.ndarray
    num_columns: np.ndarray
    num_rooms: np.ndarray
    room: np.ndarray
    looks: np.ndarray
    last_look: np.ndarray
    lone: LoneLooks | None
    look_times: np.ndarray
    look_row: np.ndarray
    step_hours: np.ndarray
    hours: np.ndarray
    last: np.ndarray
    is_in_last_room: np.ndarray
    num_seen: np.ndarray
    counts: ObjectCounts
    sums: HomeSums

    @classmethod
    def gather(cls, memory: MemoryBatch, queries: Queries) -> Question:
        """Gather what the memory has counted of the objects asked for; it counts its history."""
        history, (query, edge) = memory.history, memory.edges_of(queries)
        home, is_place = queries.home, memory.is_furniture[queries.home]
        if queries.left_out is not None:
            is_place &= ~queries.left_out
        looks = memory.furniture["num_observed"][home]
        last_look = memory.furniture["last_observed"][home]
        lone = memory.find_lone_looks(queries.object)
        if lone is not None:
            looks, last_look = looks + lone.num_looks, np.maximum(last_look, lone.last)
        counts = ObjectCounts.gather(memory, query, edge, looks)
        look_times, look_row = list_look_times(memory, queries, history)
        step_hours = compute_step_hours(memory)
        room = np.where(is_place, memory.furniture_room[home], -1)
        last = memory.objects["last_furniture"][queries.object]
        num_seen = counts.num_true.sum(axis=1)
        last_room = np.where(num_seen > 0, room[np.arange(len(home)), np.maximum(last, 0)], -1)
        return cls(
            memory=memory,
            queries=queries,
            history=history,
            home=home,
            thing=queries.object,
            query=query,
            edge=edge,
            is_place=is_place,
            num_places=is_place.sum(axis=1),
            num_columns=memory.home_num_furniture[home],
            num_rooms=memory.home_num_rooms[home] - _count_left_out(memory, queries),
            room=room,
            looks=looks,
            last_look=last_look,
            lone=lone,
            look_times=look_times,
            look_row=look_row,
            step_hours=step_hours,
            hours=step_hours[home],
            last=last,
            is_in_last_room=(room == last_room[:, None]) & is_place,
            num_seen=num_seen,
            counts=counts,
            sums=HomeSums.of(memory, history),
        )


def _count_left_out(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Count the rooms that have places, of which none is asked about, (Q,)."""
    if queries.left_out is None:
        return np.zeros(len(queries.home), dtype=np.int64)
    room = memory.furniture_room[queries.home]
    number = np.arange(memory.room_label.shape[1])
    has_place, is_asked = (
        ((room[:, :, None] == number) & mask[:, :, None]).any(axis=1)
        for mask in (room >= 0, (room >= 0) & ~queries.left_out)
    )
    return np.count_nonzero(has_place & ~is_asked, axis=1)


def list_look_times(
    memory: MemoryBatch, queries: Queries, history: HomeHistory
) -> tuple[np.ndarray, np.ndarray]:
    """Return when places were looked at, (m, F, n), and the row for what is asked for, (Q,)."""
    lone = memory.find_lone_looks(queries.object)
    if history.look_relations is None and lone is None:
        return np.ascontiguousarray(history.look_times), queries.home.astype(np.int64)
    share = None if history.look_relations is None else memory.compute_relation_shares(queries)
    times = history.list_look_times(queries.home, share)
    return times if lone is None else lone.add_to(times), np.arange(len(times))


def count_missed_then(asked: Question) -> np.ndarray:
    """Count the looks in the step of the last sighting that missed the thing there after it, (Q,).

    Looks have times in steps alone: these are known by the counters, as long as they are the last
    ones there. Later ones say more.
    """
    counts, cell = asked.counts, (np.arange(len(asked.last)), np.maximum(asked.last, 0))
    is_last = (counts.num_true[cell] > 0) & ~counts.is_true[cell] & (asked.last >= 0)
    is_last &= counts.last_known[cell] == counts.last_true[cell]
    return np.where(is_last, np.floor(counts.num_absent[cell] + 0.5), 0).astype(np.int64)


def compute_step_hours(memory: MemoryBatch) -> np.ndarray:
    """Return how long a time step of each home is in hours, one where it is unknown, (H,)."""
    if memory.clock is None:
        return np.ones(memory.num_homes)
    seconds = memory.clock[:, 1]
    return np.where(np.isnan(seconds), 3600.0, seconds) / 3600


def compute_hour(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return the hour of day in homes, in [0, 24), nan where it is unknown, (n,) -> (n,)."""
    if memory.clock is None:
        return np.full(len(home), np.nan)
    return np.mod(memory.clock[home, 0] / 3600 + memory.time * memory.clock[home, 1] / 3600, 24)


def weigh_hour(hour: np.ndarray, width: float = _HOUR_WIDTH) -> np.ndarray:
    """Return how near each bin of the day is to hours of the day, (n,) -> (n, NUM_HOURS).

    1 at that hour, whatever the width; 0 where the hour is unknown, nan.
    """
    middle = (np.arange(NUM_HOURS) + 0.5) * (24 / NUM_HOURS)
    apart = middle - hour[:, None]
    return np.nan_to_num(np.exp(width * (np.cos(apart * (2 * np.pi / 24)) - 1)))


def choose_edges(asked: Question) -> np.ndarray:
    """Choose a relation for Q objects at each of F places: seen most often so, else likelier.

    Returns:
        Prior weight in it, and 1 for the one that it is of all but the first, float32 (Q, F, R).
    """
    edges, edge, prior = asked.memory.edges, asked.edge, asked.queries.prior.copy()
    num_true = np.full(prior.shape, -1, dtype=np.int32)
    cell = asked.query, edges["furniture"][edge], edges["relation"][edge]
    num_true[cell], prior[cell] = edges["num_true"][edge], edges["prior"][edge]
    likelier = choose_relations(asked.queries.prior, last=True)
    relation = np.where((num_true < 0).all(axis=2), likelier, choose_relations(num_true))
    weight = np.take_along_axis(prior, relation[..., None], axis=2)[..., 0]
    is_other = relation[..., None] == np.arange(1, NUM_RELATIONS)
    return np.concatenate([weight[..., None], is_other], axis=2).astype(np.float32)
