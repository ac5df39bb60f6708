"""Task "Predict Object Location": where is the object with this description?"""

from __future__ import annotations

import numpy as np

from simulator.homes import NUM_RELATIONS, Homes
from simulator.streams import sample_best, sample_categorical


def sample_query(houses: Homes) -> np.ndarray:
    """Ask one question per house; return the object slot it is about, (H,).

    With probability one half uniform among the objects that moved in this step and are present,
    else with weight `move_freq` among all that are present.

    Source: appendix "Choice of query object"; ruling 9.
    """
    uniform = houses.streams.rows("query", 2).next()
    weights = compute_query_weights(houses, houses.is_present, uniform[:, 0])
    return sample_categorical(weights, uniform[:, 1])


def compute_query_weights(houses: Homes, is_open: np.ndarray, uniform: np.ndarray) -> np.ndarray:
    """Return the weights that an object to ask for is drawn with, (H, C).

    Args:
        houses: the true homes.
        is_open: objects that may be asked for, bool (H, C); some in each row.
        uniform: below one half to ask for an object that has moved, (H,).

    Source: ruling 9.
    """
    moved = houses.object_moved & is_open
    by_frequency = np.where(is_open, houses.move_freq[houses.object_type], 0.0)
    by_frequency = np.where(by_frequency.any(axis=1, keepdims=True), by_frequency, is_open)
    ask_moved = (uniform < 0.5) & moved.any(axis=1)
    return np.where(ask_moved[:, None], moved, by_frequency)


def compute_answers(houses: Homes, code: np.ndarray, homes: np.ndarray | None = None) -> np.ndarray:
    """Mark the furniture that holds an object with the description asked for, bool (Q, F).

    Args:
        houses: the true homes.
        code: description codes, (Q,).
        homes: the home of each, (Q,); None for one query per home, in order.

    Source: ruling 10.
    """
    if homes is None:
        homes = np.arange(houses.num_houses)
    answers = np.zeros((len(code), houses.num_furniture), dtype=bool)
    is_asked = (houses.object_code[homes] == code[:, None]) & houses.is_present[homes]
    query, slot = np.divmod(np.flatnonzero(is_asked), houses.num_slots)
    answers[query, houses.object_place[homes[query], slot] // NUM_RELATIONS] = True
    return answers


def choose_furniture(scores: np.ndarray, houses: Homes) -> np.ndarray:
    """Choose the furniture with the highest score, ties broken at random, (H, F) -> (H,).

    A policy without any opinion (all -inf) chooses among all furniture.
    """
    return sample_best(scores, houses.streams.rows("ties", 1).next()[:, 0])
