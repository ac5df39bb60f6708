"""What a task asks for, and where the truth has it."""

from __future__ import annotations

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from simulator.world.homes import Homes
from simulator.world.streams import sample_categorical


def sample_query(homes: Homes, asks_moved: float = TASKS_ASK_MOVED) -> np.ndarray:
    """Ask one question per home; return the object slot it is about, (H,).

    With probability `asks_moved`, one half in the tasks, uniform among the objects that moved in
    this step and are present, else with weight `move_freq` among all that are present.

    Source: appendix "Choice of query object"; docs/design.md, ruling 9.
    """
    uniform = homes.streams.rows("query", 2).take()
    weights = compute_query_weights(homes, homes.is_present, uniform[:, 0], asks_moved)
    return sample_categorical(weights, uniform[:, 1])


def compute_query_weights(
    homes: Homes, is_open: np.ndarray, uniform: np.ndarray, asks_moved: float = TASKS_ASK_MOVED
) -> np.ndarray:
    """Return the weights that an object to ask for is drawn with, (H, C), 0 but where `is_open`.

    Where `uniform` (H,) is below `asks_moved`, it is one that has moved, if any has.

    Source: docs/design.md, ruling 9.
    """
    moved = homes.object_moved & is_open
    weights = homes.move_freq.take(homes.object_type) * is_open
    is_fixed = ~weights.any(axis=1)  # nothing there ever moves
    weights[is_fixed] = is_open[is_fixed]
    ask_moved = (uniform < asks_moved) & moved.any(axis=1)
    weights[ask_moved] = moved[ask_moved]
    return weights


def compute_answers(homes: Homes, code: np.ndarray, home: np.ndarray | None = None) -> np.ndarray:
    """Mark the furniture that holds an object with the description asked for, bool (Q, F).

    Args:
        homes: the true homes.
        code: description codes, (Q,).
        home: of each, (Q,); None for one query per home, in order.

    Source: docs/design.md, ruling 10.
    """
    if home is None:
        home = np.arange(homes.num_homes)
    answers = np.zeros((len(code), homes.num_furniture), dtype=bool)
    is_asked = (homes.object_code[home] == code[:, None]) & homes.is_present[home]
    query, slot = np.divmod(np.flatnonzero(is_asked), homes.num_slots)
    answers[query, homes.object_place[home[query], slot] // NUM_RELATIONS] = True
    return answers
