"""What looks and time do to many draws of one home at once."""

from __future__ import annotations

import math

import numpy as np

from simulator.kernel import kernel
from simulator.policies.filter_kernel import correct_places, spread

_LEAST_LIKELY = 1e-9  # of a look: no draw is ruled out for good


@kernel
def spread_draws(
    density: np.ndarray,
    moves: np.ndarray,
    leave: np.ndarray,
    kept: float,
    rate: float,
    coming: float,
    room: np.ndarray,
) -> None:
    """Let objects move, leave and come for one step in n draws of a home, in place; see `spread`.

    `density` is that of the instance seen last, if that is followed, and of others, among which
    objects come, (1 or 2, n, S); `moves` and `leave` are those of each draw, (n, S), `room` (S,).
    """
    scratch = np.empty((2, max(len(room), room.max() + 1)))
    for part in range(len(density)):
        new = coming if part == len(density) - 1 else 0.0
        for draw in range(len(moves)):
            density_of_draw = density[part, draw]
            spread(density_of_draw, moves[draw], leave[draw], kept, rate, new, room, scratch)


@kernel
def correct_draws(
    density: np.ndarray, log_likelihood: np.ndarray, node: int, is_seen: bool, miss: float
) -> None:
    """Fold one look at a node into n draws of a home, and how likely it was in each (n,), in place.

    `density` is that of `spread_draws`; a look misses an object with the probability `miss`.
    """
    for draw in range(len(log_likelihood)):
        others = density[-1, draw]
        missed = math.exp(-others[node] * (1 - miss))
        if len(density) > 1:
            missed *= 1 - density[0, draw, node] * (1 - miss)
            correct_places(density[0, draw], others, node, is_seen, miss)
        else:
            others[node] *= miss
        log_likelihood[draw] += math.log(max(1 - missed if is_seen else missed, _LEAST_LIKELY))
