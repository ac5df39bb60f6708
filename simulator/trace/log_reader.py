"""Looks and the layout of a home, read from the events of a robot's memory."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from datetime import datetime
from typing import NamedTuple

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
from sgm.store.event_kinds import START, get_by_kind
from simulator.trace.layout import get_label, number_names

COUNTED = 0.5  # a sighting of less confidence is none; parts of looks that make so much are one

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


class LogReader:
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
        read = get_by_kind(READS, line.kind, __name__)
        if line.kind != START:
            self._time_s = self._shift_s + line.time * self._step_seconds
        read(self, line)

    def _read_room(self, line: MemoryEvent) -> None:
        self._add_room(line.values["room"], line.values["label"])

    def _rename_room(self, line: MemoryEvent) -> None:
        self._room_labels[self._rooms[line.values["room"]]] = line.values["label"]

    def _remove_room(self, line: MemoryEvent) -> None:
        room = self._rooms[line.values["room"]]
        for place in self._places.values():
            if self._nodes[place].room == room:
                self._add_look(place, 1.0, {})

    def _read_furniture(self, line: MemoryEvent) -> None:
        values = line.values
        node = Furniture(
            values["label"],
            values["room"],
            values["description"],
            box=values.get("box"),
            open_cost=values.get("open_cost"),
        )
        self._add_furniture(values["furniture"], node)

    def _move_furniture(self, line: MemoryEvent) -> None:
        place, room = self._find_place(line), self._rooms[line.values["room"]]
        self._nodes[place] = replace(self._nodes[place], room=room, box=line.values.get("box"))

    def _name_furniture(self, line: MemoryEvent) -> None:
        place, label = self._find_place(line), line.values["label"]
        description = line.values["description"]
        self._nodes[place] = replace(self._nodes[place], label=label, description=description)
        self._known_nodes[line.values["furniture"], label, description] = place

    def _merge_furniture(self, line: MemoryEvent) -> None:
        kept, gone = self._find_place(line), self._places.pop(line.values["other"])
        self.looks = [
            replace(look, place=kept) if look.place == gone else look for look in self.looks
        ]

    def _remove_furniture(self, line: MemoryEvent) -> None:
        self._add_look(self._find_place(line), 1.0, {})

    def _read_absent(self, line: MemoryEvent) -> None:
        sought = read_name(line.values["description"])
        self._add_look(self._find_place(line), line.values["coverage"], {}, sought)

    def _read_statement(self, line: MemoryEvent) -> None:
        """Read where a thing was said to be, or was put, and nothing of others there."""
        place, values = self._find_place(line), line.values
        name = (values["id"],) if "id" in values else read_name(values["description"])
        words = read_words("description", values["description"])
        self.descriptions.setdefault(name, words)
        relation = RELATIONS.index(read_relation(values["relation"]))
        self._add_look(place, 0.0, {name: [LoggedSpot(relation=relation)]})

    def _remove_object(self, line: MemoryEvent) -> None:
        for look in self.looks:
            look.seen.pop(read_name(line.values["description"]), None)

    def _find_place(self, line: MemoryEvent) -> int:
        return self._places[line.values["furniture"]]

    def _transform(self, line: MemoryEvent) -> None:
        """Move all that was known in the map until now into the frame of another one."""
        angle, shift = line.values["angle"], line.values["shift"]
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

    def _read_look(self, line: MemoryEvent) -> None:
        place, values = self._find_place(line), line.values
        seen: dict[Name, list[LoggedSpot]] = defaultdict(list)
        for description, relation, score, *about in values["seen"]:
            confidence = score if self._calibration is None else self._calibration(score)
            if confidence >= COUNTED:
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

    def _pass(self, line: MemoryEvent) -> None:
        """Take over nothing but the time."""


# What each kind says of where things were.
READS: Mapping[str, Callable[[LogReader, MemoryEvent], None]] = {
    "start": LogReader._start,
    "room": LogReader._read_room,
    "rename_room": LogReader._rename_room,
    "remove_room": LogReader._remove_room,
    "furniture": LogReader._read_furniture,
    "move": LogReader._move_furniture,
    "name": LogReader._name_furniture,
    "merge_furniture": LogReader._merge_furniture,
    "remove_furniture": LogReader._remove_furniture,
    "transform": LogReader._transform,
    "look": LogReader._read_look,
    "absent": LogReader._read_absent,
    "moved": LogReader._read_statement,
    "put_down": LogReader._read_statement,
    "remove_object": LogReader._remove_object,
    # What is carried stays in its place until it is put down; names change no place.
    **dict.fromkeys(("picked_up", "rename", "merge", "split", "split_off"), LogReader._pass),
    **dict.fromkeys(("query", "step", "configure"), LogReader._pass),
}
