"""Policies by name: heuristics, filters and oracles. A network is one more `Policy`."""

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
    "check_policies",
    "find_policy",
    "identify_policy",
    "list_policies",
    "make_policy",
]
