"""Policies by name or import path, and which of them can play in which homes."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

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
from simulator.policies.event_rules import Base3, EdgeBank, EdgeBankWindow, PopTrack
from simulator.policies.filters import Ceiling, HomeFilter, PriorFilter
from simulator.policies.informed import Informed
from simulator.policies.oracles import Oracle, ScheduleOracle
from simulator.world.homes import Homes
from simulator.world.parts import find_subclass
from simulator.world.source import HomeSource

# Every policy of the paper's homes by the name that command lines and tables use. Only the oracles
# among them read the true homes.
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
    "persistence": Persistence,
    "adaptive": Adaptive,
    "oracle": Oracle,
    "ceiling": Ceiling,
}
ORACLES = ("oracle", "ceiling")  # below the line in tables, and no rules that a robot could follow
# Those that play in some other homes alone, where a source knows what they need.
_OF_OTHER_HOMES: Mapping[str, type[Policy]] = {"schedule_oracle": ScheduleOracle}
# Rules of temporal graph learning (docs/events.md), which play where they are named alone.
EVENT_RULES: Mapping[str, type[Policy]] = {
    "edgebank": EdgeBank,
    "edgebank_window": EdgeBankWindow,
    "poptrack": PopTrack,
    "base3": Base3,
}
# Likewise: it takes a hundred times as long as the others.
WHERE_NAMED: Mapping[str, type[Policy]] = {"informed": Informed, **EVENT_RULES}
_ALL = {**POLICIES, **_OF_OTHER_HOMES, **WHERE_NAMED}


def find_policy(name: str) -> type[Policy]:
    """Find a policy by name, or import one of your own: "my_module:MyPolicy".

    What follows a "=" says where the policy is loaded from, see `make_policy`.

    Raises:
        ValueError: if there is no policy of that name.
    """
    found: type[Policy] = find_subclass("policy", name.partition("=")[0], _ALL, Policy)
    return found


def make_policy(name: str, homes: Homes) -> Policy:
    """Make a policy by name, or load it: "nep.players.policy:NEPPolicy=runs/mine/last.ckpt".

    Raises:
        ValueError: if there is no policy of that name, or none where it says.
    """
    _, loads, source = name.partition("=")
    policy = find_policy(name)
    return policy.load(source).play_in(homes) if loads else policy.make(homes)


def identify_policy(name: str) -> str | None:
    """Return the checksum of what a policy is loaded from, None if it is not; see `make_policy`."""
    _, loads, source = name.partition("=")
    return find_policy(name).identify(source) if loads else None


def list_policies(source: HomeSource) -> tuple[str, ...]:
    """Return the names of the policies that can play, but for those that must be named."""
    quick = {**POLICIES, **_OF_OTHER_HOMES}
    return tuple(name for name, policy in quick.items() if policy.needs <= source.knows)


def check_policies(names: Iterable[str], source: HomeSource | None = None) -> None:
    """Check the names of policies, and that they can play in homes of a source.

    Raises:
        ValueError: if there is no policy of a name, or it needs what only a simulator knows.
    """
    for name in names:
        missing = find_policy(name).needs - (frozenset() if source is None else source.knows)
        if source is not None and missing:
            raise ValueError(
                f"policies must not need what is unknown of the homes, got {name}, which reads "
                f"their true {' and '.join(sorted(missing))}. Leave it out."
            )
