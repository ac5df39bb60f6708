"""Checkpoints of a training that are on disk whole or not at all."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from nep.tensor_file import read_tensors
from sgm.files import write_whole


class WholeCheckpoints(TorchCheckpointIO):
    """Writes beside the old checkpoint, flushes to disk, then renames.

    Lightning's own way copies from the temporary folder, and leaves a truncated file where that is
    on another disk and this one is full, or the process is killed.
    """

    def save_checkpoint(
        self, checkpoint: dict[str, Any], path: Any, storage_options: Any | None = None
    ) -> None:
        """Write a checkpoint.

        Raises:
            OSError: if the disk is full; the old file, if any, is untouched.
        """
        content = io.BytesIO()
        torch.save(checkpoint, content)
        target = Path(path)
        target.parent.mkdir(parents=True, exist_ok=True)
        write_whole(target, content.getvalue())

    def load_checkpoint(
        self,
        path: Any,
        map_location: Any | None = None,
        weights_only: bool | None = None,
        **options: Any,
    ) -> dict[str, Any]:
        """Read a checkpoint; nothing in it is called, and its numbers are on the CPU.

        Raises:
            OSError, ValueError: as `read_tensors` does.
        """
        found: dict[str, Any] = read_tensors(path)
        return found
