"""Where a thing or a place is, as answers say it: the thing where it was seen, else the place."""

from __future__ import annotations

from typing import Any

from sgm.finder.answers import PositionOf
from sgm.layout.layout import Layout
from sgm.memory.sighting import Point


def find_position(layout: Layout, place: int | None) -> Point | None:
    """Return where a place is; None where that is unknown, or there is no such place."""
    piece = None if place is None else layout.furniture.get(place)
    return None if piece is None else piece.location


def tell_position(
    layout: Layout, place: int | None, position: Point | None, prefix: str = ""
) -> dict[str, Any]:
    """Return the fields of an answer that say where something is.

    Args:
        layout: rooms and furniture.
        place: id of the place that it is at; None for none.
        position: where it was seen there; None where that is unknown.
        prefix: of the names of the fields.
    """
    of: PositionOf | None = "thing"
    if position is None:
        position = find_position(layout, place)
        of = None if position is None else "place"
    return {f"{prefix}position": position, f"{prefix}position_of": of}
