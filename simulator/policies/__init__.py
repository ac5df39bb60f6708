"""Policies by name: heuristics, filters and oracles. A network is one more `Policy`."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from simulator.policies.adaptive import Adaptive
from simulator.policies.filters import Ceiling, PriorFilter
from simulator.policies.heuristics import Bayesian, Frequentist, Myopic, Priors, Random
from simulator.policies.home_filter import HomeFilter
from simulator.policies.last_seen import LastSeenUnlessAbsent, LastSeenUnlessAbsentPrior, Oracle
from simulator.policies.policy import Policy
from simulator.world.homes import Homes

# Every policy by the name that command lines and tables use. Only oracles read the true homes.
POLICIES: Mapping[str, type[Policy]] = {
    "random": Random,
    "priors": Priors,
    "frequentist": Frequentist,
    "myopic": Myopic,
    "bayesian": Bayesian,
    "last_seen": LastSeenUnlessAbsent,
    "last_seen_prior": LastSeenUnlessAbsentPrior,
    "prior_filter": PriorFilter,
    "home_filter": HomeFilter,
    "adaptive": Adaptive,
    "oracle": Oracle,
    "ceiling": Ceiling,
}


def make_policy(name: str, homes: Homes) -> Policy:
    """Make a policy by name, or by import path (`my_package:MyPolicy`).

    Raises:
        ValueError: if there is no such policy.
    """
    return find_policy(name).from_homes(homes)


def find_policy(name: str) -> type[Policy]:
    """Return the class of a policy by name, or by import path (`my_package:MyPolicy`).

    Raises:
        ValueError: if there is no such policy.
    """
    if ":" not in name:
        if name not in POLICIES:
            raise ValueError(
                f"policy must be one of {', '.join(POLICIES)}, got {name!r}. Choose one of these, "
                "or name one of your own by its import path, my_package:MyPolicy."
            )
        return POLICIES[name]
    module, _, attribute = name.partition(":")
    try:
        found = getattr(import_module(module), attribute)
    except (ImportError, AttributeError) as error:
        raise ValueError(
            f"policy must be importable, got {name!r}: {error}. Check the path; its folder must be "
            "on PYTHONPATH."
        ) from None
    if not (isinstance(found, type) and issubclass(found, Policy)):
        raise ValueError(
            f"policy must be a subclass of simulator.Policy, got {found!r} by {name!r}. "
            "Name the class."
        )
    return found


def check_policy(name: str) -> None:
    """Check the name of a policy.

    Raises:
        ValueError: if there is no policy of that name.
    """
    find_policy(name)


__all__ = ["POLICIES", "Bayesian", "Policy", "check_policy", "find_policy", "make_policy"]
