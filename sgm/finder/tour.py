"""The order in which to visit places until something is found."""

from __future__ import annotations

import numpy as np


def plan_tour(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, is_open: np.ndarray
) -> np.ndarray:
    """Return the tours with the least expected cost until found, exactly, (n, K) places in order.

    A tour k_1, k_2, ... costs the sum over its legs of the leg's cost x P(not found before it). The
    best one is found by dynamic programming over sets of places visited: work grows as 2^K.

    Args:
        prob: probability that the object is at each place, (n, K); sums to at most one.
        first_leg: cost of going to each place from here and looking, (n, K).
        legs: cost of going from place to place and looking, (n, K, K).
        is_open: places that may be visited, bool (n, K), some in each row; the others come last.
    """
    num_tours, num_places = prob.shape
    never = 1e9  # finite: times a probability of zero it is zero
    first_leg = np.where(is_open, first_leg, np.inf)
    # Closed places are left out by visiting them for nothing at the end: no probability, no leg.
    prob = np.where(is_open, prob, 0.0)
    legs = np.where(is_open[:, None, :], legs, 0.0)
    legs = np.where(is_open[:, :, None] | ~is_open[:, None, :], legs, never)
    num_sets = 1 << num_places
    is_in = (np.arange(num_sets)[:, None] >> np.arange(num_places)) & 1 == 1  # (S, K)
    missing = np.maximum(1 - prob @ is_in.T, 0)  # P(not found after visiting the set), (n, S)
    # Cost to go after visiting a set with its last place, (n, S, K); the full set is the end.
    togo = np.zeros((num_tours, num_sets, num_places))
    following = np.zeros((num_tours, num_sets, num_places), dtype=np.int64)
    places = np.arange(num_places)
    for num_visited in range(num_places - 1, 0, -1):  # sets of one size at once, (V,)
        sets = np.flatnonzero(is_in.sum(axis=1) == num_visited)
        ahead = togo[:, sets[:, None] | 1 << places, places]  # (n, V, K), by the next place
        after = missing[:, sets, None, None] * legs[:, None] + ahead[:, :, None]  # (n, V, K, K)
        after[:, is_in[sets][:, None, :].repeat(num_places, axis=1)] = np.inf
        following[:, sets] = after.argmin(axis=3)
        togo[:, sets] = after.min(axis=3)
    single = togo[:, 1 << np.arange(num_places), np.arange(num_places)]  # (n, K)
    order = np.zeros((num_tours, num_places), dtype=np.int64)
    order[:, 0] = np.argmin(first_leg + single, axis=1)
    been, tours = 1 << order[:, 0], np.arange(num_tours)
    for turn in range(1, num_places):
        order[:, turn] = following[tours, been, order[:, turn - 1]]
        been |= 1 << order[:, turn]
    return order


def compute_tour_costs(
    prob: np.ndarray, first_leg: np.ndarray, legs: np.ndarray, order: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the cost of each leg of a tour, and the probability that it has to be gone, (k,) each.

    Their product summed up is the expected cost. `order` has the places of the tour, (k,); the rest
    is as in `plan_tour`, for one tour.
    """
    cost = np.append(first_leg[order[:1]], legs[order[:-1], order[1:]])
    found = np.cumsum(prob[order])
    return cost, np.maximum(1 - found + prob[order], 0)
