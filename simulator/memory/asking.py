"""A question to a memory: a copy to ask policies of, and what the looks say about each object."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from simulator.memory.memory_batch import NEVER, MemoryBatch, Queries
from simulator.memory.sighting import SeenAt


@dataclass(frozen=True, slots=True)
class Looks:
    """What the looks at F furniture nodes say about one object.

    Attributes:
        in_vain: looks that did not show it since it was last seen there, each weighed by how much
            of the furniture was in view, (F,).
        steps_ago: time steps since the last of them, 0 where there was none, (F,).
        seen: confidence with which it was seen there in this very step, 0 where it was not, (F,).
    """

    in_vain: np.ndarray
    steps_ago: np.ndarray
    seen: np.ndarray

    def forget_sightings(self) -> Looks:
        """Return the same for another object of that description, which was not seen."""
        return replace(self, seen=np.zeros_like(self.seen))


@dataclass(frozen=True, slots=True)
class Asked:
    """K objects that are asked for, and all that a memory of F furniture nodes says of them.

    Both memories are copies of the asker's own: nothing that is done to them reaches the memory.

    Attributes:
        batch: the memory as it was before the looks of this time step, which policies are asked of.
        queries: the objects asked for in it, (K,).
        current: the memory as it is now.
        rows: the objects' rows in `current.objects`, -1 for what it does not know, (K,).
        descriptions: of all objects of `current`, (O,).
        looks: what the looks say about each, K of them.
        num_instances: most things of each description that were seen at once, 1 or more, (K,).
        sightings: every place where one of them was ever seen, the latest first.
        furniture_ids, furniture_names: F each.
    """

    batch: MemoryBatch
    queries: Queries
    current: MemoryBatch
    rows: np.ndarray
    descriptions: tuple[str, ...]
    looks: tuple[Looks, ...]
    num_instances: np.ndarray
    sightings: tuple[SeenAt, ...]
    furniture_ids: tuple[int, ...]
    furniture_names: tuple[str, ...]

    @property
    def last_seen(self) -> SeenAt | None:
        """Where and when one of them was last seen; None if that never was."""
        return next(iter(self.sightings), None)

    def choose_relation(self) -> np.ndarray:
        """Return how the objects lie at each place: 0 "in", 1 "onTop", (F,).

        As one of them last lay there; where none was ever seen, as the prior has it.
        """
        relation = (self.queries.prior[:, :, 1] >= self.queries.prior[:, :, 0]).all(axis=0)
        edges = self.current.edges
        own = np.flatnonzero(np.isin(edges["object"], self.rows) & (edges["num_true"] > 0))
        own = own[np.argsort(edges["last_true"][own], kind="stable")]
        relation[edges["furniture"][own]] = edges["relation"][own]
        return relation.astype(np.int64)


def list_looks(current: MemoryBatch, row: int, sought: np.ndarray, since: np.ndarray) -> Looks:
    """List what the looks at the furniture of a single home say about an object.

    Args:
        current: memory of one home.
        row: of the object in its table, -1 for what was never seen.
        sought: looks that were about this object alone and did not show it, weighed by what was in
            view, (F,).
        since: time of the last of them, `NEVER` without, (F,).
    """
    edges = current.edges
    looked = current.furniture_last_observed[0]
    last_true = np.full(current.num_furniture, NEVER)
    missed = np.zeros(current.num_furniture)
    confidence = np.zeros(current.num_furniture)
    own = np.flatnonzero(edges["object"] == row) if row >= 0 else np.zeros(0, dtype=np.int64)
    np.maximum.at(last_true, edges["furniture"][own], edges["last_true"][own])
    np.maximum.at(missed, edges["furniture"][own], edges["missed"][own])
    now = own[edges["last_true"][own] == current.time]
    np.maximum.at(confidence, edges["furniture"][now], edges["confidence"][now])
    # What was looked at and has no edge to the object was looked at in vain, once at least.
    in_vain = np.where((looked != NEVER) & (looked > last_true), np.maximum(missed, 1.0), 0.0)
    has_edge = np.zeros(current.num_furniture, dtype=bool)
    has_edge[edges["furniture"][own]] = True
    in_vain = np.where(has_edge & (looked != NEVER), missed, in_vain)
    is_sought = since > last_true
    in_vain = in_vain + np.where(is_sought, sought, 0.0)
    last = np.maximum(looked, np.where(is_sought, since, NEVER))
    steps_ago = np.where(in_vain > 0, current.time - last, 0)
    return Looks(in_vain, steps_ago, confidence)
