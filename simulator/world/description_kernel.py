"""Drawing descriptions."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def sample_codes(
    ruler: np.ndarray, first_code: np.ndarray, types: np.ndarray, uniform: np.ndarray
) -> np.ndarray:
    """Return the first code of each type whose mark on the ruler is above type + uniform.

    Args:
        ruler: ascending; type t owns (t, t + 1], (number of codes,).
        first_code: of every type, and an end, (T + 1,).
        types: (n,).
        uniform: (n,) in [0, 1).

    Returns:
        int32 (n,); where rounding leads beyond a type, its last code.
    """
    codes = np.empty(len(types), dtype=np.int32)
    for i in range(len(types)):
        mark = types[i] + uniform[i]
        low, high = first_code[types[i]], first_code[types[i] + 1] - 1
        while low < high:
            middle = (low + high) // 2
            if ruler[middle] <= mark:
                low = middle + 1
            else:
                high = middle
        codes[i] = low
    return codes
