"""Kinds of activity: what people take for them, and where in a home they do them."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

import numpy as np

from simulator.priors.types import load_types


@dataclass(frozen=True, slots=True)
class ActivityKind:
    """One kind of activity.

    Attributes:
        name: such as "cooking".
        objects: how often an activity of the kind uses an object type, by label.
        places: how often something lies on the furniture then, by room and furniture label.

    Source: `tools.priors.activities` counts the activity definitions of BEHAVIOR
    (package bddl 3.6.0); rows of `assumed_activities.csv` are ours, because BEHAVIOR has no phone,
    no remote control, and hardly a place to read or to dress at. Where both name a type or a place,
    the larger weight holds.
    """

    name: str
    objects: Mapping[str, float]
    places: Mapping[tuple[str, str], float]


@lru_cache(maxsize=1)
def load_kinds() -> Mapping[str, ActivityKind]:
    """Read `activities.json`: every kind by its name."""
    text = resources.files(__package__).joinpath("activities.json").read_text(encoding="utf-8")
    kinds = {}
    for name, table in json.loads(text)["kinds"].items():
        objects = dict(table["objects"])
        for label, weight in table["assumed_objects"].items():
            objects[label] = max(objects.get(label, 0.0), weight)
        places: dict[tuple[str, str], float] = {}
        for room, label, weight in table["places"] + table["assumed_places"]:
            places[room, label] = max(places.get((room, label), 0.0), float(weight))
        kinds[name] = ActivityKind(name, objects, places)
    return kinds


def compute_object_weights(labels: Sequence[str], move_freq: np.ndarray) -> np.ndarray:
    """Return how readily each kind of activity takes an object of each type, float64 (K, T).

    A type that shares the placements of another one in the type table (`alias_of`) is used like
    it. A type that no activity names is used by every kind, a tenth as readily as what it needs.
    Square roots of the products of both weights: what has a use at all is used in some activity.
    Labels and `move_freq` of the prior are those of the types, (T,).
    """
    types = load_types().objects
    weights = np.zeros((len(load_kinds()), len(labels)))
    for column, label in enumerate(labels):
        alias = types[label].alias_of if label in types else None
        for number, activity in enumerate(load_kinds().values()):
            weights[number, column] = activity.objects.get(
                label, activity.objects.get(alias or "", 0.0)
            )
    unknown = ~weights.any(axis=0)
    mean = weights.sum(axis=1, keepdims=True) / max((~unknown).sum(), 1)
    weights[:, unknown] = 0.1 * np.where(mean > 0, mean, 1.0)
    return np.sqrt(weights * move_freq)


def compute_spot_weights(
    room_labels: Sequence[str], furniture_labels: Sequence[str], furniture_room: np.ndarray
) -> np.ndarray:
    """Return how readily each kind of activity is done at each furniture node, float64 (K, F).

    A home without the furniture that a kind is done at has it anywhere in the same rooms, else
    anywhere at all. Rooms are (R,), furniture and its room (F,), of one home.
    """
    rooms = [room_labels[room] for room in furniture_room]
    weights = np.zeros((len(load_kinds()), len(rooms)))
    for number, activity in enumerate(load_kinds().values()):
        node_weights = [
            activity.places.get(key, 0.0) for key in zip(rooms, furniture_labels, strict=True)
        ]
        if not any(node_weights):
            in_room: dict[str, float] = {}
            for (room, _), weight in activity.places.items():
                in_room[room] = in_room.get(room, 0.0) + weight
            node_weights = [in_room.get(room, 0.0) for room in rooms]
        weights[number] = node_weights if any(node_weights) else 1.0
    return weights
