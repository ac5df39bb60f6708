"""Snapshots on disk, read as batches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from datamodules.batch import Batch
from datamodules.graph import GraphBuilder
from datamodules.snapshot_tables import SnapshotTables
from sgm.arrays.grouped import compute_starts, number_keys
from sgm.schema import COUNTERS, FIXED
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
        room, counts = tables.find_rows("room", home)
        first_room, room_snapshot = compute_starts(counts), np.repeat(batch, counts)
        place, counts = tables.find_rows("furniture", home)
        first_furniture, furniture_snapshot = compute_starts(counts), np.repeat(batch, counts)
        of_furniture = tables.take("snapshot_furniture", tables.find_furniture_rows(home, number))
        furniture = {
            "snapshot": furniture_snapshot,
            **_take_columns(tables.take("furniture", place), FIXED["furniture"]),
            **make_counters("furniture", len(place)),
        }
        furniture["room"] = furniture["room"] + first_room[furniture_snapshot]
        sample, version = tables.take_versions("furniture", home, number)
        looked = first_furniture[sample] + version["of"]
        for name in COUNTERS["furniture"]:
            furniture[name][looked] = version[name]

        # Nodes: objects with a version, and the query object; one key per (snapshot, object).
        sample, version = tables.take_versions("object", home, number)
        width = int(np.diff(tables.starts["object"]).max())
        object_key = sample * width + version["of"]
        query_key = batch * width + asked["query"]
        node_keys, node_of_key = number_keys(len(indices) * width, object_key, query_key)
        object_snapshot, local = np.divmod(node_keys, width)
        thing = tables.starts["object"][home][object_snapshot] + local
        objects = {
            "snapshot": object_snapshot,
            **_take_columns(tables.take("object", thing), FIXED["objects"]),
            **make_counters("objects", len(thing)),
        }
        for name in COUNTERS["objects"]:
            objects[name][node_of_key[object_key]] = version[name]

        sample, version = tables.take_versions("edge", home, number)
        edge = tables.take("edge", tables.starts["edge"][home][sample] + version["of"])
        edges = {
            "snapshot": sample,
            **_take_columns(edge, FIXED["edges"]),
            **_take_columns(version, COUNTERS["edges"]),
            "object": node_of_key[sample * width + edge["object"]],
            "furniture": edge["furniture"] + first_furniture[sample],
        }
        tables.release(len(indices))
        return Snapshots(
            labels=self._labels,
            time=asked["time"],
            clock=None if np.isnan(clock).all() else clock,
            rooms={
                "snapshot": room_snapshot,
                **_take_columns(tables.take("room", room), FIXED["rooms"]),
            },
            furniture=furniture,
            objects=objects,
            edges=edges,
            query_object=node_of_key[query_key],
            query_prior=of_furniture["prior"],
            answers=of_furniture["answers"].astype(bool),
            extras=_get_extras(of_furniture, EXTRA),
            question_extras=_get_extras(asked, QUESTION_EXTRA),
        )


def _take_columns(records: np.ndarray, names: Iterable[str]) -> dict[str, np.ndarray]:
    """Return some columns of records, by name."""
    return {name: records[name] for name in names}


def _get_extras(rows: np.ndarray, prefix: str) -> dict[str, np.ndarray]:
    """Return the columns of records whose names begin with a prefix, without it."""
    names = rows.dtype.names or ()
    return {name.removeprefix(prefix): rows[name] for name in names if name.startswith(prefix)}
