"""Features of nodes, edges, places and questions: one entry each, which all that reads them reads.

Batches are filled by what is declared in `FEATURES`, networks take their widths from it, the data
module has recorded what an entry needs, and docs/data.md lists it.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from sgm.arrays.week import DAY_SECONDS, compute_week_seconds
from sgm.evidence.columns import (
    PLACE_COLUMNS,
    PLACE_GROUP_COLUMNS,
    QUESTION_COLUMNS,
    QUESTION_GROUP_COLUMNS,
)
from sgm.messages import shorten
from sgm.schema import NEVER

if TYPE_CHECKING:
    from simulator.snapshots.snapshots import Selection

# Paper appendix B: average number of nodes (200) or edges (500) over ten times the steps (100).
NODE_SCALE = 200 / (100 * 10.0)
EDGE_SCALE = 500 / (100 * 10.0)
TEXT_DIM = 96

# Raise it when the meaning or order of features changes: checkpoints state theirs.
FEATURE_SCHEMA_VERSION = 1

# Their columns are always there, and zero where the group is off.
PAPER_GROUPS = ("temporal", "semantic", "prior")

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


@dataclass(frozen=True)
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
        evidence_without: groups of it that are switched off, or single columns such as
            "filters.belief_slow" (`sgm.evidence.columns`).
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
        """Raise ValueError if there is no group of such a name."""
        object.__setattr__(self, "evidence_without", tuple(self.evidence_without))  # JSON: a list
        known = {**PLACE_GROUP_COLUMNS, **QUESTION_GROUP_COLUMNS}
        columns = {*PLACE_COLUMNS, *QUESTION_COLUMNS}
        groups = [name for name in self.evidence_without if name not in columns]
        _check_names("evidence_without must hold", groups, known)

    def shows(self, column: str) -> bool:
        """Tell whether a column of the evidence, "group.name", is on."""
        off = self.evidence_without
        return column not in off and column.partition(".")[0] not in off

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups of `FEATURES` that are on, in their order."""
        return tuple(name for name in _GROUPS if getattr(self, name))

    @property
    def extra_groups(self) -> tuple[str, ...]:
        """Those of them beyond the paper's, which have columns only where they are on."""
        return tuple(name for name in self.groups if name not in PAPER_GROUPS)


def list_columns(table: str, groups: Collection[str]) -> list[tuple[Feature, slice]]:
    """List the features of an array of a batch, the paper's first, with their columns.

    Args:
        table: one of `TABLES`.
        groups: those beyond the paper's that are on; others have no columns.
    """
    columns, first = [], 0
    for feature in sorted(FEATURES, key=lambda feature: feature.group not in PAPER_GROUPS):
        if feature.of in TABLES[table] and feature.group in {*PAPER_GROUPS, *groups}:
            columns.append((feature, slice(first, first + feature.width)))
            first += feature.width
    return columns


def check_groups(groups: Collection[str]) -> None:
    """Raise ValueError unless names are of groups beyond the paper's."""
    known = [name for name in _GROUPS if name not in PAPER_GROUPS]
    _check_names("groups of features must be", groups, known)


def _check_names(rule: str, names: Collection[str], known: Collection[str]) -> None:
    for name in names:
        if name not in known:
            raise ValueError(
                f"{rule} some of {', '.join(known)}, got {shorten(name)}. Choose among these."
            )


def count_columns(table: str, groups: Collection[str] = ()) -> int:
    """Count the columns that `list_columns` lists."""
    return sum(feature.width for feature, _ in list_columns(table, groups))


def list_recorded(config: FeatureConfig) -> list[str]:
    """List the extras that a collection must hold for the features that are on."""
    on = (feature.recorded for feature in FEATURES if feature.group in config.groups)
    return list(dict.fromkeys(name for name in on if name is not None))


def compute_belief_features(belief: np.ndarray) -> np.ndarray:
    """Return the five belief features of query edges, float32 (n, 5).

    Probability that the last seen instance is there, expected number of others (at most 1), the
    logarithm of their sum, scaled to [0, 1] from 1e-4 to 1, and how likely class noise and
    instance noise have left the place possible; of the extra "belief" of `Snapshots`, (n, 4).
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


def _compute_clock(edges: Selection) -> np.ndarray:
    clock = edges.snapshots.clock
    if clock is None or np.isnan(clock).any():
        raise ValueError(
            "homes must have a clock for features.clock, got one without. Say in layout.json when "
            "a recorded home starts, or make the memory with SceneGraphMemory(clock=Clock(...)); "
            "simulated homes have none."
        )
    last_true = edges["last_true"]
    return compute_clock_features(clock[edges["snapshot"]], edges["time"], last_true)


def _compute_circles(week_seconds: np.ndarray) -> np.ndarray:
    """Return sine and cosine of hour of day and of day of week, (n,) -> (n, 4)."""
    day, second = np.divmod(week_seconds, DAY_SECONDS)
    hour_angle = second * (2 * np.pi / DAY_SECONDS)
    day_angle = day * (2 * np.pi / 7)
    columns = [np.sin(hour_angle), np.cos(hour_angle), np.sin(day_angle), np.cos(day_angle)]
    return np.stack(columns, axis=1)


FEATURES = (
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
    Feature(
        "belief of `HomeFilter` (`compute_belief_features`)",
        "belief",
        "query edge",
        lambda edges: compute_belief_features(edges.extra("belief")),
        width=5,
        recorded="belief",
    ),
    Feature(
        "hour and day, now and when last seen there (`compute_clock_features`)",
        "clock",
        "object edge",
        _compute_clock,
        width=8,
    ),
    Feature(
        "what the memory says about it (`sgm.evidence`)",
        "evidence",
        "place",
        lambda places: places.extra("evidence"),
        width=len(PLACE_COLUMNS),
        recorded="evidence",
    ),
    Feature(
        "what the memory says about it (`sgm.evidence`)",
        "evidence",
        "question",
        lambda questions: questions.extra("evidence"),
        width=len(QUESTION_COLUMNS),
        recorded="evidence",
    ),
)
_GROUPS = tuple(dict.fromkeys(feature.group for feature in FEATURES))
NODE_FEATURE_DIM, EDGE_FEATURE_DIM = count_columns("node"), count_columns("edge")
EVIDENCE_DIM, QUESTION_DIM = len(PLACE_COLUMNS), len(QUESTION_COLUMNS)
