"""Policies by name or import path, and which of them can play in which homes."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from simulator.world.parts import ClassesByName

if TYPE_CHECKING:
    from sgm.policies.policy import Policy
    from simulator.world.homes import Homes
    from simulator.world.source import HomeSource


def _name(**paths: str) -> ClassesByName[Policy]:
    return ClassesByName("policy", "sgm.policies.policy.Policy", **paths)


# Every policy of the paper's homes by the name that command lines and tables use. Only the oracles
# among them read the true homes.
POLICIES = _name(
    random="sgm.policies.heuristics.Random",
    priors="sgm.policies.heuristics.Priors",
    frequentist="sgm.policies.heuristics.Frequentist",
    myopic="sgm.policies.heuristics.Myopic",
    bayesian="sgm.policies.heuristics.Bayesian",
    last_seen="sgm.policies.heuristics.LastSeenUnlessAbsent",
    last_seen_prior="sgm.policies.heuristics.LastSeenUnlessAbsentPrior",
    prior_filter="simulator.policies.filters.PriorFilter",
    home_filter="simulator.policies.filters.HomeFilter",
    persistence="sgm.policies.persistence.Persistence",
    adaptive="sgm.policies.adaptive.Adaptive",
    oracle="simulator.policies.oracles.Oracle",
    ceiling="simulator.policies.filters.Ceiling",
)
ORACLES = ("oracle", "ceiling")  # below the line in tables, and no rules that a robot could follow
# Those that play in some other homes alone, where a source knows what they need.
_OF_OTHER_HOMES = _name(schedule_oracle="simulator.policies.oracles.ScheduleOracle")
# Rules of temporal graph learning (docs/events.md), which play where they are named alone.
EVENT_RULES = _name(
    edgebank="simulator.policies.event_rules.EdgeBank",
    edgebank_window="simulator.policies.event_rules.EdgeBankWindow",
    poptrack="simulator.policies.event_rules.PopTrack",
    base3="simulator.policies.event_rules.Base3",
)
_ALL = POLICIES | _OF_OTHER_HOMES | EVENT_RULES


def find_policy(name: str) -> type[Policy]:
    """Find a policy by name, or import one of your own: "my_module:MyPolicy".

    What follows a "=" says where the policy is loaded from, see `make_policy`.

    Raises:
        ValueError: if there is no policy of that name.
    """
    return _ALL.find(name.partition("=")[0])


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
    quick = POLICIES | _OF_OTHER_HOMES
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
