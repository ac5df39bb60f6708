"""The places of a question in the order of a value."""

from __future__ import annotations

import numpy as np

from sgm.kernel import kernel


@kernel
def rank_row(values: np.ndarray, ranks: np.ndarray) -> None:
    """Write 1 / rank of each place, the highest value 1, ties in order, (F,) -> (F,)."""
    order = np.argsort(-values, kind="mergesort")
    for number in range(len(order)):
        ranks[order[number]] = 1 / (number + 1)
