"""What is mixed into the answers of a network that reads evidence."""

from __future__ import annotations

import numpy as np

from sgm.belief.corrections import CORRECTIONS
from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.evidence_features import Features
from sgm.policies.probabilities import compute_probabilities


def mix_answers(
    scores: np.ndarray,
    evidence: Features,
    prior_share: float,
    asks_moved: float,
) -> np.ndarray:
    """Share answers with a filter of the prior, and count what is asked.

    Args:
        scores: logits of places and relations, (Q, F, R).
        evidence: what the network has read.
        prior_share: share of the filter of the prior, up to ten times that where the prior has
            told well where things are (`Features.follow_prior`).
        asks_moved: share of the questions that are about what has just moved; other questions
            than those of the tasks move the logits (`Features.compare_asked`).
    """
    asked = evidence.asked
    if prior_share > 0:
        trust, belief = evidence.follow_prior()
        shares = np.minimum(prior_share * (1 + CORRECTIONS.prior_gain * trust), 1)
        scores = share_answers(scores, belief, shares, asked.is_place)
    if asks_moved != TASKS_ASK_MOVED:
        weight = CORRECTIONS.asked_weight * (1 - asks_moved / TASKS_ASK_MOVED)
        scores = scores + weight * evidence.compare_asked()[..., None]
        scores = scores.round(CORRECTIONS.decimals)
    return scores


def share_answers(
    scores: np.ndarray, belief: np.ndarray, share: np.ndarray, is_place: np.ndarray
) -> np.ndarray:
    """Mix the probabilities of the places with a belief; relations of a place keep their odds.

    Scores are logits of places and relations, (Q, F, R), the belief need not sum to one, (Q, F),
    its share is (Q,), and `is_place` says which columns are furniture, bool (Q, F).
    """
    own = compute_probabilities(scores.max(axis=2), "logits", is_place)
    other, share = compute_probabilities(belief, "weights", is_place), share[:, None]
    mixed = (1 - share) * own + share * other
    gain = np.log(np.divide(mixed, own, out=np.ones_like(own), where=own > 0))
    return (scores + gain[..., None]).round(CORRECTIONS.decimals)
