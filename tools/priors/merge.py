"""From counts to a prior graph: merge sources, filter, inherit for aliases, normalise."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from sgm.messages import shorten
from sgm.prior.prior_graph import FurnitureType, ObjectType, Placement, PriorGraph
from simulator.priors.types import ROOMS, TypeTables, load_types
from tools.priors.counts import PlaceKey, PlacementCounts

Scope = Literal["house", "room"]
# Sightings of an object that make a counting source half as weighty as an exhaustive one.
HALF_TRUST = 5.0


@dataclass(frozen=True, slots=True)
class Edge:
    """Weight of a placement, how often it was seen, and where it comes from."""

    prob: float
    count: float | None
    source: str


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """How counts become a prior graph.

    Attributes:
        scope: over which places the weights of an object sum to one: "house" keeps how likely each
            room is for the object; "room" makes every room of the object equally likely.
        coarse: leave rooms out of the placements (paper figure 8).
        min_edges: furniture in a room with fewer object types is dropped.
        min_places: an object with fewer furniture types in a room is dropped from that room, if it
            has enough in another: objects move within a room, so a lone place is a dead end.
    """

    scope: Scope = "house"
    coarse: bool = False
    min_edges: int = 3
    min_places: int = 2


@dataclass(slots=True)
class BuildReport:
    """What a build dropped, for its summary: nothing goes silently."""

    dropped_furniture: list[str] = field(default_factory=list)
    dropped_objects: list[str] = field(default_factory=list)
    dropped_places: list[str] = field(default_factory=list)

    def summarise(self) -> str:
        """One line per kind of dropped type."""
        parts = {
            "lone places": self.dropped_places,
            "furniture": self.dropped_furniture,
            "objects": self.dropped_objects,
        }
        return "\n".join(
            f"dropped {part}: {', '.join(names) if names else 'none'}"
            for part, names in parts.items()
        )


def build_prior(
    sources: Sequence[PlacementCounts],
    *,
    options: BuildOptions | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> tuple[PriorGraph, BuildReport]:
    """Merge the counts of several sources to one prior graph.

    Each source becomes P(room, furniture, relation | object). Where two know the same relation the
    first one wins; then lone places and furniture with fewer than `min_edges` object types in its
    room are dropped; then aliases inherit; then weights are normalised.

    Args:
        sources: counts, the most trusted first (ProcTHOR before iGibson in the paper).
        options: how to build; None for the defaults.
        metadata: notes for the file; what this function knows is added.

    Raises:
        ValueError: if nothing is left of a room or of all objects.

    Source: paper appendix A "Object placement probabilities". Differs: P(furniture | room) is the
    share of rooms that hold the furniture, times the sample probability of its type; weights are
    normalised over the house, so that they also say in which room an object is at home (the paper's
    way is `scope="room"`); sources that saw an object rarely weigh less.
    """
    options = options or BuildOptions()
    types = load_types()
    report = BuildReport()
    edges = _merge_sources(sources, None if options.coarse else _find_rooms(sources))
    if options.coarse:
        edges = _forget_rooms(edges)
    num_edges = -1
    nodes: dict[tuple[str, str], float] = {}
    while num_edges != len(edges):  # dropping furniture can leave another place alone
        num_edges = len(edges)
        if not options.coarse:
            edges = _filter_lone_places(edges, options, report)
        edges, nodes = _filter_furniture(edges, sources, options, report)
    edges, nodes = _inherit(edges, nodes, types)
    edges = _normalise(edges, options)
    known = {key[2] for key in edges}
    report.dropped_objects = [label for label in types.objects if label not in known]
    prior = PriorGraph(
        rooms=tuple(room for room in ROOMS if any(node[0] == room for node in nodes)),
        furniture=tuple(
            FurnitureType(
                label,
                room,
                round(nodes[room, label], 6),
                furniture_type.max_count,
                furniture_type.adjectives,
            )
            for room in ROOMS
            for label, furniture_type in types.furniture.items()
            if (room, label) in nodes
        ),
        objects=tuple(
            ObjectType(
                label,
                object_type.sample_prob,
                object_type.max_count,
                object_type.move_freq,
                object_type.add_remove_prob,
                object_type.adjectives,
            )
            for label, object_type in types.objects.items()
            if label in known
        ),
        placements=tuple(_sort_placements(edges, types)),
        metadata={
            **(metadata or {}),
            "furniture_prob": "share of rooms with the furniture x sample probability of its type",
            "placement_prob": f"sum over the {options.scope} per object",
            "coarse": options.coarse,
            "min_edges": options.min_edges,
            "min_places": options.min_places,
        },
    )
    prior.metadata["checksum"] = prior.checksum
    return prior, report


def _merge_sources(
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


def _find_rooms(sources: Sequence[PlacementCounts]) -> dict[str, set[str]]:
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


def _forget_rooms(edges: Mapping[PlaceKey, Edge]) -> dict[PlaceKey, Edge]:
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


def _inherit(
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


def _filter_lone_places(
    edges: dict[PlaceKey, Edge], options: BuildOptions, report: BuildReport
) -> dict[PlaceKey, Edge]:
    """Drop objects from rooms where they have too few places, unless that is all they have."""
    furniture_of: dict[tuple[str | None, str], set[str]] = defaultdict(set)
    for room, furniture, label, _ in edges:
        furniture_of[room, label].add(furniture)
    most: dict[str, int] = defaultdict(int)
    for (_, label), places in furniture_of.items():
        most[label] = max(most[label], len(places))
    lone = {
        pair
        for pair, places in furniture_of.items()
        if len(places) < options.min_places <= most[pair[1]]
    }
    report.dropped_places += [f"{label} ({room})" for room, label in sorted(lone, key=str)]
    return {key: edge for key, edge in edges.items() if (key[0], key[2]) not in lone}


def _filter_furniture(
    edges: dict[PlaceKey, Edge],
    sources: Sequence[PlacementCounts],
    options: BuildOptions,
    report: BuildReport,
) -> tuple[dict[PlaceKey, Edge], dict[tuple[str, str], float]]:
    """Keep furniture that rooms hold and that has enough object types.

    Returns:
        the edges left, and P(furniture | room) x sample probability by (room, furniture).
    """
    objects_of: dict[tuple[str | None, str], set[str]] = defaultdict(set)
    for room, furniture, label, _ in edges:
        objects_of[room, furniture].add(label)
    nodes: dict[tuple[str, str], float] = {}
    kept: set[tuple[str | None, str]] = set()
    for (room, furniture), labels in objects_of.items():
        name = furniture if room is None else f"{furniture} ({room})"
        if len(labels) < options.min_edges:
            report.dropped_furniture.append(f"{name}: {len(labels)} object types")
            continue
        shares = {
            place: share
            for place in ([room] if room is not None else ROOMS)
            if (share := _find_share(place, furniture, sources)) is not None
        }
        if not shares:
            report.dropped_furniture.append(f"{name}: in no room of the sources")
            continue
        kept.add((room, furniture))
        for place, share in shares.items():
            nodes[place, furniture] = share * load_types().furniture[furniture].sample_prob
    return {key: edge for key, edge in edges.items() if key[:2] in kept}, nodes


def _find_share(room: str, furniture: str, sources: Sequence[PlacementCounts]) -> float | None:
    """P(furniture | room) from the first source that lists the rooms' furniture.

    A source that lists no rooms (iGibson, a table of one's own) vouches for the furniture it
    places: its share is one.
    """
    for source in sources:
        share = source.compute_share(room, furniture)
        if share is not None:
            return share
    for source in sources:
        if not source.num_rooms and any(
            key[1] == furniture and key[0] in (room, None) for key in source.placements
        ):
            return 1.0
    return None


def _normalise(edges: Mapping[PlaceKey, Edge], options: BuildOptions) -> dict[PlaceKey, Edge]:
    """Divide by the sum over an object's places."""
    groups: dict[tuple[str | None, str], list[float]] = defaultdict(list)
    for key, edge in edges.items():
        groups[key[0] if options.scope == "room" else None, key[2]].append(edge.prob)
    scale = {group: math.fsum(values) for group, values in groups.items()}
    return {
        key: Edge(
            edge.prob / scale[key[0] if options.scope == "room" else None, key[2]],
            edge.count,
            edge.source,
        )
        for key, edge in edges.items()
    }


def _sort_placements(edges: Mapping[PlaceKey, Edge], types: TypeTables) -> Iterable[Placement]:
    """Placements in the order of the tables, probabilities to six digits."""
    furniture_order = {label: index for index, label in enumerate(types.furniture)}
    object_order = {label: index for index, label in enumerate(types.objects)}
    room_order = {room: index for index, room in enumerate([None, *ROOMS])}
    ordered = sorted(
        edges,
        key=lambda key: (
            object_order[key[2]],
            room_order[key[0]],
            furniture_order[key[1]],
            key[3],
        ),
    )
    for room, furniture, label, relation in ordered:
        edge = edges[room, furniture, label, relation]
        prob = max(round(edge.prob, 6), 1e-6)
        count = None if edge.count is None else round(edge.count, 3)
        if count is not None and count == int(count):
            count = int(count)
        yield Placement(room, furniture, label, relation, prob, count, edge.source)
