"""`python -m nep.evaluate`: what it writes, that it repeats, and what it refuses."""

import csv
import hashlib
import json
import re
import sys

import numpy as np
import pytest
import torch

from nep.evaluate import EvaluateConfig, describe_made, main
from nep.export import main as export
from nep.fit import main as fit
from nep.players.checkpoints import WEIGHTS
from nep.players.contestants import Checkpoint
from nep.report.results import describe_code
from sgm.files import compute_checksum
from simulator.policies import POLICIES
from simulator.tasks.registry import TASKS

pytestmark = pytest.mark.slow

SMALL = ["--num_homes", "2", "--steps", "4"]


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    """An NEP-MLP that was trained for one epoch."""
    folder = tmp_path_factory.mktemp("fit")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        fit(
            (
                "--config mlp.yaml --trainer.max_epochs=1 --data.num_homes=2 --data.steps=6 "
                "--data.num_val_homes=1 --data.batch_size=8 --data.workers=1 --online.num_homes=1 "
                "--online.steps=2 --trainer.log_every_n_steps=1 "
                "--trainer.enable_progress_bar=false"
            ).split()
        )
    return folder / "runs" / "mlp" / "version_0" / "checkpoints" / "last.ckpt"


def read(folder):
    return json.loads((folder / "results.json").read_text())


def test_all_tasks_and_policies(tmp_path, checkpoint, capsys):
    out = tmp_path / "out"
    main(["--out", str(out), *SMALL, "--checkpoint", f"NEP-MLP={checkpoint}"])
    assert {path.name for path in out.iterdir()} == {
        "results.json",
        "table.md",
        "table.csv",
        *(f"{task}_over_steps.png" for task in TASKS),
    }
    results = read(out)
    assert list(results["tasks"]) == list(TASKS)
    for task in results["tasks"].values():
        assert set(task["policies"]) == {*POLICIES, "NEP-MLP"}
        for row in task["policies"].values():
            assert np.shape(row["values"]) == (2, 4)
            assert row["mean"] == pytest.approx(np.mean(row["values"]), abs=1e-6)
    assert results["config"]["num_homes"] == 2
    assert results["config"]["homes"]["home"]["dynamic_nodes"]
    assert len(results["config"]["homes"]["prior"]) == 64
    assert results["config"]["checkpoints"][0]["name"] == "NEP-MLP"
    assert len(results["config"]["checkpoints"][0]["sha256"]) == 64
    build = results["versions"]["torch"]  # without the "+cpu" or "+cu130" of a build
    assert build.partition("+")[0] == torch.__version__.partition("+")[0]
    assert results["command"].startswith("python -m nep.evaluate --out ")
    text = capsys.readouterr().out
    for task in TASKS.values():  # a title is as wide as its table
        title = f"{task.title}, dynamic nodes on, 2 test homes x 4 steps"
        assert title in " ".join(text.split())
    assert "2 homes are too few for intervals." in text
    assert "NEP-MLP" in text
    assert "gap closed" not in text  # of the files alone
    table = (out / "table.md").read_text(encoding="utf-8")
    assert re.search(r"\| ceiling \| .* \| 100% \|", table)


def test_the_same_seed_gives_the_same_files(tmp_path, checkpoint):
    arguments = [
        *SMALL,
        "--tasks",
        "predict_location",
        "find_object",
        "--policies",
        "bayesian",
        "ceiling",
        "--checkpoint",
        str(checkpoint),
    ]
    for name in ("a", "b"):
        main(["--out", str(tmp_path / name), *arguments])
    for name in ("table.csv", "predict_location_over_steps.png"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()
    assert read(tmp_path / "a")["tasks"] == read(tmp_path / "b")["tasks"]
    main(["--out", str(tmp_path / "c"), *arguments, "--seed", "1"])
    assert read(tmp_path / "a")["tasks"] != read(tmp_path / "c")["tasks"]


def test_differences_are_from_what_is_named(tmp_path, checkpoint):
    """Home by home, in the table and in the file of numbers."""
    out = tmp_path / "scores"
    players = ["--policies", "bayesian", "random", "--checkpoint", f"mine={checkpoint}"]
    tasks = ["--tasks", "find_object"]
    main(["--out", str(out), *SMALL, *tasks, *players, "--minus", "mine", "random"])
    values = {
        name: np.mean(player["values"], axis=1)
        for name, player in read(out)["tasks"]["find_object"]["policies"].items()
    }
    with (out / "table.csv").open() as file:
        rows = {row["policy"]: row for row in csv.DictReader(file)}
    assert float(rows["bayesian"]["minus_mine"]) == pytest.approx(
        np.mean(values["bayesian"] - values["mine"])
    )
    assert rows["mine"]["minus_mine"] == ""
    assert "minus_bayesian" not in rows["mine"]
    assert "| minus mine | minus random |" in (out / "table.md").read_text(encoding="utf-8")


def test_what_is_played_beside_it_changes_nothing(tmp_path, checkpoint):
    """Neither other tasks and policies, nor how many homes there are."""
    main(
        [
            "--out",
            str(tmp_path / "a"),
            *SMALL,
            "--policies",
            "random",
            "myopic",
            "--checkpoint",
            f"N={checkpoint}",
        ]
    )
    main(
        [
            "--out",
            str(tmp_path / "b"),
            "--num_homes",
            "3",
            "--steps",
            "4",
            "--policies",
            "myopic",
            "--tasks",
            "find_object",
            "--checkpoint",
            f"N={checkpoint}",
        ]
    )
    for name in ("myopic", "N"):
        first, second = (
            read(tmp_path / folder)["tasks"]["find_object"]["policies"][name]["values"]
            for folder in ("a", "b")
        )
        assert first == second[:2]


def test_workers_share_the_homes_out(tmp_path, checkpoint, python, monkeypatch):
    """Every policy and network gets the same scores, to the last digit."""
    monkeypatch.setattr(sys, "executable", python)  # what joblib starts
    arguments = [
        "--num_homes",
        "4",
        "--steps",
        "4",
        "--tasks",
        "predict_location",
        "find_object",
        "--policies",
        "bayesian",
        "home_filter",
        "ceiling",
        "--threads",
        "1",
        "--checkpoint",
        f"N={checkpoint}",
        "--checkpoint",
        "heat",
    ]
    tables = []
    for name, workers in (("alone", "1"), ("shared", "2")):
        main(["--out", str(tmp_path / name), *arguments, "--workers", workers])
        tables.append(read(tmp_path / name)["tasks"])
    assert tables[0] == tables[1]


def test_a_checkpoint_for_one_task_and_other_rules(tmp_path, checkpoint):
    main(
        [
            "--out",
            str(tmp_path),
            *SMALL,
            "--policies",
            "none",
            "--home.no-dynamic-nodes",
            "--tasks",
            "predict_location",
            "find_object",
            "--split",
            "val",
            "--checkpoint",
            f"N@find_object={checkpoint}",
            "--checkpoint",
            f"N@predict_location={checkpoint}",
            "--checkpoint",
            f"only@find_object={checkpoint}",
        ]
    )
    results = read(tmp_path)
    assert set(results["tasks"]["find_object"]["policies"]) == {"N", "only"}
    assert set(results["tasks"]["predict_location"]["policies"]) == {"N"}
    assert not results["config"]["homes"]["home"]["dynamic_nodes"]
    assert "dynamic nodes off, 2 val homes x 4 steps" in (tmp_path / "table.md").read_text()


def test_names_of_checkpoints(checkpoint, tmp_path):
    bare = Checkpoint.parse(str(checkpoint))
    assert (bare.name, bare.path, bare.task) == ("mlp/version_0", checkpoint, None)
    odd = tmp_path / "a=b.ckpt"
    odd.write_bytes(b"")
    assert Checkpoint.parse(str(odd)).path == odd
    one = Checkpoint.parse(f"my net@find_object={checkpoint}")
    assert (one.name, one.task) == ("my net", "find_object")
    assert Checkpoint.parse("heat").name == "heat"
    assert Checkpoint.parse("ours=heat").path == Checkpoint.parse("heat").path
    for text in ("=heat", "ours=", "@find_object=heat"):
        with pytest.raises(ValueError, match=r"checkpoint must be .*NAME.*=SOURCE, got"):
            Checkpoint.parse(text)


def test_exported_and_shipped_networks_play_like_their_checkpoint(checkpoint, tmp_path):
    exported = tmp_path / "exported"
    export([str(checkpoint), str(exported), "--num_homes", "0"])
    main(
        [
            "--out",
            str(tmp_path),
            *SMALL,
            "--policies",
            "none",
            "--tasks",
            "predict_location",
            "--checkpoint",
            f"A={checkpoint}",
            "--checkpoint",
            str(exported),
            "--checkpoint",
            "heat",
        ]
    )
    results = read(tmp_path)
    played = results["tasks"]["predict_location"]["policies"]
    assert played["A"]["values"] == played["exported"]["values"]
    assert len(played) == 3
    weights = (exported / WEIGHTS).read_bytes()
    described = {entry["name"]: entry for entry in results["config"]["checkpoints"]}
    assert described["exported"]["sha256"] == hashlib.sha256(weights).hexdigest()
    assert described["heat"]["path"] == "heat"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--tasks", "dance"], "task must be one of predict_location, .*, got 'dance'. Choose"),
        (["--policies", "clever"], "policy must be one of random, .*, got 'clever'. Choose"),
        (["--policies", "random", "random"], "policies must differ, got random, random. Name"),
        (["--policies", "none"], "a policy must play predict_location, got no policy"),
        (["--num_homes", "0"], "num_homes must be at least 1, got 0. Raise it."),
        (["--steps", "-1"], "steps must be at least 1, got -1. Raise it."),
        (["--seed", "-1"], "seed must be non-negative, got -1. Choose 0 or more."),
        (["--workers", "0"], "workers must be at least 1, got 0. Raise it"),
        (["--backend", "spark"], "backend must be one of processes, ray, got 'spark'. Choose"),
        (["--threads", "0"], "threads must be at least 1, got 0. Raise it."),
        (["--split", "all"], "split must be one of train, val, test, got 'all'"),
        (
            ["--prior", "no.json"],
            "prior must be default or household, or a file that can be read, got 'No such file",
        ),
        (
            ["--checkpoint", "no.ckpt"],
            "an exported folder or one of any_home, heat, got 'no.ckpt'. Train",
        ),
        (["--checkpoint", "a@dance=no.ckpt"], "task must be one of .*, got 'dance'"),
        (["--policies", "random", "--minus", "heat"], "minus must name what plays, got 'heat'"),
    ],
)
def test_bad_input_ends_with_a_message(tmp_path, capsys, arguments, message):
    refuse(tmp_path, capsys, arguments, message)


def refuse(tmp_path, capsys, arguments, message):
    """Nothing may be written, and argparse's exit status is 2."""
    with pytest.raises(SystemExit) as stop:
        main(["--out", str(tmp_path / "out"), *SMALL, *arguments])
    assert stop.value.code == 2
    assert re.search(message, " ".join(capsys.readouterr().err.split()))
    assert not (tmp_path / "out").exists()


def mean_by_home(scores):
    return scores.values.mean(axis=1)


def test_a_metric_that_is_no_number_is_refused_before_anything_is_played(tmp_path, capsys):
    arguments = ["--metrics", f"{__name__}:mean_by_home", "--num_homes", "2", "--steps", "2"]
    message = r"metric must return a number for all homes together, got .* of .*mean_by_home\. "
    refuse(tmp_path, capsys, arguments, message)
    assert not list(tmp_path.iterdir())


def test_results_of_another_command_are_kept(tmp_path, capsys):
    size = ["--num_homes", "1", "--steps", "1", "--tasks", "predict_location"]
    first = ["--out", str(tmp_path), *size, "--policies", "random"]
    main(first)
    before = (tmp_path / "results.json").read_bytes()
    with pytest.raises(SystemExit) as left:
        main(["--out", str(tmp_path), *size, "--policies", "bayesian"])
    assert left.value.code == 2
    error = capsys.readouterr().err
    assert "out must not hold other results" in error
    assert "--policies random" in error
    main(first)  # the same again
    assert (tmp_path / "results.json").read_bytes() == before


def test_checkpoints_that_do_not_fit_are_refused(tmp_path, capsys, checkpoint):
    clash = ["--checkpoint", f"bayesian={checkpoint}"]
    refuse(tmp_path, capsys, clash, "names of checkpoints must differ .* got 'bayesian' twice")
    twice = ["--checkpoint", f"N={checkpoint}", "--checkpoint", f"N@find_object={checkpoint}"]
    refuse(tmp_path, capsys, twice, "got 'N' twice for find_object")

    other = tmp_path / "other.ckpt"
    content = torch.load(checkpoint, weights_only=True)
    content["datamodule_hyper_parameters"]["feature_schema"] = 2
    torch.save(content, other)
    message = r"must have feature schema 1, got 2 for .*other\.ckpt\. Train again"
    refuse(tmp_path, capsys, ["--checkpoint", str(other)], message)

    content["datamodule_hyper_parameters"]["feature_schema"] = 1
    content["datamodule_hyper_parameters"]["features"]["smell"] = True
    torch.save(content, other)
    message = r"must be one that nep\.fit wrote, got TypeError for .*other\.ckpt"
    refuse(tmp_path, capsys, ["--checkpoint", str(other)], message)
    other.write_bytes(b"")
    refuse(tmp_path, capsys, ["--checkpoint", str(other)], r"must be one that nep\.fit wrote")


def test_the_table_says_with_what_it_was_made(tmp_path, checkpoint):
    size = ["--num_homes", "2", "--steps", "2", "--tasks", "predict_location"]
    main(
        ["--out", str(tmp_path), *size, "--policies", "random", "--checkpoint", f"net={checkpoint}"]
    )
    text = (tmp_path / "table.md").read_text(encoding="utf-8")
    assert f"- Played with {describe_code()}." in text
    assert f"- Network `net`: SHA-256 `{compute_checksum(checkpoint)}`." in text
    assert "Test homes" not in text  # two homes of two steps have no name
    config = EvaluateConfig(num_homes=100, steps=100)
    assert "- Test homes: `paper-32-on-v1`" in describe_made(config)
