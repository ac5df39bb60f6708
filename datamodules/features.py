"""Node and edge features of appendix B, from the raw counters of snapshots."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from sgm.evidence.columns import (
    PLACE_COLUMNS,
    PLACE_GROUP_COLUMNS,
    QUESTION_COLUMNS,
    QUESTION_GROUP_COLUMNS,
)
from sgm.memory.clock import DAY_SECONDS, compute_week_seconds
from sgm.memory.columns import NEVER
from sgm.messages import shorten
from simulator.snapshots.snapshots import Snapshots

# Paper appendix B: average number of nodes (200) or edges (500) over ten times the steps (100).
NODE_SCALE = 200 / (100 * 10.0)
EDGE_SCALE = 500 / (100 * 10.0)

# Columns of `compute_belief_features` and of `compute_clock_features`.
BELIEF_DIM = 5
CLOCK_DIM = 8
EVIDENCE_DIM, QUESTION_DIM = len(PLACE_COLUMNS), len(QUESTION_COLUMNS)

# Raise it when the meaning or order of features changes: checkpoints state theirs.
FEATURE_SCHEMA_VERSION = 1


@dataclass(frozen=True, slots=True)
class FeatureConfig:
    """Which groups of features the model sees; a group that is off is all zeros.

    Attributes:
        memory: whether the model sees what was observed at all. Without it, a snapshot is the
            layout, the query object and its hypothetical edges, as in a static scene.
        absence: whether the model sees that things were looked for and not seen. Without it, edges
            count sightings alone (`simulator.snapshots.snapshots.forget_absence`).
        temporal: counters and time stamps of nodes and edges.
        semantic: text vectors of nodes and the cosine of an edge's two nodes.
        prior: prior probability of edges.
        candidates: where hypothetical edges lead: "prior" (places the prior deems possible) or
            "random" (docs/design.md, ruling 13, the ablation without a prior). With "all", every
            furniture node has one query edge, whatever the prior and the memory say.
        threshold: prior weight above which a place gets a hypothetical edge.
        random_candidates: hypothetical edges per query with `candidates: random`.
        belief: what `HomeFilter` believes about the query object at the place of each query edge,
            five more columns: the filter knows the rules of the homes. Not in the paper.
        clock: hour of day and day of week, as sine and cosine, of the present and of the last
            sighting of every edge between an object and furniture, eight more columns
            (`compute_clock_features`). Needs homes of which it is known what time it is, recorded
            ones (docs/traces.md) or a memory with a clock. Not in the paper.
        evidence: what the memory says about every furniture node and about the question as a whole
            (`sgm.evidence`): scale-free, without knowledge of the rules. Not in the paper.
        evidence_without: groups of it that are switched off (`sgm.evidence.columns`).
        text_pipeline: None for the shipped one, or "en_core_web_sm" (docs/design.md, ruling 21).

    Source: paper appendix B, Table 2; docs/design.md, rulings 12-14.
    """

    memory: bool = True
    absence: bool = True
    temporal: bool = True
    semantic: bool = True
    prior: bool = True
    candidates: Literal["prior", "random", "all"] = "prior"
    threshold: float = 0.0
    random_candidates: int = 16
    belief: bool = False
    clock: bool = False
    evidence: bool = False
    evidence_without: tuple[str, ...] = ()
    text_pipeline: str | None = None

    def __post_init__(self) -> None:
        """Check the groups.

        Raises:
            ValueError: if there is no group of such a name.
        """
        known = {**PLACE_GROUP_COLUMNS, **QUESTION_GROUP_COLUMNS}
        object.__setattr__(self, "evidence_without", tuple(self.evidence_without))  # JSON: a list
        for name in self.evidence_without:
            if name not in known:
                raise ValueError(
                    f"evidence_without must hold some of {', '.join(known)}, got {shorten(name)}. "
                    "Choose among these."
                )


def compute_furniture_temporal(snapshots: Snapshots, furniture: np.ndarray) -> np.ndarray:
    """Return (time since observed, times observed, 0, 0) of some furniture, float32 (n, 4).

    Furniture does not move: the two features about moving are zero.
    """
    time = snapshots.time[snapshots.furniture_snapshot[furniture]]
    since = _compute_since(time, snapshots.furniture_last_observed[furniture])
    features = np.zeros((len(since), 4), dtype=np.float32)
    features[:, 0] = since * NODE_SCALE
    features[:, 1] = snapshots.furniture_num_observed[furniture] * NODE_SCALE
    return features


def compute_object_temporal(snapshots: Snapshots, objects: np.ndarray) -> np.ndarray:
    """Return the temporal features of some object nodes, float32 (n, 4).

    Time since observed, times observed, time since it was seen to have moved, and the share of
    its observations (after the first) that found it moved; times are scaled.
    """
    time = snapshots.time[snapshots.object_snapshot[objects]]
    num_observed = snapshots.object_num_observed[objects]
    num_moved = snapshots.object_num_moved[objects]
    features = np.empty((len(objects), 4), dtype=np.float32)
    features[:, 0] = _compute_since(time, snapshots.object_last_observed[objects]) * NODE_SCALE
    features[:, 1] = num_observed * NODE_SCALE
    features[:, 2] = _compute_since(time, snapshots.object_last_moved[objects]) * NODE_SCALE
    features[:, 3] = num_moved / np.maximum(num_observed - 1, 1)
    return features


def compute_edge_features(
    snapshots: Snapshots, edges: np.ndarray, cosine: np.ndarray
) -> np.ndarray:
    """Return the features of some remembered edges, float32 (n, 9).

    Cosine, time since observed, time since the state was seen to change, times observed, times
    true, share true, times changed, last state, prior; times and counts are scaled.

    Args:
        snapshots: the snapshots.
        edges: edge numbers, (n,).
        cosine: of the text vectors of each edge's two nodes, (n,).
    """
    time = snapshots.time[snapshots.object_snapshot[snapshots.edge_object[edges]]]
    num_observed = snapshots.edge_num_observed[edges]
    num_true = snapshots.edge_num_true[edges]
    features = np.empty((len(edges), 9), dtype=np.float32)
    features[:, 0] = cosine
    features[:, 1] = _compute_since(time, snapshots.edge_last_observed[edges]) * EDGE_SCALE
    features[:, 2] = _compute_since(time, snapshots.edge_last_changed[edges]) * EDGE_SCALE
    features[:, 3] = num_observed * EDGE_SCALE
    features[:, 4] = num_true * EDGE_SCALE
    features[:, 5] = num_true / num_observed
    features[:, 6] = snapshots.edge_num_changed[edges] * EDGE_SCALE
    features[:, 7] = snapshots.edge_is_true[edges]
    features[:, 8] = snapshots.edge_prior[edges]
    return features


def compute_hypothetical_features(
    time: np.ndarray, prior: np.ndarray, cosine: np.ndarray
) -> np.ndarray:
    """Return the features of edges that were never observed, float32 (n, 9)."""
    features = np.zeros((len(time), 9), dtype=np.float32)
    features[:, 0] = cosine
    features[:, 1] = time * EDGE_SCALE
    features[:, 2] = time * EDGE_SCALE
    features[:, 8] = prior
    return features


def compute_layout_features(prob: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """Return the features of edges between house, floor, rooms and furniture, float32 (n, 9).

    The layout is known and never changes: always true, with no history.
    """
    features = np.zeros((len(prob), 9), dtype=np.float32)
    features[:, 0] = cosine
    features[:, 5] = 1
    features[:, 7] = 1
    features[:, 8] = prob
    return features


def compute_belief_features(belief: np.ndarray) -> np.ndarray:
    """Return the five belief features of query edges, float32 (n, 5).

    Probability that the last seen instance is there, expected number of others (at most 1), the
    logarithm of their sum, scaled to [0, 1] from 1e-4 to 1, and how likely class noise and
    instance noise have left the place possible.

    Args:
        belief: the extra "belief" of `Snapshots` at the place of each edge, (n, 4).
    """
    last, others = belief[:, 0], belief[:, 1]
    total = np.clip(last + others, 1e-4, 1)
    columns = [last, np.minimum(others, 1), 1 + np.log10(total) / 4, *belief[:, 2:].T]
    return np.stack(columns, axis=1).astype(np.float32)


def compute_clock_features(
    clock: np.ndarray, time: np.ndarray, last_true: np.ndarray
) -> np.ndarray:
    """Return the eight clock features of edges between objects and furniture, float32 (n, 8).

    Sine and cosine of the hour of the day, then of the day of the week, now; the same four of when
    the object was last seen there. Of an edge that was never seen true these four are zero, which
    no time is.

    The hour runs around the circle once a day from midnight: 06:00 is (1, 0). The day stays where
    it is from midnight to midnight: Monday is (0, 1).

    Args:
        clock: `Snapshots.clock` of the home of each edge, (n, 2).
        time: the present time step, (n,).
        last_true: time step of the last sighting, (n,).
    """
    was_seen = last_true != NEVER
    now = _compute_circles(compute_week_seconds(clock, time))
    seen = _compute_circles(compute_week_seconds(clock, last_true)) * was_seen[:, None]
    return np.concatenate([now, seen], axis=1).astype(np.float32)


def take_evidence(snapshots: Snapshots, config: FeatureConfig) -> tuple[np.ndarray, np.ndarray]:
    """Return what the memory says about places (NF, EVIDENCE_DIM) and questions (B, QUESTION_DIM).

    Columns of groups that are switched off are zero.

    Raises:
        ValueError: if the snapshots hold no evidence.
    """
    if "evidence" not in snapshots.extras:
        raise ValueError(
            "snapshots must hold evidence for `features.evidence`, got none. Collect with "
            "`--evidence true`, or switch the feature off."
        )
    place, question = snapshots.extras["evidence"], snapshots.question_extras["evidence"]
    if config.evidence_without:
        place, question = (
            values * [name.partition(".")[0] not in config.evidence_without for name in columns]
            for values, columns in ((place, PLACE_COLUMNS), (question, QUESTION_COLUMNS))
        )
    return place.astype(np.float32), question.astype(np.float32)


def require_clock(clock: np.ndarray | None) -> np.ndarray:
    """Return the clocks of homes, which all must have one.

    Args:
        clock: `MemoryBatch.clock` or `Snapshots.clock`, (n, 2) or None.

    Raises:
        ValueError: if there is none, or some home has none.
    """
    if clock is None or np.isnan(clock).any():
        raise ValueError(
            "homes must have a clock for features.clock, got one without. Say in layout.json when "
            "a recorded home starts, or make the memory with SceneGraphMemory(clock=Clock(...)); "
            "simulated homes have none."
        )
    return clock


def drop_features(edge: np.ndarray, config: FeatureConfig) -> None:
    """Zero the groups of features of edges, (E, 9), that are switched off, in place."""
    if not config.temporal:
        edge[:, 1:8] = 0
    if not config.semantic:
        edge[:, 0] = 0
    if not config.prior:
        edge[:, 8] = 0


def _compute_circles(week_seconds: np.ndarray) -> np.ndarray:
    """Return sine and cosine of hour of day and of day of week, (n,) -> (n, 4)."""
    day, second = np.divmod(week_seconds, DAY_SECONDS)
    hour_angle = second * (2 * np.pi / DAY_SECONDS)
    day_angle = day * (2 * np.pi / 7)
    columns = [np.sin(hour_angle), np.cos(hour_angle), np.sin(day_angle), np.cos(day_angle)]
    return np.stack(columns, axis=1)


def _compute_since(time: np.ndarray, stamp: np.ndarray) -> np.ndarray:
    """Return the time since a stamp; since the start for what has never happened."""
    return np.where(stamp == NEVER, time, time - stamp)
