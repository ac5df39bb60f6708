"""Task "Predict Object Location": where is the object with this description?"""

from __future__ import annotations

import numpy as np

from simulator.houses import Houses
from simulator.streams import sample_categorical


def sample_query(houses: Houses) -> np.ndarray:
    """Ask one question per house; return the object slot it is about, (H,).

    With probability one half uniform among the objects that moved in this step and are present,
    else with weight `move_freq` among all that are present.

    Source: appendix "Choice of query object"; ruling 9.
    """
    uniform = houses.streams.rows("query", 2).next()
    present = houses.is_present
    moved = houses.object_moved & present
    by_frequency = np.where(present, houses.move_freq[houses.object_type], 0.0)
    by_frequency = np.where(by_frequency.any(axis=1, keepdims=True), by_frequency, present)
    ask_moved = (uniform[:, 0] < 0.5) & moved.any(axis=1)
    weights = np.where(ask_moved[:, None], moved, by_frequency)
    return sample_categorical(weights, uniform[:, 1])


def compute_answers(houses: Houses, code: np.ndarray) -> np.ndarray:
    """Mark the furniture that holds an object with the description asked for, bool (H, F).

    Args:
        houses: the true homes.
        code: description code per house, (H,).

    Source: ruling 10.
    """
    answers = np.zeros((houses.num_houses, houses.num_furniture), dtype=bool)
    house, slot = np.nonzero(houses.is_present & (houses.object_code == code[:, None]))
    answers[house, houses.object_furniture[house, slot]] = True
    return answers


def choose_furniture(scores: np.ndarray, houses: Houses) -> np.ndarray:
    """Choose the furniture with the highest score, ties broken at random, (H, F) -> (H,).

    A policy without any opinion (all -inf) chooses among all furniture.
    """
    uniform = houses.streams.rows("ties", 1).next()[:, 0]
    is_best = scores == scores.max(axis=1, keepdims=True)
    return sample_categorical(is_best.astype(float), uniform)
