"""Counts from ProcTHOR-10k houses: `train.jsonl.gz`, or AI2's `prior` package."""

from __future__ import annotations

import gzip
import json
import re
import zlib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, TypeGuard

from simulator.priors.counts import PlacementCounts
from simulator.priors.types import load_names, load_types

INSTALL = "Install it with `pip install prior`, or pass the path of train.jsonl.gz"


def count_procthor_houses(path: Path | None = None, *, skip_bad: bool = False) -> PlacementCounts:
    """Count furniture and objects of generated houses, one house in memory at a time.

    Args:
        path: a `.jsonl` or `.jsonl.gz` file with one house a line; None asks the `prior` package.
        skip_bad: note malformed lines and objects and go on.

    Raises:
        ValueError: names the file and line of malformed input, unless `skip_bad`.
        ModuleNotFoundError: if `path` is None and the `prior` package is missing.

    Source: paper appendix A "Object placement probabilities".
    """
    if path is None:
        return count_houses(_load_package_houses(), where="procthor-10k", skip_bad=skip_bad)
    problems: list[str] = []
    houses = read_houses(Path(path), skip_bad=skip_bad, problems=problems)
    counts = count_houses(houses, where=str(path), skip_bad=skip_bad)
    counts.problems[:0] = problems
    return counts


def read_houses(path: Path, *, skip_bad: bool, problems: list[str]) -> Iterator[tuple[int, Any]]:
    """Yield (line number, house) of a JSON-lines file.

    Args:
        path: `.jsonl`, or `.jsonl.gz`.
        skip_bad: append to `problems` instead of raising; what a truncated file still holds counts.
        problems: what was skipped.

    Raises:
        ValueError: on a line that is not JSON, or a truncated archive, unless `skip_bad`.
    """
    line = 0
    opened = gzip.open(path, "rb") if path.suffix == ".gz" else path.open("rb")
    with opened as file:
        try:
            for line, text in enumerate(file, start=1):
                if not text.strip():
                    continue
                try:
                    house = json.loads(text)
                except ValueError as error:
                    problem = f"house must be one line of JSON, got {error} at {path.name}:{line}"
                    _report(problem, problems, skip_bad, "Mend the line")
                    continue
                yield line, house
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            problem = (
                f"houses must be a complete gzip file, got {error} in {path.name} after line {line}"
            )
            _report(problem, problems, skip_bad, "Download it again")


def count_houses(
    houses: Iterable[tuple[int, Any]], *, where: str, skip_bad: bool = False
) -> PlacementCounts:
    """Count parsed houses.

    An object is in the room that its id names; if the house has no such room, in the one whose
    floor polygon holds its position.

    Args:
        houses: (line number, house in the ProcTHOR schema).
        where: the file, for messages.
        skip_bad: note malformed houses and objects and go on.

    Raises:
        ValueError: on a malformed house or object, unless `skip_bad`.
    """
    counts = PlacementCounts("procthor", is_per_room=True)
    for line, house in houses:
        place = f"{where}:{line}"
        if not isinstance(house, Mapping) or not (
            isinstance(house.get("rooms"), list) and isinstance(house.get("objects"), list)
        ):
            problem = f"house must have the lists 'rooms' and 'objects', got neither at {place}"
            _report(problem, counts.problems, skip_bad, "Mend the line")
            continue
        _HouseCounter(house, place, counts, skip_bad).count()
        counts.num_units += 1
    return counts


class _HouseCounter:
    """Counts one house into the counts of all."""

    def __init__(
        self, house: Mapping[str, Any], place: str, counts: PlacementCounts, skip_bad: bool
    ) -> None:
        self.house = house
        self.place = place
        self.counts = counts
        self.skip_bad = skip_bad
        self.room_types: dict[str, str | None] = {}  # by the number in the room's id
        self.polygons: dict[str, list[tuple[float, float]]] = {}
        self.held: set[tuple[str, str]] = set()  # (room number, furniture)

    def count(self) -> None:
        """Count rooms, then furniture with what lies on it."""
        for index, room in enumerate(self.house["rooms"]):
            if not isinstance(room, Mapping) or not (
                isinstance(room.get("id"), str) and isinstance(room.get("roomType"), str)
            ):
                self._report(f"rooms[{index}] must have the texts 'id' and 'roomType'", room)
                continue
            number = _find_room_number(room["id"]) or room["id"]
            room_type = load_names("procthor").find_room(room["roomType"])
            self.room_types[number] = room_type
            self.polygons[number] = _read_polygon(room.get("floorPolygon"))
            if room_type is None:
                self.counts.outside["rooms"][room["roomType"]] += 1
            else:
                self.counts.num_rooms[room_type] += 1
        for index, item in enumerate(self.house["objects"]):
            if self._is_object(item, f"objects[{index}]"):
                self._count_furniture(item, f"objects[{index}]")
        for number, furniture in sorted(self.held):
            room_type = self.room_types[number]
            if room_type is not None:
                self.counts.furniture[room_type, furniture] += 1

    def _count_furniture(self, item: Mapping[str, Any], name: str) -> None:
        number = self._find_room(item)
        room_type = self.room_types.get(number) if number is not None else None
        if number is None:
            self.counts.outside["rooms"]["(no known room)"] += 1
        kind = _find_type(item)
        furniture = None if kind is None else _find_labels(kind)[0]
        if furniture is None:
            self.counts.outside["furniture"][kind or str(item.get("assetId"))] += 1
        elif room_type is not None and number is not None:
            self.held.add((number, furniture))
        children = item.get("children") or []
        if not isinstance(children, list):
            self._report(f"{name}.children must be a list", children)
            return
        for index, child in enumerate(children):
            child_name = f"{name}.children[{index}]"
            if not self._is_object(child, child_name):
                continue
            if child is item or (child.get("id") is not None and child.get("id") == item.get("id")):
                self._report(f"{child_name} must not be its own parent", child.get("id"))
                continue
            kind = _find_type(child)
            label = None if kind is None else _find_labels(kind)[1]
            if label is None:
                self.counts.outside["objects"][kind or str(child.get("assetId"))] += 1
            elif room_type is not None and furniture is not None:
                relation = load_types().furniture[furniture].relation
                self.counts.placements[room_type, furniture, label, relation] += 1

    def _find_room(self, item: Mapping[str, Any]) -> str | None:
        """Number of the object's room: by id, else by floor polygon; None if in no room."""
        number = _find_room_number(str(item.get("id", "")))
        if number in self.room_types:
            return number
        position = item.get("position")
        if not isinstance(position, Mapping):
            return None
        x, z = position.get("x"), position.get("z")
        if not _is_number(x) or not _is_number(z):
            return None
        for other, polygon in self.polygons.items():
            if _is_inside(x, z, polygon):
                return other
        return None

    def _is_object(self, item: Any, name: str) -> TypeGuard[Mapping[str, Any]]:
        if isinstance(item, Mapping) and (
            isinstance(item.get("id"), str)
            or isinstance(item.get("assetId"), str)
            or isinstance(item.get("objectType"), str)
        ):
            return True
        self._report(f"{name} must have an 'id', 'assetId' or 'objectType'", item)
        return False

    def _report(self, rule: str, value: Any) -> None:
        text = repr(value) if len(repr(value)) < 60 else f"{repr(value)[:57]}..."
        problem = f"{rule}, got {text} at {self.place}"
        _report(problem, self.counts.problems, self.skip_bad, "Mend the house")


def _report(problem: str, problems: list[str], skip_bad: bool, remedy: str) -> None:
    if not skip_bad:
        raise ValueError(f"{problem}. {remedy}, or pass --skip-bad.")
    problems.append(problem)


def _find_room_number(name: str) -> str | None:
    """First number of an id: `room|2`, `Type|2|0`, `Type|surface|2|0`, `4|0|0`, `small|4|0`."""
    return next((part for part in name.split("|") if part.isdigit()), None)


def _find_type(item: Mapping[str, Any]) -> str | None:
    """ProcTHOR's name of an object's type, or None if neither its id nor its asset tells."""
    if isinstance(item.get("objectType"), str):
        return str(item["objectType"])
    first = str(item.get("id", "")).split("|")[0]
    if _is_type(first):
        return first
    asset = find_asset_type(str(item.get("assetId", "")))
    return asset or (first if first[:1].isupper() else None)


@cache
def _find_labels(kind: str) -> tuple[str | None, str | None]:
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
    return known | {word: kind for word, kind in names.assets.items()}


def _read_polygon(points: Any) -> list[tuple[float, float]]:
    """Corners (x, z); empty if there is no usable polygon."""
    if not isinstance(points, list):
        return []
    corners = [
        (float(point["x"]), float(point["z"]))
        for point in points
        if isinstance(point, Mapping) and _is_number(point.get("x")) and _is_number(point.get("z"))
    ]
    return corners if len(corners) == len(points) >= 3 else []


def _is_inside(x: float, z: float, polygon: list[tuple[float, float]]) -> bool:
    """Even-odd rule."""
    inside = False
    for (x0, z0), (x1, z1) in zip(polygon, polygon[1:] + polygon[:1], strict=True):
        if (z0 > z) != (z1 > z) and x < x0 + (z - z0) * (x1 - x0) / (z1 - z0):
            inside = not inside
    return inside


def _is_number(value: Any) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _load_package_houses() -> Iterator[tuple[int, Any]]:
    try:
        prior = import_module("prior")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"ProcTHOR-10k must come from a file or the package 'prior', got neither. {INSTALL}."
        ) from error
    for line, house in enumerate(prior.load_dataset("procthor-10k")["train"], start=1):
        yield line, json.loads(house) if isinstance(house, (str, bytes)) else house
