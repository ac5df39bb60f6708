"""The paper's features of nodes and edges (appendix B)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

# Paper appendix B: average number of nodes (200) or edges (500) over ten times the steps (100).
NODE_SCALE = 200 / (100 * 10.0)
EDGE_SCALE = 500 / (100 * 10.0)

Of = Literal[
    "node", "furniture", "object", "edge", "object edge", "query edge", "place", "question"
]
# The arrays of a batch that hold features, and what each of them holds features of.
TABLES: dict[str, tuple[Of, ...]] = {
    "node": ("node", "furniture", "object"),
    "edge": ("edge", "object edge", "query edge"),
    "place": ("place",),
    "question": ("question",),
}


@dataclass(frozen=True, slots=True)
class Feature:
    """One or more columns of a batch.

    Attributes:
        name: what it is.
        group: the switch of `FeatureConfig` that it belongs to.
        of: of what: "node", furniture and objects; "furniture"; "object"; "edge"; "object edge",
            between an object and furniture; "query edge"; "place", furniture nodes beside their own
            features, and "question", both for the embedding of evidence. It is 0 for other nodes or
            edges.
        compute: returns it for a `Selection` of them, (n,) or (n, width). Edges also have `cosine`,
            that of the text vectors of their two nodes.
        width: number of columns.
        layout: of an "edge" that joins no object; None for what is computed for these, too, of
            `cosine` and `prior` alone.
        recorded: the extra of a collection that it is computed from, if any.
        reads_others: whether it depends on what else is in a memory than the object asked for and
            its edges; if no feature does, a network without convolutions is given these alone.
    """

    name: str
    group: str
    of: Of
    compute: Callable[[Any], np.ndarray]
    width: int = 1
    layout: float | None = 0.0
    recorded: str | None = None
    reads_others: bool = False


PAPER_FEATURES = (
    Feature(
        "time since observed, scaled",
        "temporal",
        "node",
        lambda nodes: nodes.since("last_observed") * NODE_SCALE,
        reads_others=True,
    ),
    Feature(
        "times observed, scaled",
        "temporal",
        "node",
        lambda nodes: nodes["num_observed"] * NODE_SCALE,
        reads_others=True,
    ),
    Feature(
        "time since it was seen to have moved, scaled",
        "temporal",
        "object",
        lambda nodes: nodes.since("last_moved") * NODE_SCALE,
        reads_others=True,
    ),
    Feature(
        "share of observations, after the first, that found it moved",
        "temporal",
        "object",
        lambda nodes: nodes["num_moved"] / np.maximum(nodes["num_observed"] - 1, 1),
        reads_others=True,
    ),
    Feature(
        "cosine of the text vectors of its nodes",
        "semantic",
        "edge",
        lambda edges: edges["cosine"],
        layout=None,
    ),
    Feature(
        "time since observed, scaled",
        "temporal",
        "edge",
        lambda edges: edges.since("last_observed") * EDGE_SCALE,
    ),
    Feature(
        "time since its state was seen to change, scaled",
        "temporal",
        "edge",
        lambda edges: edges.since("last_changed") * EDGE_SCALE,
    ),
    Feature(
        "times observed, scaled",
        "temporal",
        "edge",
        lambda edges: edges["num_observed"] * EDGE_SCALE,
    ),
    Feature("times true, scaled", "temporal", "edge", lambda edges: edges["num_true"] * EDGE_SCALE),
    Feature(
        "share of observations in which it was true",
        "temporal",
        "edge",
        lambda edges: edges["num_true"] / np.maximum(edges["num_observed"], 1),
        layout=1.0,
    ),
    Feature(
        "times changed, scaled",
        "temporal",
        "edge",
        lambda edges: edges["num_changed"] * EDGE_SCALE,
    ),
    Feature(
        "whether it was true when last observed",
        "temporal",
        "edge",
        lambda edges: edges["is_true"],
        layout=1.0,
    ),
    Feature("prior", "prior", "edge", lambda edges: edges["prior"], layout=None),
)
