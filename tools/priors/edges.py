"""Edges of a prior on their way from counts to a graph: merged, then inherited by aliases."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from sgm.messages import shorten
from simulator.priors.types import ROOMS, TypeTables
from tools.priors.counts import PlaceKey, PlacementCounts

HALF_TRUST = 5.0
"""Sightings of an object that make a counting source half as weighty as an exhaustive one."""


@dataclass(frozen=True, slots=True)
class Edge:
    """Weight of a placement, how often it was seen, and where it comes from."""

    prob: float
    count: float | None
    source: str


def merge_sources(
    sources: Sequence[PlacementCounts], rooms_of: Mapping[str, set[str]] | None
) -> dict[PlaceKey, Edge]:
    """Each source to P(place | object); the first source that knows a place wins.

    A counting source is trusted n / (n + HALF_TRUST) after n sightings of the object, so that one
    household activity does not weigh as much as ten thousand homes.

    Args:
        sources: the most trusted first.
        rooms_of: rooms of each furniture type, to spread rows without a room over; None keeps them.
    """
    merged: dict[PlaceKey, Edge] = {}
    for source in sources:
        seen: dict[str, list[float]] = defaultdict(list)
        for key, value in source.placements.items():
            seen[key[2]].append(value)
        probs = source.compute_distributions()
        for key in sorted(probs, key=lambda key: key[0] is None):  # rows with a room come first
            count = source.placements[key] if source.is_counted else None
            total = math.fsum(seen[key[2]])
            trust = total / (total + HALF_TRUST) if source.is_counted else 1.0
            places = [key] if rooms_of is None else _spread_rooms(key, rooms_of, source.source)
            for place in places:
                edge = Edge(probs[key] * trust / len(places), count, source.source)
                merged.setdefault(place, edge)
    return merged


def find_rooms(sources: Sequence[PlacementCounts]) -> dict[str, set[str]]:
    """Rooms in which any source knows a furniture type."""
    rooms_of: dict[str, set[str]] = defaultdict(set)
    for source in sources:
        for room, furniture in source.furniture:
            rooms_of[furniture].add(room)
        for place, furniture, _, _ in source.placements:
            if place is not None:
                rooms_of[furniture].add(place)
    return rooms_of


def _spread_rooms(key: PlaceKey, rooms_of: Mapping[str, set[str]], source: str) -> list[PlaceKey]:
    """One key per room that has the furniture, if the key names no room."""
    room, furniture, label, relation = key
    if room is not None:
        return [key]
    rooms = sorted(rooms_of.get(furniture, ()))
    if not rooms:
        raise ValueError(
            "a placement without a room must be of furniture with known rooms, got "
            f"{shorten(furniture)} from {source}. Name a room for it."
        )
    return [(other, furniture, label, relation) for other in rooms]


def forget_rooms(edges: Mapping[PlaceKey, Edge]) -> dict[PlaceKey, Edge]:
    """Sum the edges of all rooms."""
    coarse: dict[PlaceKey, Edge] = {}
    for (_, furniture, label, relation), edge in edges.items():
        key = (None, furniture, label, relation)
        before = coarse.get(key)
        if before is not None:
            names = dict.fromkeys([*before.source.split("+"), edge.source])
            counts = [value for value in (before.count, edge.count) if value is not None]
            edge = Edge(before.prob + edge.prob, sum(counts) if counts else None, "+".join(names))
        coarse[key] = edge
    return coarse


def inherit(
    edges: dict[PlaceKey, Edge], nodes: dict[tuple[str, str], float], types: TypeTables
) -> tuple[dict[PlaceKey, Edge], dict[tuple[str, str], float]]:
    """Give aliases the places of the type they are another name of.

    An object type that a source placed itself keeps its own places. Furniture aliases share the
    probability of the type evenly: a couch is a sofa by another name, not one more seat.
    """
    edges = dict(edges)
    families: dict[str, list[str]] = defaultdict(list)
    for object_type in types.objects.values():
        families[object_type.alias_of or object_type.label].append(object_type.label)
    placed = _group(edges, part=2)
    for base, labels in families.items():
        heirs = [label for label in labels if label not in placed]
        if not heirs or len(heirs) == len(labels):
            continue
        donor = base if base in placed else next(label for label in labels if label in placed)
        for heir in heirs:
            for room, furniture, _, relation in placed[donor]:
                edge = edges[room, furniture, donor, relation]
                source = f"{edge.source} (as {donor})"
                edges[room, furniture, heir, relation] = Edge(edge.prob, edge.count, source)

    nodes = dict(nodes)
    by_furniture = _group(edges, part=1)
    for alias in types.furniture.values():
        base = alias.alias_of or ""
        if base not in by_furniture or alias.label in by_furniture:
            continue
        for room, _, label, relation in by_furniture[base]:
            edge = edges[room, base, label, relation]
            half = Edge(edge.prob / 2, edge.count, edge.source)
            edges[room, base, label, relation] = half
            source = f"{edge.source} (as {base})"
            edges[room, alias.label, label, relation] = Edge(half.prob, edge.count, source)
        for room in ROOMS:
            if (room, base) in nodes:
                nodes[room, base] /= 2
                nodes[room, alias.label] = nodes[room, base]
    return edges, nodes


def _group(edges: Iterable[PlaceKey], *, part: int) -> dict[str, list[PlaceKey]]:
    groups: dict[str, list[PlaceKey]] = defaultdict(list)
    for key in edges:
        groups[str(key[part])].append(key)
    return groups
