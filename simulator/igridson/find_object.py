"""Find Object on the grid: thousands of searches, all homes in lockstep."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace

import numpy as np

from sgm.checks import check_at_least, check_seed
from sgm.messages import shorten
from sgm.policies.policy import Policy
from sgm.prior.prior_graph import PriorGraph
from simulator.igridson.layout import GridLayout
from simulator.igridson.navigation import LOOK_COST, ByTravel, Routes, Walk
from simulator.policies import POLICIES
from simulator.tasks.answer import Answer
from simulator.tasks.find_object import FindObject
from simulator.tasks.search import ByScore, SearchOrder
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

TRAVEL = "+travel"  # ending of a policy's name that makes the search travel-aware
POLICY_HELP = f"one of {', '.join(POLICIES)}; with '{TRAVEL}' at its end, walking distances count"
_HOMES_AT_ONCE = 100  # in lockstep; results do not depend on it


@dataclass(frozen=True, slots=True)
class Searcher:
    """A policy and how it is followed.

    Attributes:
        make: gets the homes and returns the policy; only oracles keep them.
        is_travel_aware: whether walking distances count when the next place is chosen.
        look_cost: price of a look in steps, for a travel-aware search.
    """

    make: Callable[[SampledHomes], Policy]
    is_travel_aware: bool = False
    look_cost: float = LOOK_COST

    def make_order(self, walk: Walk, policy: Policy) -> SearchOrder:
        """Return the search order of agents that walk so and follow such a policy."""
        if not self.is_travel_aware:
            return ByScore()
        return ByTravel(walk, policy.score_kind, self.look_cost)


def list_searchers() -> dict[str, Searcher]:
    """Return all policies by name."""
    return {name: Searcher(policy.make) for name, policy in POLICIES.items()}


def find_searcher(name: str, more: Mapping[str, Searcher], look_cost: float) -> Searcher:
    """Return the searcher of a policy's name, travel-aware if it ends in `+travel`.

    Those of `more` are known beside all policies.

    Raises:
        ValueError: if there is no such policy.
    """
    known = {**list_searchers(), **more}
    plain = name.removesuffix(TRAVEL)
    if plain not in known:
        raise ValueError(
            f"policy must be one of {', '.join(known)}, got {shorten(name)}. Choose one of these, "
            f"with '{TRAVEL}' at its end for a travel-aware search; a trained network is played by "
            "`python -m nep.igridson --checkpoint CKPT`."
        )
    return replace(known[plain], is_travel_aware=name != plain, look_cost=look_cost)


@dataclass(frozen=True, slots=True)
class RunConfig:
    """How many searches to run, and where.

    Attributes:
        runs: searches in all.
        queries_per_home: searches in one home; the memory is kept over them, and the home
            evolves by one step before each. Must divide `runs`.
        attempts: looks allowed per search, N.
        seed: experiment seed; homes are those of the test split.
    """

    runs: int = 10_000
    queries_per_home: int = 100
    attempts: int = 10
    seed: int = 0

    def __post_init__(self) -> None:
        """Raise ValueError if a count is below 1, the seed negative, or homes come out uneven."""
        check_at_least(
            1, runs=self.runs, queries_per_home=self.queries_per_home, attempts=self.attempts
        )
        if self.runs % self.queries_per_home:
            raise ValueError(
                f"runs must be a multiple of the {self.queries_per_home} queries per home, got "
                f"{self.runs}. Change one of them."
            )
        check_seed(self.seed)

    @property
    def num_homes(self) -> int:
        """Homes that are searched, H."""
        return self.runs // self.queries_per_home


@dataclass(frozen=True, slots=True)
class Runs:
    """What T searches in each of H homes came to.

    Attributes:
        is_found: bool (H, T).
        num_actions: looks, or N + 1 where the object was not found, (H, T).
        path_length: steps walked, found or not, (H, T).
        shortest_path: steps to the nearest furniture that held the object, (H, T).
    """

    is_found: np.ndarray
    num_actions: np.ndarray
    path_length: np.ndarray
    shortest_path: np.ndarray

    def summarise(self) -> dict[str, float]:
        """Return means, standard deviations over runs, standard errors over homes (of several)."""
        summary: dict[str, float] = {}
        for name, values in (
            ("success_rate", self.is_found),
            ("num_actions", self.num_actions),
            ("path_length", self.path_length),
        ):
            homes = values.mean(axis=1)
            summary[name] = float(values.mean())
            summary[f"{name}_std"] = float(values.std())
            if len(homes) > 1:
                error = homes.std(ddof=1) / np.sqrt(len(homes))
                summary[f"{name}_standard_error"] = float(error)
        summary["shortest_path"] = float(self.shortest_path.mean())
        return summary


def make_homes(prior: PriorGraph, layout: GridLayout, streams: Streams) -> SampledHomes:
    """Sample homes with the furniture of a layout; objects come and go nowhere, they move.

    Source: appendix F ("the overall set of objects itself is static").
    """
    config = HomeConfig(rooms=layout.rooms, dynamic_nodes=False)
    return SampledHomes(prior, config, streams, layout.places)


def check_attempts(config: RunConfig, layout: GridLayout) -> None:
    """Raise ValueError unless there are as many places as attempts: none is offered twice."""
    if config.attempts > len(layout.furniture):
        raise ValueError(
            f"attempts must be at most the {len(layout.furniture)} furniture nodes, got "
            f"{config.attempts}. Lower it."
        )


def run_searches(
    searcher: Searcher, prior: PriorGraph, layout: GridLayout, config: RunConfig
) -> Runs:
    """Search for objects in fresh homes; the same config gives every searcher the same homes.

    Homes, queries and their order do not depend on the searcher. An agent starts its first
    search on the start cell of the layout, and every other one where the last one ended. The prior
    says what homes look like, beyond their furniture.

    Raises:
        ValueError: if there are more attempts than furniture nodes.

    Source: paper sections 4.1, 6.3 and appendix F.
    """
    check_attempts(config, layout)
    routes = Routes(layout)
    chunks = [
        range(first, min(first + _HOMES_AT_ONCE, config.num_homes))
        for first in range(0, config.num_homes, _HOMES_AT_ONCE)
    ]
    parts = [
        _run_homes(
            searcher, make_homes(prior, layout, Streams(config.seed, "test", homes)), routes, config
        )
        for homes in chunks
    ]
    return Runs(
        *(np.concatenate([getattr(part, column.name) for part in parts]) for column in fields(Runs))
    )


def _run_homes(searcher: Searcher, homes: SampledHomes, routes: Routes, config: RunConfig) -> Runs:
    """Run the searches of some homes in lockstep."""
    walk = Walk(routes, homes.num_homes)
    policy = searcher.make(homes)
    task = FindObject(homes, policy, config.attempts, searcher.make_order(walk, policy))

    def go(answer: Answer) -> None:
        walk.go(answer.queries.home, answer.choice)

    task.on_answer = go
    rows = []
    start = walk.cell.copy()
    for search in task.search(config.queries_per_home):
        steps = np.where(search.answers, routes.to_furniture[start], np.iinfo(np.int64).max)
        num_actions = np.where(search.is_found, search.num_looks, config.attempts + 1)
        rows.append((search.is_found, num_actions, walk.path_length.copy(), steps.min(axis=1)))
        walk.start_episode()
        start = walk.cell.copy()
    return Runs(*(np.stack(column, axis=1) for column in zip(*rows, strict=True)))
