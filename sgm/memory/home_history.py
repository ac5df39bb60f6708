"""What a memory counts of a home as a whole, beside the counters of its nodes and edges."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from sgm.arrays.grouped import join_groups, sum_relations
from sgm.arrays.read_numbers import read_sparse, write_sparse
from sgm.arrays.table import clone, make_table
from sgm.arrays.week import (
    DAY_SECONDS,
    HOUR_SECONDS,
    compute_week_hours,
    compute_week_seconds,
)
from sgm.memory.look_weights import RELATION_BITS, LookWeights
from sgm.memory.merged_rows import Groups, join_hours
from sgm.memory.moments import Moments
from sgm.memory.queries import Queries
from sgm.memory.remembered import Remembered
from sgm.memory.week_hours import WeekHours
from sgm.schema import HOME, NEVER, NUM_LOOKS_KEPT, NUM_RELATIONS

ALL = 2**NUM_RELATIONS - 1  # of `look_relations`
NUM_HOURS = 12  # bins of a day, two hours each
# Of more furniture, moves from place to place are not counted: few happen twice, and they would
# take the square of its number.
MOST_FURNITURE = 500

_EDGE_HOURS = ("edge_hours", "edge_gone_hours")  # what the rows of `edge_hours` are called in JSON


class HomeHistory:
    """Counts of H homes, updated by every look at the cost of what the look changes.

    Attributes:
        look_times: time steps of the latest looks at each furniture node, in no order, -1 for
            none, int32 (H, F, NUM_LOOKS_KEPT).
        look_relations: of which relations r most was in view in each of them, the sum of their 2^r,
            uint8 (H, F, NUM_LOOKS_KEPT); None as long as all were of all.
        moves: how often an object that was last seen at one furniture node was seen at another
            next, int32 (H, F, F); all zero in homes of more than `MOST_FURNITURE`.
        counters: table of homes, (H,) each; `sgm.schema.HOME` says what each column holds. Looks
            that missed what later looks found at the same place, and those that found it there,
            are each discounted by how likely it had moved meanwhile.
        edge_hours: of each edge by hour of day, sightings, and looks that did not show what had
            been seen there, uint16 (2, E, NUM_HOURS); without edges if no home has a clock.
        week: looks and sightings by hour of the working day and of the weekend's.
        moments: the latest looks at each place, and what they showed.
    """

    def __init__(self, num_homes: int, num_furniture: int) -> None:
        """Start with nothing counted."""
        shape = (num_homes, num_furniture)
        self.look_times = np.full((*shape, NUM_LOOKS_KEPT), NEVER, dtype=np.int32)
        self.look_relations: np.ndarray | None = None
        self.moves = _make_moves(num_homes, num_furniture)
        self.counters = make_table(HOME, num_rows=num_homes)
        self.edge_hours = np.zeros((2, 0, NUM_HOURS), dtype=np.uint16)
        self.week = WeekHours(num_homes, num_furniture)
        self.moments = Moments(num_homes, num_furniture)

    def add_furniture(self, num_added: int) -> None:
        """Add columns of furniture that was never looked at."""
        wider = ((0, 0), (0, num_added), (0, 0))
        self.week.add_furniture(num_added)
        self.moments.add_furniture(num_added)
        self.look_times = np.pad(self.look_times, wider, constant_values=NEVER)
        if self.look_relations is not None:
            self.look_relations = np.pad(self.look_relations, wider, constant_values=ALL)
        before = self.moves
        self.moves = _make_moves(len(before), before.shape[1] + num_added)
        if self.counts_moves:
            self.moves[:, : before.shape[1], : before.shape[1]] = before

    @property
    def counts_moves(self) -> bool:
        """Whether moves from place to place are counted."""
        return self.moves.shape[1] <= MOST_FURNITURE

    def copy(self) -> HomeHistory:
        """Return the same counts, which can be changed alone."""
        copied = clone(self)
        copied.look_times, copied.edge_hours = self.look_times.copy(), self.edge_hours.copy()
        if self.look_relations is not None:
            copied.look_relations = self.look_relations.copy()
        copied.moves = self.moves.copy() if self.counts_moves else self.moves
        copied.week, copied.moments = self.week.copy(), self.moments.copy()
        copied.counters = self.counters.copy()
        return copied

    def take(self, furniture: np.ndarray, edges: np.ndarray, objects: np.ndarray) -> HomeHistory:
        """Return a copy that keeps some furniture (F,), edges (E,) and objects (O,), bool."""
        kept = HomeHistory(0, 0)
        kept.look_times = self.look_times[:, furniture]
        if self.look_relations is not None:
            kept.look_relations = self.look_relations[:, furniture]
        kept.moves = _make_moves(len(self.moves), int(furniture.sum()))
        if self.counts_moves:
            kept.moves = self.moves[:, furniture][:, :, furniture]
        kept.counters = self.counters.copy()
        hours = self.edge_hours[:, : len(edges)]
        kept.edge_hours = hours[:, edges[: hours.shape[1]]]
        kept.week = self.week.take(furniture, objects)
        kept.moments = self.moments.take(furniture, edges)
        return kept

    def merge_furniture(
        self, kept: int, gone: int, num_looks: int, place: np.ndarray, edges: Groups
    ) -> None:
        """Count for one furniture node of a home what was counted of another, by position.

        The moves between the two were none.

        Args:
            kept: the node that stays.
            gone: the other one, of which nothing is left.
            num_looks: at both.
            place: where each edge was, (E,).
            edges: which edges became one.
        """
        both = [kept, gone]
        times = self.look_times[0, both].reshape(-1)
        known = np.flatnonzero(times != NEVER)
        latest = known[np.argsort(times[known], kind="stable")][-NUM_LOOKS_KEPT:]
        # As if noted one after the other: the next look takes the place of the oldest.
        column = (num_looks - len(latest) + np.arange(len(latest))) % NUM_LOOKS_KEPT
        self.look_times[0, both] = NEVER
        self.look_times[0, kept, column] = times[latest]
        if self.look_relations is not None:
            relations = self.look_relations[0, both].reshape(-1)
            self.look_relations[0, both] = ALL
            self.look_relations[0, kept, column] = relations[latest]
        if self.counts_moves:
            moves = self.moves[0]
            num_stayed = moves[kept, gone] + moves[gone, kept]
            for counts in (moves, moves.T):
                counts[kept] += counts[gone]
                counts[gone] = 0
            moves[kept, kept] = 0
            moved = self.counters["num_moved"]
            moved[0] = max(moved[0] - num_stayed, 0)
        self.moments.merge_furniture(kept, gone, place)
        self.join_edges(edges)
        self.week.merge_furniture(kept, gone)

    def join_edges(self, edges: Groups) -> None:
        """Count for edges that became one what was counted of each."""
        self.moments.join(edges.of_row, len(edges.kept))
        if self.edge_hours.shape[1]:
            hours = self.get_edge_hours(np.arange(len(edges.of_row)))
            self.edge_hours = join_hours(hours, edges)

    def compute_miss_rate(self, given: float | None = None) -> np.ndarray:
        """Return the share of looks that miss what is there, (H,).

        As `given` (`Queries.miss_rate`), else as counted: 0.2 at first, as of ten looks.
        """
        if given is not None:
            return np.full(len(self.look_times), given)
        missed, refound = self.counters["num_missed"], self.counters["num_refound"]
        return (missed + 2) / (missed + refound + 10)

    def compute_move_rate(self, hours: np.ndarray | float = 1.0) -> np.ndarray:
        """Return how often an object is found moved, per hour of time steps of `hours`, (H,)."""
        return (self.counters["num_moved"] + 0.5) / (self.counters["time_followed"] * hours + 15)

    def list_look_times(self, home: np.ndarray, share: np.ndarray | None) -> np.ndarray:
        """Return `look_times` of homes (Q,) that were about things, -1 for the others, (Q, F, n).

        `share` is how likely each relation to furniture that a thing is at is, (Q, F, relations).
        """
        times: np.ndarray = self.look_times[home]
        if self.look_relations is None or share is None:
            return times
        relations = self.look_relations[home]  # (Q, F, n)
        in_view = sum(
            share[..., number, None] * (relations & bit > 0)
            for number, bit in enumerate(RELATION_BITS.tolist())
        )
        return np.where(in_view >= 0.5, times, NEVER)

    def count(self, name: str, home: np.ndarray, number: np.ndarray | None = None) -> None:
        """Add whole numbers (n,), 1 if left out, to the counts of homes (n,)."""
        counter = self.counters[name]
        counter += np.bincount(home, number, minlength=len(counter))

    def note_look(
        self,
        memory: Remembered,
        looked: np.ndarray,
        look: LookWeights,
        of_touched: tuple[np.ndarray, np.ndarray],
        is_seen: np.ndarray,
        seen_again: np.ndarray,
        asked: Queries | None,
        *,
        is_again: bool = False,
    ) -> None:
        """Count one look per home, before the counters of the memory are changed.

        Args:
            memory: the memory.
            looked: furniture that each home looks at, -1 for none, (H,).
            look: how much of it counts.
            of_touched: objects and relations of the edges that are known there, (m,) each.
            is_seen: whether each object was detected, bool (O,).
            seen_again: rows of edges that were known and are found true, (n,).
            asked: open questions; None if there are none.
            is_again: whether this time step had such looks before: only what is new in these
                counts.
        """
        objects, time, is_counted = memory.objects, memory.time, look.is_counted
        if asked is not None:
            is_out_of_view = look.find_out_of_view(*of_touched)
            if is_out_of_view is not None:
                asked = asked.take(~is_out_of_view[asked.object] | is_seen[asked.object])
            self._note_answers(memory, looked, asked, is_seen[asked.object])
        home = np.flatnonzero((looked >= 0) & is_counted & (not is_again))
        column = memory.furniture["num_observed"][home, looked[home]] % NUM_LOOKS_KEPT
        latest = (home, looked[home], column)
        self.look_times[latest] = time
        in_view = ALL if look.relations is None else look.relations[home]
        if self.look_relations is None and np.any(in_view != ALL):
            self.look_relations = np.full(self.look_times.shape, ALL, dtype=np.uint8)
        if self.look_relations is not None:
            self.look_relations[latest] = in_view

        rows = np.flatnonzero(is_seen)
        if memory.clock is not None:
            counted = rows[is_counted[objects["home"][rows]]]
            hour = compute_week_hours(memory.clock, time)
            self.week.note_look(hour, home, looked[home], counted, objects["home"])
        rows = rows[objects["num_observed"][rows] > 0]
        home, before = objects["home"][rows], objects["last_furniture"][rows]
        self.count("time_followed", home, time - objects["last_observed"][rows])
        place = looked[home]
        has_moved = (before >= 0) & (before != place)
        home, before, place = home[has_moved], before[has_moved], place[has_moved]
        self.count("num_moved", home)
        if self.counts_moves:
            np.add.at(self.moves, (home, before, place), 1)

        edges = memory.edges
        again = seen_again[edges["num_true"][seen_again] > 0]
        is_last = objects["last_furniture"][edges["object"][again]] == edges["furniture"][again]
        again = again[is_last]
        home = edges["home"][again]
        stayed = np.exp(-self.compute_move_rate()[home] * (time - edges["last_true"][again]))
        np.add.at(self.counters["num_missed"], home, stayed * edges["num_absent"][again])
        np.add.at(self.counters["num_refound"], home, stayed)

    def note_hours(
        self, clock: np.ndarray, time: int, edges: np.ndarray, is_seen: np.ndarray, num_edges: int
    ) -> None:
        """Count looks at edges, each once, by hour of day; (n,) of `num_edges` rows so far.

        The clock is that of the home of each edge, nan where it is unknown, (n, 2).
        """
        num_before = self.edge_hours.shape[1]
        if num_edges > num_before:
            added = max(num_edges, 2 * num_before) - num_before
            self.edge_hours = np.pad(self.edge_hours, ((0, 0), (0, added), (0, 0)))
        hour = compute_week_seconds(clock, np.full(len(edges), time)) % DAY_SECONDS / HOUR_SECONDS
        is_known = ~np.isnan(hour)
        outcome = np.where(is_seen, 0, 1)[is_known]
        counter = (outcome, edges[is_known], (hour[is_known] * (NUM_HOURS / 24)).astype(int))
        count = self.edge_hours[counter]
        self.edge_hours[counter] = np.minimum(count, 2**16 - 2) + 1

    def get_edge_hours(self, edges: np.ndarray) -> np.ndarray:
        """Return `edge_hours` of edges, (n,) -> (2, n, NUM_HOURS)."""
        num_counted = self.edge_hours.shape[1]
        if num_counted == 0:
            return np.zeros((2, len(edges), NUM_HOURS), dtype=np.uint16)
        return self.edge_hours[:, np.minimum(edges, num_counted - 1)]

    def to_json(self) -> dict[str, Any]:
        """Return JSON values of one home, from which `from_json` makes the same.

        But for `week` and `moments`.
        """
        counted = self.moves[0] if self.counts_moves else np.zeros((0, 0), dtype=np.int32)
        relations = self.look_relations
        return {
            "look_times": self.look_times[0].tolist(),
            **({} if relations is None else {"look_relations": relations[0].tolist()}),
            "moves": write_sparse(counted),
            "counters": {name: float(column[0]) for name, column in self.counters.items()},
            **dict(zip(_EDGE_HOURS, map(write_sparse, self.edge_hours), strict=True)),
        }

    @classmethod
    def from_json(
        cls, data: Mapping[str, Any], num_furniture: int, num_edges: int, time: int
    ) -> HomeHistory:
        """Read JSON values; raises ValueError, KeyError or TypeError if they fit no such home."""
        history, shape = cls(1, num_furniture), (num_furniture, NUM_LOOKS_KEPT)
        history.look_times[0] = _read_whole(data["look_times"], shape, (NEVER, time))
        if "look_relations" in data:
            relations = _read_whole(data["look_relations"], shape, (0, ALL))
            history.look_relations = relations[None].astype(np.uint8)
        limits = (num_furniture, num_furniture, 2**31)
        src, dst, count = read_sparse("moves", data["moves"], limits)
        if history.counts_moves:
            history.moves[0, src, dst] = count
        for column in HOME:
            value = float(data["counters"][column.name])
            if not column.low <= value < math.inf:
                raise ValueError(f"{column.name} must be a number, 0 or more, got {value}")
            history.counters[column.name][0] = value
        for outcome, name in enumerate(_EDGE_HOURS):
            edge, hour, count = read_sparse(name, data[name], (num_edges, NUM_HOURS, 2**16))
            if len(edge) and history.edge_hours.shape[1] == 0:
                history.edge_hours = np.zeros((2, num_edges, NUM_HOURS), dtype=np.uint16)
            history.edge_hours[outcome, edge, hour] = count
        return history

    def _note_answers(
        self, memory: Remembered, looked: np.ndarray, asked: Queries, is_found: np.ndarray
    ) -> None:
        """Count which simple rule would have led to the objects that were asked for and found.

        And whether they still were where they were last seen, if that is where the look was.
        """
        objects = memory.objects
        place = looked[asked.home]  # -1 where a home does not look
        is_there = (objects["last_furniture"][asked.object] == place) & (place >= 0)
        np.add.at(objects["num_sought"], asked.object[is_there], 1)
        np.add.at(objects["num_still"], asked.object[is_there & is_found], 1)
        if not is_found.any():
            return
        found = asked.take(is_found)
        found_at = looked[found.home]
        self.count("num_found", found.home)
        is_last = memory.objects["last_furniture"][found.object] == found_at
        self.count("num_last_right", found.home, is_last)
        query, edge = join_groups(found.object, memory.edges["object"], objects.num_rows)
        shape = (len(found_at), memory.num_furniture)
        place = np.ravel_multi_index((query, memory.edges["furniture"][edge]), shape)
        num_true = np.bincount(place, memory.edges["num_true"][edge], minlength=np.prod(shape))
        rate = num_true.reshape(shape) / (memory.furniture_num_observed[found.home] + 0.5)
        prior = sum_relations(found.prior)
        for name, score in (("num_common_right", rate), ("num_prior_right", prior)):
            is_right = (score.argmax(axis=1) == found_at) & score.any(axis=1)
            self.count(name, found.home, is_right)


def _make_moves(num_homes: int, num_furniture: int) -> np.ndarray:
    """Return no moves, (H, F, F); without any memory where they are not counted."""
    shape = (num_homes, num_furniture, num_furniture)
    if num_furniture > MOST_FURNITURE:
        return np.broadcast_to(np.int32(0), shape)
    return np.zeros(shape, dtype=np.int32)


def _read_whole(values: Any, shape: tuple[int, int], limits: tuple[int, int]) -> np.ndarray:
    """Return whole numbers between limits, int64 of a shape; raises `ValueError` of others."""
    array = np.array(values)
    if array.size == 0:
        array = np.zeros(shape, dtype=np.int64)
    if array.shape != shape or array.dtype != np.int64:
        raise ValueError(f"history must hold whole numbers of shape {shape}")
    if array.size and not (limits[0] <= array.min() and array.max() <= limits[1]):
        raise ValueError(f"history must lie in {limits[0]} to {limits[1]}")
    return array
