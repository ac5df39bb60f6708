"""A question to a memory: a copy to ask policies of, and what the looks say about each object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from sgm.memory.clock import Clock
from sgm.memory.columns import NEVER
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.memory.sighting import SeenAt
from sgm.memory.statement import ROBOT_CONFIDENCE, Statement


class Scorer(Protocol):
    """What scores the places of what is asked for: any `sgm.policies.policy.Policy`."""

    def scores(self, memory: MemoryBatch, queries: Queries) -> np.ndarray:
        """Score every furniture node for every query, (Q, F); -inf without an opinion."""


@dataclass(frozen=True, slots=True)
class Looks:
    """What the looks at F furniture nodes say about one object.

    Attributes:
        negative: looks of this time step that did not show it, since it was seen there in this step
            or all, each weighed by how much of the furniture was in view, (F,).
        steps_ago: time steps since each of the latest looks of earlier steps that did not show it,
            since it was last seen there, infinite where there was none, (F, n).
        sought: how often it alone was looked for in an earlier step and not found, (F,).
        sought_ago: time steps since then, infinite where that never was, (F,).
        seen: confidence with which it was seen there in this step, 0 where it was not, (F,).
        is_remembered: whether it was ever seen there, so that the memory counts the looks that did
            not show it, which policies read, bool (F,).
    """

    negative: np.ndarray
    steps_ago: np.ndarray
    sought: np.ndarray
    sought_ago: np.ndarray
    seen: np.ndarray
    is_remembered: np.ndarray

    @classmethod
    def stack(cls, looks: Sequence[Looks]) -> Looks:
        """Return the looks of V objects as one; arrays have one more axis in front, (V, ...)."""
        names = cls.__slots__
        if len(looks) == 1:
            return cls(*(getattr(looks[0], name)[None] for name in names))
        return cls(*(np.stack([getattr(one, name) for one in looks]) for name in names))

    def for_another(self) -> Looks:
        """Return the same for another object of that description: its like was seen, not it."""
        return replace(
            self, negative=self.negative + (self.seen > 0), seen=np.zeros_like(self.seen)
        )


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
        said: the last statement about each, None where there was none, or a look has shown it
            since, K of them.
        statements: all that was said of each and is kept, the oldest first, K of them.
        descriptions: of all objects of `current`, (O,).
        looks: what the looks say about each, K of them.
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
    said: tuple[Statement | None, ...]
    statements: tuple[tuple[Statement, ...], ...]
    descriptions: tuple[str, ...]
    looks: tuple[Looks, ...]
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
        seen: np.ndarray = self.batch.objects["num_observed"][self.queries.object] > 0
        return seen

    @property
    def carried(self) -> np.ndarray:
        """Probability that the robot carries each of them, (K,)."""
        is_carried = np.append(self.current.objects["carried_since"] >= 0, False)[self.rows]
        sure = [0.0 if said is None else said.confidence for said in self.said]
        return np.where(is_carried, np.where(np.array(sure) > 0, sure, ROBOT_CONFIDENCE), 0.0)

    def mark_edges(self) -> np.ndarray:
        """Mark the edges of `current` that lead from what is asked for, bool (E,)."""
        is_asked = np.zeros(len(self.current.objects) + 1, dtype=bool)
        is_asked[self.rows] = True  # -1, what it does not know, is the last one
        return is_asked[self.current.edges["object"]]

    def choose_relation(self) -> np.ndarray:
        """Return how the objects lie at each place: 0 "in", 1 "onTop", (F,).

        As one of them last lay there; where none was ever seen, as the prior has it.
        """
        prior = self.queries.prior.sum(axis=0)  # (F, 2)
        relation = np.where(prior[:, 1] >= prior[:, 0], 1, 0)
        edges = self.current.edges
        own = np.flatnonzero(self.mark_edges() & (edges["num_true"] > 0))
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


def list_looks_before(batch: MemoryBatch, row: int, now: int, share: np.ndarray) -> np.ndarray:
    """Return the steps since the latest negative looks for an object, infinite for none, (F, n).

    Args:
        batch: memory of one home.
        row: of the object in its table, -1 for what was never seen.
        now: the present time step.
        share: how likely it is "in" and "onTop" of the furniture that it is at, (F, 2).
    """
    edges = batch.edges
    looked = batch.history.list_look_times(np.zeros(1, dtype=int), share[None])[0]  # (F, n)
    last_true = np.full(batch.num_furniture, NEVER)
    if row >= 0:
        own = np.flatnonzero(edges["object"] == row)
        np.maximum.at(last_true, edges["furniture"][own], edges["last_true"][own])
    return np.where(looked > last_true[:, None], now - looked, np.inf)
