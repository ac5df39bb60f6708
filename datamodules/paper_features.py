"""The paper's features of nodes and edges (appendix B)."""

from __future__ import annotations

import numpy as np

from datamodules.feature import Feature

# Paper appendix B: average number of nodes (200) or edges (500) over ten times the steps (100).
NODE_SCALE = 200 / (100 * 10.0)
EDGE_SCALE = 500 / (100 * 10.0)

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
