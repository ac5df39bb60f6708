"""The last step of a belief: what similar moments in this home say beside it.

With b the belief of a policy, l the place where the thing was seen last, m_k what moments say that
are alike in k, and m what they say together:

    log odds that it is still at l:  that of b, and Σ w_i t_i
    where it is, if not at l:        P(p) ∝ b(p)^(1 - r) m(p)^r

The terms t_i are log odds of l by m_k, by m and by b, each for as much as there are such moments,
so that a home of which nothing is known has the belief of the policy. The rate r grows with how
much likelier m makes the thing's own past: one that keeps to no rhythm is, if not at l, where the
policy says. The weights w_i are fitted in simulated homes (`python -m tools.rhythm`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from sgm.belief import Belief
from sgm.evidence.similar_moments import KINDS, PastMoments, SimilarMoments, compare_moments
from sgm.files import read_json
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries

_FILE = Path(__file__).parents[1] / "pretrained" / "rhythm" / "weights.json"
_FEW = 2.0  # moments of which half is believed
_FIRST, _MANY = 10.0, 20.0  # moments that a thing without a rhythm has to have, and more for half
_SOON = 1.0  # hours since the last look there, before which moments say less
_LEAST = 1e-4  # probability
_DOUBTED = 0.02  # probability: a policy that is surer than this is believed in any rhythm
_SLIGHT = 0.02  # nats per moment: what keeps to no rhythm more than this is as the policy says
_SURE = 0.3  # nats per moment: a thing whose past is so much likelier keeps to its rhythm
_DECIMALS = 6  # of a logit: what is asked for beside a thing does not change its answer

TERMS = (*KINDS, "all", "belief", "bias")


@dataclass(frozen=True, slots=True)
class RhythmTerms:
    """What is weighed for Q questions with F places and elsewhere; zeros where nothing is known.

    Attributes:
        last: answer that is the place where the thing was seen last, 0 if nowhere, (Q,).
        stay: the terms t_i, (Q, terms).
        others: probability of each other answer by the policy, if it is not there, (Q, F + 1).
        ratios: log ratio of m to that, (Q, F + 1).
        rate: how far moments are believed of the others, r, (Q,).
    """

    last: np.ndarray
    stay: np.ndarray
    others: np.ndarray
    ratios: np.ndarray
    rate: np.ndarray

    @classmethod
    def make(cls, believed: np.ndarray, similar: SimilarMoments, past: PastMoments) -> RhythmTerms:
        """Make the terms of questions.

        Args:
            believed: probability of each answer, by the policy, (Q, F + 1).
            similar: what similar moments say.
            past: the moments that they are of.
        """
        question, last = np.arange(len(past.last)), np.maximum(past.last, 0)
        is_some = (past.last >= 0) & (similar.amount[:, -1] > 0)
        share, amount, gain = similar.join()  # share (Q, F + 1)
        some = amount / (amount + _FEW)
        gain = np.clip(gain, 0.0, None)
        many = np.maximum(similar.amount[:, -1] - _FIRST, 0.0)
        many /= many + _MANY
        apart = 1 - (1 - gain / (gain + _SLIGHT)) * (1 - many**2)
        apart *= np.minimum(past.compute_since() / _SOON, 1.0) ** 2
        apart *= past.compute_known_share() * is_some
        stay = np.column_stack(
            [
                _log_odds(similar.shares[question, :, last])
                * (similar.amount / (similar.amount + _FEW)),
                _log_odds(share[question, last]) * some,
                _log_odds(believed[question, last], _DOUBTED) * some,
                some,
            ]
        )
        others, alike = (_leave_out(each, last) for each in (believed, share))
        with np.errstate(divide="ignore", invalid="ignore"):
            ratios = np.where(others > 0, np.log(np.maximum(alike, _LEAST) / others), 0.0)
        rate = np.minimum(gain / _SURE, 1.0) * some
        return cls(last, stay * apart[:, None], others, ratios, rate * apart)

    def weigh(self, log_weights: np.ndarray, weights: np.ndarray) -> np.ndarray:
        """Return log weights of a belief, (Q, F + 1), changed by weights of `TERMS`."""
        question = np.arange(len(self.last))
        change = self.rate[:, None] * self.ratios
        total = (self.others * np.exp(change)).sum(axis=1, keepdims=True)
        change -= np.log(np.where(total > 0, total, 1.0))
        change[question, self.last] = self.stay @ weights
        changed: np.ndarray = log_weights + change.round(_DECIMALS)
        return changed


def _log_odds(probability: np.ndarray, least: float = _LEAST) -> np.ndarray:
    kept = np.clip(probability, least, 1 - least)
    odds: np.ndarray = np.log(kept / (1 - kept))
    return odds


def _leave_out(probabilities: np.ndarray, left_out: np.ndarray) -> np.ndarray:
    """Return the probability of each answer if one is not right, 0 for what is none, (Q, F + 1)."""
    kept = np.where(probabilities > 0, np.maximum(probabilities, _LEAST), 0.0)
    kept[np.arange(len(kept)), left_out] = 0.0
    total = kept.sum(axis=1, keepdims=True)
    return np.divide(kept, total, out=np.zeros_like(kept), where=total > 0)


def weigh_rhythm(
    memory: MemoryBatch, queries: Queries, belief: Belief, weights: np.ndarray
) -> Belief:
    """Weigh what a policy believes by what similar moments say; without a clock it stays.

    Args:
        memory: that is asked.
        queries: what is asked for.
        belief: of the policy.
        weights: of `TERMS`.
    """
    if memory.clock is None or not memory.history.moments.is_counted:
        return belief
    past = PastMoments.gather(memory, queries)
    similar = compare_moments(past)
    if not (similar.amount[:, -1] > 0).any():
        return belief
    terms = RhythmTerms.make(belief.probabilities, similar, past)
    return Belief(terms.weigh(belief.log_weights, weights))


@cache
def load_weights(policy: str) -> np.ndarray:
    """Return the weights of `TERMS` that ship for a policy, "network" or "adaptive"."""
    weights = read_json(_FILE)["weights"][policy]
    return np.array([weights[name] for name in TERMS])
