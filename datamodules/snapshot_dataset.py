"""Snapshots on disk, read as batches."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from datamodules.batch import Batch
from datamodules.graph import GraphBuilder
from datamodules.snapshot_tables import SnapshotTables
from sgm.arrays.grouped import compute_starts, number_keys
from sgm.schema import EDGE_COUNTERS, FURNITURE_COUNTERS, OBJECT_COUNTERS
from simulator.snapshots.shards import (
    EXTRA,
    QUESTION_EXTRA,
    check_manifest,
    check_shard,
    load_manifest,
    load_shard,
)
from simulator.snapshots.snapshots import Snapshots, make_counters


class SnapshotDataset(Dataset[Batch]):
    """The snapshots of one or more collections; item lists become one `Batch` each.

    Shards are read and checked once, when the dataset is made, and copied into `SnapshotTables`:
    temporary files that are mapped into memory. Any snapshot is read from there, in any order, so
    that batches are shuffled over the whole collection, and memory does not grow with it.
    """

    def __init__(self, folder: Path, builder: GraphBuilder, *more: Path) -> None:
        """Read collections.

        Args:
            folder: written by `simulator.collect`.
            builder: turns snapshots into batches.
            more: further collections of homes with the same labels and the same extras.

        Raises:
            ValueError: if a collection is unfinished, its manifest or a shard is missing, cut
                short, altered or none that was collected (the file is named), or the labels differ.
            OSError: if the disk does not take a copy of the collections.
        """
        manifests = {path: load_manifest(path) for path in (folder, *more)}
        for path, manifest in manifests.items():
            check_manifest(manifest, path)
        self._builder = builder
        self._labels = tuple(manifests[folder]["settings"]["labels"])
        for path, manifest in manifests.items():
            num_homes = manifest["settings"]["num_homes"]
            if len(manifest["shards"]) != num_homes:
                raise ValueError(
                    f"collection must be finished, got {len(manifest['shards'])} of {num_homes} "
                    f"homes in {path}. Run the same `python -m simulator.collect` again."
                )
            if tuple(manifest["settings"]["labels"]) != self._labels:
                raise ValueError(
                    f"collections must have the same labels, got others in {path} than in "
                    f"{folder}. Collect both from homes of one source and prior."
                )

        def load_all() -> Iterator[dict[str, np.ndarray]]:
            for path, manifest in manifests.items():
                for name, checksum in manifest["shards"].items():
                    shard = load_shard(path / name, checksum)
                    check_shard(shard, len(self._labels), path / name)
                    yield shard

        self._tables = SnapshotTables(load_all(), folder)

    def __len__(self) -> int:
        return len(self._tables)

    def __getitem__(self, index: int) -> Batch:
        """Return a batch of one snapshot."""
        return self.__getitems__([index])

    def __getitems__(self, indices: Sequence[int] | np.ndarray) -> Batch:
        """Return several snapshots as one batch."""
        return self._builder.build(self.take(np.asarray(indices)))

    def take(self, indices: np.ndarray) -> Snapshots:
        """Read snapshots by number, (B,)."""
        tables, batch = self._tables, np.arange(len(indices))
        home = tables.find_home(indices)
        number = indices - tables.starts["snapshot"][home]  # within the home
        asked, clock = tables.take("snapshot", indices), tables.take("home", home)["home_clock"]
        rows, counts = tables.find_rows("room", home)
        first_room, room_label = compute_starts(counts), tables.take("room", rows)["label"]
        rows, counts = tables.find_rows("furniture", home)
        first_furniture, layout = compute_starts(counts), tables.take("furniture", rows)
        of_furniture = tables.take("snapshot_furniture", tables.find_furniture_rows(home, number))
        sample, version = tables.take_versions("furniture", home, number)
        looked = first_furniture[sample] + version["of"]
        furniture = make_counters(FURNITURE_COUNTERS, len(layout))
        for name, column in furniture.items():
            column[looked] = version[name]

        # Nodes: objects with a version, and the query object; one key per (snapshot, object).
        sample, version = tables.take_versions("object", home, number)
        width = int(np.diff(tables.starts["object"]).max())
        object_key = sample * width + version["of"]
        query_key = batch * width + asked["query"]
        node_keys, node_of_key = number_keys(len(indices) * width, object_key, query_key)
        snapshot, local = np.divmod(node_keys, width)
        objects, row = make_counters(OBJECT_COUNTERS, len(node_keys)), node_of_key[object_key]
        for name, column in objects.items():
            column[row] = version[name]
        object_row = tables.starts["object"][home][snapshot] + local

        sample, version = tables.take_versions("edge", home, number)
        edge = tables.take("edge", tables.starts["edge"][home][sample] + version["of"])
        tables.release(len(indices))
        return Snapshots(
            labels=self._labels,
            time=asked["time"],
            first_room=first_room,
            first_furniture=first_furniture,
            room_label=room_label,
            furniture_label=layout["label"],
            furniture_room=layout["room"] + np.repeat(first_room[:-1], counts),
            furniture_prob=layout["prob"],
            object_snapshot=snapshot,
            object_label=tables.take("object", object_row)["label"],
            edge_object=node_of_key[sample * width + edge["object"]],
            edge_furniture=edge["furniture"] + first_furniture[sample],
            edge_relation=edge["relation"],
            edge_prior=edge["prior"],
            query_object=node_of_key[query_key],
            query_prior=of_furniture["prior"],
            answers=of_furniture["answers"].astype(bool),
            extras=_get_extras(of_furniture, EXTRA),
            question_extras=_get_extras(asked, QUESTION_EXTRA),
            clock=None if np.isnan(clock).all() else clock,
            furniture_counters=furniture,
            object_counters=objects,
            edge_counters={name: version[name] for name in EDGE_COUNTERS},
        )


def _get_extras(rows: np.ndarray, prefix: str) -> dict[str, np.ndarray]:
    """Return the columns of records whose names begin with a prefix, without it."""
    names = rows.dtype.names or ()
    return {name.removeprefix(prefix): rows[name] for name in names if name.startswith(prefix)}
