"""A trace from the events of a robot's memory: where things were, as far as its looks tell."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import groupby
from typing import Any, NamedTuple

from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout
from sgm.layout.turns import turn_flat
from sgm.memory.clock import DEFAULT_STEP_SECONDS, Clock
from sgm.memory.look import Coverage, split_coverage
from sgm.memory.memory_event import MemoryEvent
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import Point, read_relation
from sgm.names.words import read_name, read_words
from sgm.schema import RELATIONS
from simulator.trace.events import GONE, Event
from simulator.trace.layout import get_label, number_names
from simulator.trace.trace import Trace

_COUNTED = 0.5  # a sighting of less confidence is none; parts of looks that make so much are one

Name = tuple[str, ...]  # of a thing: `read_name` of what it is called


class LoggedSpot(NamedTuple):
    """Where at a piece of furniture a thing was seen: a relation, and x, y, z in the map."""

    relation: int
    position: Point | None = None


@dataclass(frozen=True, slots=True)
class LoggedLook:
    """What was seen at a piece of furniture, or that one thing was not."""

    time_s: float
    place: int  # index into the furniture of the trace
    coverage: tuple[float, ...]  # share of each relation in view; 1 where it was removed
    seen: dict[Name, list[LoggedSpot]]  # where on it each thing was seen
    sought: Name | None = None  # the one thing that would have been seen; None for all
    hidden: frozenset[Name] = frozenset()  # things whose spots were out of view


@dataclass(slots=True)
class LoggedThing:
    """One object of the trace, as it was last seen."""

    name: str
    description: str
    place: int = GONE  # also since it was seen absent there
    spot: LoggedSpot = field(default_factory=lambda: LoggedSpot(relation=0))
    time_s: float = -math.inf
    unseen: float = 0.0  # parts of looks at its place that did not show it since


def make_trace(lines: Sequence[MemoryEvent], name: str = "home") -> Trace:
    """Make a trace from the events of a memory.

    Where a thing was between two looks is unknown. The trace says: where it was last seen, until

    - it is seen elsewhere, said to be there, or put there by the robot: it is there from then on,
      and moved in that step;
    - a look at its place does not show it, or looks at parts of it that make half a look: then it
      has left the home, until it is seen again. So nothing is said, and nothing asked, of a thing
      that the robot itself did not know of.

    An event has the position at which the thing was seen first since it is there, in the frame of
    the map that the memory had last.

    Things are distinguished by their words, as in the memory. Of one name there are as many as were
    seen in one time step; which one is seen is not told: one that stayed, else one that is gone,
    else the one whose last sighting is longest ago. Furniture that was moved
    stands where it stood last; what lay on furniture that was removed is gone. What was taken out
    of the memory (`remove_object`) was never there. A sighting of less than one half is none.

    Raises:
        ValueError: if nothing was seen, or a line names a room or furniture that there is not.
    """
    clocks = [line.values["clock"] for line in lines if line.kind == "start"]
    starts = (clock.start for clock in clocks if clock is not None)
    reader = _LogReader(min(starts, default=None))
    for line in lines:
        try:
            reader.read(line)
        except KeyError as error:
            raise ValueError(
                f"every {line.kind} of a log must be of furniture that was added, got "
                f"{error.args[0]} at time step {line.time}. Mend the line, or take it out."
            ) from None
    looks = sorted(reader.looks, key=lambda look: look.time_s)
    things = _LoggedThings(reader.descriptions)
    for time_s, group in groupby(looks, key=lambda look: look.time_s):
        things.see(time_s, list(group))
    if not things.events:
        raise ValueError(
            f"log must hold a sighting, got {len(looks)} looks without one. Log more of the home."
        )
    until_s = max(looks[-1].time_s, things.events[-1].time_s) or None
    return Trace(
        name, reader.make_layout(), tuple(things.events), start=reader.start, until_s=until_s
    )


def split_trace(trace: Trace, shares: Mapping[str, float]) -> dict[str, Trace]:
    """Cut a trace by time: "train" first, then the others.

    Each part begins with all that was at its place then.

    Args:
        trace: what is cut.
        shares: of the time by name, in order; what is left is "train". Parts of 0 are left out.

    Raises:
        ValueError: if a share is negative, or nothing is left to train on.
    """
    left = 1 - sum(shares.values())
    if min(shares.values()) < 0 or left <= 0:
        raise ValueError(
            "val_share and test_share must be 0 or more and leave some time to train on, got "
            f"{', '.join(map(str, shares.values()))}. Take 0.2 of each."
        )
    parts: dict[str, Trace] = {}
    begin_s, length_s = trace.start_s, trace.end_s - trace.start_s
    for name, share in {"train": left, **shares}.items():
        if share > 0:
            end_s = begin_s + share * length_s
            parts[name] = _cut(trace, name, begin_s, end_s)
            begin_s = end_s
    return parts


def _cut(trace: Trace, name: str, begin_s: float, end_s: float) -> Trace:
    """Return the part of a trace that begins with everything at its place."""
    event_of = {event.object: event for event in trace.events if event.time_s <= begin_s}
    events: list[Event] = []
    named: set[str] = set()
    for event in (
        *(replace(event, time_s=begin_s) for event in event_of.values()),
        *(event for event in trace.events if begin_s < event.time_s <= end_s),
    ):
        if event.furniture != GONE or event.object in named:  # what goes must have been there
            events.append(event)
            named.add(event.object)
    return replace(trace, name=name, events=tuple(events), truth=None, until_s=end_s)


class _LogReader:
    """Follows the layout through a log, and gathers the looks.

    Attributes:
        start: date and time of time 0, when the step 0 of the earliest clock was; None if unknown.
        looks: in the order of the log.
        descriptions: of things, as first written.
    """

    def __init__(self, start: datetime | None) -> None:
        self.start = start
        self.looks: list[LoggedLook] = []
        self.descriptions: dict[Name, str] = {}
        self._step_seconds = DEFAULT_STEP_SECONDS
        self._shift_s = 0.0  # of the memory's step 0
        self._time_s = 0.0
        self._room_labels: list[str] = []
        self._nodes: list[Furniture] = []  # `room` is an index
        self._known_rooms: dict[tuple[int, str], int] = {}
        self._known_nodes: dict[tuple[int, str, str], int] = {}
        self._rooms: dict[int, int] = {}  # index in the trace by number in the memory
        self._places: dict[int, int] = {}
        self._calibration: ScoreCalibration | None = None  # of the memory that goes on

    def read(self, line: MemoryEvent) -> None:
        """Take over what a line says; KeyError if what it names was never added."""
        values = line.values
        if line.kind == "start":
            self._start(line)
            return
        self._time_s = self._shift_s + line.time * self._step_seconds
        if line.kind == "room":
            self._add_room(values["room"], values["label"])
        elif line.kind == "rename_room":
            self._room_labels[self._rooms[values["room"]]] = values["label"]
        elif line.kind == "furniture":
            node = Furniture(
                values["label"],
                values["room"],
                values["description"],
                box=values.get("box"),
                open_cost=values.get("open_cost"),
            )
            self._add_furniture(values["furniture"], node)
        elif line.kind == "merge_furniture":
            kept, gone = self._places[values["furniture"]], self._places.pop(values["other"])
            self.looks = [
                replace(look, place=kept) if look.place == gone else look for look in self.looks
            ]
        elif line.kind == "remove_room":
            room = self._rooms[values["room"]]
            for place in self._places.values():
                if self._nodes[place].room == room:
                    self._add_look(place, 1.0, {})
        elif line.kind == "transform":
            self._transform(values["angle"], values["shift"])
        elif line.kind == "remove_object":
            for look in self.looks:
                look.seen.pop(read_name(values["description"]), None)
        elif line.kind in (
            "move",
            "name",
            "remove_furniture",
            "look",
            "absent",
            "moved",
            "put_down",
        ):
            self._read_place(line.kind, self._places[values["furniture"]], values)

    def _read_place(self, command: str, place: int, values: Mapping[str, Any]) -> None:
        """Take over what a line says of a piece of furniture."""
        if command == "move":
            room = self._rooms[values["room"]]
            self._nodes[place] = replace(self._nodes[place], room=room, box=values.get("box"))
        elif command == "name":
            label, description = values["label"], values["description"]
            self._nodes[place] = replace(self._nodes[place], label=label, description=description)
            self._known_nodes[values["furniture"], label, description] = place
        elif command == "remove_furniture":
            self._add_look(place, 1.0, {})
        elif command == "look":
            self._read_look(place, values)
        elif command == "absent":
            self._add_look(place, values["coverage"], {}, read_name(values["description"]))
        else:  # where a thing was said to be, or was put, and nothing of others there
            name = (values["id"],) if "id" in values else read_name(values["description"])
            words = read_words("description", values["description"])
            self.descriptions.setdefault(name, words)
            relation = RELATIONS.index(read_relation(values["relation"]))
            self._add_look(place, 0.0, {name: [LoggedSpot(relation=relation)]})

    def _transform(self, angle: float, shift: tuple[float, float]) -> None:
        """Move all that was known in the map until now into the frame of another one."""
        self._nodes = [node.transform(angle, shift) for node in self._nodes]
        for look in self.looks:
            for spots in look.seen.values():
                for number, (relation, position) in enumerate(spots):
                    if position is not None:
                        x, y = turn_flat(*position[:2], angle, shift)
                        spots[number] = LoggedSpot(relation=relation, position=(x, y, position[2]))

    def make_layout(self) -> Layout:
        """Return rooms and furniture; those of one label are numbered."""
        rooms = [read_words("label", label) for label in self._room_labels]
        labels = [read_words("label", node.label) for node in self._nodes]
        names = number_names(list(map(get_label, labels)))
        return Layout.of(
            map(Room, rooms, number_names(list(map(get_label, rooms)))),
            (
                replace(node, name=name, label=label)
                for node, name, label in zip(self._nodes, names, labels, strict=True)
            ),
        )

    def _start(self, line: MemoryEvent) -> None:
        """Go on with another memory of the home; what has the same number and name is the same."""
        clock: Clock | None = line.values["clock"]
        self._step_seconds = DEFAULT_STEP_SECONDS if clock is None else clock.step_seconds
        if clock is not None and self.start is not None:
            self._shift_s = (clock.start - self.start).total_seconds()
        elif self._shift_s + line.time * self._step_seconds < self._time_s:
            # a new memory, an unknown time later: one step
            self._shift_s = self._time_s + self._step_seconds * (1 - line.time)
        self._calibration = line.values["memory"].score_calibration
        self._rooms, self._places = {}, {}
        layout: Layout = line.values["layout"]
        for number, room in layout.rooms.items():
            self._add_room(number, room.label)
        for number, node in layout.furniture.items():
            self._add_furniture(number, node)

    def _add_room(self, number: int, label: str) -> None:
        index = self._known_rooms.setdefault((number, label), len(self._room_labels))
        if index == len(self._room_labels):
            self._room_labels.append(label)
        self._rooms[number] = index

    def _add_furniture(self, number: int, node: Furniture) -> None:
        node = replace(node, room=self._rooms[node.room])
        key = number, node.label, node.description
        index = self._known_nodes.setdefault(key, len(self._nodes))
        self._nodes[index:] = [node, *self._nodes[index + 1 :]]
        self._places[number] = index

    def _read_look(self, place: int, values: Mapping[str, Any]) -> None:
        seen: dict[Name, list[LoggedSpot]] = defaultdict(list)
        for description, relation, score, *about in values["seen"]:
            confidence = score if self._calibration is None else self._calibration(score)
            if confidence >= _COUNTED:
                name = (about[1],) if about and about[1] else read_name(description)
                self.descriptions.setdefault(name, read_words("description", description))
                position = tuple(about[3]) if len(about) > 3 else None
                number = RELATIONS.index(read_relation(relation))
                seen[name].append(LoggedSpot(relation=number, position=position))
        hidden = frozenset(map(read_name, values.get("hidden", ())))
        self._add_look(place, values["coverage"], seen, None, hidden)

    def _add_look(
        self,
        place: int,
        coverage: Coverage,
        seen: dict[Name, list[LoggedSpot]],
        sought: Name | None = None,
        hidden: frozenset[Name] = frozenset(),
    ) -> None:
        shares = split_coverage(coverage)
        self.looks.append(LoggedLook(self._time_s, place, shares, seen, sought, hidden))


class _LoggedThings:
    """Follows every thing through the looks."""

    def __init__(self, descriptions: Mapping[Name, str]) -> None:
        self.events: list[Event] = []
        self._descriptions = descriptions
        self._things: dict[Name, list[LoggedThing]] = defaultdict(list)
        self._num_called = Counter[str]()

    def see(self, time_s: float, looks: Sequence[LoggedLook]) -> None:
        """Take over all looks of one time step, in order."""
        seen: dict[Name, dict[int, list[LoggedSpot]]] = defaultdict(dict)
        for look in looks:
            for name, spots in look.seen.items():
                if len(spots) >= len(seen[name].get(look.place, ())):
                    seen[name][look.place] = spots
        for name, things in list(self._things.items()):
            self._lose(time_s, name, things, looks, seen.get(name, {}))
        for name, places in seen.items():
            self._place(time_s, name, places)

    def _lose(
        self,
        time_s: float,
        name: Name,
        things: list[LoggedThing],
        looks: Sequence[LoggedLook],
        seen: Mapping[int, Sequence[LoggedSpot]],
    ) -> None:
        """Let things go that looks at their places did not show."""
        unseen: dict[int, list[float]] = defaultdict(lambda: [0.0, 0.0])  # by relation
        for look in looks:
            if look.sought in (None, name) and name not in look.hidden:
                for relation, share in enumerate(look.coverage):
                    unseen[look.place][relation] += share
        for place, coverage in unseen.items():
            at_place = sorted((t for t in things if t.place == place), key=lambda t: -t.time_s)
            for thing in at_place[len(seen.get(place, ())) :]:
                thing.unseen += coverage[thing.spot.relation]
                if thing.unseen >= _COUNTED:
                    thing.place = GONE
                    self._note(time_s, thing)

    def _place(self, time_s: float, name: Name, seen: Mapping[int, Sequence[LoggedSpot]]) -> None:
        """Say where the things of a name are that were seen."""
        things = self._things[name]
        for place, spots in seen.items():
            at_place = [thing for thing in things if thing.place == place]
            for thing, spot in zip(at_place, spots, strict=False):
                self._put(time_s, thing, place, spot)
        for place, spots in seen.items():
            num_there = sum(thing.place == place for thing in things)
            for spot in spots[num_there:]:
                away = [thing for thing in things if thing.time_s < time_s]
                away.sort(key=lambda t: (t.place != GONE, t.time_s))
                if not away:
                    things.append(self._make(name))
                    away = things[-1:]
                self._put(time_s, away[0], place, spot)

    def _make(self, name: Name) -> LoggedThing:
        description = self._descriptions[name]
        called = get_label(description)
        self._num_called[called] += 1
        number = self._num_called[called]
        return LoggedThing(called if number == 1 else f"{called} {number}", description)

    def _put(self, time_s: float, thing: LoggedThing, place: int, spot: LoggedSpot) -> None:
        is_new = (thing.place, thing.spot.relation) != (place, spot.relation)
        thing.place, thing.spot, thing.time_s, thing.unseen = place, spot, time_s, 0.0
        if is_new:
            self._note(time_s, thing)

    def _note(self, time_s: float, thing: LoggedThing) -> None:
        relation, position = thing.spot
        if thing.place == GONE:
            position = None
        self.events.append(
            Event(time_s, thing.name, thing.description, thing.place, relation, position)
        )
