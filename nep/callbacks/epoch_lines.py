"""What a training says where its output is no terminal: a line per epoch."""

from __future__ import annotations

import time

import lightning.pytorch as pl
from lightning.pytorch.callbacks import ProgressBar


class EpochLines(ProgressBar):
    """Prints what a progress bar would show, once an epoch: a log has no cursor to move."""

    def __init__(self) -> None:
        """Start before the first epoch."""
        super().__init__()
        self._since: float | None = None
        self._is_on = True

    def enable(self) -> None:
        """Print lines, as in the first of several processes."""
        self._is_on = True

    def disable(self) -> None:
        """Print none."""
        self._is_on = False

    def on_train_epoch_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Print the line of the epoch before: only now are its means known."""
        self._print(trainer, pl_module)
        self._since = time.monotonic()

    def on_train_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Print the line of the last epoch."""
        self._print(trainer, pl_module)

    def _print(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        if self._since is None or not self._is_on:
            return
        last = f" of {trainer.max_epochs}" if (trainer.max_epochs or -1) > 0 else ""
        metrics = self.get_metrics(trainer, pl_module)
        shown = [f"{name} {metrics[name]:.3f}" for name in sorted(metrics) if "/" in name]
        seconds = time.monotonic() - self._since
        line = f"epoch {trainer.current_epoch}{last}: {', '.join(shown)}, {seconds:.0f} s"
        print(line, flush=True)
