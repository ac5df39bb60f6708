"""Play a task with a policy and keep every score."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from simulator.config import HouseConfig
from simulator.houses import Houses
from simulator.policies import Policy
from simulator.prior_graph import PriorGraph
from simulator.rollout import Rollout
from simulator.streams import Streams


@dataclass(frozen=True, slots=True)
class Scores:
    """What a policy scored in H homes over T steps of Predict Object Location.

    Attributes:
        is_correct: whether the chosen furniture held an object asked for, bool (H, T).
        has_candidate: whether the policy gave a true place any score above -inf, which for NEP
            means that it was among the query's candidate edges, bool (H, T).
    """

    is_correct: np.ndarray
    has_candidate: np.ndarray

    @property
    def accuracy(self) -> np.ndarray:
        """Share of correct answers per home, (H,)."""
        return self.is_correct.mean(axis=1)

    @property
    def candidate_recall(self) -> float:
        """Share of queries whose true place is a candidate (ruling 12: near 1)."""
        return float(self.has_candidate.mean())


def evaluate_policy(
    make: Callable[[Houses], Policy],
    prior: PriorGraph,
    config: HouseConfig,
    streams: Streams,
    num_steps: int,
    on_step: Callable[[], None] = lambda: None,
) -> Scores:
    """Let a policy play Predict Object Location in fresh homes, all in lockstep.

    Args:
        make: gets the homes and returns the policy; only oracles keep them.
        prior: what homes look like.
        config: the rules.
        streams: of the homes to play in; the same streams give the same homes and queries to
            every policy, so that policies can be compared home by home.
        num_steps: T.
        on_step: called after each step.
    """
    houses = Houses(prior, config, streams)
    rollout = Rollout(houses, make(houses))
    correct, candidate = [], []
    for step in rollout.run(num_steps):
        correct.append(step.is_correct)
        candidate.append((np.isfinite(step.scores) & step.answers).any(axis=1))
        on_step()
    return Scores(np.stack(correct, axis=1), np.stack(candidate, axis=1))
