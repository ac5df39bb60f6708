"""How likely it is that looks did not show what is there."""

from __future__ import annotations

import math

import numpy as np

from sgm.kernel import kernel


@kernel
def weigh_looks(
    negative: np.ndarray,
    steps_ago: np.ndarray,
    sought: np.ndarray,
    sought_ago: np.ndarray,
    is_remembered: np.ndarray,
    miss_rate: float,
    leave_rate: float,
    repeated_share: float,
    looks_counted: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Weigh the looks at F places for V objects; see `Detector.compute_log_likelihood`.

    Args:
        negative: looks of this step, (V, F).
        steps_ago: time steps since earlier ones, infinite for none, (V, F, n).
        sought: earlier looks for the object alone, (V, F).
        sought_ago: time steps since then, (V, F).
        is_remembered: where the memory counts earlier looks, bool (V, F).
        miss_rate: of one look.
        leave_rate: share of things that leave their place in a step.
        repeated_share: share of the misses that another look of a step repeats.
        looks_counted: share of what earlier looks say that is in the belief already.

    Returns:
        Log likelihood of earlier looks, and of the others, (V, F) each.
    """
    earlier, own = np.zeros(negative.shape), np.zeros(negative.shape)
    for row in range(negative.shape[0]):
        for place in range(negative.shape[1]):
            weight = 1 - looks_counted * is_remembered[row, place]
            for look in range(steps_ago.shape[2]):
                steps = steps_ago[row, place, look]
                if weight > 0 and math.isfinite(steps):
                    stay = (1 - leave_rate) ** steps
                    earlier[row, place] += math.log(1 - (1 - miss_rate) * stay)
            if weight > 0:
                earlier[row, place] *= weight
            if negative[row, place] > 0:
                missed = _compute_miss(negative[row, place], miss_rate, repeated_share)
                own[row, place] = math.log(missed)
            if weight > 0 and math.isfinite(sought_ago[row, place]):
                missed = _compute_miss(sought[row, place], miss_rate, repeated_share)
                stay = (1 - leave_rate) ** sought_ago[row, place]
                own[row, place] += weight * math.log(1 - (1 - missed) * stay)
    return earlier, own


@kernel
def _compute_miss(num_looks: float, miss_rate: float, repeated_share: float) -> float:
    """Return how likely looks of one step all miss what is there; see `sgm.belief.compute_miss`."""
    hidden = repeated_share * miss_rate
    anew = (miss_rate - hidden) / (1 - hidden)
    whole = math.floor(num_looks)
    here = hidden + (1 - hidden) * anew**whole if whole > 0 else 1.0
    further = hidden + (1 - hidden) * anew ** (whole + 1)
    return here + (num_looks - whole) * (further - here)
