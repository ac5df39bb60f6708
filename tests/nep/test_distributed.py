"""Two processes train like one: Lightning's DDP on the CPU, through the command line."""

import json
import os
import subprocess
from pathlib import Path

import pytest
import torch

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[2]
# 160 snapshots; 2 epochs of 8 steps, in each of which 20 snapshots are seen by one process or two.
# Sampled by one `DistributedSampler`, both see the same snapshots in a step. They learn by the
# listwise loss alone, a mean over snapshots, so that the mean over two halves of a batch is that
# over the batch; the paper's loss weighs false edges by their number in the batch of each process.
SETTING = (
    "--config mlp.yaml --model.encoder.init_args.units 16 --model.attention.dropout 0 "
    "--model_class recorder.Listwise --data.num_homes 8 --data.steps 20 --data.num_val_homes 2 "
    "--data.workers 1 --online.num_homes 2 --online.steps 5 --online.policies [bayesian,ceiling] "
    "--trainer.max_epochs 2 --trainer.enable_progress_bar false --threads 1 --trainer.strategy "
    "ddp --trainer.callbacks+ recorder.Recorder"
).split()

# Plain gradient descent: Adam divides a gradient by its own size, so that the sign of a rounding
# error (the bias of the last layer has gradient zero) becomes a whole step.
RECORDER = """
import torch
from lightning.pytorch.callbacks import Callback

from nep.paper.nep_module import NEPModule
from nep.training.listwise_loss import listwise_loss


class Listwise(NEPModule):
    '''Learn which edge it is.'''

    def __init__(self, **kwargs):
        super().__init__(**kwargs)

    def compute_loss(self, batch):
        _, answers = super().compute_loss(batch)
        return listwise_loss(*answers, batch.num_snapshots), answers


class Recorder(Callback):
    '''Save what each process saw and computed.'''

    def setup(self, trainer, pl_module, stage):
        pl_module.configure_optimizers = lambda: torch.optim.SGD(pl_module.parameters(), lr=0.1)

    def on_train_start(self, trainer, pl_module):
        self.samples, self.gradient = [], None

    def on_train_epoch_start(self, trainer, pl_module):
        self.samples.append(list(trainer.train_dataloader.sampler))

    def on_after_backward(self, trainer, pl_module):
        if self.gradient is None:
            self.gradient = {
                name: weight.grad.clone() for name, weight in pl_module.named_parameters()
            }

    def on_train_end(self, trainer, pl_module):
        weights = {name: weight.detach() for name, weight in pl_module.named_parameters()}
        found = {"samples": self.samples, "gradient": self.gradient, "weights": weights}
        torch.save(found, f"{trainer.num_devices}_{trainer.global_rank}.pt")
"""


def fit(python: str, folder: Path, processes: int, *options: str) -> dict:
    """Train in processes of its own; return what each recorded, the steps and the table."""
    name = str(processes)
    command = [
        python,
        "-m",
        "nep.fit",
        *SETTING,
        *options,
        "--trainer.devices",
        name,
        "--data.data_dir",
        str(folder / "data"),
        "--trainer.logger",
        "CSVLogger",
        "--trainer.logger.init_args.save_dir",
        str(folder),
        "--trainer.logger.init_args.name",
        name,
    ]
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=1200
    )
    assert done.returncode == 0, done.stderr[-3000:]
    run = folder / name / "version_0"
    checkpoint = torch.load(run / "checkpoints" / "last.ckpt", weights_only=True)
    found = [
        torch.load(folder / f"{name}_{rank}.pt", weights_only=True) for rank in range(processes)
    ]
    table = json.loads((run / "online_evaluation.json").read_text())
    return {"steps": checkpoint["global_step"], "processes": found, "table": table}


def assert_alike(one: dict, two: dict) -> None:
    """Equal up to the rounding of float32 sums in another order, relative to the largest entry."""
    assert one.keys() == two.keys()
    scale = max(float(value.abs().max()) for value in one.values())
    for name in one:
        assert float((one[name] - two[name]).abs().max()) < 1e-5 * scale, name


def test_two_processes_train_like_one(tmp_path, python):
    (tmp_path / "recorder.py").write_text(RECORDER)
    one = fit(python, tmp_path, 1, "--data.batch_size", "20")
    two = fit(python, tmp_path, 2, "--data.batch_size", "10")
    assert one["steps"] == two["steps"] == 2 * 8
    (alone,), (first, second) = one["processes"], two["processes"]

    # Each epoch sees every snapshot once, shared out between the processes step by step.
    for order, of_first, of_second in zip(
        alone["samples"], first["samples"], second["samples"], strict=True
    ):
        assert sorted(order) == list(range(160))
        assert order[::2] == of_first
        assert order[1::2] == of_second
    assert alone["samples"][0] != alone["samples"][1]

    # The same gradient of the first step, the same weights after sixteen.
    assert max(float(value.abs().max()) for value in alone["gradient"].values()) > 1e-3
    for name, value in first["weights"].items():
        assert torch.equal(value, second["weights"][name]), name
    for process in (first, second):
        assert_alike(alone["gradient"], process["gradient"])
        assert_alike(alone["weights"], process["weights"])

    # The heuristics play the same homes, once.
    assert one["table"]["bayesian"] == two["table"]["bayesian"]
    assert set(two["table"]) == {"bayesian", "ceiling", "NEP-MLP"}
