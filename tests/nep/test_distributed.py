"""Two processes train like one: Lightning's DDP on the CPU, through the command line."""

import json
import os
import subprocess
from pathlib import Path

import pytest
import torch

pytestmark = pytest.mark.slow

REPOSITORY = Path(__file__).parents[2]
# 160 snapshots; 8 epochs of 8 steps, in each of which 20 snapshots are seen by one process or two
SETTING = [
    "--config", "mlp.yaml", "--model.encoder.init_args.units", "16",
    "--model.learning_rate", "1e-2",
    "--data.num_homes", "8", "--data.steps", "20", "--data.num_val_homes", "2",
    "--data.workers", "1",
    "--online.num_homes", "2", "--online.steps", "5", "--online.policies", "[bayesian,ceiling]",
    "--trainer.max_epochs", "8", "--trainer.enable_progress_bar", "false", "--threads", "1",
]  # fmt: skip


def fit(python: str, folder: Path, name: str, *options: str) -> dict:
    """Train in a process of its own; return metrics, steps and the table."""
    command = [
        python, "-m", "nep.fit", *SETTING, *options, "--data.data_dir",
        str(folder / "data"), "--trainer.logger", "CSVLogger",
        "--trainer.logger.init_args.save_dir", str(folder), "--trainer.logger.init_args.name", name,
    ]  # fmt: skip
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY), "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        command, cwd=folder, env=environment, capture_output=True, text=True, timeout=300
    )
    assert done.returncode == 0, done.stderr[-3000:]
    run = folder / name / "version_0"
    checkpoint = torch.load(run / "checkpoints" / "last.ckpt", weights_only=True)
    lines = [line.split(",") for line in (run / "metrics.csv").read_text().splitlines()]
    column = lines[0].index("train/auroc")
    auroc = [float(line[column]) for line in lines[1:] if line[column]]
    table = json.loads((run / "online_evaluation.json").read_text())
    return {"steps": checkpoint["global_step"], "auroc": auroc, "table": table}


def test_two_processes_train_like_one(tmp_path, python):
    one = fit(python, tmp_path, "one", "--data.batch_size", "20")
    two = fit(
        python, tmp_path, "two", "--data.batch_size", "10", "--trainer.strategy", "ddp",
        "--trainer.devices", "2",
    )  # fmt: skip
    # Each epoch sees every snapshot once, shared out between the processes.
    assert one["steps"] == two["steps"] == 8 * 8
    assert len(one["auroc"]) == len(two["auroc"]) == 8
    # Other batches in another order: the same course up to noise, from chance to what it learns.
    for run in (one, two):
        assert run["auroc"][0] < 0.56 < 0.61 < run["auroc"][-1]
    assert abs(two["auroc"][-1] - one["auroc"][-1]) < 0.06
    # The heuristics play the same homes, once.
    assert one["table"]["bayesian"] == two["table"]["bayesian"]
    assert set(two["table"]) == {"bayesian", "ceiling", "NEP-MLP"}
