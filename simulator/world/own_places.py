"""Places where the things of a home are usually kept, drawn from its T^i."""

from __future__ import annotations

import numpy as np

from simulator.kernel import kernel
from simulator.world.sampled_state import SampledState

NUM_OWN_PLACES = 4  # of an object: its usual place, a second one, two that may become usual


def draw_own_places(
    homes: SampledState, home: int, gathering: float, second_place_share: float, purpose: str
) -> np.ndarray:
    """Draw the places of the objects of a home from T^i, int32 (C, 4); without a row they stay.

    Args:
        homes: the group.
        home: which of them.
        gathering: how much things are kept where others are: a place with n things has the weight
            1 + n gathering, times its weight in T^i.
        second_place_share: share of the objects that have a second place.
        purpose: of the random stream.

    Returns:
        Of each slot, -1 for an empty one.
    """
    places = np.full((homes.num_slots, NUM_OWN_PLACES), -1, dtype=np.int32)
    num_slots = int(homes.home_num_slots[home])
    uniform = homes.streams.generator(purpose, home).random((num_slots, NUM_OWN_PLACES + 1))
    slots = np.flatnonzero(homes.object_place[home, :num_slots] >= 0)
    weights = homes.transitions.read(homes.object_row[home, slots])
    none = ~weights.any(axis=1)
    weights[none, homes.object_place[home, slots[none]]] = 1
    places[slots] = _draw_places(weights, uniform[slots], gathering, second_place_share)
    return places


@kernel
def _draw_places(
    weights: np.ndarray, uniform: np.ndarray, gathering: float, second_place_share: float
) -> np.ndarray:
    """Draw the places of a home's objects by weights (n, P), one after the other, int32 (n, 4).

    The usual place, a second one, or again the usual one, and two others, by numbers (n, 5); see
    `RoutineRules`.
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
