"""What has changed in a home, and what is known of one thing over time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime

import numpy as np

from sgm.arrays.grouped import compute_starts, join_groups
from sgm.memory.clock import Clock
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import Thing
from sgm.messages import shorten
from sgm.schema import NEVER, RELATIONS


@dataclass(frozen=True, slots=True)
class ThingChange:
    """That a thing is new, was moved, or is gone, noticed between two looks.

    Attributes:
        kind: "new" in the home, "moved" to another place, "gone" from its place and not seen
            elsewhere since, or "picked_up" by the robot.
        thing: its description.
        id: its id; empty if it has none.
        from_place: furniture id where it was; None for what is new, or where that was removed.
        to_place: furniture id where it is now, of what is new, too; None for what is gone or
            carried.
        after: time step of the last look that still showed it as before, or, of what is new, of
            the last one at its place that did not show it; None if there was none, or if what is
            new has been moved since: where it came to first is not kept.
        time: time step of the look, or of what was said, that shows the change.
        probability: how sure that is: the confidence of the sighting or statement. Of what is gone,
            by Bayes' rule, with the rates of moves and of misses that the memory has counted.
        by: who said so, "robot" for what it did itself; empty for what looks have shown.
    """

    kind: str
    thing: str
    id: str
    from_place: int | None
    to_place: int | None
    after: int | None
    time: int
    probability: float
    by: str = ""


@dataclass(frozen=True, slots=True)
class ThingEvent:
    """Something that is known of a thing at a time.

    Attributes:
        time: time step.
        kind: "seen", "missed" by a look at where it had been seen, or what was said or done:
            "moved", "picked_up", "put_down".
        furniture: id of the place; None with the robot, or where it was removed.
        relation: such as "in" or "onTop" it; None without a place.
        confidence: of the sighting or statement; 1 of a look that missed it.
        by: who said so; empty for looks.
    """

    time: int
    kind: str
    furniture: int | None
    relation: str | None
    confidence: float
    by: str = ""


def read_since(since: datetime | int, clock: Clock | None) -> int:
    """Return the time step that a time is in, or that is given.

    Raises:
        ValueError: if it is something else, or a date and there is no clock.
    """
    if isinstance(since, (int, np.integer)) and not isinstance(since, bool):
        return int(since)
    if not isinstance(since, datetime) or clock is None or since.tzinfo is not None:
        raise ValueError(
            f"since must be a time step or, with a clock, a local date and time, got "
            f"{shorten(since)}. Give for example memory.time - 24."
        )
    return int((since - clock.start).total_seconds() // clock.step_seconds)


def list_changes(
    batch: MemoryBatch,
    get_thing: Callable[[int], Thing],
    spoken_of: Sequence[int],
    furniture_ids: Sequence[int],
    since: int,
) -> list[ThingChange]:
    """List what was noticed to have changed in a home from a time step on, the latest first.

    Args:
        batch: the memory, what was merged as one.
        get_thing: what an object is called, and what was said of it, by its row.
        spoken_of: rows of the objects of which something was said.
        furniture_ids: by position.
        since: the time step.
    """
    edges = batch.edges
    rows = _find_changed(batch, spoken_of, since)
    asked, edge = join_groups(rows, edges["object"], batch.objects.num_rows)
    edge = edge[np.argsort(asked, kind="stable")]
    bounds = compute_starts(np.bincount(asked, minlength=len(rows)))
    found: list[ThingChange] = []
    for number, row in enumerate(rows.tolist()):
        thing = get_thing(row)
        own = edge[bounds[number] : bounds[number + 1]]
        own = own[edges["num_true"][own] > 0]
        # The latest sighting first, of equal ones the one that is still there, then the one of
        # which was spoken last: within a step a thing may be taken from one place to another.
        told = thing.order_places()
        at = zip(edges["last_true"][own].tolist(), edges["furniture"][own], strict=True)
        spoken = np.array([told.get((time, furniture_ids[f]), -1) for time, f in at], dtype=int)
        own = own[np.lexsort((-spoken, ~edges["is_true"][own], -edges["last_true"][own]))]
        changes = _list_changes(batch, thing, row, own, furniture_ids)
        found += [change for change in changes if change.time >= since]
    return sorted(found, key=lambda change: -change.time)


def _find_changed(batch: MemoryBatch, spoken_of: Sequence[int], since: int) -> np.ndarray:
    """Return the rows of the objects that may have changed from a time step on, ascending, (n,)."""
    objects, edges = batch.objects, batch.edges
    times = ("first_observed", "carried_since", "last_moved")
    has_changed = np.logical_or.reduce([objects[name] >= since for name in times])
    left = ~edges["is_true"] & (edges["num_true"] > 0) & (edges["last_changed"] >= since)
    has_changed[edges["object"][left]] = True
    has_changed[list(spoken_of)] = True
    return np.flatnonzero(has_changed)


def _list_changes(
    batch: MemoryBatch, thing: Thing, row: int, own: np.ndarray, ids: Sequence[int]
) -> Iterator[ThingChange]:
    """Yield the last changes of a thing; `own` are its edges once true, the latest first, (n,)."""
    objects, edges = batch.objects, batch.edges
    place = [ids[position] for position in edges["furniture"][own]]
    last_true = edges["last_true"][own].tolist()
    is_true = edges["is_true"][own].tolist()
    there = [number for number, true in enumerate(is_true) if true]
    said = {one.time: one for one in thing.statements}
    first = int(objects["first_observed"][row])
    if first == NEVER or objects["same_as"][row] >= 0:
        return
    name = thing.description, thing.id
    if place:
        here = there[0] if there else 0
        by = said[first].by if first in said else ""
        sure = float(edges["confidence"][own[here]])
        was_moved = int(objects["last_moved"][row]) > first
        position = int(edges["furniture"][own[here]])
        before = None if was_moved else _find_look_before(batch, position, first)
        yield ThingChange("new", *name, None, place[here], before, first, sure, by)
    carried = int(objects["carried_since"][row])
    if carried != NEVER:
        was_at, sure = _get_held(thing, carried)
        seen_there = [t for t, at in zip(last_true, place, strict=True) if at == was_at]
        last = max(seen_there, default=None)
        yield ThingChange("picked_up", *name, was_at, None, last, carried, sure, "robot")
        return
    moved = int(objects["last_moved"][row])
    put_down = [one for one in thing.statements if one.kind == "put_down"]
    if put_down and put_down[-1].time > moved:
        moved = put_down[-1].time
    is_single = objects["num_at_once"][row] <= 1
    if is_single and there and len(place) > 1 and moved > first:
        here = there[0]
        elsewhere = [n for n, at in enumerate(place) if at != place[here] and last_true[n] <= moved]
        if elsewhere:
            came = elsewhere[0]
            by = said[moved].by if moved in said else ""
            sure = float(edges["confidence"][own[here]])
            at = place[came], place[here]
            yield ThingChange("moved", *name, *at, last_true[came], moved, sure, by)
    gone = [] if there and is_single else [n for n, true in enumerate(is_true) if not true]
    for number in gone[: 1 if is_single else None]:
        edge = own[number]
        time = int(edges["last_changed"][edge])
        if not is_single and time in said:
            continue  # one of several that was moved
        sure = _compute_gone(batch, int(edge))
        yield ThingChange("gone", *name, place[number], None, last_true[number], time, sure)


def _find_look_before(batch: MemoryBatch, position: int, time: int) -> int | None:
    """Return the last look at furniture before a time step, None if none is remembered."""
    looks = batch.history.look_times[0, position]
    before = looks[(looks != NEVER) & (looks < time)]
    return int(before.max()) if len(before) else None


def _get_held(thing: Thing, since: int) -> tuple[int | None, float]:
    """Return where the robot took a thing from, if that was one place, and how sure it has it."""
    for one in thing.statements:
        if (one.kind, one.time) == ("picked_up", since):
            return (one.was_at[0] if len(one.was_at) == 1 else None), one.confidence
    return None, 1.0


def _compute_gone(batch: MemoryBatch, edge: int) -> float:
    """Return how likely a thing has left a place, which looks since have missed there."""
    edges, history = batch.edges, batch.history
    rate, miss = float(history.compute_move_rate()[0]), float(history.compute_miss_rate()[0])
    steps = max(int(edges["last_changed"][edge] - edges["last_true"][edge]), 0)
    stayed = float(np.exp(-rate * max(steps, 1))) * miss ** float(edges["missed"][edge])
    left = 1 - float(np.exp(-rate * max(steps, 1)))
    return left / (left + stayed)


def list_events(
    batch: MemoryBatch, thing: Thing, row: int, places: Sequence[SeenAt], ids: Sequence[int]
) -> list[ThingEvent]:
    """List what is kept of a thing over time, the latest first.

    That is what was said of it, and `places` where it was ever seen; `ids` are of furniture, by
    position.
    """
    edges = batch.edges
    events = [
        ThingEvent(one.time, one.kind, one.furniture, one.relation, one.confidence, one.by)
        for one in reversed(thing.statements)  # of one time step, the latest first, too
    ]
    events += [
        ThingEvent(one.time, "seen", None, None, 1.0)
        for one in places
        if one.furniture is None and not one.by
    ]
    told = {(one.time, one.furniture) for one in thing.statements}
    for edge in np.flatnonzero((edges["object"] == row) & (edges["num_true"] > 0)):
        furniture = ids[edges["furniture"][edge]]
        relation = RELATIONS[edges["relation"][edge]]
        seen, changed = int(edges["last_true"][edge]), int(edges["last_changed"][edge])
        if (seen, furniture) not in told:
            sure = float(edges["confidence"][edge])
            events.append(ThingEvent(seen, "seen", furniture, relation, sure))
        if not edges["is_true"][edge] and not any(time == changed for time, _ in told):
            events.append(ThingEvent(changed, "missed", furniture, relation, 1.0))
    return sorted(events, key=lambda event: -event.time)
