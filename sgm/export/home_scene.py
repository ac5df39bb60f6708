"""What stands and lies where in a home, also where a memory has no coordinates of it."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Point, SeenAt

MEASURED, ASSUMED, LAID_OUT = "measured", "assumed", "laid out"
MOST_THINGS = 2000
_SIZE = (0.5, 0.5, 0.8)  # metres of furniture without extents
_PITCH = 1.5  # metres between furniture that is laid out
_MOST_BESIDE = 6  # pieces of a row that is laid out
_FILLED = 0.4  # of each side on which things without a position are spread, from the middle
_GOLDEN = math.pi * (3 - math.sqrt(5))


@dataclass(frozen=True, slots=True)
class PlacedFurniture:
    """A piece of furniture in the map.

    Attributes:
        name: for people, with its room.
        box: its extents.
        extents: `MEASURED`; `ASSUMED` around a position; `LAID_OUT` in rows beside the home, where
            the memory has no coordinates.
    """

    name: str
    box: Box
    extents: str


@dataclass(frozen=True, slots=True)
class PlacedThing:
    """A thing in the map.

    Attributes:
        name: its description.
        position: x, y, z of its middle, metres.
        is_measured: whether it was seen there, and not spread over its furniture.
        furniture: id of the place.
        relation: such as "in" or "onTop" it.
        last_seen: time step of the last sighting there.
        picture: path or id of one that shows it there; None without one.
    """

    name: str
    position: Point
    is_measured: bool
    furniture: int
    relation: str
    last_seen: int
    picture: str | None = None


@dataclass(frozen=True, slots=True)
class HomeScene:
    """A home at one moment.

    Attributes:
        furniture: by id.
        things: that are there by the last looks, or by what was said.
        rooms: where to write the label of each room, (label, x, y, z).
    """

    furniture: Mapping[int, PlacedFurniture]
    things: tuple[PlacedThing, ...]
    rooms: tuple[tuple[str, Point], ...]


def make_scene(memory: SceneGraphMemory) -> HomeScene:
    """Return what a memory knows now; of things the `MOST_THINGS` that were seen last."""
    furniture = _place_furniture(memory)
    return HomeScene(
        furniture, tuple(_place_things(memory, furniture)), tuple(_name_rooms(memory, furniture))
    )


def _place_furniture(memory: SceneGraphMemory) -> dict[int, PlacedFurniture]:
    """Place furniture by its box, else around its position, else in rows by room beside it."""
    known: dict[int, tuple[Box, str]] = {}
    for number, piece in memory.layout.furniture.items():
        if piece.box is not None:
            known[number] = piece.box, MEASURED
        elif piece.position is not None:
            known[number] = Box((*piece.position, _SIZE[2] / 2), _SIZE), ASSUMED
    left = min((corner for box, _ in known.values() for corner in box.corners[:, 0]), default=0.0)
    bottom = min((corner for box, _ in known.values() for corner in box.corners[:, 1]), default=0.0)
    rows = -1
    for room in memory.layout.rooms:
        lost = [number for number in memory.list_furniture(room) if number not in known]
        for count, number in enumerate(lost):
            rows += count % _MOST_BESIDE == 0
            x, y = count % _MOST_BESIDE, rows + 1 if known else rows
            center = (left + x * _PITCH, bottom - y * _PITCH, _SIZE[2] / 2)
            known[number] = Box(center, _SIZE), LAID_OUT
    return {
        number: PlacedFurniture(memory.describe(number), *known[number])
        for number in memory.furniture_ids
    }


def _place_things(
    memory: SceneGraphMemory, furniture: Mapping[int, PlacedFurniture]
) -> list[PlacedThing]:
    """Place things where they were seen, else spread over the top or the inside of furniture."""
    by_place: dict[tuple[int, str], list[tuple[str, SeenAt]]] = defaultdict(list)
    for name, seen in memory.list_seen(most=MOST_THINGS)[0]:
        if seen.is_there and seen.furniture is not None and seen.relation is not None:
            by_place[seen.furniture, seen.relation].append((name, seen))
    placed = []
    for (number, relation), things in sorted(by_place.items(), key=lambda pair: pair[0]):
        spots = _spread(furniture[number].box, relation, len(things))
        named = sorted(things, key=lambda pair: pair[0])
        for (name, seen), spot in zip(named, spots, strict=True):
            is_measured = seen.position is not None
            placed.append(
                PlacedThing(
                    name,
                    seen.position or spot,
                    is_measured,
                    number,
                    relation,
                    seen.time,
                    seen.picture,
                )
            )
    return placed


def _spread(box: Box, relation: str, number: int) -> list[Point]:
    """Return points on top of a box, or at half its height for what is in or under it."""
    turns = np.arange(number)
    away = np.sqrt(turns / max(number, 1)) * _FILLED
    length, width, height = box.size
    local = np.column_stack(
        [
            away * np.cos(turns * _GOLDEN) * length,
            away * np.sin(turns * _GOLDEN) * width,
            np.full(number, height / 2 if relation == "onTop" else 0.0),
        ]
    )
    return [(x, y, z) for x, y, z in box.to_map(local).tolist()]


def _name_rooms(
    memory: SceneGraphMemory, furniture: Mapping[int, PlacedFurniture]
) -> list[tuple[str, Point]]:
    """Return where to write the label of each room that has furniture: above its middle."""
    rooms = []
    for room, known in memory.layout.rooms.items():
        boxes = [furniture[number].box for number in memory.list_furniture(room)]
        if boxes:
            x, y, _ = np.mean([box.center for box in boxes], axis=0).tolist()
            rooms.append((known.label, (x, y, max(box.top for box in boxes) + 0.8)))
    return rooms
