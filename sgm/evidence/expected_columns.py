"""Columns of places: where the thing is expected by the prior, by words and by the filters.

Each function computes the columns of a group of `sgm.evidence.columns`, by name, (Q, F) each.
"""

from __future__ import annotations

import numpy as np

from sgm.arrays.rows import add_in_order, rank_rows
from sgm.evidence.question import FILTERS, Question


def compute_prior(asked: Question) -> dict[str, np.ndarray]:
    """The prior, and posteriors that trust it as so many looks.

    A place's share is in proportion to how much of what is expected there is this thing: a place
    where all is kept has as much room as one where little is.
    """
    arrays, own = asked.arrays, asked.expected.share
    is_trusted, in_room = asked.expected.trust[:, None] > 0, arrays.is_in_last_room
    share = own / np.maximum(arrays.crowding, 1e-6)
    total = add_in_order(share * arrays.is_place)
    share = np.divide(share, total, out=np.zeros_like(share), where=total > 1e-9)
    columns = {
        "prior": own,
        "log_prior": arrays.log_share(own) * is_trusted,
        "prior_rank": rank_rows(own) * is_trusted,
        "is_possible": own > 0,
        "place_share": share,
        "log_place_share": arrays.log_share(share) * is_trusted,
        "place_share_rank": rank_rows(share) * is_trusted,
        "prior_in_room": own / np.maximum(add_in_order(own * in_room), 1e-6) * in_room,
    }
    for strength in (0.5, 2.0, 8.0):
        weight = (asked.counts.num_true + strength * own) / (arrays.looks + strength)
        total = add_in_order(weight * arrays.is_place)
        columns[f"posterior_{strength:g}"] = weight / np.maximum(total, 1e-6)
    return columns


def compute_words(asked: Question) -> dict[str, np.ndarray]:
    """Where things of such names are kept by the prior and in this home, and the place's own."""
    by_name, similar = asked.expected.by_name, asked.companions.similar
    is_called = asked.expected.name_cosine[:, None] > 0
    here = similar / (add_in_order(similar) + 0.1)
    return {
        "by_name": by_name,
        "log_by_name": asked.arrays.log_share(by_name) * is_called,
        "by_name_rank": rank_rows(by_name) * is_called,
        "similar_here": here,
        "log_similar_here": asked.arrays.log_share(here),
        "furniture_cosine": asked.expected.furniture_cosine,
    }


def compute_filters(asked: Question) -> dict[str, np.ndarray]:
    """What the adaptive filters believe."""
    columns = {}
    for name in FILTERS:
        belief = asked.get_belief(name)
        columns[f"belief_{name}"] = belief
        columns[f"log_belief_{name}"] = asked.arrays.log_share(belief)
    columns["belief_rank"] = rank_rows(asked.ranking_belief[:, :-1])
    return columns
