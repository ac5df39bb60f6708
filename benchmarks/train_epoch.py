"""One epoch of training NEP-HEAT with Lightning: batches built, forward, backward, Adam, metrics.

Seconds for 10,000 snapshots, extrapolated from fewer.
"""

from __future__ import annotations

import tempfile
import time
import warnings

import lightning.pytorch as pl
from _measure import Benchmark, Measure, run

from datamodules.sgm_datamodule import SGMDataModule
from nep.encoders import HEAT
from nep.module import NEPModule
from simulator.collect import collect


class EpochTimer(pl.Callback):
    """Notes how long each epoch of training takes."""

    def __init__(self) -> None:
        self.seconds: list[float] = []

    def on_train_epoch_start(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Start the clock."""
        self._start = time.perf_counter()

    def on_train_epoch_end(self, trainer: pl.Trainer, pl_module: pl.LightningModule) -> None:
        """Stop it."""
        self.seconds.append(time.perf_counter() - self._start)


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect snapshots."""
    warnings.filterwarnings("ignore")  # Lightning's advice, and what it deprecated itself
    houses, steps, batch_size = (2, 5, 5) if tiny else (20, 100, 100)
    folder = tempfile.TemporaryDirectory()
    module = NEPModule(HEAT())
    data = SGMDataModule(
        folder.name, houses, steps, 1, batch_size=batch_size, num_hops=module.num_hops, workers=1
    )
    for config in (data.train_config, data.val_config):
        collect(config, data.get_folder(config), progress=False)

    def measure() -> tuple[float, dict[str, float]]:
        timer = EpochTimer()
        trainer = pl.Trainer(
            accelerator="cpu", max_epochs=1, limit_val_batches=0, num_sanity_val_steps=0,
            callbacks=[timer], logger=False, enable_checkpointing=False,
            enable_progress_bar=False, enable_model_summary=False,
        )  # fmt: skip
        trainer.fit(module, datamodule=data)
        return timer.seconds[0] * 10_000 / (houses * steps), {}

    return measure, f"{houses * steps} snapshots in batches of {batch_size}"


if __name__ == "__main__":
    benchmark = Benchmark("train NEP-HEAT", "s an epoch of 10,000", 3, is_higher_better=False)
    run(benchmark, prepare, repeats=2, uses_torch=True)
