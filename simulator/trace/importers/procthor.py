"""A house of ProcTHOR as a trace: one JSON object in the schema of ProcTHOR-10k."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from sgm.checks import is_number
from sgm.files import read_json
from sgm.layout.box import FLOOR_THICKNESS, Box
from sgm.layout.outline import Outline, contains_points
from sgm.memory.sighting import Point
from sgm.messages import shorten
from sgm.schema import INSIDE, MOST_METRES, ON_TOP, RELATIONS
from simulator.priors.types import load_names, load_types
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.trace import Trace

_MOST_STANDING = 1.0  # metres: higher is the middle of what hangs on a wall
_BELOW_TOP = 0.05  # metres below the upper side of furniture, of what lies inside
# Upper sides of these are those of their backs: what lies on them is lower.
_SEATS = frozenset(("armchair", "bed", "chair", "chairs", "couch", "sofa", "toilet"))


class HouseRooms:
    """The rooms of one house, found by the number in an object's id, or by position.

    Attributes:
        names: ProcTHOR's name of each room's type, by room number.
    """

    def __init__(self) -> None:
        self.names: dict[str, str] = {}
        self._polygons: dict[str, Outline] = {}

    def add(self, room: Mapping[str, Any]) -> str:
        """Add a room with the texts `id` and `roomType`; return its number."""
        number = find_room_number(room["id"]) or str(room["id"])
        self.names[number] = room["roomType"]
        self._polygons[number] = read_polygon(room.get("floorPolygon"))
        return number

    def make_floor(self, number: str) -> Box | None:
        """Return the floor of a room, by its polygon; None without a usable one."""
        try:
            return Box.of_polygon([*self._polygons[number]], -FLOOR_THICKNESS, 0.0)
        except ValueError:
            return None

    def find(self, item: Mapping[str, Any]) -> str | None:
        """Number of an object's room: by id, else by floor polygon; None if in no room."""
        number = find_room_number(str(item.get("id", "")))
        if number in self.names:
            return number
        point = read_point(item.get("position"))
        if point is None:
            return None
        holds = (
            n
            for n, polygon in self._polygons.items()
            if polygon and contains_points(polygon, np.array(point))
        )
        return next(holds, None)


def find_room_number(name: str) -> str | None:
    """First number of an id: `room|2`, `Type|2|0`, `Type|surface|2|0`, `4|0|0`, `small|4|0`."""
    return next((part for part in name.split("|") if part.isdigit()), None)


def find_type(item: Mapping[str, Any]) -> str | None:
    """ProcTHOR's name of an object's type, or None if neither its id nor its asset tells."""
    if isinstance(item.get("objectType"), str):
        return str(item["objectType"])
    first = str(item.get("id", "")).split("|")[0]
    if _is_type(first):
        return first
    asset = find_asset_type(str(item.get("assetId", "")))
    return asset or (first if first[:1].isupper() else None)


@cache
def find_labels(type_name: str) -> tuple[str | None, str | None]:
    """Our furniture label and object label of ProcTHOR's type."""
    names = load_names("procthor")
    return names.find_furniture(type_name), names.find_object(type_name)


@cache
def _is_type(name: str) -> bool:
    names = load_names("procthor")
    known = names.find_furniture(name) or names.find_object(name) or name in names.outside
    return bool(known) and name[:1].isupper()


@cache
def find_asset_type(asset: str) -> str | None:
    """Type that an asset id speaks of: `RoboTHOR_office_chair_jules` is a Chair, or None.

    The longest run of words that is a known type wins, the earliest if two are equally long. Types
    outside our tables are known too, or `Toilet_Paper_Hanger_1` would be toilet paper.
    """
    words = []
    for word in re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|\d+", asset.removeprefix("RoboTHOR_")):
        if word.isdigit():
            break
        words.append(word.lower())
    known = _load_squashed_types()
    longest = max(map(len, known))
    runs = []
    for start in range(len(words)):
        run = ""
        for stop in range(start, len(words)):
            run += words[stop]
            if len(run) > longest:  # no longer run is a type either: linear in the words
                break
            if run in known:
                runs.append((start - stop, start, known[run]))
    return min(runs)[2] if runs else None


@cache
def _load_squashed_types() -> dict[str, str]:
    """`dishsponge` -> `DishSponge` for all known types, and other words for them."""
    names, types = load_names("procthor"), load_types()
    labels = [*types.furniture, *types.objects]
    known = {label.replace(" ", ""): label.title().replace(" ", "") for label in labels}
    for name in (*names.furniture, *names.objects, *names.outside):
        known[name.lower()] = name
    return known | dict(names.assets)


def read_polygon(points: Any) -> Outline:
    """Corners (x, z); empty if there is no usable polygon."""
    found = [read_point(point) for point in points] if isinstance(points, list) else []
    corners = tuple(point for point in found if point is not None)
    return corners if len(corners) == len(found) >= 3 else ()


def read_point(point: Any) -> tuple[float, float] | None:
    """(x, z) of a position; None if there is no usable one."""
    x, z = (point.get("x"), point.get("z")) if isinstance(point, Mapping) else (None, None)
    return (float(x), float(z)) if is_number(x) and is_number(z) else None


def read_position(item: Mapping[str, Any]) -> Point | None:
    """Where the middle of an item is, x, y and height in metres; None if that is not known.

    Unity's y is up; its x and z are those of the floor plan.
    """
    flat, at = read_point(item.get("position")), item.get("position")
    height = at.get("y") if isinstance(at, Mapping) else None
    if flat is None or not is_number(height) or max(map(abs, (*flat, height))) > MOST_METRES:
        return None
    return (*flat, float(height))


def read_procthor(path: Path, furniture_labels: Collection[str] = ()) -> tuple[Trace, HomeBuilder]:
    """Read a house; furniture is what the type table knows as such, or what holds something.

    A child is in or on its nearest ancestor that is furniture: in it where its middle is below the
    upper side, on top above that. What lies on nothing is on the floor of its room. Types are named
    as in our tables where these have them, else by ProcTHOR's words ("GarbageCan" is a "garbage
    can").

    Args:
        path: a JSON file with the lists `rooms` and `objects`.
        furniture_labels: labels that are furniture besides those of the type table.

    Raises:
        ValueError: if it is no such file, or nothing of it can be placed.
        OSError: if it cannot be read.
    """
    if not path.is_file():
        raise ValueError(f"house must be a file that exists, got none at {path}. Check the path.")
    try:
        house = read_json(path)
    except ValueError as error:
        raise ValueError(
            f"house must be one JSON object, got {error} in {path}. Take one line of a .jsonl file."
        ) from None
    if not isinstance(house, Mapping) or not (
        isinstance(house.get("rooms"), list) and isinstance(house.get("objects"), list)
    ):
        raise ValueError(
            f"house must have the lists 'rooms' and 'objects', got neither in {path}. "
            "Give a house in the schema of ProcTHOR-10k."
        )
    reader = _HouseReader(HomeBuilder(furniture_labels))
    reader.read(house)
    return reader.builder.build(path.stem), reader.builder


class _HouseReader:
    """Reads one house into a builder."""

    def __init__(self, builder: HomeBuilder) -> None:
        self.builder = builder
        self._rooms = HouseRooms()
        self._room_index: dict[str, int] = {}  # by the number in the room's id
        self._floors: dict[str, int] = {}  # index of the furniture, likewise
        self._heights: dict[int, float | None] = {}  # of the middle of furniture, by its index

    def read(self, house: Mapping[str, Any]) -> None:
        """Read rooms, then furniture with what lies on it."""
        for room in house["rooms"]:
            if not isinstance(room, Mapping) or not (
                isinstance(room.get("id"), str) and isinstance(room.get("roomType"), str)
            ):
                self.builder.leave_out("a room without id and roomType", shorten(room, 40))
                continue
            number = self._rooms.add(room)
            room_type = room["roomType"]
            label = load_names("procthor").find_room(room_type) or _split_words(room_type)
            self._room_index[number] = self.builder.add_room(label)
        for item in house["objects"]:
            self._read_item(item)

    def _read_item(
        self, item: Any, room: int = -1, furniture: int | None = None, is_nested: bool = False
    ) -> None:
        """Read what stands in a room, or lies on furniture there, or on another object."""
        names = _find_names(item)
        if names is None:
            self.builder.leave_out("no type in id, assetId or objectType", shorten(item, 40))
            return
        children, position = _list_children(item), read_position(item)
        is_furniture = self.builder.is_furniture(names[0])
        if furniture is None:
            number = self._rooms.find(item)
            if number is None:
                self.builder.leave_out("in no room of the house", names[0])
                for child in map(_find_names, children):
                    self.builder.leave_out("on furniture in no room", child[1] if child else "?")
                return
            room = self._room_index[number]
            if not children and not is_furniture:
                self._put_on_floor(names[1], number, position)
                return
        if furniture is None or is_furniture:
            stand = None if position is None else position[:2]
            furniture = self.builder.add_furniture(names[0], room, position=stand)
            self._heights[furniture] = None if position is None else position[2]
            is_nested = False
        else:
            relation = self._find_relation(furniture, position)
            self.builder.add_object(
                names[1], furniture, is_nested=is_nested, relation=relation, position=position
            )
            is_nested = True
        for child in children:
            self._read_item(child, room, furniture, is_nested)

    def _put_on_floor(self, label: str, number: str, position: Point | None) -> None:
        """Put an object on the floor of a room, unless it hangs on a wall."""
        if position is not None and position[2] > _MOST_STANDING:
            self.builder.leave_out("on a wall", label)
            return
        if number not in self._floors:
            room, box = self._room_index[number], self._rooms.make_floor(number)
            self._floors[number] = self.builder.add_furniture("floor", room, box=box)
        self.builder.add_object(
            label, self._floors[number], relation=RELATIONS[ON_TOP], position=position
        )

    def _find_relation(self, furniture: int, position: Point | None) -> str | None:
        """Return whether an object is in furniture or on it, by their heights; None if unknown.

        Furniture stands on the floor, and its position is its middle.
        """
        middle, label = self._heights[furniture], self.builder.get_label(furniture)
        if position is None or not middle or middle < 0 or label in _SEATS:
            return None
        return RELATIONS[INSIDE if position[2] < 2 * middle - _BELOW_TOP else ON_TOP]


def _find_names(item: Any) -> tuple[str, str] | None:
    """Label of an item as furniture, and as an object; None if nothing tells its type."""
    type_name = find_type(item) if isinstance(item, Mapping) else None
    if type_name is None or not _split_words(type_name):
        return None
    furniture, label = find_labels(type_name)
    words = _split_words(type_name)
    return furniture or words, label or words


def _list_children(item: Mapping[str, Any]) -> list[Any]:
    children = item.get("children")
    return children if isinstance(children, list) else []


def _split_words(type_name: str) -> str:
    """Split "GarbageCan" into "garbage can"."""
    return " ".join(re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", type_name)).lower()
