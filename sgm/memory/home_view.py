"""A memory for people: where an object was seen, and rooms > furniture > objects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from sgm.layout.layout import Layout
from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.sighting import RELATIONS, SeenAt


def list_places_of_edges(
    memory: MemoryBatch, furniture_ids: Sequence[int], row: int, seen: np.ndarray
) -> list[SeenAt]:
    """List the places of an object, the latest first, by its edges that were ever true, (n,)."""
    names = ("last_true", "furniture", "relation", "is_true", "num_true", "num_observed")
    columns = (memory.edges[name][seen].tolist() for name in names)
    places = [
        SeenAt(time, memory.time - time, furniture_ids[place], RELATIONS[relation], *counts)
        for time, place, relation, *counts in zip(*columns, strict=True)
    ]
    last = int(memory.objects["last_observed"][row])
    if last != NEVER and all(place.time < last for place in places):
        places.append(SeenAt(last, memory.time - last, None, None, False, 0, 0))
    return sorted(places, key=lambda place: -place.time)


def list_home(
    memory: MemoryBatch,
    layout: Layout,
    descriptions: Sequence[str],
    said_by: Mapping[int, Mapping[tuple[int, int | None], str]],
) -> dict[str, Any]:
    """List rooms > furniture > objects as JSON values.

    `said_by` has for objects of which something was said, by row, who said that they are at
    places, by time step and furniture.
    """
    objects: dict[int, list[dict[str, Any]]] = {number: [] for number in layout.furniture}
    unplaced = []
    furniture_ids = tuple(layout.furniture)
    # The edges of all objects, sorted once instead of searched for each of them.
    seen = np.flatnonzero(memory.edges["num_true"] > 0)
    owner = memory.edges["object"][seen]
    order = np.argsort(owner, kind="stable")
    seen_of = np.split(seen[order], np.searchsorted(owner[order], np.arange(1, len(descriptions))))
    for row, description in enumerate(descriptions):
        if memory.objects["same_as"][row] >= 0:  # it stands under another name
            continue
        for place in list_places_of_edges(memory, furniture_ids, row, seen_of[row]):
            if place.furniture is None:
                unplaced.append({"description": description, "last_seen": place.time})
                continue
            by = said_by.get(row, {}).get((place.time, place.furniture))
            objects[place.furniture].append(
                {
                    "description": description,
                    "relation": place.relation,
                    "is_there": place.is_there,
                    "last_seen": place.time,
                    "times_seen": place.times_seen,
                    "times_looked": place.times_looked,
                    **({} if by is None else {"by": by}),
                }
            )
    last_looked = memory.furniture_last_observed[0].tolist()
    looked = dict(zip(layout.furniture, last_looked, strict=True))
    return {
        "time": memory.time,
        "rooms": [
            {
                "id": room,
                "label": own.label,
                "furniture": [
                    {
                        "id": number,
                        "label": node.label,
                        "description": node.description,
                        "last_looked": None if looked[number] == NEVER else looked[number],
                        "objects": objects[number],
                    }
                    for number, node in layout.furniture.items()
                    if node.room == room
                ],
            }
            for room, own in layout.rooms.items()
        ],
        "unplaced": unplaced,
    }


def list_rows(home: Mapping[str, Any]) -> list[dict[str, Any]]:
    """List what `list_home` gave as one row for each object at each place."""
    counts = ("is_there", "last_seen", "times_seen", "times_looked")
    return [
        {
            "object": seen["description"],
            "relation": seen["relation"],
            "furniture": furniture["description"],
            "room": room["label"],
            **{name: seen[name] for name in counts},
        }
        for room in home["rooms"]
        for furniture in room["furniture"]
        for seen in furniture["objects"]
    ]
