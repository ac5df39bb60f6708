r"""Where a thing is that someone had in hand a minute ago.

What is asked for by who works with it was moved within minutes, often after it was seen last.
With s how likely it still is where it was last seen, by a policy that is asked for anything,

    log odds that it is there = BIAS + SLOPE log(s / (1 - s))

and the other answers keep their proportions. Without such a question the policy is right as it is.
"""

from __future__ import annotations

import numpy as np

from sgm.belief.posterior import Belief
from sgm.memory.memory_questions import Asked

# Fitted in simulated homes by the minute (`python -m tools.kitchens.in_use`).
BIAS, SLOPE = -1.17, 0.51
_LEAST = 1e-6  # probability


def weigh_in_use(belief: Belief, asked: Asked, bias: float = BIAS, slope: float = SLOPE) -> Belief:
    """Weigh a belief about K things, (K, F + 1), of which each is in use."""
    last = asked.batch.objects["last_furniture"][asked.queries.object]
    rows = np.flatnonzero(last >= 0)
    stays = np.clip(belief.places[rows, last[rows]], _LEAST, 1 - _LEAST)
    log_weights = belief.log_weights.copy()
    log_weights[rows, last[rows]] += bias + (slope - 1) * np.log(stays / (1 - stays))
    return Belief(log_weights)
