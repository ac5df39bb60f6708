"""Columns of what has changed lately, at places and in the home.

Each function computes the columns of a group of `sgm.evidence.columns`, by name.
"""

from __future__ import annotations

import numpy as np

from sgm.evidence.lately import SPANS
from sgm.evidence.question import Question

_USUAL_CHANGES = 0.1  # for each look, before anything was seen to change
_MOST_HOURS = 1e4  # since a thing moved; what never did counts as this


def compute_at_places(asked: Question) -> dict[str, np.ndarray]:
    """What has changed at each place lately."""
    minutes, hours, _ = np.log1p(asked.lately.changes_at)
    return {"changes_minutes": minutes, "changes_hours": hours}


def compute_in_home(asked: Question) -> dict[str, np.ndarray]:
    """What has changed in the home lately, by itself and for each look; whether this thing has."""
    lately = asked.lately
    rates = np.log((lately.changes + _USUAL_CHANGES) / (lately.looks + 1))
    columns = {f"changes_{span}": np.log1p(lately.changes[n]) for n, span in enumerate(SPANS)}
    columns |= {f"rate_{span}": rates[n] for n, span in enumerate(SPANS)}
    since = lately.hours_since_moved
    return columns | {
        "hours_since_moved": np.log1p(np.minimum(since, _MOST_HOURS)),
        "moved_lately": np.exp(-since / SPANS["hours"]),
        "asks_moved": np.full(len(since), asked.asks_moved),
    }
