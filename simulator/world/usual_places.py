"""Places where the things of a home are usually kept, drawn from its T^i."""

from __future__ import annotations

import numpy as np

from simulator.kernel import kernel
from simulator.world.sampled_state import SampledState

# The own places of an object, in this order: its usual one, a second one, and others that may
# become usual.
USUAL, SECOND, FIRST_OTHER = range(3)
NUM_OTHERS = 2
NUM_OWN_PLACES = FIRST_OTHER + NUM_OTHERS


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
    num_place_codes = weights.shape[1]
    num_kept = np.zeros(num_place_codes)
    own_places = np.empty((len(weights), NUM_OWN_PLACES), dtype=np.int32)
    for i in range(len(weights)):
        kept_at = own_places[i]
        for turn in range(NUM_OWN_PLACES):
            total = 0.0
            for place in range(num_place_codes):
                if turn == USUAL or place != kept_at[USUAL]:
                    total += weights[i, place] * (1 + gathering * num_kept[place])
            kept_at[turn] = kept_at[USUAL]
            mark = uniform[i, turn] * total
            for place in range(num_place_codes if total > 0 else 0):
                if weights[i, place] > 0 and (turn == USUAL or place != kept_at[USUAL]):
                    kept_at[turn] = place
                    mark -= weights[i, place] * (1 + gathering * num_kept[place])
                    if mark < 0:
                        break
        if uniform[i, NUM_OWN_PLACES] >= second_place_share:
            kept_at[SECOND] = kept_at[USUAL]
        num_kept[kept_at[USUAL]] += 1
    return own_places
