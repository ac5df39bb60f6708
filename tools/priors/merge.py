"""From counts to a prior graph: merge sources, filter, inherit for aliases, normalise."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from sgm.prior.prior_graph import FurnitureType, ObjectType, Placement, PriorGraph
from simulator.priors.types import ROOMS, TypeTables, load_types
from tools.priors.counts import PlaceKey, PlacementCounts
from tools.priors.edges import Edge, find_rooms, forget_rooms, inherit, merge_sources

Normalise = Literal["sum", "max"]
Scope = Literal["house", "room"]


@dataclass(frozen=True, slots=True)
class BuildOptions:
    """How counts become a prior graph.

    Attributes:
        normalise: "sum": the weights of an object's places sum to one; "max": the largest is one.
        scope: over which places: "house" keeps how likely each room is for the object;
            "room" makes every room of the object equally likely (sums to one per room).
        coarse: leave rooms out of the placements (paper figure 8).
        min_edges: furniture in a room with fewer object types is dropped.
        min_places: an object with fewer furniture types in a room is dropped from that room, if it
            has enough in another: objects move within a room, so a lone place is a dead end.
    """

    normalise: Normalise = "sum"
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
    edges = merge_sources(sources, None if options.coarse else find_rooms(sources))
    if options.coarse:
        edges = forget_rooms(edges)
    num_edges = -1
    nodes: dict[tuple[str, str], float] = {}
    while num_edges != len(edges):  # dropping furniture can leave another place alone
        num_edges = len(edges)
        if not options.coarse:
            edges = _filter_lone_places(edges, options, report)
        edges, nodes = _filter_furniture(edges, sources, options, report)
    edges, nodes = inherit(edges, nodes, types)
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
            "placement_prob": f"{options.normalise} over the {options.scope} per object",
            "coarse": options.coarse,
            "min_edges": options.min_edges,
            "min_places": options.min_places,
        },
    )
    prior.metadata["checksum"] = prior.checksum
    return prior, report


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
    """Divide by the sum or the maximum over an object's places."""
    groups: dict[tuple[str | None, str], list[float]] = defaultdict(list)
    for key, edge in edges.items():
        groups[key[0] if options.scope == "room" else None, key[2]].append(edge.prob)
    reduce = math.fsum if options.normalise == "sum" else max
    scale = {group: reduce(values) for group, values in groups.items()}
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
