"""One epoch of training NEP-HEAT with Lightning: batches built, forward, backward, Adam, metrics.

Seconds for 10,000 snapshots, extrapolated from fewer.

Limit: the matrix products. A batch of 100, pruned to one hop, has some N = 6,900 nodes, E = 9,700
edges, Q = 910 query edges and 10,000 pairs of query edges of one snapshot. Forwards, in millions of
operations (two for each multiplication): nodes N x (4 + 64) x 64 and 136 labels x 96 x 64, 62;
edges E x (13 + 64) x 64, 96; convolution N x 64 x 68 + E x 64 x 16 + 1 M, 82; two layers of
attention among query edges 2 x Q x 128 x (384 + 128 + 2 x 64), 298, and their pairs, 10; head 22.
That is 570 M; with two gradients of each product but those of the input 1.69 G a batch, 169 G an
epoch: 1.0 s on 2 cores that do 83 G a second each (8 numbers, 2 units, 2 operations, 2.6 GHz). MKL
does 73 G on one core for these sizes. Around the products some 60 arrays of E x 64 or N x 64
numbers, 2 MB each, are written and read again, 0.25 GB a batch: 25 GB an epoch, 1.2 s at 20 GB/s
for both cores, if the caches held nothing.
"""

from __future__ import annotations

import tempfile
import time
import warnings

import lightning.pytorch as pl
from _measure import Benchmark, Measure, run

from datamodules.sgm_datamodule import SGMDataModule
from nep.paper.encoders import HEAT
from nep.paper.nep_module import NEPModule
from simulator.collect.folder import collect


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
    homes, steps, batch_size = (2, 5, 5) if tiny else (20, 100, 100)
    folder = tempfile.TemporaryDirectory()
    module = NEPModule(HEAT())
    data = SGMDataModule(
        data_dir=folder.name,
        num_homes=homes,
        steps=steps,
        num_val_homes=1,
        workers=1,
        batch_size=batch_size,
        num_hops=module.num_hops,
    )
    for config in (data.train_config, data.val_config):
        collect(config, data.get_folder(config), progress=False)

    def measure() -> tuple[float, dict[str, float]]:
        timer = EpochTimer()
        trainer = pl.Trainer(
            accelerator="cpu",
            max_epochs=1,
            limit_val_batches=0,
            num_sanity_val_steps=0,
            callbacks=[timer],
            logger=False,
            enable_checkpointing=False,
            enable_progress_bar=False,
            enable_model_summary=False,
        )
        trainer.fit(module, datamodule=data)
        return timer.seconds[0] * 10_000 / (homes * steps), {}

    return measure, f"{homes * steps} snapshots in batches of {batch_size}"


if __name__ == "__main__":
    benchmark = Benchmark(
        "train NEP-HEAT", "s an epoch of 10,000", 3, limit=1.0, is_higher_better=False
    )
    run(benchmark, prepare, repeats=2, uses_torch=True)
