"""Who leaves, moves and comes: passes over all slots of all homes."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel


@kernel
def choose_below(
    uniform: np.ndarray, threshold: np.ndarray, budget: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Choose the numbers (H, C) that lie below their thresholds, up to a budget per home, (H,).

    Given that it lies below, uniform / threshold is uniform: where a home has more of them than
    its budget, those with the lowest stay, of equals the earlier.

    Returns:
        Homes and columns of the chosen, (n,) each, home after home, columns ascending.
    """
    homes = np.empty(uniform.size, dtype=np.int64)
    columns = np.empty(uniform.size, dtype=np.int64)
    order = np.empty(uniform.shape[1])
    end = 0
    for home in range(len(uniform)):
        start = end
        for column in range(uniform.shape[1]):
            if uniform[home, column] < threshold[home, column]:
                homes[end] = home
                columns[end] = column
                order[end - start] = uniform[home, column] / threshold[home, column]
                end += 1
        count = end - start
        if count > budget[home]:
            last = -1.0
            if budget[home] > 0:
                last = order[np.argsort(order[:count])[budget[home] - 1]]
            num_equal = budget[home] - (order[:count] < last).sum()
            end = start
            for i in range(count):
                if order[i] < last or (order[i] == last and num_equal > 0):
                    num_equal -= order[i] == last
                    columns[end] = columns[start + i]
                    end += 1
    return homes[:end], columns[:end]


@kernel
def run_race(
    uniform: np.ndarray, weight: np.ndarray, total_weight: np.ndarray, num_winners: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the slots with the largest log(uniform) / weight, at most `num_winners` per home.

    Only slots within a reach are looked at where that leaves enough of them, as it nearly always
    does; else all of the home are. A weight is 0 for slots that do not take part, (H, C); no result
    depends on the rounding of its sum per home, (H,).

    Returns:
        Homes of the winners, home after home, their slots, and their ranks in the home.
    """
    total = num_winners.sum()
    homes = np.empty(total, dtype=np.int64)
    slots = np.empty(total, dtype=np.int64)
    ranks = np.empty(total, dtype=np.int64)
    runners = np.empty(uniform.shape[1], dtype=np.int64)
    lags = np.empty(uniform.shape[1])
    end = 0
    for home in range(len(uniform)):
        most = num_winners[home]
        reach = (most + 3 * math.sqrt(most)) / max(total_weight[home], 1e-300)
        count = _list_runners(uniform[home], weight[home], reach, runners, lags)
        if (lags[:count] < reach).sum() < most:
            count = _list_runners(uniform[home], weight[home], np.inf, runners, lags)
        order = np.argsort(lags[:count])
        for rank in range(min(count, most)):
            homes[end], slots[end], ranks[end] = home, runners[order[rank]], rank
            end += 1
    return homes[:end], slots[:end], ranks[:end]


@kernel
def _list_runners(
    uniform: np.ndarray, weight: np.ndarray, reach: float, runners: np.ndarray, lags: np.ndarray
) -> int:
    """List the slots that take part and may be in reach, and how far they lag; count them.

    As log(u) <= u - 1, an object with 1 - u > reach * weight is out of reach.
    """
    count = 0
    for slot in range(len(weight)):
        runners[count] = slot
        is_near = (1 - uniform[slot]) * (1 - 1e-12) <= reach * weight[slot]
        count += is_near & (weight[slot] > 0)
    for i in range(count):
        slot = runners[i]
        lags[i] = -math.log(max(uniform[slot], 1e-300)) / weight[slot]
    return count


@kernel
def find_empty_slots(object_place: np.ndarray, homes: np.ndarray) -> np.ndarray:
    """Return an empty slot for each of n objects, as home * C + slot; a home has enough of them.

    A slot is empty where its place (H, C) is negative; the homes of the objects ascend, (n,).
    """
    num_slots = object_place.shape[1]
    objects = np.empty(len(homes), dtype=np.int64)
    slot = 0
    for i in range(len(homes)):
        if i == 0 or homes[i] != homes[i - 1]:
            slot = 0
        while object_place[homes[i], slot] >= 0:
            slot += 1
        objects[i] = homes[i] * num_slots + slot
        slot += 1
    return objects
