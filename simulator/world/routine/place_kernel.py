"""Usual places in homes with routines."""

import numpy as np

from sgm.kernel import kernel


@kernel
def draw_own_places(
    weights: np.ndarray, uniform: np.ndarray, gathering: float, second_place_share: float
) -> np.ndarray:
    """Draw the places of a home's objects, one object after the other.

    Args:
        weights: of the places of each object, each row with a positive sum, float32 (n, P).
        uniform: (n, 5).
        gathering: how much more readily an object is kept where others are.
        second_place_share: share of the objects that have a second place.

    Returns:
        Usual place, second place (or again the usual one), two others, int32 (n, 4).
    """
    num_places = weights.shape[1]
    num_kept = np.zeros(num_places)
    own = np.empty((len(weights), 4), dtype=np.int32)
    for i in range(len(weights)):
        for turn in range(4):
            total = 0.0
            for place in range(num_places):
                if turn == 0 or place != own[i, 0]:
                    total += weights[i, place] * (1 + gathering * num_kept[place])
            own[i, turn] = own[i, 0]
            mark = uniform[i, turn] * total
            for place in range(num_places if total > 0 else 0):
                if weights[i, place] > 0 and (turn == 0 or place != own[i, 0]):
                    own[i, turn] = place
                    mark -= weights[i, place] * (1 + gathering * num_kept[place])
                    if mark < 0:
                        break
        if uniform[i, 4] >= second_place_share:
            own[i, 1] = own[i, 0]
        num_kept[own[i, 0]] += 1
    return own
