"""Priors of language: from word vectors alone, and from a table that a language model filled in."""

from __future__ import annotations

import csv
import io
from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import read_file
from sgm.memory.sighting import read_relation
from sgm.messages import shorten
from sgm.names.words import read_words
from sgm.prior.prior_graph import ObjectType, Placement, PriorGraph
from sgm.schema import RELATIONS, USUAL_RELATION
from sgm.text import TextVectors, load_text

# Of the softmax over places. Of .05, .1, .15, .2, .3, .5 and 1 the one whose places of the things
# of the household prior have the least cross-entropy to its own. Nothing was chosen in a home.
TEMPERATURE = 0.2
NUM_PLACES = 30  # of each thing that are kept; the others have less than a hundredth together
COLUMNS = ("room", "furniture", "object", "relation", "weight")
_UNKNOWN = ObjectType("", 1.0, 2, 0.5, 0.001, ())  # as in the household prior

PROMPT = """\
Where do people keep the things of a home? Answer with a CSV table and nothing else. Its first line
is

room,furniture,object,relation,weight

Write three to six rows for each thing, the usual places first. "room" and "furniture" are one of
the pairs below, as they are written there. "object" is the thing, as it is written below.
"relation" is {relations}. "weight" is a whole number from 1 (odd) to 10 (usual): how often you
would find it there, where it is kept and where it is used. Do not leave out a thing.

Places:
{places}

Things:
{things}
"""


def make_word_prior(
    base: PriorGraph, text: TextVectors | None = None, temperature: float = TEMPERATURE
) -> PriorGraph:
    """Return a prior whose placements come from word vectors alone.

    P(place | thing) is proportional to exp((cosine of thing and furniture + cosine of thing and
    room) / temperature), over the places with the highest ones. No counts and no table say where
    anything is.

    Args:
        base: whose rooms, furniture and things it has; what it says of placements is not read, but
            for whether things are in or on a piece of furniture.
        text: vectors; None for those that ship.
        temperature: of the softmax.

    Raises:
        ValueError: if the temperature is not above 0.
    """
    if not temperature > 0:
        raise ValueError(f"temperature must be above 0, got {temperature}. Take one like .2.")
    text = load_text() if text is None else text
    nodes = [(furniture_type.room, furniture_type.label) for furniture_type in base.furniture]
    names = [object_type.label for object_type in base.objects]
    thing, furniture, room = (
        _scale(text.vectors(list(labels)))
        for labels in (names, [label for _, label in nodes], [name for name, _ in nodes])
    )
    cosine = (thing @ (furniture + room).T).astype(np.float64)  # (O, K)
    kept = np.argsort(-cosine, axis=1, kind="stable")[:, :NUM_PLACES]
    logits = np.take_along_axis(cosine, kept, axis=1) / temperature
    weights = np.exp(logits - logits.max(axis=1, keepdims=True))
    weights /= weights.sum(axis=1, keepdims=True)
    relation = find_relations(base)
    placements = tuple(
        Placement(
            room=nodes[node][0],
            furniture=nodes[node][1],
            object=name,
            relation=relation[nodes[node][1]],
            prob=round(float(weight), 6),
        )
        for name, places, shares in zip(names, kept, weights, strict=True)
        for node, weight in zip(places.tolist(), shares, strict=True)
        if round(float(weight), 6) > 0
    )
    metadata = {
        "name": "words",
        "sources": [f"cosines of word vectors alone ({text.name}), temperature {temperature:g}"],
    }
    return make_prior(base, base.objects, placements, metadata)


def read_filled(path: Path, base: PriorGraph | None = None) -> PriorGraph:
    """Read a table that a language model, or anyone, has filled in (`make_prompt`).

    Args:
        path: CSV with the columns `COLUMNS`; `room` may be empty (every room with the furniture),
            so may `relation` (the usual one) and `weight` (1).
        base: whose rooms and furniture it uses; of things that it knows, how often they move and
            the like is taken from there. None for the household prior.

    Raises:
        ValueError: names the file and the row of a bad one.
    """
    base = PriorGraph.household() if base is None else base
    rooms_of: dict[str, list[str]] = defaultdict(list)
    for furniture_type in base.furniture:
        rooms_of[furniture_type.label].append(furniture_type.room)
    usual = find_relations(base)
    found: dict[str, dict[tuple[str, str, str], float]] = defaultdict(lambda: defaultdict(float))
    for number, cells in _read_rows(path):
        where = f"at {path.name}:{number}"
        room, furniture, name, relation, weight = (cell.strip() for cell in cells)
        if furniture not in rooms_of:
            raise ValueError(
                f"furniture must be one of the prior's, got {shorten(furniture)} {where}. Write it "
                "as the prompt does (`python -m simulator.priors prompt`)."
            )
        if room and room not in rooms_of[furniture]:
            raise ValueError(
                f"room must be one that has a {furniture}, {', '.join(rooms_of[furniture])}, got "
                f"{shorten(room)} {where}. Choose one, or leave it empty."
            )
        try:
            where_put = read_relation(relation) if relation else usual[furniture]
        except ValueError as error:
            raise ValueError(
                f"relation must be {', '.join(RELATIONS)} or empty, got {shorten(relation)} "
                f"{where}. Mend it."
            ) from error
        try:
            thing = read_words("object", name)
            value = float(weight) if weight else 1.0
        except ValueError as error:
            raise ValueError(
                f"row must have an object and a weight that is a number, got {shorten(str(error))} "
                f"{where}. Mend it."
            ) from error
        if not 0 <= value < 1e9:
            raise ValueError(f"weight must be from 0 on, got {shorten(weight)} {where}. Mend it.")
        rooms = [room] if room else rooms_of[furniture]
        for each_room in rooms:
            found[thing][each_room, furniture, where_put] += value / len(rooms)
    known = {object_type.label: object_type for object_type in base.objects}
    placements = [
        Placement(
            room=room,
            furniture=furniture,
            object=thing,
            relation=relation,
            prob=round(value / sum(places.values()), 6),
        )
        for thing, places in found.items()
        if sum(places.values()) > 0
        for (room, furniture, relation), value in places.items()
        if value > 0
    ]
    if not placements:
        raise ValueError(f"table must have a row with a weight, got none in {path}. Fill it in.")
    kept = dict.fromkeys(placement.object for placement in placements)
    objects = tuple(known.get(thing, replace(_UNKNOWN, label=thing)) for thing in kept)
    metadata = {"name": "filled", "sources": [f"table {path.name}, filled in by its user"]}
    return make_prior(base, objects, placements, metadata)


def make_prompt(base: PriorGraph, things: Sequence[str] = ()) -> str:
    """Return what to ask a language model for a table that `read_filled` reads.

    Args:
        base: whose places are offered; furniture that is the same under another name is offered
            once.
        things: to be placed; those of `base` if none are given.
    """
    by_room: dict[str, list[str]] = defaultdict(list)
    for furniture_type in base.furniture:
        if furniture_type.prob > 0:
            by_room[furniture_type.room].append(furniture_type.label)
    places = "\n".join(f"- {room}: {', '.join(labels)}" for room, labels in by_room.items())
    names = list(things) or [object_type.label for object_type in base.objects]
    relations = " or ".join(f'"{name}"' for name in RELATIONS)
    return PROMPT.format(places=places, relations=relations, things=", ".join(names))


def make_prior(
    base: PriorGraph,
    objects: Sequence[ObjectType],
    placements: Sequence[Placement],
    metadata: dict[str, Any],
) -> PriorGraph:
    """Return a prior with the rooms and furniture of another that something is placed at."""
    used = {(placement.room, placement.furniture) for placement in placements}
    furniture = tuple(
        furniture_type
        for furniture_type in base.furniture
        if (furniture_type.room, furniture_type.label) in used
    )
    rooms = tuple(
        room
        for room in base.rooms
        if any(room == furniture_type.room for furniture_type in furniture)
    )
    return PriorGraph(rooms, furniture, tuple(objects), tuple(placements), metadata)


def find_relations(base: PriorGraph) -> dict[str, str]:
    """Return whether things are rather in or on each piece of furniture, by its label."""
    counts: dict[str, Counter[str]] = defaultdict(Counter)
    for placement in base.placements:
        counts[placement.furniture][placement.relation] += 1
    usual = {label: relations.most_common(1)[0][0] for label, relations in counts.items()}
    return {
        furniture_type.label: usual.get(furniture_type.label, USUAL_RELATION)
        for furniture_type in base.furniture
    }


def _scale(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return np.asarray(vectors / np.maximum(length, 1e-9))


def _read_rows(path: Path) -> list[tuple[int, list[str]]]:
    try:
        text = read_file(path).decode("utf-8-sig")
        rows = list(csv.reader(io.StringIO(text), strict=True))
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(
            f"table must be CSV in UTF-8, got {shorten(str(error))} in {path}. Save it again."
        ) from error
    if not rows or tuple(cell.strip() for cell in rows[0]) != COLUMNS:
        found = ",".join(rows[0]) if rows else ""
        raise ValueError(
            f"columns must be {','.join(COLUMNS)}, got {shorten(found)} in {path}. Write them in "
            "the first line."
        )
    numbered = [(number, cells) for number, cells in enumerate(rows[1:], 2) if cells]
    for number, cells in numbered:
        if len(cells) != len(COLUMNS):
            raise ValueError(
                f"row must have {len(COLUMNS)} cells, got {len(cells)} at {path.name}:{number}. "
                "Mend it."
            )
    return numbered
