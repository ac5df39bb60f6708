"""Snapshots compared column by column."""

from collections.abc import Mapping
from dataclasses import fields

import numpy as np

from simulator.snapshots.snapshots import Snapshots


def list_columns(snapshots: Snapshots) -> dict[str, object]:
    """All columns by name, those of tables and extras as "edges.num_true"."""
    columns: dict[str, object] = {}
    for field in fields(snapshots):
        value = getattr(snapshots, field.name)
        if isinstance(value, Mapping):
            columns |= {f"{field.name}.{name}": column for name, column in value.items()}
        else:
            columns[field.name] = value
    return columns


def assert_equal_snapshots(found: Snapshots, expected: Snapshots) -> None:
    """The order of edges within a snapshot is free: they are compared as sorted tables."""
    columns, wanted = list_columns(found), list_columns(expected)
    assert columns.keys() == wanted.keys()
    for name, column in columns.items():
        other = wanted[name]
        if name.startswith("edges."):
            column, other = column[_sort_edges(found)], other[_sort_edges(expected)]
        np.testing.assert_array_equal(column, other, err_msg=name)


def _sort_edges(snapshots: Snapshots) -> np.ndarray:
    edges = snapshots.edges
    return np.lexsort((edges["relation"], edges["furniture"], edges["object"]))
