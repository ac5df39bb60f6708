"""Rooms as polygons by name: which room of a home a point lies in."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sgm.layout.outline import Outline, compute_outline_distance, read_outline
from sgm.messages import shorten, warn_caller
from sgm.names.words import read_words

_MOST_AREAS = 1000
_NEAR = 1.0  # metres from an area within which a point belongs to it: walls are between them
_POINTS = ("polygon", "points", "vertices", "corners")  # names of the corners of an area
_LISTS = ("areas", "rooms", "zones", "regions")  # of the list of all areas


class Areas:
    """Named polygons of the floor, as navigation stacks keep them.

    Attributes:
        names: of the areas, in order.
        outlines: corners of each in the map.
    """

    def __init__(self, polygons: Mapping[str, Any] | None = None) -> None:
        """Take the corners of each area by its name; without one, all is "home".

        Raises:
            ValueError: if a name is none, or the corners are no polygon.
        """
        polygons = {} if polygons is None else polygons
        self.names = tuple(read_words("name of an area", name) for name in polygons)
        self.outlines: tuple[Outline, ...] = tuple(
            read_outline(f"area {shorten(name)}", _read_corners(corners))
            for name, corners in polygons.items()
        )

    @classmethod
    def from_values(cls, data: Any, where: str = "areas") -> Areas:
        """Read what a file of areas holds: corners by name, in one of the usual ways to write it.

        A mapping from names to lists of corners, or to entries with a `polygon`; or a list of
        entries with `name` and `polygon`, perhaps below `areas` or `rooms`. A corner is x and y.
        An area without corners is left out, with a warning, if others have some.

        Raises:
            ValueError: if it is none of these; names the area.
        """
        if isinstance(data, Mapping):
            for name in _LISTS:
                if isinstance(data.get(name), (Mapping, list)):
                    data = data[name]
                    break
        if isinstance(data, list) and all(isinstance(entry, Mapping) for entry in data):
            data = {entry.get("name"): entry for entry in data}
        if not isinstance(data, Mapping) or not 0 < len(data) <= _MOST_AREAS:
            raise ValueError(
                f"areas must be corners by name, got {shorten(data)} in {where}. Write "
                "kitchen: [[0, 0], [4, 0], [4, 3], [0, 3]]."
            )
        drawn = {
            name: entry for name, entry in data.items() if _read_corners(entry) not in ([], None)
        }
        if drawn and len(drawn) < len(data):
            empty = [str(name) for name in data if name not in drawn]
            warn_caller(f"areas without corners are left out, {shorten(empty)} in {where}")
            data = drawn
        try:
            return cls(data)
        except (ValueError, TypeError) as error:
            raise ValueError(f"{error} In {where}.") from None

    def find(self, point: Sequence[float] | np.ndarray) -> str:
        """Return the name of the area of a point x, y: that it lies in, or the nearest within 1 m.

        "home" where there is none.
        """
        if not self.names:
            return "home"
        position = np.asarray(point, dtype=float)[:2]
        away = [float(compute_outline_distance(outline, position)) for outline in self.outlines]
        nearest = int(np.argmin(away))
        return self.names[nearest] if away[nearest] <= _NEAR else "home"


def _read_corners(value: Any) -> Any:
    """Return the corners of an area as rows of two numbers."""
    if isinstance(value, Mapping):
        value = next((value[name] for name in _POINTS if name in value), None)
    if not isinstance(value, list):
        return value
    return [
        [corner.get("x"), corner.get("y")] if isinstance(corner, Mapping) else corner
        for corner in value
    ]
