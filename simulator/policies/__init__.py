"""Policies by name: heuristics, filters and oracles. A network is one more `Policy`."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from simulator.policies.adaptive import Adaptive
from simulator.policies.filters import Ceiling, PriorFilter
from simulator.policies.heuristics import Bayesian, Frequentist, Myopic, Priors, Random
from simulator.policies.home_filter import HomeFilter
from simulator.policies.last_seen import LastSeenUnlessAbsent, LastSeenUnlessAbsentPrior, Oracle
from simulator.policies.policy import Policy
from simulator.world.homes import Homes

# Every policy by the name that command lines and tables use. Only oracles read the true homes.
POLICIES: Mapping[str, Callable[[Homes], Policy]] = {
    "random": lambda homes: Random(),
    "priors": lambda homes: Priors(),
    "frequentist": lambda homes: Frequentist(),
    "myopic": lambda homes: Myopic(),
    "bayesian": lambda homes: Bayesian(),
    "last_seen": lambda homes: LastSeenUnlessAbsent(),
    "last_seen_prior": lambda homes: LastSeenUnlessAbsentPrior(),
    "prior_filter": lambda homes: PriorFilter(homes.prior, homes.config),
    "home_filter": lambda homes: HomeFilter(homes.prior, homes.config),
    "adaptive": lambda homes: Adaptive(),
    "oracle": Oracle,
    "ceiling": Ceiling,
}


def make_policy(name: str, homes: Homes) -> Policy:
    """Make a policy by name.

    Raises:
        ValueError: if there is no policy of that name.
    """
    check_policy(name)
    return POLICIES[name](homes)


def check_policy(name: str) -> None:
    """Check the name of a policy.

    Raises:
        ValueError: if there is no policy of that name.
    """
    if name not in POLICIES:
        raise ValueError(
            f"policy must be one of {', '.join(POLICIES)}, got {name!r}. Choose one of these."
        )


__all__ = ["POLICIES", "Bayesian", "Policy", "check_policy", "make_policy"]
