"""What lets a training go on: checkpoints that are whole, with the states of random generators."""

from __future__ import annotations

import io
import random
from pathlib import Path
from typing import Any

import lightning.pytorch as pl
import numpy as np
import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from nep.tensor_file import read_tensors
from sgm.files import write_whole
from sgm.messages import shorten


class RandomStates(pl.Callback):
    """Lets a training that goes on from a checkpoint draw what it would have drawn unbroken.

    Checkpoints hold the states of Python, numpy and torch on the CPU, as plain numbers and tensors.
    The order of the batches is kept by the data module.

    Args:
        seed: that of the training, which is kept beside them.

    Attributes:
        has_begun: whether the training has: its checkpoint, if it had one, was restored.
    """

    def __init__(self, seed: int | bool | None = None) -> None:
        self.has_begun = False
        self._seed = seed
        self._found: dict[str, Any] = {}

    def state_dict(self) -> dict[str, Any]:
        """Return the states of now."""
        version, words, gauss = random.getstate()
        name, keys, position, has_gauss, cached = np.random.get_state(legacy=True)  # noqa: NPY002 - packages draw from it
        assert name == "MT19937"
        return {
            "seed": self._seed,
            "python": {"version": version, "words": torch.tensor(words), "gauss": gauss},
            "numpy": {
                "keys": torch.from_numpy(np.asarray(keys).astype(np.int64)),
                "position": int(position),
                "has_gauss": int(has_gauss),
                "cached": float(cached),
            },
            "torch": torch.get_rng_state(),
        }

    def load_state_dict(self, state_dict: dict[str, Any]) -> None:
        """Keep states until the training begins: what is set up before may draw."""
        self._found = state_dict

    def on_train_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Restore the states of the checkpoint, if there was one.

        Raises:
            ValueError: if they are no states of generators.
        """
        found, self._found = self._found, {}
        before = self.state_dict()
        try:
            if found:
                _restore(found)
            self.has_begun = True
        except (LookupError, TypeError, AttributeError, ValueError, RuntimeError) as error:
            _restore(before)
            raise ValueError(
                "random states of a checkpoint must be those of generators, got "
                f"{type(error).__name__}: {shorten(str(error))}. Check --ckpt_path, or leave it "
                "out."
            ) from error


def _restore(states: dict[str, Any]) -> None:
    python, numpy = states["python"], states["numpy"]
    random.setstate((python["version"], tuple(python["words"].tolist()), python["gauss"]))
    keys = np.array(numpy["keys"].tolist(), dtype=np.uint32)
    words = ("MT19937", keys, numpy["position"], numpy["has_gauss"], numpy["cached"])
    np.random.set_state(words)  # noqa: NPY002
    torch.set_rng_state(states["torch"].to(torch.uint8))


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
