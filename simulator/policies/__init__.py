"""Policies by name: heuristics, filters and oracles. A network is one more `Policy`."""

from sgm.policies.heuristics import Bayesian
from sgm.policies.policy import Policy
from simulator.policies.registry import (
    POLICIES,
    check_policies,
    find_policy,
    identify_policy,
    list_policies,
    make_policy,
)

__all__ = [
    "POLICIES",
    "Bayesian",
    "Policy",
    "check_policies",
    "find_policy",
    "identify_policy",
    "list_policies",
    "make_policy",
]
