"""Batches as graphs of PyTorch Geometric (extra `events`)."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

import torch

from datamodules.graph_columns import list_edge_data, list_ends, list_node_data
from sgm.messages import needed_to

if TYPE_CHECKING:
    from torch_geometric.data import HeteroData


def make_pyg(batch: Any) -> HeteroData:
    """Make PyTorch Geometric's `HeteroData`.

    Raises:
        ModuleNotFoundError: if torch_geometric is not installed.
    """
    data = import_pyg("batch.to_pyg()").HeteroData()
    for ntype, columns in list_node_data(batch).items():
        data[ntype].update(columns)
        data[ntype].update(num_nodes=len(columns["label"]), batch=columns["snapshot"])
    ends = list_ends(batch)
    for etype, columns in list_edge_data(batch).items():
        data[etype].update(columns)
        data[etype].edge_index = torch.stack(ends[etype])
    data.text, data.num_snapshots = batch.text, batch.num_snapshots
    if batch.question is not None:
        data.question = batch.question
    return data


def import_pyg(noun: str) -> Any:
    """Return `torch_geometric.data`.

    Args:
        noun: what needs it, for the message.

    Raises:
        ModuleNotFoundError: if it is not installed.
    """
    with needed_to(f"make {noun}", extra="events"):
        return import_module("torch_geometric.data")
