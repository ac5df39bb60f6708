"""Networks that know what time it is: what they learn, where they play, and where they refuse."""

import json
from datetime import datetime
from pathlib import Path

import pytest
import torch

from datamodules.feature_config import FeatureConfig
from datamodules.sgm_datamodule import SGMDataModule
from nep import Clock, ObjectFinder, SceneGraphMemory, Sighting, evaluate, export, fit
from nep.callbacks.online_evaluation import OnlineEvaluation
from nep.paper.encoders import MLP
from nep.paper.loss import balanced_bce
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import load_config, load_trained
from nep.training.hits_at_one import HitsAtOne
from sgm.network.shipped import PRETRAINED

HOUR = 3600
LAYOUT = """{"rooms": ["kitchen", "study"], "furniture": [
 {"name": "desk", "room": "study"}, {"name": "rack", "room": "kitchen"},
 {"name": "bench", "room": "kitchen"}], "start": "2026-11-16T00:00"}"""
OBJECTS = ("robot", "hamster", "gizmo", "doodad", "widget", "gadget")


def write_trace(folder: Path, num_days: int) -> str:
    """At the desk from 08:00 to 20:00, in the rack by night: all objects, every day."""
    folder.mkdir(parents=True)
    (folder / "layout.json").write_text(LAYOUT)
    rows = [f"0,{name},rack,in" for name in OBJECTS]
    for day in range(num_days):
        for hour, place in ((8, "desk"), (20, "rack")):
            rows += [f"{(day * 24 + hour) * HOUR},{name},{place},in" for name in OBJECTS]
    (folder / "events.csv").write_text("\n".join(["time_s,object,furniture,relation", *rows]))
    return str(folder)


@pytest.fixture(scope="module")
def homes(tmp_path_factory) -> dict[str, list[str]]:
    folder = tmp_path_factory.mktemp("homes")
    return {
        "trace": [write_trace(folder / "train", 30)],
        "val_trace": [write_trace(folder / "val", 15)],
    }


def train_and_score(data: SGMDataModule, clock: bool) -> float:
    """Return how often a small network is right about the validation home."""
    torch.manual_seed(1)
    module = NEPModule(MLP(units=32), transformer=False, reads=["clock"] * clock)
    optimizer = torch.optim.Adam(module.parameters(), lr=1e-2)
    for batch in list(data.train_dataloader()) * 40:
        optimizer.zero_grad()
        balanced_bce(module(batch), batch.query_target).backward()
        optimizer.step()
    hits = HitsAtOne()
    for batch in data.val_dataloader():
        with torch.no_grad():
            hits.update(module(batch), batch.query_target, batch.query_snapshot)
    return float(hits.compute())


@pytest.mark.slow
def test_a_home_that_follows_the_clock_is_predicted_better_with_one(homes, tmp_path):
    """All objects are at the desk or all in the rack: half right without a clock, always with."""
    scores = {}
    for clock in (False, True):
        data = SGMDataModule(
            step_seconds=4 * HOUR,
            data_dir=str(tmp_path),
            policy="random",
            workers=1,
            features=FeatureConfig(clock=clock),
            batch_size=64,
            num_hops=0,
            **homes,
        )
        data.prepare_data()
        data.setup()
        scores[clock] = train_and_score(data, clock)
    assert scores[True] > 0.95
    assert scores[False] < 0.7


@pytest.fixture(scope="module")
def checkpoint(homes, tmp_path_factory) -> Path:
    """A network with a clock, as the training command leaves it."""
    folder = tmp_path_factory.mktemp("runs")
    cli = fit.main(
        [
            "--config",
            "mlp.yaml",
            "--data.features.clock=true",
            f"--data.data_dir={folder}/data",
            f"--data.trace={homes['trace']}",
            f"--data.val_trace={homes['val_trace']}",
            "--data.step_seconds=14400",
            "--data.workers=1",
            "--trainer.max_epochs=1",
            "--trainer.enable_progress_bar=false",
            f"--trainer.default_root_dir={folder}",
            "--trainer.logger=false",
            "--online.policies=[bayesian, ceiling]",
            "--trainer.log_every_n_steps=1",
        ]
    )
    assert cli.model.hparams["reads"] == ["clock"]
    online = next(row for row in cli.trainer.callbacks if isinstance(row, OnlineEvaluation))
    assert set(online.scores) == {"bayesian", "NEP-MLP"}  # nobody knows the dynamics for a ceiling
    assert online.scores["NEP-MLP"].values.shape == (1, 89)  # all that was recorded
    return folder / "checkpoints" / "last.ckpt"


@pytest.mark.slow
def test_evaluated_in_recorded_homes_alone(checkpoint, homes, tmp_path, capsys):
    shared = ["--policies=none", "--tasks=predict_location", f"--checkpoint=net={checkpoint}"]
    out = tmp_path / "out"
    evaluate.main([*shared, "--trace", *homes["val_trace"], "--steps=5", f"--out={out}"])
    assert "net" in (out / "table.md").read_text()
    blind = tmp_path / "blind"
    blind.mkdir()
    for file in Path(homes["val_trace"][0]).iterdir():
        text = file.read_text().replace(', "start": "2026-11-16T00:00"', "")
        (blind / file.name).write_text(text)
    for arguments, message in (
        (["--num_homes=1"], "must have a clock for features.clock, got sampled homes"),
        (["--trace", str(blind)], "got no start in the layout.json of blind. Add a line like"),
    ):
        with pytest.raises(SystemExit):
            evaluate.main([*shared, *arguments, f"--out={tmp_path / 'none'}"])
        assert message in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.slow
def test_exported_and_asked(checkpoint, tmp_path, capsys):
    with pytest.raises(SystemExit):
        export.main([str(checkpoint), str(tmp_path / "net")])
    assert "must read no clock to be scored in homes without one" in capsys.readouterr().err
    assert not (tmp_path / "net").exists()
    export.main([str(checkpoint), str(tmp_path / "net"), "--num_homes=0"])
    config = load_config(tmp_path / "net")
    training = config["notes"]["training"]  # 30 days of six steps, the last ends at 20:00
    assert (training["num_homes"], training["steps"], training["is_recorded"]) == (1, 179, True)
    assert config["features"]["clock"]
    assert config["model"]["reads"] == ["clock"]
    finder = ObjectFinder.load(tmp_path / "net")
    memory = SceneGraphMemory()
    study = memory.add_room("study")
    desk = memory.add_furniture("desk", room=study)
    rack = memory.add_furniture("rack", room=study)
    memory.observe(rack, [])  # no more than UNRELATED is given to what was never looked at
    memory.observe(desk, [Sighting("robot")])
    with pytest.raises(ValueError, match=r"must have a clock .*SceneGraphMemory\(clock=Clock\("):
        finder.rank(memory, "gizmo")
    assert memory.descriptions == ("robot",)  # nothing was asked
    memory.save(tmp_path / "home.sgm")
    probability = []
    for hour in (0, 9):
        clock = Clock(datetime(2026, 11, 16, hour), 60)
        memory = SceneGraphMemory.load(tmp_path / "home.sgm", clock=clock)
        memory.step()  # what was seen in this very step is there, whatever the time
        probability.append(finder.rank(memory, "robot").places[0].probability)
    assert probability[0] != probability[1]  # the same memory at another time


def test_a_network_without_a_clock_needs_none(tmp_path):
    """Nor do networks that were exported before there were clocks."""
    for file in (PRETRAINED / "heat").iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    config = load_config(tmp_path)
    del config["features"]["clock"], config["model"]["reads"]
    (tmp_path / "config.json").write_text(json.dumps(config), encoding="utf-8")
    assert not load_trained(tmp_path).module.hparams["reads"]
