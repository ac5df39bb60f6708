"""What has changed in a home, and what is known of one thing over time."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Any

import numpy as np

from sgm.arrays.grouped import compute_starts, join_groups
from sgm.memory.clock import Clock
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import Thing
from sgm.messages import shorten
from sgm.schema import MAX_TIME, NEVER, RELATIONS
from sgm.store.event_kinds import STATEMENTS
from sgm.store.past import StoredSighting


@dataclass(frozen=True, slots=True)
class ThingChange:
    """That a thing is new, was moved, or is gone, noticed between two looks.

    Attributes:
        kind: "new" in the home, "moved" to another place, "gone" from its place and not seen
            elsewhere since, or "picked_up" by the robot.
        thing: its description.
        id: its id; empty if it has none.
        from_place: furniture id where it was; None for what is new, or where that was removed.
        to_place: furniture id where it is now; of what is new, where it was seen first. None for
            what is gone or carried, and where the memory keeps no first place of what has been
            moved since.
        after: time step of the last look that still showed it as before, or, of what is new, of
            the last one at its first place that did not show it; None if there was none.
        time: time step of the look, or of what was said, that shows the change.
        probability: how sure that is: the confidence of the sighting or statement. Of what is gone,
            by Bayes' rule, with the rates of moves and of misses that the memory has counted.
        by: who said so, "robot" for what it did itself; empty for what looks have shown.
        picture: path or id of one that shows it at `to_place`; None without one.
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
    picture: str | None = None


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
        picture: path or id of the latest one that shows it there; None without one.
    """

    time: int
    kind: str
    furniture: int | None
    relation: str | None
    confidence: float
    by: str = ""
    picture: str | None = None


def read_since(since: datetime | int, clock: Clock | None) -> int:
    """Return the time step that a time is in, or that is given.

    Raises:
        ValueError: if it is something else, or a date and there is no clock.
    """
    if isinstance(since, (int, np.integer)) and not isinstance(since, bool):
        return int(since)
    if not isinstance(since, datetime) or clock is None or since.tzinfo is not None:
        got = str(since) if isinstance(since, datetime) else shorten(since)
        raise ValueError(
            f"since must be a time step or, with a clock, a local date and time, got {got}. Give "
            "for example the present step less 24."
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
    for number, object_row in enumerate(rows.tolist()):
        thing = get_thing(object_row)
        thing_edges = edge[bounds[number] : bounds[number + 1]]
        thing_edges = thing_edges[edges["num_true"][thing_edges] > 0]
        # The latest sighting first, of equal ones the one that is still there, then the one of
        # which was spoken last: within a step a thing may be taken from one place to another.
        told = thing.order_places()
        sightings = zip(
            edges["last_true"][thing_edges].tolist(), edges["furniture"][thing_edges], strict=True
        )
        spoken = np.array(
            [told.get((time, furniture_ids[f]), -1) for time, f in sightings], dtype=int
        )
        thing_edges = thing_edges[
            np.lexsort(
                (
                    -spoken,
                    ~find_last_edges(batch, thing_edges),
                    ~batch.find_present(thing_edges),
                    -edges["last_true"][thing_edges],
                )
            )
        ]
        changes = _list_changes(batch, thing, object_row, thing_edges, furniture_ids)
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
    batch: MemoryBatch, thing: Thing, object_row: int, thing_edges: np.ndarray, ids: Sequence[int]
) -> Iterator[ThingChange]:
    """Yield the last changes of a thing.

    `thing_edges` are those that were ever true, the latest first, (n,).
    """
    objects, edges = batch.objects, batch.edges
    first = int(objects["first_observed"][object_row])
    if first == NEVER or objects["same_as"][object_row] >= 0:
        return
    places = _SeenPlaces(
        batch=batch,
        thing=thing,
        edges=thing_edges,
        furniture=[ids[position] for position in edges["furniture"][thing_edges]],
        last_true=edges["last_true"][thing_edges].tolist(),
        is_there=batch.find_present(thing_edges).tolist(),
        speakers={statement.time: statement.by for statement in thing.statements},
    )
    moved = int(objects["last_moved"][object_row])
    if places.furniture:
        yield places.tell_new(first, moved)
    carried = int(objects["carried_since"][object_row])
    if carried != NEVER:
        yield places.tell_picked_up(carried)
        return
    is_single = objects["num_at_once"][object_row] <= 1
    if is_single:
        yield from places.list_moved(first, moved)
    yield from places.list_gone(is_single)


@dataclass(frozen=True, slots=True)
class _SeenPlaces:
    """The n places where a thing was ever seen, the latest first, and what they say of changes.

    Attributes:
        batch: the memory.
        thing: what it is called, and what was said of it.
        edges: row of the edge of each, (n,).
        furniture: id of each.
        last_true: time step of the last sighting at each.
        is_there: whether it is at each by the last looks.
        speakers: who said something of it, by time step.
    """

    batch: MemoryBatch
    thing: Thing
    edges: np.ndarray
    furniture: Sequence[int]
    last_true: Sequence[int]
    is_there: Sequence[bool]
    speakers: Mapping[int, str]

    @property
    def _current(self) -> int | None:
        """Number of the place where it is, the latest of several; None if it is at none."""
        return next((number for number, present in enumerate(self.is_there) if present), None)

    def tell_new(self, first: int, moved: int) -> ThingChange:
        """Tell that it is new since its first sighting; `moved` is when it was moved last."""
        speaker = self.speakers.get(first, "")
        number: int | None = self._current or 0
        if moved > first:
            number = self.last_true.index(first) if first in self.last_true else None
        if number is None:
            return self._make("new", None, None, None, first, 1.0, speaker)
        edge = self.edges[number]
        before = _find_look_before(self.batch, int(self.batch.edges["furniture"][edge]), first)
        sure = self._get_confidence(edge)
        return self._make("new", None, self.furniture[number], before, first, sure, speaker)

    def tell_picked_up(self, carried: int) -> ThingChange:
        """Tell that the robot carries it since a time step."""
        was_at, sure = _get_held(self.thing, carried)
        pairs = zip(self.last_true, self.furniture, strict=True)
        last = max((time for time, place in pairs if place == was_at), default=None)
        return self._make("picked_up", was_at, None, last, carried, sure, "robot")

    def list_moved(self, first: int, moved: int) -> Iterator[ThingChange]:
        """Yield that it was moved, if it was so after its first sighting, to where it is."""
        put_down = [said.time for said in self.thing.statements if said.kind == "put_down"]
        moved = max([moved, *put_down[-1:]])
        number = self._current
        if number is None or moved <= first:
            return
        place = self.furniture[number]
        for other, last in zip(self.furniture, self.last_true, strict=True):
            if other != place and last <= moved:
                sure = self._get_confidence(self.edges[number])
                speaker = self.speakers.get(moved, "")
                yield self._make("moved", other, place, last, moved, sure, speaker)
                return

    def list_gone(self, is_single: bool) -> Iterator[ThingChange]:
        """Yield where it is no more: the latest place of a single thing that is nowhere, else all.

        Of several things of one description, one may have been moved from there.
        """
        if is_single and self._current is not None:
            return
        gone = [number for number, present in enumerate(self.is_there) if not present]
        for number in gone[: 1 if is_single else None]:
            edge = int(self.edges[number])
            time = int(self.batch.edges["last_changed"][edge])
            if not is_single and time in self.speakers:
                continue
            sure = _compute_gone(self.batch, edge)
            yield self._make(
                "gone", self.furniture[number], None, self.last_true[number], time, sure
            )

    def _get_confidence(self, edge: int) -> float:
        return float(self.batch.edges["confidence"][edge])

    def _make(self, kind: str, *about: Any) -> ThingChange:
        change = ThingChange(kind, self.thing.description, self.thing.id, *about)
        shown = [row for row in self.thing.pictures if row.furniture == change.to_place]
        return replace(change, picture=shown[-1].picture) if shown else change


def _find_look_before(batch: MemoryBatch, position: int, time: int) -> int | None:
    """Return the last look at furniture before a time step, None if none is remembered."""
    looks = batch.history.look_times[0, position]
    before = looks[(looks != NEVER) & (looks < time)]
    return int(before.max()) if len(before) else None


def find_last_edges(batch: MemoryBatch, edges: np.ndarray) -> np.ndarray:
    """Mark edges (n,) that lead to where their things were seen last, bool (n,)."""
    thing, table = batch.edges["object"][edges], batch.edges
    is_last: np.ndarray = table["furniture"][edges] == batch.objects["last_furniture"][thing]
    return is_last & (table["last_true"][edges] == batch.objects["last_observed"][thing])


def _get_held(thing: Thing, since: int) -> tuple[int | None, float]:
    """Return where the robot took a thing from, if that was one place, and how sure it has it."""
    for statement in thing.statements:
        if (statement.kind, statement.time) == ("picked_up", since):
            place = statement.was_at[0] if len(statement.was_at) == 1 else None
            return place, statement.confidence
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
    batch: MemoryBatch,
    thing: Thing,
    object_row: int,
    places: Sequence[SeenAt],
    ids: Sequence[int],
    past: Sequence[StoredSighting] | None = None,
) -> list[ThingEvent]:
    """List what is kept of a thing over time, the latest first.

    That is what was said of it, and where it was seen: all that a file has of it, `past`, the
    latest first; without one, the last that was said, and the last sighting at each of the
    `places` where it was ever seen. `ids` are of furniture, by position.
    """
    edges = batch.edges
    events = [
        ThingEvent(seen.time, "seen", None, None, 1.0)
        for seen in places
        if seen.furniture is None and not seen.by
    ]
    told = {(statement.time, statement.furniture) for statement in thing.statements}
    seen_edges = np.flatnonzero((edges["object"] == object_row) & (edges["num_true"] > 0))
    seen_edges = seen_edges[np.argsort(~find_last_edges(batch, seen_edges), kind="stable")]
    if past is None:
        events = [*_list_said(thing), *events]
    else:
        events += _list_past(thing, past)
    for edge in seen_edges.tolist():
        furniture = ids[edges["furniture"][edge]]
        relation = RELATIONS[edges["relation"][edge]]
        seen, changed = int(edges["last_true"][edge]), int(edges["last_changed"][edge])
        if past is None and (seen, furniture) not in told:
            sure = float(edges["confidence"][edge])
            picture = thing.find_picture(furniture, relation)
            events.append(ThingEvent(seen, "seen", furniture, relation, sure, picture=picture))
        if not edges["is_true"][edge] and not any(time == changed for time, _ in told):
            events.append(ThingEvent(changed, "missed", furniture, relation, 1.0))
    return sorted(events, key=lambda event: -event.time)


def _list_said(thing: Thing) -> Iterator[ThingEvent]:
    """Yield what was said of a thing last; of one time step, the latest first, too."""
    for statement in reversed(thing.statements):
        about = statement.furniture, statement.relation, statement.confidence, statement.by
        yield ThingEvent(statement.time, statement.kind, *about)


def _list_past(thing: Thing, past: Sequence[StoredSighting]) -> Iterator[ThingEvent]:
    """Yield what a file has of a thing; its last picture at a place is that of the last time."""
    pictured: set[tuple[int, str]] = set()
    for row in past:
        picture = None
        if row.said is None and row.place is not None and row.relation is not None:
            if (row.place, row.relation) not in pictured:
                picture = thing.find_picture(row.place, row.relation)
            pictured.add((row.place, row.relation))
        about = row.place, row.relation, row.confidence, row.by or ""
        yield ThingEvent(row.time, row.said or "seen", *about, picture=picture)


def read_past(rows: Iterable[StoredSighting], places: Collection[int]) -> list[StoredSighting]:
    """Return what a file has of a thing; a place that came to it since is left out.

    Raises:
        ValueError: for what no memory wrote; the file may come from anyone.
    """
    found = []
    for row in rows:
        is_right = (
            type(row.time) is int
            and 0 <= row.time <= MAX_TIME
            and (row.place is None or type(row.place) is int)
            and row.relation in (None, *RELATIONS)
            and (row.place is None) == (row.relation is None)
            and isinstance(row.confidence, float)
            and 0 <= row.confidence <= 1
            and row.said in (None, *STATEMENTS)
            and (row.by is None or isinstance(row.by, str))
        )
        if not is_right:
            raise ValueError(
                f"every sighting of a memory file must be one that SceneGraphMemory wrote, got "
                f"{shorten(tuple(row))}. It was altered: use a copy."
            )
        if row.place is None or row.place in places:
            found.append(row)
    return found


def list_sighted(rows: Iterable[StoredSighting]) -> list[ThingEvent]:
    """Return what a file has of a thing around a time, the earliest first."""
    events = [
        ThingEvent(
            row.time, row.said or "seen", row.place, row.relation, row.confidence, row.by or ""
        )
        for row in rows
    ]
    return sorted(events, key=lambda event: event.time)


def list_arrivals(
    events: Iterable[ThingEvent], changes: Iterable[ThingChange], thing: str
) -> list[ThingEvent]:
    """Return when a thing is known to have been where, by all that is kept, the earliest first.

    That is its `events` without those that missed it, and its arrivals by all `changes`.
    """
    found = [event for event in events if event.kind != "missed"]
    relations = {event.furniture: event.relation for event in reversed(found)}
    of_thing = [change for change in changes if change.thing == thing]
    for change in of_thing:
        if change.kind in ("new", "moved") and change.to_place is not None:
            about = change.to_place, relations.get(change.to_place), change.probability
            found.append(ThingEvent(change.time, "seen", *about, change.by))
    return sorted(found, key=lambda event: event.time)
