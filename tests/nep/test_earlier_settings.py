"""Configs, command lines and checkpoints of version 0.1, whose settings had no groups."""

import ast
import json
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml

from nep.config_files import list_groups, name_groups
from nep.encoders import HEAT
from nep.fit import FitCLI
from nep.model.module import NEPModule
from nep.model.settings import GROUPS, group_settings
from nep.players.checkpoints import load_trained, save_exported
from nep.players.policy import NEPPolicy
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

ROOT = Path(__file__).resolve().parents[2]
FILES = Path(__file__).parent / "earlier_files"
CONFIG, CHECKPOINT = FILES / "heat_v0_1.yaml", FILES / "heat_v0_1.ckpt"
MOST_PARAMETERS = 8


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_config_without_groups_says_what_it_said():
    old = yaml.safe_load(CONFIG.read_text("utf-8"))
    cli = FitCLI([f"--config={CONFIG}"])
    new = cli.config.as_dict()
    seen = []
    for part in ("model", "data"):
        groups = list_groups({"model": NEPModule, "data": type(cli.datamodule)}[part])
        for name, value in old[part].items():
            if name == "encoder":
                continue
            found = new[part][groups[name]][name] if name in groups else new[part][name]
            if name not in ("homes", "home"):  # classes; compared below
                assert json.loads(json.dumps(found)) == value, name
            seen.append(name)
    assert {"learning_rate", "num_homes", "batch_size", "features"} <= set(seen)
    encoder = new["model"]["encoder"]["init_args"]
    assert tuple(encoder["edge_units"]) == (3, 5)
    assert encoder["alike"] is True
    assert cli.datamodule.train_config.homes.home.rooms == ("kitchen",)
    assert cli.datamodule.train_config.belief
    assert cli.model.hparams["reads"] == ["belief"]


@pytest.mark.parametrize(
    ("typed", "named"),
    [
        ("--data.num_homes=3", "--data.collection.num_homes=3"),
        ("--data.num-homes", "--data.collection.num_homes"),
        ("--data.no_relevance", "--data.collection.no_relevance"),
        ("--data.homes.init_args.largest=5", "--data.source.homes.init_args.largest=5"),
        ("--data.home.max_looks=4", "--data.source.home.max_looks=4"),
        ("--data.dynamics=paper", "--data.source.dynamics=paper"),
        ("--data.collection.num_homes=3", "--data.collection.num_homes=3"),
        ("--data.features.belief=true", "--data.features.belief=true"),
        ("--model.learning_rate=1", "--model.optimiser.learning_rate=1"),
        ("--model.encoder=nep.encoders.MLP", "--model.encoder=nep.encoders.MLP"),
        ("--online.num_homes=3", "--online.num_homes=3"),
        ("5", "5"),
    ],
)
def test_an_option_may_leave_out_its_group(typed, named):
    from datamodules.sgm_datamodule import SGMDataModule

    groups = {"model": list_groups(NEPModule), "data": list_groups(SGMDataModule)}
    assert name_groups([typed], groups) == [named]


def test_both_spellings_in_one_command(folder):
    (folder / "new.yaml").write_text("data:\n  collection:\n    steps: 7\n  num_homes: 5\n")
    cli = FitCLI(
        ["--config=mlp.yaml", "--config=new.yaml", "--data.num_homes", "4",
         "--data.loading.batch_size=3", "--model.network.dropout=0.2", "--model.schedule=cosine",
         "--data.dynamics", "paper", "--data.no_relevance"]
    )  # fmt: skip
    assert (cli.datamodule.train_config.steps, cli.datamodule.train_config.num_homes) == (7, 4)
    assert cli.datamodule.loading.batch_size == 3
    assert cli.model.hparams["dropout"] == 0.2
    assert cli.model.optimiser.schedule == "cosine"


def test_a_setting_twice_in_one_config_is_refused(folder, capsys):
    text = "data:\n  collection:\n    steps: 7\n  steps: 8\n"
    (folder / "twice.yaml").write_text(text)
    with pytest.raises(SystemExit):
        FitCLI(["--config=mlp.yaml", "--config=twice.yaml"])
    assert "steps must be set once, got it with and without its group" in capsys.readouterr().err


def test_a_checkpoint_without_groups_answers_as_it_did():
    """The scores are those that version 0.1 gave for it."""
    home = HomeConfig(rooms=("kitchen",), furniture_per_room=4)
    homes = SampledHomes(PriorGraph.default(), home, Streams(0, "test", [0]))
    policy = NEPPolicy.load(CHECKPOINT).play_in(homes)
    scores = [step.scores[0] for step in predict_locations(Rollout(homes, policy), 5)]
    np.testing.assert_allclose(scores[-1], [-np.inf, -np.inf, 0.069774, 0.068555], atol=2e-6)


def test_lightning_loads_it_too():
    module = NEPModule.load_from_checkpoint(CHECKPOINT, weights_only=True)
    assert isinstance(module.predictor.encoder, HEAT)
    assert module.predictor.encoder.edge_units == (3, 5)
    assert (module.optimiser.learning_rate, module.optimiser.schedule) == (2e-3, "cosine")
    assert (module.loss.listwise_weight, module.hparams["reads"]) == (0.5, ["belief"])
    assert module.predictor.query_attention is None
    trained = load_trained(CHECKPOINT).module.state_dict()
    for name, tensor in module.state_dict().items():
        assert torch.equal(tensor, trained[name])


def test_an_export_has_the_settings_without_groups(folder):
    """Under the names that earlier versions and the core read, such as `prior_share`."""
    save_exported(folder / "net", load_trained(CHECKPOINT), {})
    settings = json.loads((folder / "net" / "config.json").read_text())["model"]
    assert (settings["prior_share"], settings["learning_rate"]) == (0.0, 2e-3)
    assert settings["reads"] == ["belief"]
    assert load_trained(folder / "net").module.hparams == load_trained(CHECKPOINT).module.hparams


@pytest.mark.parametrize("change", [{"belief": "yes"}, {"reads": "belief"}, {"clock": 1}])
def test_odd_groups_of_features_are_refused(change):
    with pytest.raises(TypeError, match="groups of features"):
        group_settings(change)


def test_settings_belong_to_one_group_each():
    names = [name for cls in GROUPS.values() for name in cls.__dataclass_fields__]
    assert len(names) == len(set(names))


def test_no_constructor_has_more_parameters_than_one_remembers():
    """Settings are frozen dataclasses; a constructor takes these."""
    large = {}
    for package in ("sgm", "simulator", "datamodules", "nep"):
        for path in (ROOT / package).rglob("*.py"):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if not isinstance(node, ast.ClassDef):
                    continue
                for method in node.body:
                    if isinstance(method, ast.FunctionDef) and method.name == "__init__":
                        own = method.args
                        count = len(own.posonlyargs + own.args + own.kwonlyargs) - 1
                        if count > MOST_PARAMETERS:
                            large[node.name] = count
    assert large == {}
