"""The training command, shrunk: configs, overrides, replay, resume, errors."""

from __future__ import annotations

import errno
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from lightning.pytorch import Trainer
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from datamodules.feature_config import FeatureConfig
from datamodules.sgm_datamodule import SGMDataModule
from nep.config_files import CONFIG_FOLDER, find_configs
from nep.fit import FitCLI, find_classes, main
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.policy import NEPPolicy
from simulator import PriorGraph, SampledHomes, SampledSource, Streams, evaluate_policy
from simulator.world.mixture.lived_in_homes import LivedInSource
from simulator.world.mixture.paper_homes import PaperSizesSource
from simulator.world.mixture.source import Mixture, MixtureSource

pytestmark = pytest.mark.slow

SMALL = (
    "--trainer.max_epochs=1 --trainer.log_every_n_steps=1 --trainer.enable_progress_bar=false "
    "--data.num_homes=2 --data.steps=8 --data.num_val_homes=1 --data.batch_size=8 "
    "--data.workers=1 --online.num_homes=1 --online.steps=3"
).split()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A fresh working directory."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("name", "num_hops"),
    [
        ("mlp", 0),
        ("gcn", 1),
        ("heat", 1),
        ("hgt", 1),
        ("han", 1),
    ],
)
def test_packaged_configs_build_the_papers_setting(name, num_hops, folder):
    cli = FitCLI(["--config", f"{name}.yaml"])
    assert type(cli.model.predictor.encoder).__name__ == name.upper().replace("_", "")
    assert cli.model.num_hops == num_hops
    assert cli.config_init.data.builder.num_hops == num_hops
    assert cli.model.predictor.encoder.units == 64
    assert cli.model.learning_rate == 1e-4
    assert cli.trainer.max_epochs == 25
    assert cli.datamodule.batch_size == 100


# A resumed run writes to a folder of its own, and lightning says so.
@pytest.mark.filterwarnings("ignore:The dirpath has changed:UserWarning")
def test_fit_writes_what_replays_reloads_and_resumes(folder, capsys):
    cli = main(["--config", "heat.yaml", *SMALL, "--model.encoder.init_args.heads=4"])
    assert "NEP-HEAT" in capsys.readouterr().out
    run = folder / "runs" / "heat" / "version_0"
    events = EventAccumulator(str(run)).Reload()
    scalars = {name: len(events.Scalars(name)) for name in events.Tags()["scalars"]}
    assert scalars["1_loss/train"] == cli.trainer.global_step
    for name in (
        *("2_hits_at_1/train", "5_more_metrics/train_auroc", "1_loss/val", "2_hits_at_1/val"),
        *("5_more_metrics/val_auroc", "5_more_metrics/val_average_precision"),
    ):
        assert scalars[name] == 1, name  # once an epoch

    checkpoints = run / "checkpoints"
    assert {path.name for path in checkpoints.iterdir()} == {"best.ckpt", "last.ckpt"}
    module = NEPModule.load_from_checkpoint(checkpoints / "last.ckpt", weights_only=True)
    assert module.predictor.encoder.heads == 4
    weights = cli.model.state_dict()
    assert all(torch.equal(value, weights[key]) for key, value in module.state_dict().items())

    state = torch.load(checkpoints / "last.ckpt", weights_only=True)
    trained_on = state["datamodule_hyper_parameters"]["training"]  # what a model card says
    assert trained_on["num_memories"] == len(cli.datamodule.train_dataset)

    saved = run / "config.yaml"
    replayed = main(["--config", str(saved)])
    for want, got in zip(cli.model.parameters(), replayed.model.parameters(), strict=True):
        assert torch.equal(got, want)  # same seed, same data: same weights
    again = run.with_name("version_1") / "config.yaml"
    assert yaml.safe_load(again.read_text()) == yaml.safe_load(saved.read_text())

    last = str(checkpoints / "last.ckpt")
    resumed = main(["--config", str(saved), "--ckpt_path", last, "--trainer.max_epochs", "2"])
    assert resumed.trainer.global_step == 2 * cli.trainer.global_step


def test_packaged_config_of_hms_has_no_memory(folder):
    cli = FitCLI(["--config", "hms.yaml"])
    features = cli.datamodule.builder.config
    assert (features.memory, features.temporal, features.prior) == (False, False, True)
    assert cli.model.predictor.query_attention is None
    assert type(cli.model.predictor.encoder).__name__ == "GCN"


@pytest.mark.parametrize(
    ("ablation", "features", "has_transformer"),
    [
        ("no_prior", FeatureConfig(prior=False, candidates="random"), True),
        ("no_transformer", FeatureConfig(), False),
        ("no_temporal", FeatureConfig(temporal=False), True),
        ("no_semantic", FeatureConfig(semantic=False), True),
        ("no_absence", FeatureConfig(absence=False), True),
    ],
)
def test_an_ablation_is_put_after_the_config_of_a_model(
    ablation, features, has_transformer, folder
):
    cli = FitCLI(["--config", "gcn.yaml", "--config", f"{ablation}.yaml"])
    assert cli.datamodule.builder.config == features
    assert (cli.model.predictor.query_attention is not None) == has_transformer
    assert type(cli.model.predictor.encoder).__name__ == "GCN"
    assert cli.trainer.max_epochs == 25


@pytest.mark.parametrize(
    ("config", "arguments"),
    [
        ("heat_two_heads", {"heads": 2, "residual": True, "root_weight": False}),
        ("heat", {"heads": 1, "residual": False, "root_weight": True}),
    ],
)
def test_a_variant_changes_its_encoder_alone(config, arguments, folder):
    cli = FitCLI(["--config", f"{config}.yaml"])
    found = cli.model.predictor.encoder.config()["init_args"]
    assert found | arguments == found
    assert cli.model.learning_rate == 1e-4


@pytest.mark.parametrize("config", ["gcn", "heat"])
def test_a_change_is_put_after_the_config_of_an_encoder(config, folder):
    packaged = FitCLI(["--config", f"{config}.yaml"]).model.predictor.encoder.config()
    model = FitCLI(["--config", f"{config}.yaml", "--config", "two_convolutions.yaml"]).model
    packaged["init_args"] |= {"num_convolutions": 2}
    assert model.predictor.encoder.config() == packaged
    assert (model.num_hops, model.learning_rate) == (2, 1e-4)


def test_a_file_here_goes_before_the_packaged_one(folder):
    packaged = [f"--config={CONFIG_FOLDER / name}" for name in ("paper.yaml", "gcn.yaml")]
    assert find_configs(["--config", "gcn.yaml"]) == packaged
    assert find_configs(["--config=gcn.yaml", "-c", "gcn.yaml"]) == 2 * packaged
    (folder / "gcn.yaml").write_text("seed_everything: 3")
    assert find_configs(["--config", "gcn.yaml"]) == ["--config=gcn.yaml"]


def test_a_config_builds_on_another(folder):
    """It says what differs; what is saved says everything, and names no other file."""
    (folder / "mine.yaml").write_text("# ours\nbase: heat_plus.yaml\ndata:\n  steps: 7\n")
    cli = FitCLI(["--config", "mine.yaml", "--data.num_homes=3"])
    assert type(cli.model.predictor.encoder).__name__ == "HEAT"  # heat.yaml
    assert cli.model.predictor.encoder.heads == 2  # heat_two_heads.yaml
    assert cli.model.hparams["learning_rate"] == 1e-3  # heat_plus.yaml
    assert cli.datamodule.train_config.steps == 7
    assert cli.datamodule.train_config.num_homes == 3
    assert cli.datamodule.builder.config.belief
    assert cli.config.data.batch_size == 100  # paper.yaml
    assert cli.config.trainer.logger.init_args.save_dir == "runs"
    assert cli.config.trainer.logger.init_args.name == "heat_plus"
    assert "base" not in cli.config


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (
            ["--config", "heta.yaml"],
            "got 'heta.yaml'. Give a path, or a packaged config: any_home.yaml",
        ),
        (["--config", "heat.yaml", "--data.hauses", "3"], "--data.hauses"),
        (["--config", "heat.yaml", "--model.encoder.init_args.head", "3"], "head"),
        (["--config", "heat.yaml", "--model.encoder.init_args.heads", "3"], "got 3 heads for 64"),
        (["--config", "heat.yaml", "--data.num_homes", "0"], "num_homes must be at least 1, got 0"),
        (
            ["--config", "heat.yaml", "--model.encoder", "nep.paper.encoders.GAT"],
            "nep.paper.encoders.GAT",
        ),
        (["--base", "heat.yaml"], "--base must stand in a config file, got --base on the command"),
        (
            ["--data.num_workers", "4"],
            "data must be loaded by the training itself, got --data.num_w",
        ),
        (["--data.num-workers=4"], "--data.workers is of processes that collect"),
    ],
)
def test_bad_input_ends_with_a_message(args, message, folder, capsys):
    with pytest.raises(SystemExit) as exit_info:
        main(args)
    assert exit_info.value.code == 2
    assert message in capsys.readouterr().err
    assert not list(folder.iterdir())


def test_any_home_learns_from_what_people_ask_in_homes_of_four_kinds(folder):
    args = ["--config=any_home.yaml"]
    data = FitCLI(args, **find_classes(args)).datamodule
    configs = (data.train_config, *data.also_configs)
    assert {config.task for config in configs} == {"simulator.tasks.ask_anything:AskAnything"}
    assert {config.asked.task for config in configs} == {0.15}
    lived, hourly, mixed, _ = sources = [config.homes for config in configs]
    kinds = [LivedInSource, LivedInSource, MixtureSource, PaperSizesSource]
    assert [type(source) for source in sources] == kinds
    assert (lived.pace, hourly.pace) == ("minutes", "hours")
    assert mixed.mixture == Mixture(carrying_share=0.5, resettling_share=0.3, has_copies=True)
    assert len({tuple(source.labels) for source in sources}) == 1


def test_unknown_key_in_a_config_file_is_named(folder, capsys):
    (folder / "my.yaml").write_text(
        (CONFIG_FOLDER / "paper.yaml").read_text().replace("  num_homes:", "  num_hauses:")
    )
    with pytest.raises(SystemExit):
        main(["--config", "my.yaml"])
    assert "hauses" in capsys.readouterr().err


def test_a_base_that_is_no_packaged_config_is_named(folder, capsys):
    (folder / "my.yaml").write_text("base: hot.yaml\n")
    with pytest.raises(SystemExit):
        main(["--config", "my.yaml"])
    error = " ".join(capsys.readouterr().err.split())
    assert "base must be a packaged config, got 'hot.yaml' in my.yaml. Choose from: any" in error


def test_damaged_data_ends_with_a_message_that_names_the_file(folder, capsys):
    args = ["--config", "mlp.yaml", *SMALL]
    data = FitCLI(args).datamodule
    data.prepare_data()
    shard = next(Path(data.data_dir).rglob("home_000001.safetensors"))
    shard.write_bytes(shard.read_bytes()[:-10])
    with pytest.raises(SystemExit) as stop:
        main(args)
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert str(shard) in error
    assert "collect again" in error


def test_malformed_prior_names_its_row(folder, capsys):
    prior = json.loads(json.dumps(PriorGraph.default().to_dict()))
    prior["placements"][7]["prob"] = -1
    (folder / "bad.json").write_text(json.dumps(prior))
    with pytest.raises(SystemExit) as stop:
        main(["--config", "mlp.yaml", *SMALL, "--data.prior=bad.json"])
    assert stop.value.code == 2
    assert "placements[7]" in capsys.readouterr().err


def test_a_full_disk_leaves_the_last_checkpoint_and_one_line(folder, capsys, monkeypatch):
    """Checkpoints go through the writer of all files, not through the temporary folder."""
    main(["--config", "mlp.yaml", *SMALL])
    last = folder / "runs" / "mlp" / "version_0" / "checkpoints" / "last.ckpt"
    before = last.read_bytes()

    def fill(descriptor):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("sgm.files.os.fsync", fill)
    with pytest.raises(SystemExit, match=r"error: .*disk must take \d+ bytes.*(last|best)"):
        main(["--config", "mlp.yaml", *SMALL, "--data.num_homes=2"])
    assert last.read_bytes() == before
    assert not list(folder.rglob("*.part"))


OWN = '''
from datamodules.sgm_datamodule import SGMDataModule
from nep.paper.nep_module import NEPModule


class Model(NEPModule):
    """With an argument more."""

    def __init__(self, temper: float = 1.0, **kwargs):
        super().__init__(**kwargs)
        self.temper = temper


class Data(SGMDataModule):
    """With an argument more."""

    def __init__(self, note: str = "none", **kwargs):
        super().__init__(**kwargs)
        self.note = note
'''


def test_classes_of_ones_own_are_trained(folder, monkeypatch):
    (folder / "own_classes.py").write_text(OWN)
    monkeypatch.syspath_prepend(folder)
    cli = main(
        [
            "--model_class",
            "own_classes.Model",
            "--data_class=own_classes.Data",
            "--config",
            "mlp.yaml",
            *SMALL,
            "--model.temper=2",
            "--data.note=mine",
        ]
    )
    assert (cli.model.temper, cli.datamodule.note) == (2.0, "mine")
    with pytest.raises(SystemExit):
        main(["--data_class=own_classes.Model", "--config", "mlp.yaml"])


def test_rules_of_the_homes_are_options_and_are_recorded(folder):
    cli = main(
        [
            "--config",
            "mlp.yaml",
            *SMALL,
            "--data.home.furniture_per_room",
            "3",
            "--data.home.sensing",
            "partial_views",
            "--data.home.no-dynamic-nodes",
        ]
    )
    home = cli.datamodule.hparams["training"]["homes"]["home"]
    assert (home["furniture_per_room"], home["dynamic_nodes"]) == (3, False)
    assert home["sensing"]["name"] == "partial_views"
    with pytest.raises(SystemExit):
        main(["--config", "mlp.yaml", "--data.flats=3"])


def test_homes_of_8_16_and_32_places_are_trained_and_evaluated_together(folder):
    """By a source of one's own; no batch is padded, and every home is played."""

    class Mixed(SampledSource):
        def make(self, streams):
            sizes = [(2, 4, 8)[home % 3] for home in streams.homes]
            rules = [replace(self.home, furniture_per_room=size) for size in sizes]
            return SampledHomes(self.prior, rules, streams)

        def describe(self):
            return {**super().describe(), "source": "mixed"}

    data = SGMDataModule(
        homes=Mixed,
        data_dir="data",
        num_homes=3,
        steps=6,
        num_val_homes=3,
        workers=1,
    )
    module = NEPModule(MLP(units=8))
    trainer = Trainer(
        max_epochs=1,
        accelerator="cpu",
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    trainer.fit(module, datamodule=data)
    player = NEPPolicy(module, data.builder)
    source = data.val_config.homes
    scores = evaluate_policy(player.play_in, source, Streams(0, "val", range(3)), 5)
    assert scores.values.shape == (3, 5)
    assert np.isfinite(scores.confidence).all()
    assert source.make(Streams(0, "val", range(3))).home_num_furniture.tolist() == [8, 16, 32]


@pytest.mark.slow
def test_a_fast_run_collects_and_plays_little(folder):
    """`--trainer.fast_dev_run 2`: two batches of 100, and one home of two steps."""
    cli = main("--config heat.yaml --trainer.fast_dev_run 2 --threads 1".split())
    assert cli.trainer.global_step == 2
    assert (cli.datamodule.train_config.num_homes, cli.datamodule.val_config.num_homes) == (2, 2)
    online = next(c for c in cli.trainer.callbacks if type(c).__name__ == "OnlineEvaluation")
    assert (online.num_homes, online.steps, [*online.scores]) == (1, 2, ["NEP-HEAT"])
