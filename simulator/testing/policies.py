"""Check that a policy keeps the contract of `Policy`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from sgm.policies.policy import Policy
from sgm.prior.prior_graph import PriorGraph
from simulator.tasks.rollout import Rollout, compute_answers, sample_query
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
from simulator.world.source import HomeSource, SampledSource
from simulator.world.streams import Streams


class SmallHomes(SampledSource):
    """Sampled homes of two rooms with 2, 3 or 4 furniture nodes each, one size after the other."""

    def __init__(
        self, prior: PriorGraph | None = None, home: HomeConfig | None = None, **parts: Any
    ) -> None:
        """Keep prior and rules; three of four homes have other parts, such as `dynamics`."""
        super().__init__(prior, home)
        self._parts = parts

    def make(self, streams: Streams) -> SampledHomes:
        """Sample homes at t = 0."""
        small = replace(self.home, rooms=("kitchen", "bedroom"))
        rules = [
            replace(small, furniture_per_room=2 + home % 3, **(self._parts if home % 4 else {}))
            for home in streams.homes
        ]
        return SampledHomes(self.prior, rules, streams)


def check_policy(
    make: Callable[[Homes], Policy],
    source: HomeSource | None = None,
    *,
    num_homes: int = 3,
    num_steps: int = 8,
    seed: int = 0,
    tolerance: float = 1e-6,
) -> None:
    """Check that a policy answers as every task expects.

    Its scores are numbers or -inf, one for every furniture node, and -inf where a home has none;
    the same memory gives the same scores; neither the other homes of a batch nor the other
    questions matter; answering and `observe` leave the memory alone; after `reset` nothing is left
    of earlier homes (but for oracles, which hold the true ones).

    Args:
        make: gets the homes and returns the policy, such as `MyPolicy.make`.
        source: homes to play in; None for `SmallHomes`.
        num_homes: how many of them.
        num_steps: for how long.
        seed: of the homes.
        tolerance: relative difference allowed between scores that must be equal, because sums of
            other batches may round otherwise.

    Raises:
        AssertionError: if one of this does not hold; says which, in which home and step.
    """
    source = SmallHomes() if source is None else source

    def start(homes: range) -> Homes:
        return source.make(Streams(seed, "test", homes))

    together = start(range(num_homes))
    policy = make(together)
    scores = _play(policy, together, num_steps, tolerance)
    for home in range(num_homes):
        alone = start(range(home, home + 1))
        single_scores = _play(make(alone), alone, num_steps, tolerance)
        for step, (single, batch) in enumerate(zip(single_scores, scores, strict=True), start=1):
            _check_equal(
                batch[home::num_homes, : alone.num_furniture],
                single,
                tolerance,
                f"be the same in any batch, got others for home {home} alone in step "
                f"{step}. Work on each home by itself",
            )
    if policy.needs:
        return
    again = _play(policy, start(range(num_homes)), num_steps, tolerance)
    for step, (first, second) in enumerate(zip(scores, again, strict=True), start=1):
        _check_equal(
            first,
            second,
            tolerance,
            f"be those of a new policy after reset, got others in step {step} of the same homes. "
            "Forget everything in reset",
        )


def _play(policy: Policy, homes: Homes, num_steps: int, tolerance: float) -> list[np.ndarray]:
    """Ask two questions per home and step, look somewhere, and return the scores, (2 H, F) each.

    Looks depend on the homes alone: at the object, at any place in turn, or in every third step
    nowhere in every second home.
    """
    rollout = Rollout(homes, _Watched(policy, tolerance))
    memory, home = rollout.memory, np.arange(homes.num_homes)
    numbers = np.array(homes.streams.homes)
    scores = []
    for step in range(num_steps):
        rollout.evolve()
        codes = homes.object_code[home, sample_query(homes)]
        others = (13 * step + numbers) % homes.object_descriptions.num_descriptions
        queries = rollout.query(np.tile(home, 2), np.concatenate([codes, others]))
        scores.append(rollout.policy.scores(memory, queries))
        place = (7 * step + numbers) % memory.home_num_furniture
        if step % 2:
            place = compute_answers(homes, codes).argmax(axis=1)
        if step % 3 == 2:
            place = np.where(numbers % 2, -1, place)
        rollout.look(place)
    return scores


class _Watched(Policy):
    """Plays like another policy, and checks every answer and every note that it takes."""

    def __init__(self, policy: Policy, tolerance: float) -> None:
        self._policy = policy
        self._tolerance = tolerance

    def reset(self, memory: MemoryBatch) -> None:
        """Reset the policy."""
        self._policy.reset(memory)

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Let the policy answer, and check what it says."""
        before = _copy_counters(memory)
        scores = self._policy.scores(memory, queries)
        _check_scores(memory, queries, scores)
        again = self._policy.scores(memory, queries)
        when = f"in step {memory.time}"
        _check_equal(
            scores,
            again,
            0.0,
            f"be the same for the same memory, got others when asked twice {when}. Let nothing but "
            "the memory and the queries matter",
        )
        for query in range(len(scores)):
            question = queries.take(np.array([query]))
            _check_equal(
                scores[query : query + 1],
                self._policy.scores(memory, question),
                self._tolerance,
                f"be the same for a question alone, got others for question {query} {when}. Answer "
                "each question by itself",
            )
        _check_unchanged(memory, before, "scores")
        return scores

    def observe(self, memory: MemoryBatch, change: Change) -> None:
        """Let the policy take note."""
        before = _copy_counters(memory)
        self._policy.observe(memory, change)
        _check_unchanged(memory, before, "observe")


def _check_scores(memory: MemoryBatch, queries: Queries, scores: np.ndarray) -> None:
    shape = (len(queries.home), memory.num_furniture)
    if np.shape(scores) != shape:
        raise AssertionError(
            f"scores must have the shape (Q, F) = {shape}, got {np.shape(scores)} in step "
            f"{memory.time}. Return one score per question and furniture node."
        )
    if np.isnan(scores).any() or (scores == np.inf).any():
        raise AssertionError(
            f"scores must be numbers or -inf, got nan or inf in step {memory.time}. Return -inf "
            "where there is no opinion."
        )
    is_furniture = memory.is_furniture[queries.home]
    if (scores[~is_furniture] > -np.inf).any():
        query, column = np.argwhere(~is_furniture & (scores > -np.inf))[0]
        raise AssertionError(
            f"scores must be -inf where a home has no furniture, got {scores[query, column]} in "
            f"column {column} of home {queries.home[query]}. Use "
            "`sgm.policies.policy.mask_furniture`."
        )


def _check_equal(first: np.ndarray, second: np.ndarray, tolerance: float, rule: str) -> None:
    is_finite = np.isfinite(first)
    if not np.array_equal(is_finite, np.isfinite(second)) or not np.allclose(
        first[is_finite], second[is_finite], rtol=tolerance, atol=tolerance
    ):
        raise AssertionError(f"scores must {rule}.")


def _copy_counters(memory: MemoryBatch) -> dict[str, np.ndarray]:
    """Copy all that a memory counts."""
    tables = {"objects": memory.objects, "edges": memory.edges}
    columns = {
        f"{name} {column}": table[column] for name, table in tables.items() for column in table
    }
    columns["time"] = np.array(memory.time)
    columns["furniture num_observed"] = memory.furniture_num_observed
    columns["furniture last_observed"] = memory.furniture_last_observed
    if memory.counts_history:
        columns |= {f"history {name}": value for name, value in memory.history.counters.items()}
    return {name: values.copy() for name, values in columns.items()}


def _check_unchanged(memory: MemoryBatch, before: dict[str, np.ndarray], caller: str) -> None:
    for name, values in _copy_counters(memory).items():
        if not np.array_equal(values, before[name]):
            raise AssertionError(
                f"{caller} must leave the memory alone, got another '{name}' in step "
                f"{memory.time}. Copy what you change."
            )
