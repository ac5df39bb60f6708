"""The columns of a memory's tables, by what they are for; `MemoryBatch` says what each holds."""

from __future__ import annotations

import numpy as np

from sgm.arrays.table import Table

NEVER = -1  # time stamp of what has not happened

# Columns of MemoryBatch tables that change over time, by the table they belong to.
FURNITURE_COUNTERS = ("num_observed", "last_observed")
OBJECT_COUNTERS = ("num_observed", "last_observed", "num_moved", "last_moved")
EDGE_COUNTERS = (
    "num_observed", "num_true", "num_changed", "last_observed", "last_changed", "last_true",
    "is_true",
)  # fmt: skip
# Counted beside the paper's counters, and in no snapshot: `sgm.evidence` reads them.
OBJECT_HISTORY = ("first_observed", "num_at_once", "num_sought", "num_still")
EDGE_HISTORY = ("num_absent", "time_true")
EDGE_MEASURES = ("missed", "confidence")  # float32

_OBJECT_NODE = ("home", "key", "label", "type", "last_furniture")
_EDGE = ("home", "object", "furniture", "relation")


def make_object_table() -> Table:
    """Make an empty table of object nodes."""
    return Table(dict.fromkeys((*_OBJECT_NODE, *OBJECT_COUNTERS, *OBJECT_HISTORY), np.int32))


def make_edge_table() -> Table:
    """Make an empty table of object-furniture edges."""
    whole = dict.fromkeys((*_EDGE, *EDGE_COUNTERS, *EDGE_HISTORY), np.int32)
    measures = dict.fromkeys(("prior", *EDGE_MEASURES), np.float32)
    return Table({**whole, **measures, "is_true": np.bool_})
