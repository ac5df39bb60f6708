"""Contents of files and options that nobody wrote on purpose: each is one error with its place."""

import json
import os
import sqlite3
from collections import OrderedDict
from contextlib import closing
from datetime import datetime, timezone

import pytest
import torch

from datamodules.batch_builder import BatchBuilder
from datamodules.feature_config import FeatureConfig
from nep.export import main as export
from nep.fit import main as fit
from nep.importers.homer import read_homer
from nep.paper.encoders import MLP
from nep.paper.nep_module import NEPModule
from nep.players.checkpoints import TrainedModel, checksum_trained, load_trained, save_exported
from nep.players.contestants import Checkpoint
from nep.players.stored_network import import_encoders
from sgm.memory.memory_event import read_events
from sgm.store.event import StoredEvent, insert_event
from simulator import Clock, SceneGraphMemory
from simulator.policies import find_policy
from tools.priors.procthor_houses import count_procthor_houses

DEEP = "[" * 50_000 + "]" * 50_000


def make_model(seed: int) -> TrainedModel:
    torch.manual_seed(seed)
    return TrainedModel(NEPModule(MLP(units=8)), BatchBuilder(FeatureConfig()))


@pytest.mark.parametrize("name", [".:", "..x:y", ":x", "..:", "os.:y", "os:system", "json:loads"])
def test_odd_names_of_policies_are_refused(name):
    with pytest.raises(ValueError, match=r"policy must be .*got '"):
        find_policy(name)


@pytest.mark.parametrize("name", ["..", ".", "", "..x"])
def test_odd_names_of_encoders_are_refused(name):
    with pytest.raises(ValueError, match="encoders must be modules that can be imported, got '"):
        import_encoders([name])


@pytest.mark.parametrize(
    ("kind", "arguments"),
    [
        ("look", DEEP),
        ("look", '{"furniture": 0, "seen": [], "coverage": %s}' % ("9" * 400)),
        ("look", '{"furniture": 0, "seen": [], "coverage": 1e999}'),
        ("step", '{"num_steps": 1, "num_steps": 2}'),
        ("step", "no JSON"),
    ],
)
def test_odd_events_of_a_memory_file_are_refused_by_number(kind, arguments, tmp_path):
    path = tmp_path / "looks.sgm"
    SceneGraphMemory(path=path).close()
    with closing(sqlite3.connect(path)) as connection, connection:
        insert_event(connection, StoredEvent(1, 0, kind, arguments, None))
    with pytest.raises(ValueError, match=r"event 1 of a memory file must be .*looks\.sgm"):
        read_events(path)


def test_odd_houses_are_refused_by_name(tmp_path):
    (tmp_path / "houses.jsonl").write_text(f"{DEEP}\n")
    with pytest.raises(ValueError, match=r"one line of JSON, got .*too deeply at houses\.jsonl:1"):
        count_procthor_houses(tmp_path / "houses.jsonl")


def test_a_time_zone_is_refused():
    memory = SceneGraphMemory(clock=Clock(datetime(2024, 5, 6), 3600))
    with pytest.raises(ValueError, match=r"local time, got the time zone of 2024.*Leave the zone"):
        memory.step_to(datetime(2024, 5, 7, tzinfo=timezone.utc))


@pytest.mark.parametrize(
    "edges",
    [
        torch.zeros(2, 3, 3, requires_grad=True),
        torch.zeros(2, 3, 3, dtype=torch.bfloat16),
        torch.zeros(2, 3, 3).to_sparse(),
        torch.zeros(2, 3, 3, dtype=torch.complex64),
        "edges",
        [["a"]],
        None,
        {},
    ],
    ids=["gradient", "bfloat16", "sparse", "complex", "text", "list", "none", "dictionary"],
)
@pytest.mark.parametrize("kind", ["homer", "homer plus"])
@pytest.mark.filterwarnings("ignore:Casting complex")
def test_odd_days_of_homer_are_refused_by_name(kind, edges, tmp_path):
    (tmp_path / "train").mkdir()
    times = torch.tensor([1, 2])
    day = [edges, 0, 0, times]
    if kind == "homer":
        common = {"node_classes": list("abc"), "node_categories": ["Rooms"] * 3}
        (tmp_path / "common_data.json").write_text(json.dumps(common))
    else:
        day = {"edges": edges, "times": times, "class_names": ["home", "a", "b"]}
    torch.save(day, tmp_path / "train" / "000.pt")
    with pytest.raises(ValueError, match=r"000\.pt|household must hold an object at a place"):
        read_homer(tmp_path)


@pytest.mark.parametrize(
    "change",
    [
        {"class_names": 5},
        {"class_names": "home"},
        {"times": torch.tensor([float("nan"), 1])},
        {"times": 5},
        {"times": None},
        {"times": torch.tensor([])},
    ],
    ids=str,
)
def test_odd_dictionaries_of_homer_are_refused_by_name(change, tmp_path):
    (tmp_path / "train").mkdir()
    day = {
        "edges": torch.zeros(2, 1, 1),
        "times": torch.tensor([1, 2]),
        "class_names": ["home"],
    }
    torch.save(day | change, tmp_path / "train" / "000.pt")
    with pytest.raises(ValueError, match=r"000\.pt"):
        read_homer(tmp_path)


@pytest.mark.parametrize(
    ("part", "value"),
    [
        ("model", {"learning_rate": 10**400}),
        ("model", {"dropout": 10**400}),
        ("features", {"text_pipeline": 10**400}),
    ],
)
def test_huge_numbers_of_an_export_are_refused(part, value, tmp_path):
    save_exported(tmp_path, make_model(0), {})
    config = json.loads((tmp_path / "config.json").read_text())
    config[part] = (config[part] or {}) | value
    (tmp_path / "config.json").write_text(json.dumps(config))
    with pytest.raises(ValueError, match="got"):
        load_trained(tmp_path)


@pytest.mark.parametrize("notes", [{}, {"training": {}}, {"training": 3}, None, [1]])
def test_an_export_without_notes_is_not_exported_again(notes, tmp_path, capsys):
    save_exported(tmp_path / "old", make_model(0), notes)
    with pytest.raises(SystemExit):
        export([str(tmp_path / "old"), str(tmp_path / "new"), "--num_homes=0"])
    error = capsys.readouterr().err
    assert "notes of config.json must have checkpoint_sha256 and training, got" in error
    assert not (tmp_path / "new").exists()


@pytest.mark.parametrize("stop", range(1, 7))
def test_an_export_that_is_stopped_leaves_a_network_that_loads(stop, tmp_path, monkeypatch):
    """Stopped at the first, second, ... change of the folder: the old network, or the new one."""
    old, new = make_model(0), make_model(1)
    save_exported(tmp_path / "net", old, {})
    done = []

    def change(original):
        def wrapped(*arguments):
            done.append(original)
            if len(done) == stop:
                raise KeyboardInterrupt
            return original(*arguments)

        return wrapped

    monkeypatch.setattr("sgm.files.os.fsync", change(os.fsync))
    monkeypatch.setattr("pathlib.Path.replace", change(os.replace))
    try:
        save_exported(tmp_path / "net", new, {})
        is_stopped = False
    except KeyboardInterrupt:
        is_stopped = True
    monkeypatch.undo()
    assert is_stopped == (stop <= 5)  # each of two files is flushed and renamed, weights again
    found = load_trained(tmp_path / "net").module.state_dict()
    assert any(
        all(torch.equal(found[name], tensor) for name, tensor in model.module.state_dict().items())
        for model in ((old, new) if is_stopped else (new,))
    )
    assert len(checksum_trained(tmp_path / "net")) == 64
    assert Checkpoint.parse(f"net={tmp_path / 'net'}").describe()["name"] == "net"
    save_exported(tmp_path / "net", new, {})  # the next one ends what was begun
    assert sorted(os.listdir(tmp_path / "net")) == ["config.json", "weights.safetensors"]


@pytest.mark.parametrize(
    "change",
    [
        {"loops": {"fit_loop": 3}},
        {"loops": 5},
        {"optimizer_states": [{"state": 3}]},
        {"optimizer_states": [5]},
        {"lr_schedulers": [1, 2]},
        {"epoch": "x"},
        {"global_step": None, "loops": None},
        {"callbacks": 7},
        {"pytorch-lightning_version": 8},
    ],
    ids=str,
)
def test_an_odd_state_to_go_on_from_is_refused(change, tmp_path, monkeypatch, capsys, small_run):
    content = torch.load(small_run, weights_only=True)
    path = tmp_path / "odd.ckpt"
    torch.save({**content, **change}, path)
    monkeypatch.chdir(small_run.parent)
    with pytest.raises(SystemExit) as stop:
        fit([*SMALL, f"--ckpt_path={path}", "--trainer.max_epochs=2"])
    error = f"{stop.value.code} {capsys.readouterr().err}"
    assert "odd.ckpt" in error
    assert len(error) < 1500


SMALL = (
    "--config=mlp.yaml --data.num_homes=2 --data.num_val_homes=1 --data.steps=3 "
    "--online.num_homes=1 --online.steps=2 --trainer.enable_progress_bar=false "
    "--trainer.logger=false --trainer.enable_model_summary=false --data.data_dir=data"
).split()


@pytest.fixture(scope="module")
def small_run(tmp_path_factory):
    """Checkpoint of a training of one epoch."""
    folder = tmp_path_factory.mktemp("run")
    before = os.getcwd()
    os.chdir(folder)
    try:
        cli = fit([*SMALL, "--trainer.max_epochs=1"])
        cli.trainer.save_checkpoint(folder / "good.ckpt")
    finally:
        os.chdir(before)
    assert isinstance(cli.model.state_dict(), OrderedDict)
    return folder / "good.ckpt"
