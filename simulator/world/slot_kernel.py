"""Slots and rows for objects that come."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def find_empty_slots(object_place: np.ndarray, homes: np.ndarray) -> np.ndarray:
    """Return an empty slot for each of n objects, as home * C + slot.

    Args:
        object_place: negative where a slot is empty, (H, C).
        homes: home of each object, ascending, (n,); a home has enough empty slots.
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


@kernel
def find_new_codes(row_of_code: np.ndarray, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
    """List the descriptions that have no row yet, each once.

    Args:
        row_of_code: -1 where there is no row; becomes -2 for what is listed, (H, number of codes).
        homes: (n,).
        codes: (n,).

    Returns:
        Their numbers, home * number of codes + code, (m,).
    """
    new = np.empty(len(homes), dtype=np.int64)
    end = 0
    for i in range(len(homes)):
        if row_of_code[homes[i], codes[i]] == -1:
            row_of_code[homes[i], codes[i]] = -2
            new[end] = homes[i] * row_of_code.shape[1] + codes[i]
            end += 1
    return new[:end]
