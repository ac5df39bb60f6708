"""A prior counted from recorded homes: what was put where, how often it moves, comes and goes."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from sgm.names.words import read_words
from sgm.prior.prior_graph import Adjectives, FurnitureType, ObjectType, Placement, PriorGraph
from sgm.schema import RELATIONS, PlaceCode
from simulator.priors.types import FurnitureRow, ObjectRow, load_types
from simulator.trace.episode import Episode
from simulator.trace.recorded_homes import RecordedTypes
from simulator.trace.source import RecordedSource
from simulator.trace.trace import Trace

_ROUNDS = 200  # of fitting sample probabilities

Place = tuple[str, str, str]  # room, furniture, relation


@dataclass(slots=True)
class TypeCounts:
    """What was counted of one object type over all homes."""

    object_steps: int = 0  # summed over its objects
    home_steps: int = 0  # of the homes that ever held one
    moves: int = 0
    additions: int = 0
    removals: int = 0
    most: int = 0  # in one home at once
    # By home, how often one was put at a place.
    arrivals: dict[int, Counter[Place]] = field(default_factory=lambda: defaultdict(Counter))
    adjectives: dict[str, None] = field(default_factory=dict)  # words before it, as they appear


def count_prior(
    traces: Sequence[Trace], step_seconds: float | None = None
) -> tuple[PriorGraph, list[str]]:
    """Count a prior from recorded homes.

    With arrivals a(h, p) of an object type at the furniture of a kind p in home h, that has n(h, p)
    such furniture nodes, a placement weighs

        sum over h of a(h, p) / n(h, p)   divided by   sum over h that have p, of all arrivals in h

    which is the share of arrivals per furniture node, in homes that have such furniture; weights
    of a type then sum to one. Nothing is smoothed: where nothing ever was, the prior says 0. The
    other columns:

    - `sample_prob`: fitted, so that homes sampled with it hold as many of each type, in the mean,
      as were present in the recorded ones; the largest is 1;
    - `move_freq`: moves per object and step, relative to the type that moves most;
    - `add_remove_prob`: (additions + removals) / (steps of homes + steps of objects), which is the
      maximum likelihood if one probability makes a type appear and each object of it leave;
    - `prob` of furniture: mean number in a room of that label;
    - `max_count`: the most in one home; adjectives: those of the type table, or what was said.

    Args:
        traces: one or more.
        step_seconds: length of a step; None for an hour, or what the homes were simulated with.

    Returns:
        The prior, and what was left out of it, a line each.

    Raises:
        ValueError: if a trace is too short for a step, or no object ever lay anywhere.
    """
    default = PriorGraph.default()
    types = RecordedTypes(default, traces)
    source = RecordedSource.from_traces(traces, default, step_seconds)
    counts: dict[str, TypeCounts] = defaultdict(TypeCounts)
    layouts = [_list_layout(trace, types) for trace in traces]
    for home, episode in enumerate(source.episodes):
        labels = _read_labels(episode, types, counts)
        _count_home(home, episode, labels, layouts[home], counts)
    rooms = list(dict.fromkeys(room for layout in layouts for room, _ in layout))
    placements = list(_weigh_placements(counts, layouts))
    used = {(placement.room, placement.furniture) for placement in placements}
    nodes = dict.fromkeys(node for layout in layouts for node in layout)
    left_out = [
        f"{label} in {room}: nothing was ever put there"
        for room, label in nodes
        if (room, label) not in used
    ]
    kept_rooms = tuple(room for room in rooms if any(place == room for place, _ in used))
    steps = sum(episode.num_steps for episode in source.episodes)
    prior = PriorGraph(
        rooms=kept_rooms,
        furniture=tuple(
            _describe_furniture(node, traces, layouts, types) for node in nodes if node in used
        ),
        objects=tuple(_describe_objects(counts)),
        placements=tuple(placements),
        metadata={
            "name": "own",
            "sources": [f"trace ({len(traces)} recorded homes, {steps} steps)"],
            "placement_prob": "share of arrivals per furniture node, sum over the house per object",
        },
    )
    present = np.array([counts[object_type.label].object_steps for object_type in prior.objects])
    fitted = fit_sample_probs(prior, np.maximum(present, 1) / steps)
    objects = tuple(
        replace(object_type, sample_prob=max(round(float(prob), 6), 1e-6))
        for object_type, prob in zip(prior.objects, fitted, strict=True)
    )
    prior = replace(prior, objects=objects)
    prior.metadata["checksum"] = prior.checksum
    return prior, left_out


def fit_sample_probs(prior: PriorGraph, present: np.ndarray) -> np.ndarray:
    """Fit the sample probabilities with which homes hold given numbers of objects.

    A furniture node takes objects in proportion to placement weight x sample probability; each
    round multiplies the probability of a type by what was present over what is expected.

    Args:
        prior: placements and furniture; its sample probabilities are not read.
        present: mean number of each object type, positive, (O,).

    Returns:
        (O,), the largest 1.
    """
    weights = prior.weights.sum(axis=2)  # (O, K)
    furniture = np.array([furniture_type.prob for furniture_type in prior.furniture])
    probs = np.ones(len(present))
    for _ in range(_ROUNDS):
        taken = weights * probs[:, None]
        expected = (taken / taken.sum(axis=0) * furniture).sum(axis=1)
        probs *= present / expected
        probs /= probs.max()
    return probs


def _read_labels(
    episode: Episode, types: RecordedTypes, counts: Mapping[str, TypeCounts]
) -> list[str]:
    """Return the type of each description, and note the words before it."""
    labels = []
    for text in episode.descriptions:
        words = read_words("description", text)
        label = types.object_labels[types.type_of_code[types.code_of[words]]]
        labels.append(label)
        before = words.removesuffix(read_words("label", label)).strip()
        if before:
            counts[label].adjectives[before] = None
    return labels


def _count_home(
    home: int,
    episode: Episode,
    labels: Sequence[str],
    layout: Sequence[tuple[str, str]],
    counts: Mapping[str, TypeCounts],
) -> None:
    """Count one home into the counts of all, going through its changes in order of step."""
    holds: dict[int, str] = {}  # slot to type
    present: Counter[str] = Counter()
    columns = (
        episode.step,
        episode.slot,
        episode.place,
        episode.description,
        episode.is_move,
        episode.is_new,
    )
    rows = zip(*(column.tolist() for column in columns), strict=True)
    end = episode.num_steps
    for step, slot, place, description, is_move, is_new in rows:
        if (is_new or place < 0) and slot in holds:
            left = holds.pop(slot)
            present[left] -= 1
            counts[left].object_steps -= end - step
            counts[left].removals += 1
        if place < 0:
            continue
        label = labels[description]
        type_counts = counts[label]
        if is_new:
            holds[slot] = label
            present[label] += 1
            type_counts.object_steps += end - step  # in each it may leave or move
            type_counts.additions += step > 0
            type_counts.most = max(type_counts.most, present[label])
        type_counts.moves += is_move
        if is_new or is_move:
            furniture, relation = PlaceCode.split(place)
            type_counts.arrivals[home][(*layout[furniture], RELATIONS[relation])] += 1
    for label in set(labels):
        counts[label].home_steps += end


def _list_layout(trace: Trace, types: RecordedTypes) -> list[tuple[str, str]]:
    """List (room label, furniture label) of every furniture node, (F,)."""
    rooms = [types.spell(label) for label in trace.layout.room_labels]
    return [
        (rooms[furniture.room], types.spell(furniture.label))
        for furniture in trace.layout.furniture.values()
    ]


def _weigh_placements(
    counts: Mapping[str, TypeCounts], layouts: Sequence[Sequence[tuple[str, str]]]
) -> list[Placement]:
    rows = []
    num_nodes = [Counter(layout) for layout in layouts]
    for label, type_counts in counts.items():
        share: dict[Place, float] = defaultdict(float)
        for home, arrivals in type_counts.arrivals.items():
            for place, number in arrivals.items():
                share[place] += number / num_nodes[home][place[:2]]
        total = sum(type_counts.arrivals.values(), Counter[Place]())
        weights = {}
        for place, value in share.items():
            at_hand = sum(
                arrivals.total()
                for home, arrivals in type_counts.arrivals.items()
                if place[:2] in num_nodes[home]
            )
            weights[place] = value / at_hand
        scale = sum(weights.values())
        for (room, furniture, relation), weight in weights.items():
            prob = max(round(weight / scale, 6), 1e-6)
            number = total[room, furniture, relation]
            rows.append(Placement(room, furniture, label, relation, prob, number, "trace"))
    return rows


def _describe_objects(counts: Mapping[str, TypeCounts]) -> list[ObjectType]:
    rate = {
        label: type_counts.moves / max(type_counts.object_steps, 1)
        for label, type_counts in counts.items()
    }
    fastest = max(rate.values())
    return [
        ObjectType(
            label,
            sample_prob=1.0,
            max_count=type_counts.most,
            move_freq=round(rate[label] / fastest, 6) if fastest else 0.0,
            add_remove_prob=round(
                (type_counts.additions + type_counts.removals)
                / max(type_counts.home_steps + type_counts.object_steps, 1),
                6,
            ),
            adjectives=_find_adjectives(load_types().objects.get(label), type_counts.adjectives),
        )
        for label, type_counts in counts.items()
    ]


def _describe_furniture(
    node: tuple[str, str],
    traces: Sequence[Trace],
    layouts: Sequence[Sequence[tuple[str, str]]],
    types: RecordedTypes,
) -> FurnitureType:
    room, label = node
    num_rooms = sum(
        types.spell(room_label) == room
        for trace in traces
        for room_label in trace.layout.room_labels
    )
    num_nodes = sum(layout.count(node) for layout in layouts)
    most = max(sum(furniture_label == label for _, furniture_label in layout) for layout in layouts)
    said: dict[str, None] = {}
    for trace in traces:
        for furniture in trace.layout.furniture.values():
            words = read_words("description", furniture.description)
            if types.spell(furniture.label) == label and words.endswith(label) and words != label:
                said[words.removesuffix(label).strip()] = None
    adjectives = _find_adjectives(load_types().furniture.get(label), said)
    return FurnitureType(label, room, round(num_nodes / num_rooms, 6), most, adjectives)


def _find_adjectives(
    known: FurnitureRow | ObjectRow | None, said: Mapping[str, None]
) -> Adjectives:
    """Adjectives of the type table, else what was said before the label, as one category."""
    if known is not None:
        return known.adjectives
    return (tuple(said),) if said else ()
