"""A robot with a memory in a home of boxes, and four ways in which it may see."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np

from sgm.eyes.built_look import BuiltLook
from sgm.eyes.look_builder import LookBuilder
from sgm.eyes.look_rules import Gate
from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.schema import RELATIONS, PlaceCode
from simulator.box_world.floor import STANDOFF
from simulator.box_world.robot_body import RobotBody, RobotFrame
from simulator.box_world.world import BoxWorld
from simulator.trace.layout import number_names

_AT = 0.15  # metres from a place of the own map at which a thing truly is there
_AT_FURNITURE = 0.5  # metres between the middles of furniture and what is drawn of it


@dataclass(frozen=True, slots=True)
class Errand:
    """How a search for one thing went.

    Attributes:
        description: what was looked for.
        is_found: whether it was found where it truly is.
        num_looks: places looked at.
        metres: how far the robot drove.
    """

    description: str
    is_found: bool
    num_looks: int
    metres: float


class HomeRobot(ABC):
    """Visits furniture, remembers what it sees there, and fetches things.

    Attributes:
        body: drives through the world.
        memory: what it remembers; ids of furniture are the numbers of the world.
        world: where it is.
    """

    def __init__(
        self, body: RobotBody, memory: SceneGraphMemory, finder: Finder, most_looks: int
    ) -> None:
        """Begin with a memory from `make_memory`; `most_looks` are those of one errand."""
        self.body, self.memory, self.world = body, memory, body.world
        self._finder, self._most_looks = finder, most_looks

    @abstractmethod
    def look_at(self, furniture: int) -> BuiltLook | None:
        """Go to furniture and look at it; None if nothing of it was in view.

        What is seen of other furniture on the way goes into the memory.
        """

    def patrol(self, furniture: int) -> None:
        """Go and look at furniture for no reason."""
        look = self.look_at(furniture)
        if look is not None:
            look.tell(self.memory)

    def fetch(self, description: str) -> Errand:
        """Look for a thing until it is found, at `most_looks` places at most."""
        search = self._finder.search(
            self.memory, description, start=self.body.position, distance=self._compute_distance
        )
        metres, is_found, num_before = 0.0, False, 0
        while num_before + search.num_looks < self._most_looks:
            going = search.next()
            if going is None:
                break
            furniture = going.place.furniture
            metres += self._compute_distance(self.body.position, furniture)
            look = self.look_at(furniture)
            if furniture not in self.memory.layout.furniture:  # the map has changed meanwhile
                num_before += search.num_looks + 1
                search = self._finder.search(
                    self.memory,
                    description,
                    start=self.body.position,
                    distance=self._compute_distance,
                )
            elif look is None:
                search.not_found(0.01)
            elif search.seen(look.seen, look.coverage, look.hidden, look.viewpoint):
                # Something that the question means is truly there.
                names = [thing.description for thing, _ in self._list_there(furniture)]
                meant = self._finder.resolve_among(self.memory, description, names).matches
                is_found = description in names or bool(meant)
                break
        return Errand(description, is_found, num_before + search.num_looks, metres)

    def _compute_distance(self, start: Any, furniture: int) -> float:
        if isinstance(start, int):
            start = self.world.floor.find_stand(start)
        return self.body.routes.compute_distance(start, furniture)

    def _list_there(self, furniture: int) -> list[tuple[Sighting, int]]:
        """List what truly is at a piece of furniture, and the slot of each."""
        return [
            (Sighting(self.world.describe_thing(slot), RELATIONS[relation]), slot)
            for slot, relation in self.world.list_there(furniture)
        ]

    def _make_look(
        self, furniture: int, seen: Iterable[Sighting], hidden: Iterable[str]
    ) -> BuiltLook:
        """Return a look of now that had all of the furniture in view."""
        now = self.body.time
        return BuiltLook(
            furniture,
            tuple(seen),
            dict.fromkeys(RELATIONS, 1.0),
            tuple(dict.fromkeys(hidden)),
            start=now,
            end=now,
            num_frames=1,
        )


class PerfectRobot(HomeRobot):
    """A robot that is given everything at the furniture that it looks at."""

    def look_at(self, furniture: int) -> BuiltLook:
        """Return everything that is there."""
        self.body.go_to(furniture)
        return self._make_look(furniture, (thing for thing, _ in self._list_there(furniture)), ())


class ShownRobot(HomeRobot):
    """A robot that is given everything that its camera shows of the furniture that it looks at.

    What stands hidden behind other things in all pictures is hidden, as for eyes. Nothing else is
    wrong: no name, no place, no thing is missed of which the share is visible that the detector of
    the robot needs at least.
    """

    def look_at(self, furniture: int) -> BuiltLook:
        """Return everything that is there and shows in a picture."""
        self.body.go_to(furniture)
        num_slots = self.world.homes.num_slots
        share = np.zeros(num_slots)
        for frame in self.body.look(furniture):
            owner = frame.shot.owner
            visible = np.bincount(owner[(owner >= 0) & (owner < num_slots)], minlength=num_slots)
            share = np.maximum(share, visible / np.maximum(frame.shot.num_alone[:num_slots], 1))
        things, least = self._list_there(furniture), self.body.rules.detector.least_share
        return self._make_look(
            furniture,
            (thing for thing, slot in things if share[slot] > least),
            (thing.description for thing, slot in things if not share[slot] > least),
        )


class SeeingRobot(HomeRobot):
    """A robot that makes looks of the frames of its camera.

    Attributes:
        builder: makes the looks.
    """

    def __init__(
        self, body: RobotBody, memory: SceneGraphMemory, finder: Finder, most_looks: int
    ) -> None:
        super().__init__(body, memory, finder, most_looks)
        nearest, farthest = body.rules.reach
        boxes = dict(enumerate(self.world.floor.furniture))
        self.builder = LookBuilder(boxes, gate=Gate(nearest=nearest, farthest=farthest))

    def look_at(self, furniture: int) -> BuiltLook | None:
        """Return the look that the frames before the furniture make."""
        for frame in self.body.drive(furniture):
            self._show(frame)
        begin = self.body.time
        has_door = self.world.floor.furniture[furniture].has_door
        if has_door:
            self.builder.set_open(furniture)
        for frame in self.body.look(furniture):
            self._show(frame)
        looks = list(self.builder.finish())
        if has_door:
            self.builder.set_open(furniture, is_open=False)
        answer = None
        for look in looks:
            if look.furniture == furniture and look.end >= begin:
                answer = look
            else:
                look.tell(self.memory)
        return answer

    def _show(self, frame: RobotFrame) -> None:
        detections = [found.detection for found in frame.detected]
        self.builder.frame(
            frame.time, frame.pose, self.body.rules.camera.intrinsics, detections, frame.shot.depth
        )


class MappingRobot(HomeRobot):
    """A robot without a map: it draws one of the furniture that its camera sees.

    It is led to places to look at (`patrol`); all else it knows from its own map. It opens what has
    a door there, as one finds out who tries.

    Attributes:
        builder: makes the looks.
        mapper: draws the map.
    """

    def __init__(
        self, body: RobotBody, memory: SceneGraphMemory, finder: Finder, most_looks: int
    ) -> None:
        """Begin with an empty memory, and a body that names furniture."""
        super().__init__(body, memory, finder, most_looks)
        nearest, farthest = body.rules.reach
        self.mapper = FurnitureMapper(memory)
        # Where one stands before furniture, as long as the map is the same.
        self._stands: dict[int, tuple[float, float] | None] | None = None
        self.builder = LookBuilder(
            discover=self.mapper, gate=Gate(nearest=nearest, farthest=farthest)
        )

    def patrol(self, furniture: int) -> None:
        """Be led to furniture of the world, and look at all that is there."""
        self._watch(self.body.drive(furniture))
        box = self.world.floor.furniture[furniture]
        self._open(self._find_place(box) if box.has_door else None)
        self._watch(self.body.look(furniture))
        for look in self.builder.finish():
            look.tell(self.memory)
        self._shut()
        if box.has_door:  # it is known since
            self._tell_door(self._find_place(box))

    def look_at(self, furniture: int) -> BuiltLook | None:
        """Return the look that the frames before furniture of the own map make."""
        position = self.memory.get_position(furniture)
        box = self.memory.layout.furniture[furniture].box
        assert box is not None
        if position is None:
            x, y, _ = box.to_map(np.array([box.size[0] / 2 + STANDOFF, 0.0, 0.0]))
            position = float(x), float(y)
        self._watch(self.body.drive(position))
        begin = self.body.time
        self._open(furniture if self.body.find_door(box) is not None else None)
        self._watch(self.body.look_at_box(box))
        looks = list(self.builder.finish())
        self._shut()
        answer = None
        for look in looks:
            if look.furniture == furniture and look.end >= begin and answer is None:
                answer = look
            else:
                look.tell(self.memory)
        return answer

    def _compute_distance(self, start: Any, furniture: int) -> float:
        if self._stands is None:
            self._stands = self.memory.layout.compute_positions()
        places = [self._stands[end] for end in (start, furniture) if isinstance(end, int)]
        if any(place is None for place in places):
            return 0.0
        begin = places[0] if isinstance(start, int) else start
        end = places[-1]
        assert begin is not None
        assert end is not None
        return self.body.routes.measure_way(begin, end)

    def _list_there(self, furniture: int) -> list[tuple[Sighting, int]]:
        """List what truly lies at a place of the own map, and the slot of each."""
        box = self.memory.layout.furniture[furniture].box
        assert box is not None
        things = self.world.things
        slots = np.flatnonzero(things.place >= 0)
        is_there = box.compute_reach(things.center[slots]) <= _AT
        return [
            (
                Sighting(
                    self.world.describe_thing(slot),
                    RELATIONS[PlaceCode.relation(int(things.place[slot]))],
                ),
                slot,
            )
            for slot in slots[is_there].tolist()
        ]

    def _watch(self, frames: Iterable[RobotFrame]) -> None:
        self._stands = None  # the map may change
        for frame in frames:
            found = [seen.detection for seen in frame.detected]
            found += [seen.detection for seen in frame.furniture]
            self.builder.frame(
                frame.time, frame.pose, self.body.rules.camera.intrinsics, found, frame.shot.depth
            )

    def _find_place(self, box: Box) -> int | None:
        """Return the found furniture that stands where a box is; None for none."""
        near = [
            (math.dist(furniture.box.center, box.center), number)
            for number, furniture in self.memory.layout.furniture.items()
            if furniture.box is not None and self.mapper.is_found(number)
        ]
        away, number = min(near, default=(math.inf, -1))
        return number if away < _AT_FURNITURE else None

    def _tell_door(self, furniture: int | None) -> None:
        if furniture is not None:
            self.builder.set_open(furniture, is_open=False)

    def _open(self, furniture: int | None) -> None:
        """Open furniture that was found; a spot before a door is none."""
        is_found = furniture is not None and self.mapper.is_found(furniture)
        self._opened = furniture if is_found else None
        if self._opened is not None:
            self.builder.set_open(self._opened)

    def _shut(self) -> None:
        if self._opened is not None and self._opened in self.memory.layout.furniture:
            self.builder.set_open(self._opened, is_open=False)
        self._opened = None


def make_memory(world: BoxWorld, **options: Any) -> SceneGraphMemory:
    """Return an empty memory, with such options, that knows rooms and furniture of a world."""
    memory = SceneGraphMemory(world.homes.prior, **options)
    rooms = [memory.add_room(label) for label in world.room_labels]
    labels = world.homes.furniture_labels[0, : world.num_furniture].tolist()
    for number, (label, name) in enumerate(zip(labels, number_names(labels), strict=True)):
        room = rooms[int(world.homes.furniture_room[0, number])]
        stand, box = world.floor.find_stand(number), world.floor.furniture[number]
        memory.add_furniture(label, room, name, position=stand, box=box)
    return memory
