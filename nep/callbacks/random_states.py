"""Keeps the state of every random generator of a training in its checkpoints."""

from __future__ import annotations

import random
from typing import Any

import lightning.pytorch as pl
import numpy as np
import torch
from torch import Tensor

from sgm.messages import shorten


class RandomStates(pl.Callback):
    """Lets a training that goes on from a checkpoint draw what it would have drawn unbroken.

    Checkpoints hold the states of Python, numpy and torch on the CPU, as plain numbers and tensors.
    The order of the batches is kept by the data module. Checkpoints without such states, of earlier
    versions, are gone on from as they were: with fresh generators.
    """

    def __init__(self) -> None:
        self._found: dict[str, Any] = {}

    def state_dict(self) -> dict[str, Any]:
        """Return the states of now."""
        version, words, gauss = random.getstate()
        name, keys, position, has_gauss, cached = np.random.get_state(legacy=True)  # noqa: NPY002 - packages draw from it
        assert name == "MT19937"
        return {
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
        if not found:
            return
        before = self.state_dict()
        try:
            _restore(found)
        except (LookupError, TypeError, AttributeError, ValueError, RuntimeError) as error:
            _restore(before)
            raise ValueError(
                "random states of a checkpoint must be those of generators, got "
                f"{type(error).__name__}: {shorten(str(error))}. Check --ckpt_path, or leave it "
                "out."
            ) from error


def _restore(states: dict[str, Any]) -> None:
    python, numpy = states["python"], states["numpy"]
    random.setstate((python["version"], tuple(_list(python["words"])), python["gauss"]))
    keys = np.array(_list(numpy["keys"]), dtype=np.uint32)
    words = ("MT19937", keys, numpy["position"], numpy["has_gauss"], numpy["cached"])
    np.random.set_state(words)  # noqa: NPY002
    torch.set_rng_state(states["torch"].to(torch.uint8))


def _list(words: Tensor) -> list[int]:
    numbers: list[int] = words.tolist()
    return numbers
