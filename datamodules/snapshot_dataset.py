"""Snapshots on disk, read as batches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from datamodules.batch import SGMBatch
from datamodules.graph import GraphBuilder
from datamodules.snapshot_tables import SnapshotTables
from simulator.arrays.grouped import number_keys
from simulator.memory.memory_batch import EDGE_COUNTERS, FURNITURE_COUNTERS, NEVER, OBJECT_COUNTERS
from simulator.snapshots.shards import load_manifest, load_shard
from simulator.snapshots.snapshots import (
    Snapshots,
)

_PER_HOUSE = ("room_label", "furniture_label", "furniture_room", "furniture_prob")
_NO_CLOCK = np.full(2, np.nan)


class SnapshotDataset(Dataset[SGMBatch]):
    """The snapshots of a collection; item lists become one `SGMBatch` each.

    Shards are read and checked once, when the dataset is made, and copied into `SnapshotTables`:
    temporary files that are mapped into memory. Any snapshot is read from there, in any order, so
    that batches are shuffled over the whole collection, and memory does not grow with it.
    """

    def __init__(self, folder: Path, builder: GraphBuilder) -> None:
        """Read a collection.

        Args:
            folder: written by `simulator.collect`.
            builder: turns snapshots into batches.

        Raises:
            ValueError: if the collection is unfinished, or a shard is missing, truncated or
                altered; the file is named.
            OSError: if the disk does not take a copy of the collection.
        """
        manifest = load_manifest(folder)
        num_homes = manifest["settings"]["num_homes"]
        if len(manifest["shards"]) != num_homes:
            raise ValueError(
                f"collection must be finished, got {len(manifest['shards'])} of {num_homes} "
                f"homes in {folder}. Run the same `python -m simulator.collect` again."
            )
        self._builder = builder
        self._labels = tuple(manifest["settings"]["labels"])
        shards = (
            {"home_clock": _NO_CLOCK, **load_shard(folder / name, sha)}
            for name, sha in manifest["shards"].items()
        )
        self._tables = SnapshotTables(shards, folder)

    def __len__(self) -> int:
        return len(self._tables)

    def __getitem__(self, index: int) -> SGMBatch:
        """Return a batch of one snapshot."""
        return self.__getitems__([index])

    def __getitems__(self, indices: Sequence[int]) -> SGMBatch:
        """Return several snapshots as one batch."""
        return self._builder.build(self.take(np.asarray(indices)))

    def take(self, indices: np.ndarray) -> Snapshots:
        """Read snapshots by number, (B,)."""
        tables, batch = self._tables, np.arange(len(indices))
        home = tables.find_home(indices)
        number = indices - tables.starts["snapshot"][home]  # within the home
        layout, asked = tables.take("home", home), tables.take("snapshot", indices)
        sample, version = tables.take_versions("furniture", home, number)
        shape = layout["furniture_label"].shape
        furniture = {
            "num_observed": np.zeros(shape, dtype=np.int32),
            "last_observed": np.full(shape, NEVER, dtype=np.int32),
        }
        for name in FURNITURE_COUNTERS:
            furniture[name][sample, version["of"]] = version[name]

        # Nodes: objects with a version, and the query object; one key per (snapshot, object).
        sample, version = tables.take_versions("object", home, number)
        width = int(np.diff(tables.starts["object"]).max())
        object_key = sample * width + version["of"]
        query_key = batch * width + asked["query"]
        node_keys, node_of_key = number_keys(len(indices) * width, object_key, query_key)
        snapshot, local = np.divmod(node_keys, width)
        objects = {
            name: np.full(len(node_keys), NEVER if name.startswith("last") else 0, dtype=np.int32)
            for name in OBJECT_COUNTERS
        }
        row = node_of_key[object_key]
        for name in OBJECT_COUNTERS:
            objects[name][row] = version[name]
        object_row = tables.starts["object"][home][snapshot] + local

        sample, version = tables.take_versions("edge", home, number)
        edge = tables.take("edge", tables.starts["edge"][home][sample] + version["of"])
        tables.release(len(indices))
        extras = asked.dtype.names or ()
        return Snapshots(
            labels=self._labels,
            time=asked["time"],
            **{name: layout[name] for name in _PER_HOUSE},
            object_snapshot=snapshot,
            object_label=tables.take("object", object_row)["label"],
            edge_object=node_of_key[sample * width + edge["object"]],
            edge_furniture=edge["furniture"],
            edge_relation=edge["relation"],
            edge_prior=edge["prior"],
            query_object=node_of_key[query_key],
            query_prior=asked["prior"],
            answers=asked["answers"].astype(bool),
            query_belief=asked["belief"] if "belief" in extras else None,
            query_grades=asked["grades"] if "grades" in extras else None,
            clock=None if np.isnan(layout["home_clock"]).all() else layout["home_clock"],
            **{f"furniture_{name}": furniture[name] for name in FURNITURE_COUNTERS},
            **{f"object_{name}": objects[name] for name in OBJECT_COUNTERS},
            **{f"edge_{name}": version[name] for name in EDGE_COUNTERS},
        )
