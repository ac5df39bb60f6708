"""A map of rooms and furniture with extents, as plain values of a YAML or JSON file."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from sgm.arrays.read_numbers import read_numbers
from sgm.layout.box import FLOOR_THICKNESS, Box
from sgm.layout.furniture import Furniture
from sgm.layout.layout import RoomId
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten
from sgm.names.words import read_words

Stand: TypeAlias = tuple[float, float]  # x, y, metres
_SAME = 2e-3  # metres and radians: maps are written to millimetres
_MOST_ROOMS, _MOST_FURNITURE = 1000, 10_000
_ROOM_FIELDS = ("name", "label", "floor", "id")
_BOX, _POLYGON = ("center", "size"), ("polygon", "bottom", "top")  # one or the other
_EXTENTS = (*_BOX, *_POLYGON, "yaw", "interior")
_FURNITURE_FIELDS = (
    "name",
    "label",
    "room",
    *_BOX,
    *_POLYGON,
    "yaw",
    "interior",
    "position",
    "open_cost",
    "is_open",
    "id",
)


@dataclass(frozen=True, slots=True)
class MapFurniture(Furniture):
    """Furniture of a map.

    Attributes:
        is_open: whether its door stands open all the time.
        id: in the memory that the map was written of; None for what a person added.
    """

    is_open: bool = False
    id: int | None = None


@dataclass(frozen=True, slots=True)
class HomeMap:
    """Rooms and furniture of a home in one frame of coordinates.

    Attributes:
        frame: name of that frame.
        rooms: label of each, (R,).
        furniture: (F,); floors of rooms are among it.
        room_ids: of each room in the memory that the map was written of; None for new ones, (R,).
    """

    frame: str
    rooms: tuple[str, ...]
    furniture: tuple[MapFurniture, ...]
    room_ids: tuple[int | None, ...] = ()

    @classmethod
    def from_values(cls, data: Any, where: str = "map", *, needs_boxes: bool = True) -> HomeMap:
        """Read what a file of a map holds.

        Args:
            data: plain values: {"frame": "map", "rooms": [...], "furniture": [...]}.
            where: name of the file, for messages.
            needs_boxes: whether all furniture must have a box, without which no camera sees it.

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
        room_ids: list[int | None] = []
        furniture: list[MapFurniture] = []
        for number, entry in enumerate(_read_list("rooms", data["rooms"], _MOST_ROOMS, where)):
            spot = f"room {number} in {where}"
            fields = {"name": entry} if isinstance(entry, str) else entry
            _check_fields(fields, _ROOM_FIELDS, ("name",), spot)
            name = read_words(f"name of {spot}", fields["name"])
            if name in rooms:
                raise ValueError(
                    f"rooms must have names of their own, got {shorten(name)} again as {spot}. "
                    'Write {name: "bedroom 2", label: bedroom}.'
                )
            rooms[name] = number
            room_ids.append(_read_id(fields, spot))
            labels.append(read_words(f"label of {spot}", fields.get("label", _drop_number(name))))
            if fields.get("floor") is not None:
                box = _read_floor(fields["floor"], f"floor of {spot}")
                furniture.append(MapFurniture("floor", number, f"floor of {name}", box=box))
        entries = _read_list("furniture", data["furniture"], _MOST_FURNITURE, where)
        for number, entry in enumerate(entries):
            spot = f"furniture {number} in {where}"
            furniture.append(_read_furniture(entry, rooms, spot, needs_boxes))
        _check_unique([piece.id for piece in furniture], where)
        _check_unique(room_ids, where)
        frame = str(data.get("frame", "map"))
        return cls(frame, tuple(labels), tuple(furniture), tuple(room_ids))

    def add_to(self, memory: SceneGraphMemory) -> dict[int, Box]:
        """Add all rooms and furniture to a memory, and return its boxes by furniture id."""
        rooms = [memory.add_room(label) for label in self.rooms]
        for piece in self.furniture:
            room, text = rooms[piece.room], piece.description
            memory.add_furniture(
                piece.label, room, text, piece.position, piece.box, piece.open_cost
            )
        return memory.boxes

    def update(self, memory: SceneGraphMemory) -> Counter[str]:
        """Take rooms and furniture over, and say what was done how often; nothing is removed.

        What the memory has already is not added again: the first room of a label is the first of
        that label there, and furniture of one name in one room likewise. It is moved to where it
        is now, and costs to be opened what the map says. So a map may be given at every start.
        """
        counts: Counter[str] = Counter()
        layout = memory.layout
        known: dict[str, list[int]] = {label: [] for label in self.rooms}
        for number, node in layout.rooms.items():
            known.setdefault(node.label, []).append(number)
        rooms = []
        for label in self.rooms:
            is_known = bool(known[label])
            rooms.append(known[label].pop(0) if is_known else memory.add_room(label))
            counts["room added"] += not is_known
        pieces: dict[tuple[int, str], list[int]] = {}
        for number, piece in layout.furniture.items():
            pieces.setdefault((piece.room, piece.description), []).append(number)
        for new in self.furniture:
            room, same = rooms[new.room], pieces.get((rooms[new.room], new.description))
            if not same:
                about = new.description, new.position, new.box, new.open_cost
                memory.add_furniture(new.label, room, *about)
                counts["place added"] += 1
                continue
            number = same.pop(0)
            old = layout.furniture[number]
            if old.label != new.label:
                memory.name_furniture(number, new.label, new.description)
                counts["place renamed"] += 1
            has_moved = new.box is not None and not _is_same_box(old.box, new.box)
            if has_moved or new.position not in (None, old.position):
                memory.move_furniture(number, None, new.position, new.box if has_moved else None)
                counts["place moved"] += 1
            if new.open_cost not in (None, old.open_cost):
                memory.move_furniture(number, open_cost=new.open_cost)
                counts["open cost"] += 1
        return counts

    def correct(self, memory: SceneGraphMemory) -> Counter[str]:
        """Correct a memory by a map that was written of it, and say what was done how often.

        Furniture of a known id is moved and renamed, what has no id is added, and furniture with a
        box that the map does not have any more is removed.

        Raises:
            ValueError: if an id is none of the memory.
        """
        counts: Counter[str] = Counter()
        layout = memory.layout
        for piece in self.furniture:
            if piece.id is not None and piece.id not in layout.furniture:
                raise ValueError(
                    f"id of furniture must be one of the memory, got {piece.id} for "
                    f"{shorten(piece.description)}. Leave it out to add furniture."
                )
        rooms = []
        for number, label in zip(self.room_ids, self.rooms, strict=True):
            is_known = number in layout.rooms and layout.rooms[RoomId(number)].label == label
            rooms.append(number if is_known and number is not None else memory.add_room(label))
            counts["rooms added"] += not is_known
        kept = {piece.id for piece in self.furniture}
        for number, node in layout.furniture.items():
            if node.box is not None and number not in kept:
                memory.remove_furniture(number)
                counts["pieces of furniture removed"] += 1
        for piece in self.furniture:
            room = rooms[piece.room]
            if piece.id is None:
                memory.add_furniture(
                    piece.label, room, piece.description, piece.position, piece.box, piece.open_cost
                )
                counts["pieces of furniture added"] += 1
                continue
            node = layout.furniture[piece.id]
            if (node.label, node.description) != (piece.label, piece.description):
                memory.name_furniture(piece.id, piece.label, piece.description)
                counts["pieces of furniture renamed"] += 1
            is_same = _is_same_box(node.box, piece.box) and node.room == room
            if not is_same or not _is_same_stand(node.position, piece.position):
                memory.move_furniture(piece.id, room, piece.position, piece.box)
                counts["pieces of furniture moved"] += 1
            if piece.open_cost not in (None, node.open_cost):
                memory.move_furniture(piece.id, open_cost=piece.open_cost)
                counts["costs of opening changed"] += 1
        for number in layout.rooms:
            if number not in rooms and not memory.list_furniture(number):
                memory.remove_room(number)
                counts["rooms removed"] += 1
        return counts


def _is_same_box(box: Box | None, other: Box | None) -> bool:
    """Tell whether boxes are the same to a millimetre."""
    if box is None or other is None:
        return box is other
    sides, others = ((*either.center, *either.size, either.yaw) for either in (box, other))
    is_near = all(abs(a - b) < _SAME for a, b in zip(sides, others, strict=True))
    return is_near and box.interior == other.interior


def _is_same_stand(stand: Stand | None, other: Stand | None) -> bool:
    """Tell whether one stands at the same place, to a millimetre."""
    if stand is None or other is None:
        return stand is other
    return math.dist(stand, other) < _SAME


def _check_unique(ids: Sequence[int | None], where: str) -> None:
    """Raise ValueError for an id that is there twice."""
    counts = Counter(identifier for identifier in ids if identifier is not None)
    again = next((identifier for identifier, count in counts.items() if count > 1), None)
    if again is not None:
        raise ValueError(
            f"ids of a map must be there once, got {again} again in {where}. Leave the id of what "
            "was added out."
        )


def _read_id(entry: Mapping[str, Any], spot: str) -> int | None:
    """Return the id of an entry, a whole number; None where there is none."""
    value = entry.get("id")
    if value is not None and (type(value) is not int or value < 0):
        raise ValueError(
            f"id of {spot} must be a whole number, got {shorten(value)}. Leave it as it was "
            "written, or leave it out."
        )
    return value


def _read_floor(corners: Any, spot: str) -> Box:
    """Return the floor of a room between two corners, or with a polygon of more of them."""
    if isinstance(corners, list) and len(corners) > 2:
        try:
            return Box.of_polygon(corners, -FLOOR_THICKNESS, 0.0)
        except ValueError as error:
            raise ValueError(f"{spot}: {error}") from None
    read = read_numbers(spot, corners, (2, 2))
    return Box.of_floor(read[0].tolist(), read[1].tolist())


def read_extents(entry: Mapping[str, Any], spot: str) -> Box | None:
    """Return the box that an entry describes, by its middle and size, or a polygon.

    Args:
        entry: some of center, size, yaw, interior; or polygon, bottom, top, yaw, interior; others
            are not read. None is as good as nothing.
        spot: name of the entry, for messages.

    Returns:
        None where there is none of center, size and polygon.

    Raises:
        ValueError: if a part is missing or malformed.
    """
    said = {name: entry[name] for name in _EXTENTS if entry.get(name) is not None}
    if not said:
        return None
    needed, others = (_POLYGON, _BOX) if "polygon" in said else (_BOX, _POLYGON)
    missing = [name for name in needed if name not in said]
    unknown = [name for name in others if name in said]
    if missing or unknown:
        got = f"no {' and no '.join(missing)}" if missing else " and ".join(unknown)
        raise ValueError(
            f"extents of {spot} must be {' and '.join(_BOX)}, or {', '.join(_POLYGON)}, got {got}. "
            "Give all of the one or of the other, or none."
        )
    yaw, interior = said.get("yaw", 0.0), said.get("interior", "none")
    try:
        if "polygon" in said:
            box = Box.of_polygon(said["polygon"], said["bottom"], said["top"], yaw)
            return replace(box, interior=interior)
        return Box(said["center"], said["size"], yaw, interior)
    except (ValueError, TypeError) as error:
        raise ValueError(f"{spot}: {error}") from None


def _read_furniture(
    entry: Any, rooms: Mapping[str, int], spot: str, needs_boxes: bool
) -> MapFurniture:
    is_polygon = isinstance(entry, Mapping) and "polygon" in entry
    needed, others = (_POLYGON, _BOX) if is_polygon else (_BOX, _POLYGON)
    known = tuple(name for name in _FURNITURE_FIELDS if name not in others)
    _check_fields(entry, known, ("name", "room", *(needed if needs_boxes else ())), spot)
    name = read_words(f"name of {spot}", entry["name"])
    room = rooms.get(read_words(f"room of {spot}", entry["room"]))
    if room is None:
        raise ValueError(
            f"room of {spot} must be one of {shorten(list(rooms))}, got {shorten(entry['room'])}. "
            "Add the room, or correct the name."
        )
    position = None
    if entry.get("position") is not None:
        position = read_stand(entry["position"], spot)
    cost, box = entry.get("open_cost"), read_extents(entry, spot)
    is_open = entry.get("is_open", False)
    if not isinstance(is_open, bool) or (is_open and not (box is not None and box.has_door)):
        raise ValueError(
            f"is_open of {spot} must be true or false, and true of doors alone, got "
            f"{shorten(is_open)}. Write interior: door, or leave it out."
        )
    label = read_words(f"label of {spot}", entry.get("label", _drop_number(name)))
    cost = None if cost is None else float(read_numbers(f"open_cost of {spot}", cost, ()))
    furniture_id = _read_id(entry, spot)
    return MapFurniture(label, room, name, "", position, box, cost, is_open, furniture_id)


def read_stand(value: Any, spot: str) -> Stand:
    """Return where one stands, x, y in metres; with a height, as answers have it, without that.

    Raises:
        ValueError: if it is neither two numbers nor three.
    """
    with_height = isinstance(value, Sequence) and len(value) == 3
    numbers = read_numbers(f"position of {spot}", value, (3,) if with_height else (2,)).tolist()
    return numbers[0], numbers[1]


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
