"""Snapshots on disk, read as batches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

from datamodules.batch import SGMBatch
from datamodules.graph import GraphBuilder
from simulator.grouped import concatenate_ranges, number_keys
from simulator.memory.memory_batch import NEVER
from simulator.memory.snapshots import (
    EDGE_COUNTERS,
    FURNITURE_COUNTERS,
    OBJECT_COUNTERS,
    Snapshots,
)
from simulator.shards import load_manifest, load_shard

_PER_HOUSE = ("room_label", "furniture_label", "furniture_room", "furniture_prob")
_NO_CLOCK = np.full(2, np.nan)


class SnapshotDataset(Dataset[SGMBatch]):
    """The snapshots of a collection; item lists become one `SGMBatch` each.

    The versions of all houses are kept in flat arrays; a snapshot is read by masking the
    versions of its house, so 10,000 snapshots take about 15 MB of memory.
    """

    def __init__(self, folder: Path, builder: GraphBuilder) -> None:
        """Read a collection.

        Args:
            folder: written by `simulator.collect`.
            builder: turns snapshots into batches.

        Raises:
            ValueError: if the collection is unfinished, or a shard is missing, truncated or
                altered; the file is named.
        """
        manifest = load_manifest(folder)
        num_houses = manifest["settings"]["houses"]
        if len(manifest["shards"]) != num_houses:
            raise ValueError(
                f"collection must be finished, got {len(manifest['shards'])} of {num_houses} "
                f"houses in {folder}. Run the same `python -m simulator.collect` again."
            )
        self._builder = builder
        self._labels = tuple(manifest["settings"]["labels"])
        shards = [load_shard(folder / name, sha) for name, sha in manifest["shards"].items()]
        self._flat = {
            name: np.concatenate([shard[name] for shard in shards])
            for name in shards[0]
            if name not in (*_PER_HOUSE, "home_clock")
        }
        self._houses = {name: np.stack([shard[name] for shard in shards]) for name in _PER_HOUSE}
        clock = np.stack([shard.get("home_clock", _NO_CLOCK) for shard in shards])
        self._clock = None if np.isnan(clock).all() else clock
        self._starts = {
            name: np.cumsum([0, *(len(shard[name]) for shard in shards)])
            for name in self._flat
            if name.endswith(("_version_of", "_time", "edge_object", "object_label"))
        }
        self._house = np.repeat(
            np.arange(len(shards)), [len(shard["snapshot_time"]) for shard in shards]
        )

    def __len__(self) -> int:
        return len(self._house)

    def __getitem__(self, index: int) -> SGMBatch:
        """Return a batch of one snapshot."""
        return self.__getitems__([index])

    def __getitems__(self, indices: Sequence[int]) -> SGMBatch:
        """Return several snapshots as one batch."""
        return self._builder.build(self.take(np.asarray(indices)))

    def take(self, indices: np.ndarray) -> Snapshots:
        """Read snapshots by number, (B,)."""
        flat, house = self._flat, self._house[indices]
        number = indices - self._starts["snapshot_time"][house]  # within the house
        batch = np.arange(len(indices))
        furniture_sample, furniture_row = self._select("furniture", house, number)
        shape = self._houses["furniture_label"][house].shape
        furniture = {
            "num_observed": np.zeros(shape, dtype=np.int32),
            "last_observed": np.full(shape, NEVER, dtype=np.int32),
        }
        place = (furniture_sample, flat["furniture_version_of"][furniture_row])
        for name in FURNITURE_COUNTERS:
            furniture[name][place] = flat[f"furniture_version_{name}"][furniture_row]

        # Nodes: objects with a version, and the query object; one key per (snapshot, object).
        object_sample, object_row = self._select("object", house, number)
        width = int(np.diff(self._starts["object_label"]).max())
        object_key = object_sample * width + flat["object_version_of"][object_row]
        query_key = batch * width + flat["snapshot_query"][indices]
        node_keys, node_of_key = number_keys(len(indices) * width, object_key, query_key)
        snapshot, local = np.divmod(node_keys, width)
        objects = {
            name: np.full(len(node_keys), NEVER if name.startswith("last") else 0, dtype=np.int32)
            for name in OBJECT_COUNTERS
        }
        for name in OBJECT_COUNTERS:
            objects[name][node_of_key[object_key]] = flat[f"object_version_{name}"][object_row]

        edge_sample, edge_row = self._select("edge", house, number)
        edge = self._starts["edge_object"][house[edge_sample]] + flat["edge_version_of"][edge_row]
        return Snapshots(
            labels=self._labels,
            time=flat["snapshot_time"][indices],
            **{name: self._houses[name][house] for name in _PER_HOUSE},
            object_snapshot=snapshot,
            object_label=flat["object_label"][
                self._starts["object_label"][house[snapshot]] + local
            ],
            edge_object=node_of_key[edge_sample * width + flat["edge_object"][edge]],
            edge_furniture=flat["edge_furniture"][edge],
            edge_relation=flat["edge_relation"][edge],
            edge_prior=flat["edge_prior"][edge],
            query_object=node_of_key[query_key],
            query_prior=flat["snapshot_prior"][indices],
            answers=flat["snapshot_answers"][indices].astype(bool),
            query_belief=flat["snapshot_belief"][indices] if "snapshot_belief" in flat else None,
            query_grades=flat["snapshot_grades"][indices] if "snapshot_grades" in flat else None,
            clock=None if self._clock is None else self._clock[house],
            **{f"furniture_{name}": furniture[name] for name in FURNITURE_COUNTERS},
            **{f"object_{name}": objects[name] for name in OBJECT_COUNTERS},
            **{f"edge_{name}": flat[f"edge_version_{name}"][edge_row] for name in EDGE_COUNTERS},
        )

    def _select(
        self, kind: str, house: np.ndarray, number: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Find the versions that are valid in each snapshot.

        Returns:
            (k,) position in the batch and (k,) row of the versions, in the order of nodes or
            edges within each snapshot.
        """
        starts = self._starts[f"{kind}_version_of"]
        count = starts[house + 1] - starts[house]
        rows = concatenate_ranges(starts[house], count)
        sample = np.repeat(np.arange(len(house)), count)
        number = np.repeat(number, count)
        valid = (self._flat[f"{kind}_version_valid_from"][rows] <= number) & (
            number < self._flat[f"{kind}_version_valid_to"][rows]
        )
        return sample[valid], rows[valid]
