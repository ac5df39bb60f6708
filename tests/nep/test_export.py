"""Exported folders: equal logits, no pickle, and every misfit said in words. What is shipped."""

import json
import os
import re
import subprocess
import zipfile
from pathlib import Path

import lightning.pytorch as pl
import numpy as np
import pytest
import torch
from safetensors.numpy import load_file, save_file

from datamodules.feature_config import FeatureConfig
from datamodules.sgm_datamodule import SGMDataModule
from nep import ObjectFinder
from nep.export import ExportConfig, main
from nep.paper.encoders import GCN, HEAT
from nep.paper.nep_module import NEPModule
from nep.paper.query_attention import AttentionConfig
from nep.players.checkpoints import load_config, load_trained
from nep.players.policy import NEPPolicy
from nep.report.model_card import REFERENCES, make_card
from sgm.network.shipped import PRETRAINED
from simulator import HomeConfig, PriorGraph, SampledHomes, Streams
from simulator.policies import make_policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.mixture.lived_in_homes import LivedInSource
from simulator.world.mixture.source import MixtureSource
from simulator.world.source import SampledSource

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[2]


def save_checkpoint(path: Path, encoder, **features) -> Path:
    """Write what Lightning writes for `nep.fit`, of a network that was not trained."""
    torch.manual_seed(0)
    module = NEPModule(encoder, attention=AttentionConfig(heads=4, dropout=0.2))
    data = SGMDataModule(
        data_dir=str(path.parent / "data"),
        features=FeatureConfig(**features),
    )
    content = {
        "pytorch-lightning_version": pl.__version__,
        "state_dict": module.state_dict(),
        "hyper_parameters": dict(module.hparams),
        "datamodule_hyper_parameters": dict(data.hparams),
    }
    torch.save(content, path)
    return path


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory) -> Path:
    torch.manual_seed(0)
    return save_checkpoint(tmp_path_factory.mktemp("run") / "last.ckpt", HEAT(units=16))


@pytest.fixture(scope="module")
def exported(checkpoint) -> Path:
    folder = checkpoint.parent / "exported"
    main([str(checkpoint), str(folder), "--num_homes=0"])
    return folder


@pytest.fixture
def folder(exported, tmp_path) -> Path:
    """A copy to spoil."""
    for file in exported.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    return tmp_path


def play_both(one: NEPPolicy, other: NEPPolicy) -> None:
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "test", range(3)))
    rollout = Rollout(homes, make_policy("bayesian", homes))
    for step in predict_locations(rollout, 6):
        scores = [policy.scores(rollout.memory, step.queries) for policy in (one, other)]
        assert np.array_equal(*scores)
        assert np.isfinite(scores[0]).any()


@pytest.mark.parametrize("encoder", [HEAT(units=16, heads=4), GCN(units=8)])
def test_logits_are_those_of_the_checkpoint(encoder, tmp_path):
    checkpoint = save_checkpoint(tmp_path / "last.ckpt", encoder, temporal=False)
    main([str(checkpoint), str(tmp_path / "out"), "--num_homes=0"])
    assert load_trained(tmp_path / "out").builder.config == FeatureConfig(temporal=False)
    play_both(NEPPolicy.load(checkpoint), NEPPolicy.load(tmp_path / "out"))


def test_weights_are_tensors_and_config_is_json(exported):
    assert sorted(file.name for file in exported.iterdir()) == [
        "MODEL_CARD.md",
        "config.json",
        "weights.safetensors",
    ]
    card = (exported / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert "Not measured: it was exported with `--num_homes=0`." in card
    weights = load_file(exported / "weights.safetensors")
    assert all(array.dtype == np.float32 for array in weights.values())
    config = json.loads((exported / "config.json").read_text(encoding="utf-8"))
    assert config["schema"]["feature_schema"] == 1
    assert config["schema"]["edge_types"][0] == ["house", "contains", "floor"]
    assert config["model"]["encoder"]["class_path"] == "nep.paper.encoders.heat.HEAT"


def test_reference_pages_name_the_files_of_an_exported_folder(exported):
    written = {file.name for file in exported.iterdir()} | {"network.onnx"}  # where it can be
    for page in ("files.md", "network.md"):
        lines = (ROOT / "docs" / "reference" / page).read_text(encoding="utf-8").split("\n")
        (about,) = [line for line in lines if line.startswith(("| `config.json`", "`config.json`"))]
        named = set(re.findall(r"`(\w+\.\w+)`", about)) - {"nep.export"}
        assert {"config.json", "weights.safetensors"} <= named <= written


def test_the_card_of_a_network_from_recorded_homes_claims_no_simulated_ones():
    config = load_config(PRETRAINED / "heat")
    simulated = " ".join(make_card("net", config).split())
    assert "No household of people, scripted or recorded, went into it." in simulated
    training = {**config["notes"]["training"], "is_recorded": True, "num_homes": 3, "steps": 80}
    config["notes"]["training"] = training
    card = " ".join(make_card("net", config).split())
    assert "Recorded homes (docs/traces.md): at most 40,000 memories of 3 homes" in card
    training["num_memories"] = 180  # the limit was 40,000, and there were 180
    card = " ".join(make_card("net", config).split())
    assert "Recorded homes (docs/traces.md): 180 memories of 3 homes x 80 time steps" in card
    for claim in ("No household", "one object in twenty", "had 32 places"):
        assert claim not in card


@pytest.mark.parametrize(
    ("source", "first", "test_homes"),
    [
        (SampledSource(), "first guesses among 32 places,", "simulated test homes x"),
        (
            SampledSource(home=HomeConfig(furniture_per_room=3)),
            "first guesses among 12 places,",
            "simulated test homes x",
        ),
        (MixtureSource(), "first guesses,", "test homes of a mixture x"),
        (LivedInSource(), "first guesses,", "test homes of a mixture x"),
    ],
    ids=["paper's", "small", "mixed", "lived in"],
)
def test_the_card_says_in_which_homes_was_measured(source, first, test_homes):
    config = load_config(PRETRAINED / "heat")
    config["notes"]["measured"] = {**config["notes"]["measured"], "source": source.describe()}
    card = " ".join(make_card("net", config).split())
    assert f"Share of right {first}" in card
    assert test_homes in card


@pytest.mark.parametrize(
    ("features", "sees"),
    [
        ({"clock": False}, "poses, people or the time of day"),  # of an older network
        ({"clock": True}, "poses or people"),
        ({"clock": False, "evidence": True, "evidence_without": []}, "poses or people"),
        (
            {"clock": False, "evidence": True, "evidence_without": ["hour", "hours", "week"]},
            "poses, people or the time of day",
        ),
    ],
)
def test_the_card_says_whether_it_reads_the_clock(features, sees):
    config = load_config(PRETRAINED / "heat")
    assert f"It does not see {sees}." in make_card("net", {**config, "features": features})


def test_a_small_export_says_what_it_measured(checkpoint, tmp_path, capsys):
    main([str(checkpoint), str(tmp_path / "net"), "--num_homes=2", "--steps=3", "--threads=1"])
    out = capsys.readouterr().out
    assert out.endswith("config.json, weights.safetensors, MODEL_CARD.md\n")
    assert out.startswith("Scores in 2 homes, 3 steps each. --num_homes 0 leaves it out")
    config = load_config(tmp_path / "net")
    measured = config["notes"]["measured"]
    assert (measured["homes"], measured["steps"]) == (2, 3)
    assert measured["after"].keys() == measured["before"].keys()
    assert measured["after"]["nll"] != measured["before"]["nll"]
    for scores in measured["scores"].values():
        assert set(scores) >= {"network", "bayesian", "ceiling"}
    card = (tmp_path / "net" / "MODEL_CARD.md").read_text(encoding="utf-8")
    # Nothing of the machine: the path was absolute, so that its name alone is left.
    assert "python -m nep.export last.ckpt net --num_homes=2 --steps=3 --seed=0" in card
    assert str(tmp_path) not in card
    assert (
        "all memories of 100 homes x 100 time steps, with the questions and looks of the task "
        "`predict_location`, collected by `bayesian`."
    ) in " ".join(card.split())
    assert f"| **net** | {measured['scores']['predict_location']['network']['mean']:.3f} |" in card
    assert isinstance(ObjectFinder.load(tmp_path / "net"), ObjectFinder)


def test_an_export_is_small_by_default():
    """Twelve games of 50 steps and one of searches, not of 100: a minute of training is no more."""
    assert ExportConfig().count_steps() == 50 * (1 + 2 * (len(REFERENCES) + 1)) == 650


def test_an_exported_network_is_exported_anew(exported, checkpoint, tmp_path):
    """Weights and where they are from stay; the command is the one that was run."""
    out = tmp_path / "again"
    main([str(exported), str(out), "--num_homes=0"])
    weights = [(folder / "weights.safetensors").read_bytes() for folder in (exported, out)]
    assert weights[0] == weights[1]
    notes = [load_config(folder)["notes"] for folder in (exported, out)]
    assert notes[1]["checkpoint_sha256"] == notes[0]["checkpoint_sha256"]
    assert notes[1]["training"] == notes[0]["training"]
    assert notes[1]["command"] == (
        "python -m nep.export exported again --num_homes=0 --steps=50 --seed=0"
    )


def edit(folder: Path, *path: str, value) -> None:
    config = json.loads((folder / "config.json").read_text(encoding="utf-8"))
    part = config
    for step in path[:-1]:
        part = part[step]
    part[path[-1]] = value
    (folder / "config.json").write_text(json.dumps(config), encoding="utf-8")


@pytest.mark.parametrize(
    ("path", "value", "message"),
    [
        (["schema", "feature_schema"], 7, r"must have feature schema \d+, got 7 for .*Train again"),
        (["schema", "edge_feature_dim"], 8, r"edge_feature_dim of the exported schema must be 9"),
        (["schema", "edge_types"], [], r"edge_types of the exported schema must be .*got \[\]"),
        (["schema", "text"], "fr_maison-2", r"text vectors must be 'fr_maison-2', got en_househ"),
        (["schema"], None, r"config\.json must be as nep\.export wrote it, got TypeError"),
        (["version"], 3, r"exported folder's version must be 1, got 3 in .*Make it again"),
        (["format"], "cake", r"config\.json must be as nep\.export wrote it, got ValueError"),
        (["features"], {"smell": True}, r"must be one that nep\.export wrote, got TypeError"),
        (["model", "encoder", "class_path"], "os.path", r"encoder must be one of nep\.paper\.enc"),
        (["model", "transformer"], False, r"weights must be those of the network, got 'predictor"),
        (["model"], "x", r"must be one that nep\.export wrote, got AttributeError"),
    ],
)
def test_another_schema_or_config_is_refused(folder, path, value, message):
    edit(folder, *path, value=value)
    with pytest.raises(ValueError, match=message):
        ObjectFinder.load(folder)


@pytest.mark.parametrize("name", ["feature_schema", "node_types", "text"])
def test_messages_repeat_no_more_than_200_characters_of_a_value(folder, name):
    edit(folder, "schema", name, value="x" * 5000)
    with pytest.raises(ValueError, match=name.split("_")[0]) as caught:
        ObjectFinder.load(folder)
    assert "xxx" in str(caught.value)
    assert "x" * 201 not in str(caught.value)


def test_a_checkpoint_whose_names_are_no_text_is_refused(tmp_path):
    path = tmp_path / "last.ckpt"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("café", "")
    path.write_bytes(path.read_bytes().replace("é".encode(), b"\xff\xff"))
    with pytest.raises(
        ValueError, match=r"must be one that nep\.fit wrote, got 'utf-8' codec .* for"
    ):
        load_trained(path)


def test_missing_and_damaged_files_are_named(folder):
    whole = (folder / "weights.safetensors").read_bytes()
    (folder / "weights.safetensors").write_bytes(whole[:-100])
    with pytest.raises(ValueError, match=r"must be one that nep\.export wrote, got SafetensorErr"):
        ObjectFinder.load(folder)
    (folder / "weights.safetensors").unlink()
    with pytest.raises(ValueError, match=r"exported folder must have weights\.safetensors"):
        ObjectFinder.load(folder)
    (folder / "config.json").write_text("{", encoding="utf-8")
    with pytest.raises(ValueError, match=r"config\.json must be as nep\.export wrote it"):
        ObjectFinder.load(folder)
    (folder / "config.json").unlink()
    with pytest.raises(ValueError, match=r"exported folder must have config\.json"):
        ObjectFinder.load(folder)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["none.ckpt", "out"],
            "checkpoint must be a file that can be read, an exported folder or one",
        ),
        (["CKPT", "out", "--num_homes=-1"], "homes must be at least 0, got -1"),
        (["CKPT", "out", "--steps=0"], "steps must be at least 1, got 0"),
        (["CKPT", "out", "--threads=0"], "threads must be at least 1, got 0"),
        (["CKPT", "CKPT", "--num_homes=0"], "File exists"),
    ],
)
def test_a_wrong_command_ends_with_its_message(checkpoint, options, message, capsys, tmp_path):
    options = [str(checkpoint) if option == "CKPT" else option for option in options]
    options = [str(tmp_path / option) if option == "out" else option for option in options]
    with pytest.raises(SystemExit):
        main(options)
    error = capsys.readouterr().err
    assert message in error
    assert "Traceback" not in error


@pytest.mark.parametrize("folder", sorted(PRETRAINED.glob("*/")), ids=lambda folder: folder.name)
def test_what_is_shipped_is_small_measured_and_described(folder):
    if not (folder / "config.json").is_file():
        pytest.skip("no network")
    assert sum(file.stat().st_size for file in folder.iterdir()) < 2_100_000
    config = load_config(folder)
    card = (folder / "MODEL_CARD.md").read_text(encoding="utf-8")
    assert card == make_card(folder.name, config)
    measured = config["notes"]["measured"]
    assert measured["homes"] >= 100
    assert measured["after"]["ece"] < 0.5 * measured["before"]["ece"]
    assert measured["after"]["ece_elsewhere"] < 0.05
    first_guesses, looks = (
        {name: own["mean"] for name, own in measured["scores"][task].items()}
        for task in ("predict_location", "find_object")
    )
    assert first_guesses["bayesian"] < first_guesses["network"] < first_guesses["ceiling"]
    assert looks["bayesian"] > looks["network"] > looks["ceiling"]
    assert NEPPolicy.load(folder.name)


@pytest.mark.parametrize("kind", ["checkpoint", "folder"])
def test_no_file_makes_us_import_a_module(kind, checkpoint, folder, monkeypatch):
    """What a file names as its encoder is looked for among the classes that are loaded."""
    (folder / "stolen_code.py").write_text("raise SystemExit('imported')")
    monkeypatch.chdir(folder)
    monkeypatch.syspath_prepend(folder)
    source = folder
    if kind == "checkpoint":
        content = torch.load(checkpoint, weights_only=True)
        content["hyper_parameters"]["encoder"]["class_path"] = "stolen_code.X"
        source = folder / "altered.ckpt"
        torch.save(content, source)
    else:
        config = json.loads((folder / "config.json").read_text())
        config["model"]["encoder"]["class_path"] = "stolen_code.X"
        (folder / "config.json").write_text(json.dumps(config))
    with pytest.raises(ValueError, match=r"encoder must be one of .*HEAT.*got 'stolen_code\.X'"):
        ObjectFinder.load(source)


def test_weights_of_another_export_are_refused(folder, tmp_path_factory):
    """As an export leaves them that was interrupted between its two files."""
    other = save_checkpoint(tmp_path_factory.mktemp("other") / "last.ckpt", HEAT(units=16))
    main([str(other), str(other.parent / "net"), "--num_homes=0"])
    weights = load_file(other.parent / "net" / "weights.safetensors")
    name = next(iter(weights))
    save_file({**weights, name: weights[name] + 1}, folder / "weights.safetensors")
    with pytest.raises(
        ValueError, match=r"must be those of config\.json, got others .*Export again"
    ):
        load_trained(folder)


def test_an_encoder_of_ones_own_is_named_by_the_caller(tmp_path, monkeypatch, python):
    """In a process that has not imported it: refused without --encoders."""
    (tmp_path / "own_encoder.py").write_text(
        "from nep.paper.encoders import GCN\n\n\nclass Mine(GCN):\n    pass\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    from own_encoder import Mine

    own = save_checkpoint(tmp_path / "last.ckpt", Mine(units=8))
    command = [
        python,
        "-m",
        "nep.evaluate",
        "--checkpoint",
        f"mine={own}",
        "--policies",
        "none",
        "--tasks",
        "predict_location",
        "--num_homes",
        "1",
        "--steps",
        "2",
        "--out",
        "out",
    ]
    environment = {**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{ROOT}"}
    results = [
        subprocess.run(
            [*command, *more],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        for more in ((), ("--encoders", "own_encoder"))
    ]
    assert results[0].returncode == 2
    assert "name it by --encoders" in results[0].stderr
    assert results[1].returncode == 0, results[1].stderr
    assert "mine" in results[1].stdout
