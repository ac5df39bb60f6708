"""A house of ProcTHOR as a trace: one JSON object in the schema of ProcTHOR-10k."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from sgm.files import read_json
from sgm.messages import shorten
from simulator.priors.types import load_names
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.importers.procthor_schema import HouseRooms, find_labels, find_type
from simulator.trace.trace import Trace


def read_procthor(path: Path, furniture_labels: Collection[str] = ()) -> tuple[Trace, HomeBuilder]:
    """Read a house; furniture is what the type table knows as such, or what holds something.

    A child is in or on its nearest ancestor that is furniture. Types are named as in our tables
    where these have them, else by ProcTHOR's words ("GarbageCan" is a "garbage can").

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

    def read(self, house: Mapping[str, Any]) -> None:
        """Read rooms, then furniture with what lies on it."""
        for room in house["rooms"]:
            if not isinstance(room, Mapping) or not (
                isinstance(room.get("id"), str) and isinstance(room.get("roomType"), str)
            ):
                self.builder.leave_out("a room without id and roomType", shorten(room, 40))
                continue
            number = self._rooms.add(room)
            kind = room["roomType"]
            label = load_names("procthor").find_room(kind) or _split_words(kind)
            self._room_index[number] = self.builder.add_room(label)
        for item in house["objects"]:
            self._read_top(item)

    def _read_top(self, item: Any) -> None:
        """Read what stands in a room."""
        names = _find_names(item)
        if names is None:
            self.builder.leave_out("no type in id, assetId or objectType", shorten(item, 40))
            return
        furniture, label = names
        children = _list_children(item)
        if not children and not self.builder.is_furniture(furniture):
            self.builder.leave_out("not on furniture", label)
            return
        number = self._rooms.find(item)
        if number is None:
            self.builder.leave_out("in no room of the house", furniture)
            for child in children:
                names = _find_names(child)
                self.builder.leave_out("on furniture in no room", names[1] if names else "?")
            return
        room = self._room_index[number]
        index = self.builder.add_furniture(furniture, room)
        for child in children:
            self._read_child(child, index, room, is_nested=False)

    def _read_child(self, item: Any, furniture: int, room: int, *, is_nested: bool) -> None:
        """Read what lies on furniture, or on another object there."""
        names = _find_names(item)
        if names is None:
            self.builder.leave_out("no type in id, assetId or objectType", shorten(item, 40))
            return
        is_furniture = self.builder.is_furniture(names[0])
        if is_furniture:
            furniture = self.builder.add_furniture(names[0], room)
        else:
            self.builder.add_object(names[1], furniture, is_nested=is_nested)
        for child in _list_children(item):
            self._read_child(child, furniture, room, is_nested=not is_furniture)


def _find_names(item: Any) -> tuple[str, str] | None:
    """Label of an item as furniture, and as an object; None if nothing tells its type."""
    kind = find_type(item) if isinstance(item, Mapping) else None
    if kind is None or not _split_words(kind):
        return None
    furniture, label = find_labels(kind)
    words = _split_words(kind)
    return furniture or words, label or words


def _list_children(item: Mapping[str, Any]) -> list[Any]:
    children = item.get("children")
    return children if isinstance(children, list) else []


def _split_words(kind: str) -> str:
    """Split "GarbageCan" into "garbage can"."""
    return " ".join(re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", kind)).lower()
