"""What `nep.fit` says in words: what is trained on what, and which commands come next."""

from __future__ import annotations

import os
import shlex
import sys
from collections.abc import Sized
from pathlib import Path
from typing import cast

import lightning.pytorch as pl
from lightning.pytorch.callbacks import ModelCheckpoint

from datamodules.sgm_datamodule import SGMDataModule
from nep.training.training_module import TrainingModule
from simulator.world.paper_dynamics import PaperDynamics
from simulator.world.source import SampledSource

_FEW_HOMES = 50  # half of the paper's: of fewer, a network learns the homes and not the kind


class FitMessages(pl.Callback):
    """Says at the start what is trained, and at the end where it is and what to do with it."""

    def __init__(self, name: str, best: ModelCheckpoint | None) -> None:
        """Know the name of the network, and what keeps its best epoch, None for nothing."""
        self._name = name
        self._best = best

    def on_fit_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Say what is trained, and what is to be known of its homes."""
        data = getattr(trainer, "datamodule", None)
        if not trainer.is_global_zero or not isinstance(data, SGMDataModule):
            return
        weights = sum(parameter.numel() for parameter in pl_module.parameters())
        source, num_homes = data.val_config.homes, data.train_config.num_homes
        train, val = (len(cast(Sized, part)) for part in (data.train_dataset, data.val_dataset))
        print(
            f"{self._name}: {weights:,} weights, {train:,} training snapshots, {val:,} of other "
            "homes for validation"
        )
        if not isinstance(source, SampledSource):
            return
        if num_homes < _FEW_HOMES:
            print(
                f"{num_homes} homes are few to learn from: the paper has 100 (--data.num_homes). "
                "Expect rules to be ahead."
            )
        if isinstance(source.home.dynamics, PaperDynamics):
            print(
                "The homes are the paper's: each step some things move by chance, as the home's "
                "own habits have it. In them the rule 'persistence' is level with its networks."
            )

    def on_fit_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Name the checkpoint, and commands that use it."""
        path = self._best.best_model_path if self._best is not None else ""
        log_dir = trainer.log_dir  # asked by all processes
        if trainer.is_global_zero and path:
            assert isinstance(pl_module, TrainingModule)
            network = pl_module.predictor
            module = type(getattr(network, "encoder", network)).__module__
            encoders = "" if module.startswith("nep.") else f" --encoders {module}"
            print("\n".join(["", *list_next_commands(self._name, Path(path), log_dir, encoders)]))


def list_next_commands(
    name: str, checkpoint: Path, log_dir: str | None, more: str = ""
) -> list[str]:
    """List what was written, and the commands that read it, to copy.

    Args:
        name: of the network, in tables.
        checkpoint: of the best epoch.
        log_dir: what TensorBoard shows; None for nothing.
        more: options that name an encoder of one's own.
    """
    python, file = _shorten_path(Path(sys.executable)), _shorten_path(checkpoint)
    called = name.replace("@", " ").replace("=", " ")  # which part a name from the rest there
    named = shlex.quote(f"{called}={file}")
    commands = {
        "play it in homes that it has not seen": (
            f"-m nep.evaluate --checkpoint {named} --policies bayesian persistence "
            f"--tasks predict_location --num_homes 20 --out scores{more}"
        ),
    }
    if not more:  # the page knows our own encoders alone
        commands["ask it in a browser"] = f"-m nep.view sampled --checkpoint {named}"
    if log_dir is not None:
        board = f"-m tensorboard.main --logdir {_shorten_path(Path(log_dir))}"
        commands = {"see how it learnt": board, **commands}
    lines = [f"The best epoch is in {file}. Next:"]
    for purpose, command in commands.items():
        lines += [f"  {python} {command}", f"      {purpose}"]
    return lines


def _shorten_path(path: Path) -> str:
    """Return a path as one would type it here; symbolic links are kept."""
    path = Path(os.path.abspath(path))  # resolve() would follow links
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else str(path)
