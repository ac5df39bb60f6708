"""Entries of a chain, found by walking from the newest to the oldest."""

from __future__ import annotations

import numpy as np

from simulator.compiled.kernel import kernel

# The arrays of `simulator.policies.look_log.Chains`: number of each key's newest entry, number of
# the oldest entry kept, then `at`, `value`, `share` and `previous` of the entries kept.
ChainArrays = tuple[np.ndarray, int, np.ndarray, np.ndarray, np.ndarray, np.ndarray]


@kernel
def list_entries(chain: ChainArrays, key: int, since: int) -> np.ndarray:
    """Return the rows of a key's entries with `at` >= since, oldest first; none for key -1."""
    newest, first, at, _, _, previous = chain
    count = 0
    if key >= 0:
        entry = newest[key]
        while entry >= first and at[entry - first] >= since:
            count += 1
            entry = previous[entry - first]
    rows = np.empty(count, dtype=np.int64)
    if count > 0:
        entry = newest[key]
        for number in range(count - 1, -1, -1):
            rows[number] = entry - first
            entry = previous[entry - first]
    return rows
