"""Event tables as the objects of PyTorch Geometric and of TGM (extras `events` and `tgm`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import torch

from datamodules.pyg_graph import import_pyg
from sgm.messages import needed_to
from sgm.schema import NUM_RELATIONS, RELATIONS
from simulator.events.files import make_edge_types
from simulator.events.table import EventTable

if TYPE_CHECKING:
    from torch_geometric.data import TemporalData

_OTHERS = RELATIONS[1:]  # than the first, each with a column
MESSAGE_COLUMNS = ("is_seen", *(f"is_{name}" for name in _OTHERS), "coverage", "confidence")


def to_temporal_data(table: EventTable, sightings_alone: bool = False) -> TemporalData:
    """Return events as PyG's `TemporalData`, in the order of the table.

    `src` is the thing, `dst` the place, `t` the time step and `msg` has `MESSAGE_COLUMNS`,
    float32 (E, R + 2). `home`, `look`, `order` and `y` (1 where the thing was seen) are further
    attributes, which a slice or a mask cuts alike. Ids of nodes are those of the table, so that
    homes share none: one graph with a part for each home. With `sightings_alone`, that things were
    not seen is left out.

    Raises:
        ModuleNotFoundError: if torch_geometric is not installed.
    """
    TemporalData = import_pyg("events as TemporalData").TemporalData
    events = table.events
    chosen = np.flatnonzero(events.is_seen) if sightings_alone else np.arange(len(events.home))

    def take(values: np.ndarray) -> torch.Tensor:
        return torch.from_numpy(np.ascontiguousarray(values[chosen]).astype(np.int64))

    return TemporalData(
        src=take(events.thing),
        dst=take(events.place),
        t=take(events.time),
        msg=torch.from_numpy(_make_messages(table)[chosen]),
        y=take(events.is_seen),
        home=take(events.home),
        look=take(events.look),
        order=take(events.order),
    )


def to_tgm(table: EventTable) -> Any:
    """Return events as TGM's `DGData`, extra `tgm`; times are ordered, without a unit.

    Edges have `MESSAGE_COLUMNS` as features, and a type for relation and sign
    (`simulator.events.files.save_tgb`); nodes have 0 for a place and 1 for a thing.

    Raises:
        ModuleNotFoundError: if tgm is not installed.
    """
    with needed_to("make a graph of TGM", extra="tgm"):
        from tgm.data import DGData

    events = table.events
    return DGData.from_raw(
        edge_time=torch.from_numpy(events.time.astype(np.int64)),
        edge_index=torch.from_numpy(np.column_stack([events.thing, events.place]).astype(np.int32)),
        edge_x=torch.from_numpy(_make_messages(table)),
        edge_type=torch.from_numpy(make_edge_types(events)).to(torch.int32),
        node_type=torch.from_numpy(table.nodes.kind.astype(np.int32)),
    )


def _make_messages(table: EventTable) -> np.ndarray:
    events = table.events
    is_other = events.relation[:, None] == np.arange(1, NUM_RELATIONS)  # (E, R - 1)
    columns = [events.is_seen, is_other, events.coverage, events.confidence]
    return np.column_stack(columns).astype(np.float32)  # (E, R + 2)
