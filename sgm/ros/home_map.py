"""A map of rooms and furniture with extents, as plain values of a YAML or JSON file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from sgm.arrays.read_numbers import read_numbers
from sgm.layout.box import FLOOR_THICKNESS, Box
from sgm.layout.furniture import Furniture
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.names.words import read_words

_MOST_ROOMS, _MOST_FURNITURE = 1000, 10_000
_ROOM_FIELDS = ("name", "label", "floor")
_BOX, _POLYGON = ("center", "size"), ("polygon", "bottom", "top")  # one or the other
_FURNITURE_FIELDS = (
    "name", "label", "room", *_BOX, *_POLYGON, "yaw", "interior", "position", "open_cost",
    "is_open",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class MapFurniture(Furniture):
    """Furniture of a map; it has a box, and `is_open` if its door stands open all the time."""

    is_open: bool = False


@dataclass(frozen=True, slots=True)
class HomeMap:
    """Rooms and furniture of a home in one frame of coordinates.

    Attributes:
        frame: name of that frame.
        rooms: label of each, (R,).
        furniture: (F,); floors of rooms are among it.
    """

    frame: str
    rooms: tuple[str, ...]
    furniture: tuple[MapFurniture, ...]

    @classmethod
    def from_values(cls, data: Any, where: str = "map") -> HomeMap:
        """Read what a file of a map holds.

        Args:
            data: plain values: {"frame": "map", "rooms": [...], "furniture": [...]}.
            where: name of the file, for messages.

        Raises:
            ValueError: if something is missing or malformed; names the entry.
        """
        if not isinstance(data, Mapping) or not data.get("rooms") or not data.get("furniture"):
            raise ValueError(
                f"map must have rooms and furniture, got {shorten(data)} in {where}. Write a list "
                "of each."
            )
        unknown = sorted(set(map(str, data)) - {"frame", "rooms", "furniture"})
        if unknown:
            raise ValueError(
                f"map must have the fields frame, rooms and furniture, got {shorten(unknown)} in "
                f"{where}. Take the others out."
            )
        rooms: dict[str, int] = {}
        labels: list[str] = []
        furniture: list[MapFurniture] = []
        for number, entry in enumerate(_read_list("rooms", data["rooms"], _MOST_ROOMS, where)):
            spot = f"room {number} in {where}"
            row = {"name": entry} if isinstance(entry, str) else entry
            _check_fields(row, _ROOM_FIELDS, ("name",), spot)
            name = read_words(f"name of {spot}", row["name"])
            if name in rooms:
                raise ValueError(
                    f"rooms must have names of their own, got {shorten(name)} again as {spot}. "
                    'Write {name: "bedroom 2", label: bedroom}.'
                )
            rooms[name] = number
            labels.append(read_words(f"label of {spot}", row.get("label", _drop_number(name))))
            if row.get("floor") is not None:
                box = _read_floor(row["floor"], f"floor of {spot}")
                furniture.append(MapFurniture("floor", number, f"floor of {name}", box=box))
        entries = _read_list("furniture", data["furniture"], _MOST_FURNITURE, where)
        for number, entry in enumerate(entries):
            furniture.append(_read_furniture(entry, rooms, f"furniture {number} in {where}"))
        return cls(str(data.get("frame", "map")), tuple(labels), tuple(furniture))

    def add_to(self, memory: SceneGraphMemory) -> dict[int, Box]:
        """Add all rooms and furniture to a memory, and return its boxes by furniture id."""
        rooms = [memory.add_room(label) for label in self.rooms]
        for row in self.furniture:
            room, text = rooms[row.room], row.description
            memory.add_furniture(row.label, room, text, row.position, row.box, row.open_cost)
        return memory.boxes


def _read_floor(corners: Any, what: str) -> Box:
    """Return the floor of a room between two corners, or with a polygon of more of them."""
    if isinstance(corners, list) and len(corners) > 2:
        try:
            return Box.of_polygon(corners, -FLOOR_THICKNESS, 0.0)
        except ValueError as error:
            raise ValueError(f"{what}: {error}") from None
    read = read_numbers(what, corners, (2, 2))
    return Box.of_floor(read[0].tolist(), read[1].tolist())


def _read_furniture(entry: Any, rooms: Mapping[str, int], spot: str) -> MapFurniture:
    is_polygon = isinstance(entry, Mapping) and "polygon" in entry
    needed, others = (_POLYGON, _BOX) if is_polygon else (_BOX, _POLYGON)
    known = tuple(name for name in _FURNITURE_FIELDS if name not in others)
    _check_fields(entry, known, ("name", "room", *needed), spot)
    name = read_words(f"name of {spot}", entry["name"])
    room = rooms.get(read_words(f"room of {spot}", entry["room"]))
    if room is None:
        raise ValueError(
            f"room of {spot} must be one of {shorten(list(rooms))}, got {shorten(entry['room'])}. "
            "Add the room, or correct the name."
        )
    position = None
    if entry.get("position") is not None:
        x, y = read_numbers(f"position of {spot}", entry["position"], (2,)).tolist()
        position = x, y
    cost = entry.get("open_cost")
    try:
        yaw, interior = entry.get("yaw", 0.0), entry.get("interior", "none")
        if is_polygon:
            box = Box.of_polygon(entry["polygon"], entry["bottom"], entry["top"], yaw)
            box = replace(box, interior=interior)
        else:
            box = Box(entry["center"], entry["size"], yaw, interior)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{spot}: {error}") from None
    is_open = entry.get("is_open", False)
    if not isinstance(is_open, bool) or (is_open and not box.has_door):
        raise ValueError(
            f"is_open of {spot} must be true or false, and true of doors alone, got "
            f"{shorten(is_open)}. Write interior: door, or leave it out."
        )
    label = read_words(f"label of {spot}", entry.get("label", _drop_number(name)))
    cost = None if cost is None else float(read_numbers(f"open_cost of {spot}", cost, ()))
    return MapFurniture(label, room, name, "", position, box, cost, is_open)


def _read_list(name: str, values: Any, most: int, where: str) -> list[Any]:
    if not isinstance(values, list) or len(values) > most:
        raise ValueError(
            f"{name} of a map must be a list of at most {most}, got {shorten(values)} in {where}. "
            "Write one entry a line."
        )
    return values


def _check_fields(entry: Any, known: tuple[str, ...], needed: tuple[str, ...], spot: str) -> None:
    if not isinstance(entry, Mapping):
        raise ValueError(f"{spot} must be an entry with fields, got {shorten(entry)}. Give a name.")
    missing = [name for name in needed if entry.get(name) is None]
    unknown = sorted(set(map(str, entry)) - set(known))
    if missing or unknown:
        raise ValueError(
            f"{spot} must have the fields {', '.join(needed)} and may have "
            f"{', '.join(sorted(set(known) - set(needed)))}, got "
            f"{'none of ' + ', '.join(missing) if missing else shorten(unknown)}. Correct them."
        )


def _drop_number(name: str) -> str:
    """Return what something is from its name: "shelf 2" is a "shelf"."""
    words = name.split()
    return " ".join(words[:-1]) if len(words) > 1 and words[-1].isdecimal() else name
