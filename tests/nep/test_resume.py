"""A training that goes on from a checkpoint ends where one that never stopped does."""

from __future__ import annotations

import random
import subprocess
import time
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from lightning.pytorch import Trainer
from lightning.pytorch.utilities.exceptions import SIGTERMException
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from datamodules.sgm_datamodule import SGMDataModule
from nep.callbacks.resume import RandomStates
from nep.fit import main

SMALL = (
    "--config=heat.yaml --threads=1 --trainer.log_every_n_steps=1 "
    "--trainer.enable_progress_bar=false --data.num_homes=3 --data.steps=8 --data.num_val_homes=1 "
    "--data.batch_size=4 --data.workers=1 --online.num_homes=1 --online.steps=2 "
    "--online.policies=[]"
).split()
RUN = "runs/heat/version_{}"


def list_weights(cli):
    return {name: value.clone() for name, value in cli.model.state_dict().items()}


@pytest.mark.slow
# A resumed run writes to a folder of its own, and lightning says so.
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_two_epochs_and_one_are_three_to_the_last_bit(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    whole = list_weights(main([*SMALL, "--trainer.max_epochs=3"]))
    first = list_weights(main([*SMALL, "--trainer.max_epochs=2"]))
    assert any(not torch.equal(value, whole[name]) for name, value in first.items())
    last = tmp_path / RUN.format(1) / "checkpoints" / "last.ckpt"
    resumed = main([*SMALL, "--trainer.max_epochs=3", f"--ckpt_path={last}"])
    assert resumed.trainer.global_step == 3 * len(resumed.datamodule.train_dataloader())
    for name, value in list_weights(resumed).items():
        assert torch.equal(value, whole[name]), name

    # settings of the data, and the learning rate, are logged
    settings = yaml.full_load((tmp_path / RUN.format(0) / "hparams.yaml").read_text())
    assert settings["training"]["num_homes"] == 3
    assert settings["training"]["batch_size"] == 4
    assert settings["features"]["prior"] is True
    events = EventAccumulator(str(tmp_path / RUN.format(0))).Reload()
    assert [row.value for row in events.Scalars("6_learning_rate/Adam")] == pytest.approx(
        [1e-4] * 18
    )


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_killed_and_gone_on_with_is_as_if_never_stopped(tmp_path, monkeypatch, python):
    """The command is killed without warning, again and again, soon after a checkpoint was there."""
    monkeypatch.chdir(tmp_path)
    repository = Path(__file__).parents[2]
    monkeypatch.setenv("PYTHONPATH", str(repository))
    options = [*SMALL, "--trainer.max_epochs=6"]
    whole = list_weights(main(options))
    last: Path | None = None
    num_killed = 0
    for number, delay in enumerate([0.0, 0.02, 0.1, 0.3], start=1):
        folder = tmp_path / RUN.format(number) / "checkpoints"
        going_on = [] if last is None else [f"--ckpt_path={last}"]
        process = subprocess.Popen(
            [python, "-m", "nep.fit", *options, *going_on],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            while not (folder / "last.ckpt").exists() and process.poll() is None:
                time.sleep(0.005)
            time.sleep(delay)
        finally:
            process.kill()
            num_killed += process.wait() != 0
        if (folder / "last.ckpt").exists():  # else it had no epoch left
            last = folder / "last.ckpt"
    assert last is not None
    assert num_killed > 0
    resumed = list_weights(main([*options, f"--ckpt_path={last}"]))
    assert all(torch.equal(value, whole[name]) for name, value in resumed.items())


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_states_of_another_kind_are_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main([*SMALL, "--trainer.max_epochs=1"])
    last = tmp_path / RUN.format(0) / "checkpoints" / "last.ckpt"
    for part, value in (("torch", torch.zeros(3, dtype=torch.uint8)), ("python", 4), ("numpy", {})):
        content = torch.load(last, weights_only=True)
        content["callbacks"]["RandomStates"][part] = value
        torch.save(content, "damaged.ckpt")
        with pytest.raises(SystemExit, match=r"error: .*random states of a checkpoint must be"):
            main([*SMALL, "--trainer.max_epochs=2", "--ckpt_path=damaged.ckpt"])


@pytest.mark.slow
def test_what_a_training_that_goes_on_does_not_take_over_is_refused(tmp_path, monkeypatch, capsys):
    """What comes from the checkpoint, and what its weights would mean something else with."""
    monkeypatch.chdir(tmp_path)
    main([*SMALL, "--trainer.max_epochs=1"])
    last = RUN.format(0) + "/checkpoints/last.ckpt"
    for option, message in {
        "--model.learning_rate=1e-3": "model.learning_rate must be that of the checkpoint, 0.0001,",
        "--model.transformer=false": "weights must be those of the network",
        "--model.attention.heads=4": "model.attention.heads must be that of the checkpoint, 2, got",
        "--model.encoder.init_args.residual=true": "init_args.residual must be that of the",
        "--model.schedule=cosine": "model.schedule must be that of the checkpoint, 'constant', got",
        "--data.features.prior=false": "data.features.prior must be that of the checkpoint, True",
        "--data.seed=3": "data.seed must be that of the checkpoint, 0, got 3",
        "--seed_everything=7": "seed_everything must be that of the checkpoint, 0, got 7",
    }.items():
        with pytest.raises(SystemExit) as stop:
            main([*SMALL, "--trainer.max_epochs=2", f"--ckpt_path={last}", option])
        assert stop.value.code == 2
        assert message in " ".join(capsys.readouterr().err.split()), option


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_a_cosine_schedule_is_not_made_longer(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = [*SMALL, "--model.schedule=cosine"]
    main([*options, "--trainer.max_epochs=1"])
    last = RUN.format(0) + "/checkpoints/last.ckpt"
    with pytest.raises(SystemExit, match=r"error: a cosine schedule must end as it began, after 6"):
        main([*options, "--trainer.max_epochs=2", f"--ckpt_path={last}"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_what_it_takes_over_may_change(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main([*SMALL, "--trainer.max_epochs=1"])
    last = RUN.format(0) + "/checkpoints/last.ckpt"
    others = ["--model.listwise_weight=1", "--model.attention.dropout=0", "--data.batch_size=8"]
    cli = main([*SMALL, "--trainer.max_epochs=2", f"--ckpt_path={last}", *others])
    assert cli.model.listwise_weight == 1
    assert cli.trainer.current_epoch == 2


def _draw_numpy():
    return np.random.normal()  # noqa: NPY002 - of the global generator, which packages may draw from


def test_states_are_those_of_all_generators():
    """What is drawn after they were kept is drawn again after they are restored."""

    def draw():
        return random.random(), random.gauss(0, 1), _draw_numpy(), torch.rand(3).tolist()

    draw()
    states = RandomStates().state_dict()
    want = draw()
    callback = RandomStates()
    callback.load_state_dict(states)
    draw()
    callback.on_train_start(None, None)
    assert draw() == want
    callback.on_train_start(None, None)  # of a training that does not go on: nothing is restored
    assert draw() != want


def test_an_order_of_another_kind_is_refused():
    data = SGMDataModule(num_homes=1, num_val_homes=1)
    with pytest.raises(ValueError, match="order of a checkpoint must be the state of a generator"):
        data.load_state_dict({"order": torch.zeros(2, dtype=torch.uint8)})


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_a_command_that_trains_nothing_does_not_end_well(tmp_path, monkeypatch, capsys):
    """A saved config with a checkpoint of all its epochs ended without table, with status 0."""
    monkeypatch.chdir(tmp_path)
    main([*SMALL, "--trainer.max_epochs=1"])
    run = tmp_path / RUN.format(0)
    saved = [f"--config={run / 'config.yaml'}", f"--ckpt_path={run / 'checkpoints' / 'last.ckpt'}"]
    for args, message in (
        (saved, r"error: checkpoint must have epochs left, got one of 1 of 1 epochs"),
        ([*SMALL, "--trainer.max_epochs=0"], r"error: training must have an epoch and a batch"),
    ):
        with pytest.raises(SystemExit, match=message):
            main(args)
    capsys.readouterr()
    with pytest.raises(SystemExit) as caught:  # a folder has one run
        main([*SMALL, "--trainer.logger.init_args.version=0"])
    assert caught.value.code == 2
    assert "run must have a folder of its own" in capsys.readouterr().err


def test_a_signal_does_not_end_it_well(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)

    def end(*_, **__):
        raise SIGTERMException

    monkeypatch.setattr(Trainer, "fit", end)
    with pytest.raises(SystemExit) as caught:
        main([*SMALL, "--trainer.max_epochs=1"])
    assert caught.value.code == 143
    assert "error: training must run to its end, got SIGTERM" in capsys.readouterr().err
