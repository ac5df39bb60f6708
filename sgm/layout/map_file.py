"""Rooms and furniture of a memory as the text of a map, for a person to correct."""

from __future__ import annotations

import json
import math
from typing import Any

from sgm.layout.box import Box
from sgm.layout.layout import Layout

_HEADING = """\
# Rooms and furniture, in metres and radians in the frame of the map. Correct names, boxes, rooms
# and interiors (none, open, door). Take out what is not there. Add what is missing, without an id.
"""


def write_map(layout: Layout, frame: str = "map") -> str:
    """Return YAML that `HomeMap.from_values` reads, with the ids by which a memory is corrected.

    Furniture without a box is left out: no camera can see it.
    """
    names = _number_names([room.label for room in layout.rooms.values()])
    rooms = dict(zip(layout.rooms, names, strict=True))
    lines = [_HEADING + f"frame: {_quote(frame)}", "rooms:"]
    for number, room in layout.rooms.items():
        fields = {"id": int(number), "name": rooms[number], "label": room.label}
        lines.append(f"  - {_write_row(fields)}")
    lines.append("furniture:")
    for number, node in layout.furniture.items():
        if node.box is None:
            continue
        fields = {
            "id": number,
            "name": node.description,
            "label": node.label,
            "room": rooms[node.room],
            **_list_extents(node.box),
        }
        if node.position is not None:
            fields["position"] = _round(node.position)
        if node.open_cost is not None:
            fields["open_cost"] = node.open_cost
        lines.append(f"  - {_write_row(fields)}")
    return "\n".join(lines) + "\n"


def _list_extents(box: Box) -> dict[str, Any]:
    if box.outline is not None:
        corners = [_round(corner) for corner in box.corners.tolist()]
        return {
            "polygon": corners,
            "bottom": round(box.bottom, 3),
            "top": round(box.top, 3),
            "yaw": round(box.yaw, 4),
        }
    return {
        "center": _round(box.center),
        "size": _round(box.size),
        "yaw": round(math.remainder(box.yaw, 2 * math.pi), 4),
        "interior": box.interior,
    }


def _round(values: Any) -> list[float]:
    return [round(value, 3) for value in values]


def _write_row(fields: dict[str, Any]) -> str:
    """Return a mapping in the flow style of YAML."""
    return "{" + ", ".join(f"{name}: {_quote(value)}" for name, value in fields.items()) + "}"


def _quote(value: Any) -> str:
    """Return a value as JSON, which is YAML, too."""
    return json.dumps(value, ensure_ascii=False)


def _number_names(labels: list[str]) -> list[str]:
    """Return labels with numbers behind those that are there several times."""
    names: list[str] = []
    for label in labels:
        number, name = 1, label
        while name in names:
            number += 1
            name = f"{label} {number}"
        names.append(name)
    return names
