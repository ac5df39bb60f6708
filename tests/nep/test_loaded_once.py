"""Traces are parsed once, networks loaded once, whatever a command does with them."""

from collections import Counter

import pytest

from nep import evaluate, fit
from nep.players import checkpoints
from nep.players.policy import NEPPolicy
from sgm.network.shipped import PRETRAINED
from simulator.trace import record_homes, save_trace, source
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture
def traces(tmp_path):
    """Two homes to train in and one to validate in, of different sizes."""
    for home, rooms in enumerate((("kitchen",), ("kitchen", "bedroom"), ("bathroom", "kitchen"))):
        rules = HomeConfig(rooms=rooms, furniture_per_room=4 - home % 2)
        (trace,) = record_homes(SampledSource(home=rules).make(Streams(0, "test", [home])), 6)
        save_trace(trace, tmp_path / ("val" if home == 2 else "train") / f"home{home}")
    return tmp_path


@pytest.fixture
def count(monkeypatch):
    """How often each trace was read and each network loaded."""
    counts = Counter()
    load_trace, load = source.load_trace, NEPPolicy.load

    def count_trace(folder):
        counts[folder.name] += 1
        return load_trace(folder)

    def count_network(path):
        counts[path.name] += 1
        return load(path)

    monkeypatch.setattr(source, "load_trace", count_trace)
    monkeypatch.setattr(NEPPolicy, "load", staticmethod(count_network))
    return counts


@pytest.mark.slow
def test_a_training_in_homes_of_different_sizes(traces, count, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cli = fit.main(
        [
            "--config",
            "mlp.yaml",
            "--data.trace",
            str(traces / "train"),
            "--data.val_trace",
            str(traces / "val"),
            f"--data.data_dir={tmp_path}/data",
            "--data.workers=1",
            "--trainer.max_epochs=2",
            "--online.every_n_epochs=1",
            "--online.policies=[bayesian]",
            "--trainer.enable_progress_bar=false",
            "--trainer.log_every_n_steps=1",
        ]
    )
    assert count == {"home0": 1, "home1": 1, "home2": 1}
    assert cli.datamodule.hparams["training"]["homes"]["source"] == "recorded"
    (last,) = (tmp_path / "runs").rglob("last.ckpt")
    count.clear()
    evaluate.main(
        [
            "--trace",
            str(traces / "train"),
            str(traces / "val"),
            "--policies",
            "bayesian",
            "myopic",
            "--checkpoint",
            f"net={last}",
            "--out",
            str(tmp_path / "out"),
        ]
    )
    assert count == {"home0": 1, "home1": 1, "home2": 1, "last.ckpt": 1}
    assert "| net |" in (tmp_path / "out" / "table.md").read_text()


def test_a_network_that_changes_is_loaded_again(tmp_path, count):
    """Trained further meanwhile: the file says so."""
    from nep.players.contestants import Checkpoint

    folder = PRETRAINED / "heat"
    for file in folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    point = Checkpoint("net", tmp_path)
    assert point.load() is point.load()
    weights = tmp_path / checkpoints.WEIGHTS
    weights.write_bytes(weights.read_bytes())
    point.load()
    assert count[tmp_path.name] == 2
