"""Policies that search on the grid, by name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sgm.messages import shorten
from simulator.igridson.find_object import Searcher
from simulator.policies import POLICIES

TRAVEL = "+travel"  # ending of a policy's name that makes the search travel-aware
POLICY_HELP = f"one of {', '.join(POLICIES)}; with '{TRAVEL}' at its end, walking distances count"


def list_searchers() -> dict[str, Searcher]:
    """Return all policies by name."""
    return {name: Searcher(policy.make) for name, policy in POLICIES.items()}


def find_searcher(name: str, known: Mapping[str, Searcher], look_cost: float) -> Searcher:
    """Return the searcher of a policy's name, travel-aware if it ends in `+travel`.

    Raises:
        ValueError: if there is no such policy.
    """
    plain = name.removesuffix(TRAVEL)
    if plain not in known:
        raise ValueError(
            f"policy must be one of {', '.join(known)}, got {shorten(name)}. Choose one of these, "
            f"with '{TRAVEL}' at its end for a travel-aware search; a trained network is played by "
            "`python -m nep.igridson --checkpoint CKPT`."
        )
    return replace(known[plain], is_travel_aware=name != plain, look_cost=look_cost)
