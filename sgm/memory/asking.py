"""A question to a memory: a copy to ask policies of, and what the looks say about each object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sgm.memory.clock import Clock
from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import ROBOT_CONFIDENCE, Statement


class Scorer(Protocol):
    """What scores the places of what is asked for: any `sgm.policies.policy.Policy`."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Score every furniture node for every query, (Q, F); -inf without an opinion."""


@dataclass(frozen=True, slots=True)
class Looks:
    """What the looks at F furniture nodes say about V objects.

    Attributes:
        negative: looks of this time step that did not show it, since it was seen there in this step
            or all, each weighed by how much of the furniture was in view, (V, F).
        steps_ago: time steps since each of the latest looks of earlier steps that did not show it,
            since it was last seen there, infinite where there was none, (V, F, n).
        sought: how often it alone was looked for in an earlier step and not found, (V, F).
        sought_ago: time steps since then, infinite where that never was, (V, F).
        seen: confidence with which it was seen there in this step, 0 where it was not, (V, F).
        is_remembered: whether it was ever seen there, so that the memory counts the looks that did
            not show it, which policies read, bool (V, F).
    """

    negative: np.ndarray
    steps_ago: np.ndarray
    sought: np.ndarray
    sought_ago: np.ndarray
    seen: np.ndarray
    is_remembered: np.ndarray

    def take(self, rows: Sequence[int], is_another: Sequence[bool]) -> Looks:
        """Return those about some of the objects, of one perhaps several times, (n,).

        Where one `is_another` of that description, its like was seen, not it.
        """
        looks = Looks(*(getattr(self, name)[rows] for name in Looks.__slots__))
        if any(is_another):
            looks.negative[is_another] += looks.seen[is_another] > 0
            looks.seen[is_another] = 0.0
        return looks


@dataclass(frozen=True, slots=True)
class Asked:
    """K objects that are asked for, and all that a memory of F furniture nodes says of them.

    Both memories are the asker's own for questions, and share what was observed with other
    questions of the same state: what is done to the memory later does not reach them. They are to
    be read; who wants to change them takes a `copy`.

    Attributes:
        batch: the memory as it was before the looks of this time step, which policies are asked of.
        origin: stands for the state that `batch` is a copy of: the same object for all questions
            that ask of that state.
        queries: the objects asked for in it, (K,).
        current: the memory as it is now.
        question: for each name that was asked for, which of the K things it means, the first of
            several with ids, (n,).
        rows: the objects' rows in `current.objects`, -1 for what it does not know, (K,).
        edges: rows of the edges that lead from them in `current.edges`, ascending, (n,).
        said: the last statement about each, None where there was none, or a look has shown it
            since, K of them.
        statements: all that was said of each and is kept, the oldest first, K of them.
        descriptions: of all objects of `current`, (O,).
        looks: what the looks say about each of the K.
        num_instances: most things of each description that were seen at once, 1 or more, (K,).
        sightings: every place where one of them was ever seen, the latest first.
        furniture_ids, furniture_names: F each.
        open_costs: of opening each to look into it, None where there is nothing to open; F each.
        clock: of the memory; None if it has none.
    """

    batch: MemoryBatch
    origin: object
    queries: Queries
    current: MemoryBatch
    question: np.ndarray
    rows: np.ndarray
    edges: np.ndarray
    said: tuple[Statement | None, ...]
    statements: tuple[tuple[Statement, ...], ...]
    descriptions: tuple[str, ...]
    looks: Looks
    num_instances: np.ndarray
    sightings: tuple[SeenAt, ...]
    furniture_ids: tuple[int, ...]
    furniture_names: tuple[str, ...]
    open_costs: tuple[float | None, ...]
    clock: Clock | None = None

    @property
    def last_seen(self) -> SeenAt | None:
        """Where and when one of them was last seen; None if that never was."""
        return next(iter(self.sightings), None)

    @property
    def was_seen(self) -> np.ndarray:
        """Which of them were seen before the looks of this time step, bool (K,)."""
        return self.batch.objects["num_observed"][self.queries.object] > 0

    @property
    def carried(self) -> np.ndarray:
        """Probability that the robot carries each of them, (K,)."""
        is_carried = np.append(self.current.objects["carried_since"], NEVER)[self.rows] >= 0
        if not is_carried.any():
            return np.zeros(len(is_carried))
        sure = [0.0 if said is None else said.confidence for said in self.said]
        return np.where(is_carried, np.where(np.array(sure) > 0, sure, ROBOT_CONFIDENCE), 0.0)

    def choose_relation(self) -> np.ndarray:
        """Return how the objects lie at each place: 0 "in", 1 "onTop", (F,).

        As one of them last lay there; where none was ever seen, as the prior has it.
        """
        prior = self.queries.prior.sum(axis=0)  # (F, 2)
        relation = np.where(prior[:, 1] >= prior[:, 0], 1, 0)
        edges = self.current.edges
        own = self.edges[edges["num_true"][self.edges] > 0]
        own = own[np.argsort(edges["last_true"][own], kind="stable")]
        relation[edges["furniture"][own]] = edges["relation"][own]
        return relation


def compute_relation_shares(batch: MemoryBatch, queries: Queries) -> np.ndarray:
    """Return how likely things are "in" and "onTop" of furniture that they are at, (Q, F, 2).

    As they were seen there last; by the prior where they never were, and alike where that knows
    nothing.
    """
    prior = queries.prior.astype(float)
    total = prior.sum(axis=2, keepdims=True)
    share = np.where(total > 0, prior / np.where(total > 0, total, 1), 0.5)
    query, edge = batch.edges_of(queries)
    is_seen = batch.edges["num_true"][edge] > 0
    query, edge = query[is_seen], edge[is_seen]
    order = np.argsort(batch.edges["last_true"][edge], kind="stable")
    query, edge = query[order], edge[order]
    place, relation = batch.edges["furniture"][edge], batch.edges["relation"][edge]
    share[query, place, 0], share[query, place, 1] = 1 - relation, relation
    return share
