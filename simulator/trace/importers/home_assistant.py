"""Areas, devices and entities of Home Assistant as a map: rooms, and the furniture among them.

Source: the registries that Home Assistant keeps in the folder `.storage` of its configuration:
core.area_registry, core.device_registry and core.entity_registry, each JSON with `data`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from pathlib import Path
from typing import Any

from sgm.files import MissingFileError, make_read_error, read_json
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.messages import shorten
from sgm.names.words import is_name, split_words
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.trace import Trace

_STORAGE = ".storage"


def read_home_assistant(
    path: Path, furniture_labels: Collection[str] = ()
) -> tuple[Trace, HomeBuilder]:
    """Read a map: each area is a room, and a device or entity that is furniture stands in it.

    A device is furniture if its name ends with that of furniture ("Samsung fridge" of the kitchen).
    An entity without a device, or in another area than its device, is taken likewise. What was
    disabled is left out.

    Args:
        path: the configuration's folder, its folder `.storage`, or the file core.area_registry.
        furniture_labels: labels that are furniture besides those of the household's table.

    Raises:
        ValueError: if there is no such file, it cannot be read or is another one, or it has no area
            or no furniture.
    """
    folder = path.parent if path.is_file() else path
    if (folder / _STORAGE).is_dir():
        folder = folder / _STORAGE
    builder = HomeBuilder(furniture_labels)
    rooms: dict[str, tuple[str, int]] = {}  # name and index by the id of the area
    for area in _read(folder, "area", "areas", is_needed=True):
        number, name = area.get("id", area.get("area_id")), area.get("name")
        if isinstance(number, str) and is_name(name):
            rooms[number] = name, builder.add_room(name)
        else:
            builder.leave_out("an area without id and name", shorten(area, 40))
    places = _Places(builder, FurnitureLabels(), rooms)
    areas: dict[str, str] = {}  # of devices
    for device in _read(folder, "device", "devices"):
        names = (device.get("name_by_user"), device.get("name"))
        if isinstance(device.get("id"), str) and isinstance(device.get("area_id"), str):
            areas[device["id"]] = device["area_id"]
        places.add(device, names, device.get("area_id"))
    for entity in _read(folder, "entity", "entities"):
        owner, area_id = entity.get("device_id"), entity.get("area_id")
        if isinstance(owner, str) and area_id in (None, areas.get(owner)):
            continue  # it is a part of a device
        called = (entity.get("name"), entity.get("original_name"), _name_entity(entity))
        places.add(entity, called, area_id)
    return builder.build("home assistant"), builder


class _Places:
    """Adds what is furniture to rooms, each name of a room once."""

    def __init__(
        self,
        builder: HomeBuilder,
        labels: FurnitureLabels,
        rooms: Mapping[str, tuple[str, int]],
    ) -> None:
        self._builder, self._labels, self._rooms = builder, labels, rooms
        self._known: set[tuple[str, str]] = set()

    def add(self, entry: Mapping[str, Any], names: Iterable[Any], area: Any) -> None:
        """Add a device or entity by the first of its names, if that ends with furniture."""
        name = next(filter(is_name, names), None)
        if name is None:
            self._builder.leave_out("without a name", shorten(entry.get("id"), 40))
        elif entry.get("disabled_by") is not None:
            self._builder.leave_out("disabled", name)
        elif not isinstance(area, str) or area not in self._rooms:
            self._builder.leave_out("in no area", name)
        else:
            self._place(name, area)

    def _place(self, name: str, area: str) -> None:
        room_name, room = self._rooms[area]
        words, room_words = split_words(name), split_words(room_name)
        if words[: len(room_words)] == room_words and len(words) > len(room_words):
            words = words[len(room_words) :]  # "Kitchen fridge" of the kitchen
        description = " ".join(words)
        label = self._find_label(words)
        if label is None:
            self._builder.leave_out("no furniture", name)
        elif (area, description) not in self._known:
            self._known.add((area, description))
            self._builder.add_furniture(label, room, description)

    def _find_label(self, words: tuple[str, ...]) -> str | None:
        """Return the label of furniture that words end with, the longest; None if with none."""
        for begin in range(len(words)):
            tail = " ".join(words[begin:])
            if self._builder.is_furniture(tail):
                return tail
            label = self._labels.find_label(tail)
            if label is not None:
                return label
        return None


def _name_entity(entity: Mapping[str, Any]) -> str:
    """Return the words of an entity's id: "cover.wardrobe_left" is "wardrobe left"."""
    return str(entity.get("entity_id", "")).partition(".")[2].replace("_", " ")


def _read(
    folder: Path, kind: str, rows: str, *, is_needed: bool = False
) -> list[Mapping[str, Any]]:
    """Read the rows of a registry, those that are objects; none where there is no such file."""
    path = folder / f"core.{kind}_registry"
    try:
        content = read_json(path)
    except FileNotFoundError:
        if not is_needed:
            return []
        raise MissingFileError(
            f"home must have the file core.{kind}_registry of Home Assistant, got none in "
            f"{folder}. Name its folder of configuration, or a copy of .storage."
        ) from None
    except OSError as error:
        where = f"for {path}. Copy it again."
        raise make_read_error(error, "registry must be a file that can be read", where) from error
    except ValueError as error:
        raise ValueError(f"registry must be JSON, got {error} in {path}. Copy it again.") from None
    data = content.get("data") if isinstance(content, Mapping) else None
    found = data.get(rows) if isinstance(data, Mapping) else None
    if not isinstance(found, list):
        raise ValueError(
            f"registry must have the list '{rows}' in 'data', got {shorten(content, 80)} in "
            f"{path}. Copy it again."
        )
    return [row for row in found if isinstance(row, Mapping)]
