"""Heuristics and filters that answer from a memory alone.

Oracles, and filters that are given the rules of homes, are in `simulator.policies`.
"""

from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import (
    Bayesian,
    Frequentist,
    LastSeenUnlessAbsent,
    LastSeenUnlessAbsentPrior,
    Myopic,
    Priors,
    Random,
)
from sgm.policies.persistence import Persistence
from sgm.policies.policy import Policy

__all__ = [
    "Adaptive",
    "Bayesian",
    "Frequentist",
    "LastSeenUnlessAbsent",
    "LastSeenUnlessAbsentPrior",
    "Myopic",
    "Persistence",
    "Policy",
    "Priors",
    "Random",
]
