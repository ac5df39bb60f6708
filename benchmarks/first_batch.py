"""How long `python -m nep.fit` takes to the end of its first batch on data that is on disk.

From the start of the interpreter: imports of torch and lightning, checking and reading the
shards, spaCy for the text vectors, the graphs of 100 snapshots, two batches of validation, forward,
backward and Adam. The heuristics play later, before the model's first online evaluation.

The limit is what nothing of ours can change: `import torch, lightning.pytorch`, 4,000 modules
that took 6.3 s of processor time with a warm cache on a busy machine. `libraries` is the same on
the machine at hand, `imports` the time of `import nep.fit`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time

from _measure import Benchmark, Measure, run

from datamodules.sgm_datamodule import SGMDataModule
from simulator.collect.folder import collect

_CODE = """
import os, sys
from nep import fit
from nep.paper.nep_module import NEPModule
NEPModule.on_train_batch_end = lambda self, *rest: os._exit(0)
fit.main(sys.argv[1:])
"""


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Collect the data."""
    size = {"num_homes": 2, "steps": 5, "num_val_homes": 1} if tiny else {}
    folder = tempfile.TemporaryDirectory()
    data = SGMDataModule(data_dir=folder.name, **size)
    for config in (data.train_config, data.val_config):
        collect(config, data.get_folder(config), progress=False)
    options = [f"--data.{name}={count}" for name, count in size.items()]
    options += ["--online.num_homes=1", "--online.steps=2"] * tiny
    command = [
        sys.executable,
        "-c",
        _CODE,
        "--config",
        "heat.yaml",
        *options,
        "--data.data_dir",
        folder.name,
        "--trainer.logger.init_args.save_dir",
        folder.name,
    ]

    def measure() -> tuple[float, dict[str, float]]:
        seconds = {
            name: _time([sys.executable, "-c", f"import {modules}"])
            for name, modules in (("libraries", "torch, lightning.pytorch"), ("imports", "nep.fit"))
        }
        figure = _time(command)
        folder.cleanup()
        return figure, seconds

    return measure, f"{data.train_config.num_homes} homes x {data.train_config.steps} steps on disk"


def _time(command: list[str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    return time.perf_counter() - start


if __name__ == "__main__":
    benchmark = Benchmark("first batch of nep.fit", "s", 8, limit=6.3, is_higher_better=False)
    run(benchmark, prepare, repeats=1)
