"""Counts from ProcTHOR-10k houses: `train.jsonl.gz`, or AI2's `prior` package."""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from pathlib import Path
from typing import IO, Any, TypeGuard, cast

from sgm.files import open_file, parse_json
from sgm.messages import shorten
from simulator.priors.types import load_names, load_types
from simulator.trace.importers.procthor import HouseRooms, find_labels, find_type
from tools.priors.counts import PlacementCounts

INSTALL = "Install it with `pip install prior`, or pass the path of train.jsonl.gz"
_MAX_LINE = 1 << 24  # bytes of a house; the largest of ProcTHOR-10k have one


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
    counts = PlacementCounts("procthor", is_per_room=True, skips_bad=skip_bad)
    houses = _load_package_houses() if path is None else read_houses(Path(path), counts)
    return count_houses(houses, "procthor-10k" if path is None else str(path), counts)


def read_houses(path: Path, counts: PlacementCounts) -> Iterator[tuple[int, Any]]:
    """Yield (line number, house) of a JSON-lines file; what a truncated one still holds counts.

    Args:
        path: `.jsonl`, or `.jsonl.gz`.
        counts: gets what was skipped.

    Raises:
        ValueError: on a line that is not JSON, or a truncated archive, unless they are skipped.
    """
    line = 0
    plain = open_file(path)
    opened = gzip.GzipFile(fileobj=plain) if path.suffix == ".gz" else plain
    with plain, cast("IO[bytes]", opened) as file:
        try:
            for line, text in enumerate(_read_lines(file, path.name), start=1):
                if not text.strip():
                    continue
                try:
                    house = parse_json(text, allow_nan=True)
                except ValueError as error:
                    problem = f"house must be one line of JSON, got {error} at {path.name}:{line}"
                    counts.report(problem, "Mend the line")
                    continue
                yield line, house
        except (EOFError, zlib.error, gzip.BadGzipFile) as error:
            problem = (
                f"houses must be a complete gzip file, got {error} in {path.name} after line {line}"
            )
            counts.report(problem, "Download it again")


def _read_lines(file: IO[bytes], name: str) -> Iterator[bytes]:
    """Yield the lines of a file, none of which may be so long that memory does not hold it."""
    line = 0
    while text := file.readline(_MAX_LINE + 1):
        line += 1
        if len(text) > _MAX_LINE:
            raise ValueError(
                f"house must be one line of at most {_MAX_LINE} bytes, got more at {name}:{line}. "
                "Put each house on a line of its own."
            )
        yield text


def count_houses(
    houses: Iterable[tuple[int, Any]], where: str, counts: PlacementCounts
) -> PlacementCounts:
    """Count parsed houses, and return the counts.

    An object is in the room that its id names; if the house has no such room, in the one whose
    floor polygon holds its position.

    Args:
        houses: (line number, house in the ProcTHOR schema).
        where: the file, for messages.
        counts: are added to.

    Raises:
        ValueError: on a malformed house or object, unless they are skipped.
    """
    for line, house in houses:
        place = f"{where}:{line}"
        if not isinstance(house, Mapping) or not (
            isinstance(house.get("rooms"), list) and isinstance(house.get("objects"), list)
        ):
            problem = f"house must have the lists 'rooms' and 'objects', got neither at {place}"
            counts.report(problem, "Mend the line")
            continue
        _HouseCounter(house, place, counts).count()
        counts.num_units += 1
    return counts


class _HouseCounter:
    """Counts one house into the counts of all."""

    def __init__(self, house: Mapping[str, Any], place: str, counts: PlacementCounts) -> None:
        self.house = house
        self.place = place
        self.counts = counts
        self.rooms = HouseRooms()
        self.room_types: dict[str, str | None] = {}  # by the number in the room's id
        self.held: set[tuple[str, str]] = set()  # (room number, furniture)

    def count(self) -> None:
        """Count rooms, then furniture with what lies on it."""
        for index, room in enumerate(self.house["rooms"]):
            if not isinstance(room, Mapping) or not (
                isinstance(room.get("id"), str) and isinstance(room.get("roomType"), str)
            ):
                self._report(f"rooms[{index}] must have the texts 'id' and 'roomType'", room)
                continue
            number = self.rooms.add(room)
            room_type = load_names("procthor").find_room(room["roomType"])
            self.room_types[number] = room_type
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
        number = self.rooms.find(item)
        room_type = self.room_types.get(number) if number is not None else None
        if number is None:
            self.counts.outside["rooms"]["(no known room)"] += 1
        type_name = find_type(item)
        furniture = None if type_name is None else find_labels(type_name)[0]
        if furniture is None:
            self.counts.outside["furniture"][type_name or str(item.get("assetId"))] += 1
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
            type_name = find_type(child)
            label = None if type_name is None else find_labels(type_name)[1]
            if label is None:
                self.counts.outside["objects"][type_name or str(child.get("assetId"))] += 1
            elif room_type is not None and furniture is not None:
                relation = load_types().furniture[furniture].relation
                self.counts.placements[room_type, furniture, label, relation] += 1

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
        self.counts.report(f"{rule}, got {shorten(value, 60)} at {self.place}", "Mend the house")


def _load_package_houses() -> Iterator[tuple[int, Any]]:
    try:
        prior = import_module("prior")
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(
            f"ProcTHOR-10k must come from a file or the package 'prior', got neither. {INSTALL}."
        ) from error
    for line, house in enumerate(prior.load_dataset("procthor-10k")["train"], start=1):
        yield line, parse_json(house, allow_nan=True) if isinstance(house, (str, bytes)) else house
