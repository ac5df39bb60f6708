"""What a house in the ProcTHOR schema says: types, rooms and floors from ids and assets."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np

from sgm.checks import is_number
from sgm.layout.outline import Outline, contains_points
from simulator.priors.types import load_names, load_types


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

    def find(self, item: Mapping[str, Any]) -> str | None:
        """Number of an object's room: by id, else by floor polygon; None if in no room."""
        number = find_room_number(str(item.get("id", "")))
        if number in self.names:
            return number
        at = read_point(item.get("position"))
        if at is None:
            return None
        holds = (
            n for n, own in self._polygons.items() if own and contains_points(own, np.array(at))
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
def find_labels(kind: str) -> tuple[str | None, str | None]:
    """Our furniture label and object label of ProcTHOR's type."""
    names = load_names("procthor")
    return names.find_furniture(kind), names.find_object(kind)


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
    runs = [
        (start - stop, start, kind)
        for start in range(len(words))
        for stop in range(start + 1, len(words) + 1)
        if (kind := known.get("".join(words[start:stop]))) is not None
    ]
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
