"""Where people keep the things of a home: a prior written by hand, for homes that are lived in."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from typing import Any

from sgm.files import VERSION, read_table

ROOMS = ("kitchen", "living room", "bedroom", "bathroom", "hallway")
_ANY_ROOM = "*"


def build_household() -> dict[str, Any]:
    """Build the JSON form of the prior from `data/household.csv` and `household_furniture.csv`.

    A row of the first lists things that are kept alike, and their places: room ("*" for all of
    them), furniture and a weight, by which an object's placements are shares of one. A row of the
    second lists what else a piece of furniture is called, and whether things are in or on it. Each
    of these names is a furniture node of its own, and homes are sampled with the first ones alone.
    """
    relation, meanings = _read_furniture()
    own_names = set(relation)
    placements: list[dict[str, Any]] = []
    things: list[str] = []
    nodes: dict[tuple[str, str], None] = {}
    for entry in read_table("sgm.prior", "household.csv"):
        places = _read_places(entry["places"], meanings)
        total = sum(places.values())
        nodes |= dict.fromkeys(places)
        for thing in entry["things"].split("|"):
            things.append(thing)
            placements += (
                {
                    "room": room,
                    "furniture": name,
                    "object": thing,
                    "relation": relation[meanings[name][0]],
                    "prob": round(weight / total, 6),
                }
                for (room, name), weight in places.items()
            )
    return {
        "version": VERSION,
        "metadata": {
            "name": "household",
            "sources": ["written by hand for this package"],
            "placement_prob": "share of the places of the object, by rank of how usual they are",
        },
        "rooms": list(ROOMS),
        "furniture": [
            {
                "label": name,
                "room": room,
                "prob": float(name in own_names),
                "max_count": 2,
                "adjectives": [],
            }
            for room, name in nodes
        ],
        "objects": [
            {
                "label": thing,
                "sample_prob": 1.0,
                "max_count": 2,
                "move_freq": 0.5,
                "add_remove_prob": 0.001,
                "adjectives": [],
            }
            for thing in things
        ],
        "placements": placements,
    }


def _read_furniture() -> tuple[dict[str, str], Mapping[str, list[str]]]:
    """Read the relation of each piece of furniture, and which of them each name may mean."""
    relation: dict[str, str] = {}
    meanings: dict[str, list[str]] = defaultdict(list)
    for entry in read_table("sgm.prior", "household_furniture.csv"):
        relation[entry["label"]] = entry["relation"]
        for name in (entry["label"], *filter(None, entry["also"].split("|"))):
            meanings[name].append(entry["label"])
    return relation, meanings


def _read_places(text: str, meanings: Mapping[str, list[str]]) -> dict[tuple[str, str], float]:
    """Read `kitchen/sink 3|*/desk 2`: the weight of each room and name of furniture."""
    weights: dict[tuple[str, str], float] = {}
    for place in text.split("|"):
        where, weight = place.rsplit(" ", 1)
        room, label = where.split("/")
        names = [name for name, meant in meanings.items() if label in meant]
        for meant_room in ROOMS if room == _ANY_ROOM else (room,):
            for name in names:
                weights[meant_room, name] = max(weights.get((meant_room, name), 0), float(weight))
    return weights
