"""The paper's heuristics: Random, Priors, Frequentist, Myopic and Bayesian."""

from __future__ import annotations

import numpy as np

from sgm.arrays.grouped import max_relations, sum_relations
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.policy import Policy, mask_furniture, spread_over_furniture
from sgm.schema import NEVER, NUM_RELATIONS


class Random(Policy):
    """Every furniture node alike. Source: paper section 5.3."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return zeros, (Q, F)."""
        return mask_furniture(memory, queries, np.zeros(queries.prior.shape[:2]))


class Priors(Policy):
    """The most likely place according to the prior. Source: paper section 5.3."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the prior weight, (Q, F), -inf where it is zero."""
        prior = max_relations(queries.prior)
        return np.where(prior > 0, prior, -np.inf)


class Frequentist(Policy):
    """The edge with the highest share of true observations, else at random.

    It has no prior: an edge that was never observed counts as 0, like one that never was true. A
    baseline, which does not follow the latest sighting, as `Bayesian`.
    Source: paper section 5.3.
    """

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return true / total observations of each edge, (Q, F)."""
        true, observed = memory.edges["num_true"], memory.edges["num_observed"]
        none = np.zeros(queries.prior.shape)
        ratio = spread_over_furniture(
            memory, queries, lambda edge: true[edge] / observed[edge], none
        )
        return mask_furniture(memory, queries, max_relations(ratio))


class Myopic(Policy):
    """The place where the object was last seen, else at random. Source: paper section 5.3."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return 1 at the last place, -inf elsewhere, (Q, F)."""
        last = memory.objects["last_furniture"][queries.object]
        is_last = last[:, None] == np.arange(memory.num_furniture)
        return np.where(is_last & (last != NEVER)[:, None], 1.0, -np.inf)


class Bayesian(Policy):
    """A beta-binomial model per edge, its beta prior matched to the prior weight.

    A baseline: the latest sighting has no more weight than any other, so that it does not follow a
    thing that was moved. `Adaptive` does.

    alpha = mu^2 ((1 - mu) / v - 1 / mu), beta = alpha (1 / mu - 1), which is alpha = mu s and
    beta = (1 - mu) s with s = mu (1 - mu) / v - 1; then
    p = (alpha + true) / (alpha + beta + observed).

    Attributes:
        variance: the desired variance v of the beta prior.

    Source: paper appendix "Bayesian policy". Differs: s would be negative where
    mu (1 - mu) < v, as it is for most places of a big home; there it is kept at `min_strength`.
    """

    variance = 0.05
    min_strength = 0.1
    min_prior = 1e-3  # of an edge that was observed although the prior excludes it

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the posterior predictive of each candidate edge, (Q, F), else -inf."""
        edges = memory.edges

        def compute_posterior(rows: np.ndarray) -> np.ndarray:
            mean = np.maximum(edges["prior"][rows].astype(float), self.min_prior)
            strength = np.maximum(mean * (1 - mean) / self.variance - 1, self.min_strength)
            alpha = mean * strength
            return (alpha + edges["num_true"][rows]) / (strength + edges["num_observed"][rows])

        unobserved = np.where(
            memory.propose_places(queries),
            np.maximum(queries.prior.astype(float), self.min_prior),
            -np.inf,
        )
        posterior = spread_over_furniture(memory, queries, compute_posterior, unobserved)
        return max_relations(posterior)


class LastSeenUnlessAbsent(Policy):
    """The last seen place, unless that place has been seen without the object since.

    Then the places ranked by how often the object was seen there, those that were recently seen
    without it last.
    """

    recent_steps = 10  # "recently": at 5 % moves a step, half of what was there has moved on

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return 2 for a trusted last place, otherwise weights in [0, 1], (Q, F)."""
        never = np.full((len(queries.home), memory.num_furniture, NUM_RELATIONS), NEVER)
        true_at = memory.edges["last_true"]
        last_true = max_relations(
            spread_over_furniture(memory, queries, true_at.__getitem__, never)
        )
        last_look = memory.furniture_last_observed[queries.home]
        if (lone := memory.find_lone_looks(queries.object)) is not None:
            last_look = np.maximum(last_look, lone.last)
        is_absent = (last_look > last_true) & (last_look != NEVER)
        is_empty = is_absent & (memory.time - last_look <= self.recent_steps)
        weights = self.compute_weights(memory, queries)
        scores = np.where(is_empty, weights * 1e-3, weights)
        last = memory.objects["last_furniture"][queries.object]
        trusted = np.flatnonzero(last != NEVER)
        trusted = trusted[~is_absent[trusted, last[trusted]]]
        scores[trusted, last[trusted]] = 2.0
        return mask_furniture(memory, queries, scores)

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the weight of each furniture node where the last place is not trusted, (Q, F)."""
        none = np.zeros((len(queries.home), memory.num_furniture, NUM_RELATIONS))
        num_true = memory.edges["num_true"]
        counts = sum_relations(spread_over_furniture(memory, queries, num_true.__getitem__, none))
        return (counts + 0.5) / (counts.sum(axis=1, keepdims=True) + 1)


class LastSeenUnlessAbsentPrior(LastSeenUnlessAbsent):
    """The same rule, falling back on the prior."""

    def compute_weights(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Return the prior, (Q, F)."""
        return sum_relations(queries.prior).astype(float)
