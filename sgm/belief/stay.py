"""How likely a thing is where it was, and whether two of one name are one that stayed there."""

from __future__ import annotations

import numpy as np

from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_questions import Asked
from sgm.memory.seen_positions import find_positions
from sgm.names.words import read_name
from sgm.schema import NEVER, PlaceCode

_SAME_SPOT = 0.3  # metres from where a thing was, within which it was not moved
_LOST = 0.5  # probability that a tracker gives a thing another number after a time out of view
_BY_CHANCE = 0.3  # that what is put at a place lies so near to a spot: tables have a square metre


def compute_stay(memory: MemoryBatch, steps: np.ndarray) -> np.ndarray:
    """Return how likely a thing of a home stays where it is for some time steps, of any shape.

    At the rate at which things were found moved there (`HomeHistory.compute_move_rate`).
    """
    seconds = np.nan if memory.clock is None else float(memory.clock[0, 1])
    hours = 1.0 if np.isnan(seconds) else seconds / 3600
    rate = float(memory.history.compute_move_rate(hours)[0])
    stay: np.ndarray = np.exp(-rate * hours * steps)
    return stay


def compute_same(asked: Asked) -> np.ndarray:
    """Return how likely each of K things is another one of them, which was seen since, (K,).

    Of two things of one name a tracker may have given the second number to the first one.

    So it may be if it was at a place, at a position, where the last look did not find it; if the
    other one has its name, was seen first after it was seen last, and last within 30 cm of there.
    With s, the probability that a thing stays for as long as that took (`compute_stay`):

        P(same) = .5 s / (.5 s + .3 (1 - s))
    """
    memory, rows = asked.current, asked.rows
    same = np.zeros(len(rows))
    table, edges, objects = memory.positions, memory.edges, memory.objects
    if not table.num_rows:
        return same
    edge = asked.edges[edges["num_true"][asked.edges] > 0]
    position = np.array(find_positions(memory, edge), dtype=np.int64)
    edge, position = edge[position >= 0], position[position >= 0]
    thing, time = edges["object"][edge], table["time"][position]
    last, first = objects["last_observed"][thing], objects["first_observed"][thing]
    is_there = edges["is_true"][edge]
    has_left = ~is_there & (time == last) & (objects["carried_since"][thing] == NEVER)
    # One that a look has missed since is the same as before: there are no two of them again.
    has_come = (is_there & (time != NEVER)) | (time == last)
    gone, present = np.flatnonzero(has_left), np.flatnonzero(has_come)
    if not len(gone) or not len(present):
        return same
    words = [read_name(asked.descriptions[row]) for row in thing.tolist()]
    name = np.array([words.index(thing_words) for thing_words in words])
    place = PlaceCode.of(edges["furniture"][edge], edges["relation"][edge])
    point = np.column_stack([table[axis][position] for axis in ("x", "y", "z")])
    is_one = np.linalg.norm(point[gone, None] - point[present], axis=2) <= _SAME_SPOT
    for column in (name, place):
        is_one &= column[gone, None] == column[present]
    is_one &= last[gone, None] < first[present]
    for left, came in zip(*np.nonzero(is_one), strict=True):
        stay = float(compute_stay(memory, first[present[came]] - last[gone[left]]))
        likely = _LOST * stay / (_LOST * stay + _BY_CHANCE * (1 - stay))
        is_lost = rows == thing[gone[left]]
        same[is_lost] = np.maximum(same[is_lost], likely)
    return same
