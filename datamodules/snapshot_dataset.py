"""Snapshots on disk, read as batches."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from torch.utils.data import Dataset

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
