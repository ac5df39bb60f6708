"""Why an object may be at a place: what the memory holds for and against it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from simulator.memory.memory_batch import Queries
from simulator.memory.scene_graph_memory import SceneGraphMemory
from simulator.memory.sighting import SeenAt

SIMILAR = 0.7  # cosine of the labels' text vectors: mug and cup .96, document and book .74
_NAMED = 2  # similar objects that are called by name


@dataclass(frozen=True, slots=True)
class Evidence:
    """What a memory holds about an object at one furniture node.

    Counts of the memory, not an account of what moved the network.

    Attributes:
        seen: its last sighting there; None if it was never seen there.
        times_absent: looks at this furniture that did not find it, since it was first seen or
            looked for there.
        similar: descriptions of other objects with a similar label that were seen there, the
            latest first.
        prior: share of this place in where such objects tend to be, 0 to 1.
    """

    seen: SeenAt | None
    times_absent: int
    similar: tuple[str, ...]
    prior: float

    def __str__(self) -> str:
        """Say it in one line."""
        parts = []
        if self.seen is not None:
            ago = self.seen.steps_ago
            when = f"{_count(ago, 'step')} ago" if ago else "in this step"
            parts.append(f"seen here {when}" + ("" if self.seen.is_there else ", then gone"))
        elif self.times_absent:
            parts.append(f"not seen here in {_count(self.times_absent, 'look')}")
        if self.similar:
            names = ", ".join(self.similar[:_NAMED])
            more = len(self.similar) - _NAMED
            parts.append(f"similar objects: {names}" + (f" and {more} more" if more > 0 else ""))
        if self.prior > 0:
            parts.append(f"prior {self.prior:.0%}")
        return "; ".join(parts) or "no evidence"


def _count(number: int, what: str) -> str:
    return f"{number} {what}" if number == 1 else f"{number} {what}s"


def gather_evidence(
    memory: SceneGraphMemory,
    description: str,
    query: Queries,
    cosines: np.ndarray,
    furniture: np.ndarray,
) -> list[Evidence]:
    """Gather what a memory holds about an object at some furniture nodes.

    Args:
        memory: the memory.
        description: what was asked for.
        query: what `memory.query(description)` gave.
        cosines: of the text vectors of every pair of labels, (L, L).
        furniture: positions in `memory.furniture_ids`, (n,).

    Returns:
        One entry per furniture node, n of them.
    """
    edges, objects = memory.batch.edges, memory.batch.objects
    row, ids = int(query.object[0]), memory.furniture_ids
    seen_at: dict[int | None, SeenAt] = {}
    for sighting in memory.places_of(description):  # the latest first
        seen_at.setdefault(sighting.furniture, sighting)
    is_own = edges["object"] == row
    is_similar = cosines[objects["label"], objects["label"][row]] >= SIMILAR
    is_alike = ~is_own & is_similar[edges["object"]] & (edges["num_true"] > 0)
    evidence = []
    for place in furniture.tolist():
        is_here = edges["furniture"] == place
        own, alike = np.flatnonzero(is_own & is_here), np.flatnonzero(is_alike & is_here)
        alike = alike[np.argsort(-edges["last_true"][alike], kind="stable")]
        num_absent = edges["num_observed"][own].max(initial=0) - edges["num_true"][own].sum()
        # One entry per object, though it may have been seen both in and on top.
        names = dict.fromkeys(memory.descriptions[other] for other in edges["object"][alike])
        evidence.append(
            Evidence(
                seen=seen_at.get(ids[place]),
                times_absent=max(int(num_absent), 0),
                similar=tuple(names),
                prior=float(query.prior[0, place].sum()),
            )
        )
    return evidence
