"""Features of nodes, edges, places and questions: one entry each, which all that reads them reads.

Batches are filled by what is declared in `FEATURES`, networks take their widths from it, the data
module has recorded what an entry needs, and docs/data.md lists it.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Literal

from datamodules.more_features import MORE_FEATURES
from datamodules.paper_features import PAPER_FEATURES, TABLES, Feature
from sgm.evidence.columns import (
    PLACE_COLUMNS,
    PLACE_GROUP_COLUMNS,
    QUESTION_COLUMNS,
    QUESTION_GROUP_COLUMNS,
)
from sgm.messages import shorten

TEXT_DIM = 96

# Raise it when the meaning or order of features changes: checkpoints state theirs.
FEATURE_SCHEMA_VERSION = 1

# Their columns are always there, and zero where the group is off.
PAPER_GROUPS = ("temporal", "semantic", "prior")

FEATURES = (
    *PAPER_FEATURES,
    *MORE_FEATURES,
)
_GROUPS = tuple(dict.fromkeys(feature.group for feature in FEATURES))


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


NODE_FEATURE_DIM, EDGE_FEATURE_DIM = count_columns("node"), count_columns("edge")
EVIDENCE_DIM, QUESTION_DIM = len(PLACE_COLUMNS), len(QUESTION_COLUMNS)
