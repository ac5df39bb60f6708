"""Snapshots on disk, read as batches: which of them, in which order."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np
import torch
from torch.utils.data import DataLoader, Dataset, Subset

from datamodules.batch import Batch
from datamodules.batch_builder import BatchBuilder
from simulator.snapshots.stored import StoredSnapshots


class SnapshotDataset(Dataset[Batch]):
    """The snapshots of one or more collections; item lists become one `Batch` each.

    Attributes:
        snapshots: what the batches are built of.
    """

    def __init__(self, folder: Path, builder: BatchBuilder, *more: Path) -> None:
        """Read collections, which `builder` turns into batches; see `StoredSnapshots.open`."""
        self.snapshots = StoredSnapshots.open(folder, *more)
        self._builder = builder

    def __len__(self) -> int:
        return len(self.snapshots)

    def __getitem__(self, index: int) -> Batch:
        """Return a batch of one snapshot."""
        return self.__getitems__([index])

    def __getitems__(self, indices: Sequence[int] | np.ndarray) -> Batch:
        """Return several snapshots as one batch, with the graph that a convolution reads."""
        batch = self._builder.build(self.snapshots.take(np.asarray(indices)))
        if self._builder.num_hops != 0:
            _ = batch.homogeneous
        return batch


def draw_share(dataset: SnapshotDataset, limit: int | None, seed: int) -> Dataset[Batch]:
    """Draw `limit` of the snapshots where there are more; None for all."""
    if limit is None or limit >= len(dataset):
        return dataset
    chosen = torch.randperm(len(dataset), generator=torch.Generator().manual_seed(seed))[:limit]
    return Subset(dataset, chosen.sort().values.tolist())


def make_loader(
    dataset: Dataset[Batch], batch_size: int, shuffle: torch.Generator | None
) -> DataLoader[Batch]:
    """Load batches, in the order that a generator draws; None for that of the snapshots."""
    return DataLoader(
        dataset,
        batch_size=batch_size,
        shuffle=shuffle is not None,
        generator=shuffle,
        collate_fn=_keep,  # `SnapshotDataset.__getitems__` gives a whole batch
    )


def _keep(batch: object) -> Batch:
    return cast("Batch", batch)
