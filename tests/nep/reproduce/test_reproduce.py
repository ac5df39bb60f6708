"""`python -m nep.reproduce`, shrunk: whole, resumed, repeated, refused."""

import json
import os
import re
import shutil
import subprocess
import time
from functools import partial
from pathlib import Path

import pytest
import torch
from filelock import FileLock

from nep.fit import FitCLI
from nep.games.play_all import list_missing, play_all
from nep.players.checkpoints import load_exported
from nep.players.contestants import list_contestants
from nep.reproduce.__main__ import Options, main, make_parser
from nep.reproduce.__main__ import make_plan as make_plan_of
from nep.reproduce.experiments import (
    ABLATION_SETTING,
    SETTINGS,
    Setting,
    enter,
    find_models,
)
from nep.reproduce.job_stages import _THREAD_VARIABLES, LOCK
from nep.reproduce.plan import SCORES
from nep.reproduce.training import Training
from simulator.command_line import parse, pick
from simulator.policies import POLICIES

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("python")]

ROOT = Path(__file__).resolve().parents[3]
TINY = ["--tiny", "--models", "mlp", "--workers", "2"]


def list_folders(folder: Path) -> list[str]:
    return [option for name in ("out", "runs", "data") for option in (f"--{name}", folder / name)]


def reproduce(folder: Path, *options: str) -> None:
    main([*TINY, *map(str, list_folders(folder)), *options])


def make_plan(folder: Path, *options: str):
    arguments = [*TINY, *map(str, list_folders(folder)), *options]
    return make_plan_of(Options(**pick(parse(make_parser(), arguments), Options)))


def list_jobs(plan):
    """The jobs of all stages, in order."""
    return [job for stage in plan.plan_stages() for job in stage]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, python):
    """A whole tiny Table 1."""
    folder = tmp_path_factory.mktemp("reproduce")
    reproduce(folder, "--table", "1")
    return folder


def list_plays(plan) -> list[str]:
    """Who has still to play, of networks that are trained and policies."""
    trained = plan.list_trained()
    players = partial(plan.list_players, trained=trained)
    missing = list_missing(plan.list_games(), players, plan.load_cache())
    return [f"{game.setting.name} {who}" for _, game, part in missing for who in part]


def read_scores(folder: Path, plan, setting=ABLATION_SETTING):
    """What all have scored in a setting, by name."""
    stored = json.loads((folder / "runs" / SCORES).read_text())
    return stored["scores"][plan.make_game(setting).name]


def read_times(folder: Path) -> dict[str, int]:
    return {
        str(path): path.stat().st_mtime_ns
        for path in (folder / "runs").rglob("*")
        if path.is_file() and path.suffix in (".json", ".ckpt")
    }


def test_table_1_has_every_cell(folder):
    assert {path.name for path in (folder / "out").iterdir()} == {
        "table_1.md",
        "table_1.csv",
        "table_1.json",
        "table_1.png",
    }
    stored = json.loads((folder / "out" / "table_1.json").read_text())
    assert list(stored["settings"]) == [setting.name for setting in SETTINGS]
    for rows in stored["settings"].values():
        assert set(rows) == {*POLICIES, "NEP-MLP"}
    text = (folder / "out" / "table_1.md").read_text(encoding="utf-8")
    assert "python -m nep.reproduce --table 1 --seed 0 --models mlp --tiny" in text
    assert str(folder) not in text


def test_stored_scores_are_those_of_the_checkpoint(folder, tmp_path, python):
    """The same network that `nep.evaluate` is given scores the same.

    In a process with the environment of a job: where sums are rounded otherwise, as they are with
    another number of threads, near ties of a network that has hardly learnt anything turn round.
    """
    checkpoint = folder / "runs" / "find_object-off" / "mlp" / "checkpoints" / "last.ckpt"
    subprocess.run(
        [
            python,
            "-m",
            "nep.evaluate",
            "--out",
            str(tmp_path),
            "--tasks",
            "find_object",
            "--home.no-dynamic-nodes",
            "--num_homes",
            "3",
            "--steps",
            "4",
            "--policies",
            "bayesian",
            "--checkpoint",
            f"N={checkpoint}",
            "--threads",
            "1",
        ],
        check=True,
        cwd=ROOT,
        capture_output=True,
        env=os.environ | dict.fromkeys(_THREAD_VARIABLES, "1"),
    )
    want = json.loads((tmp_path / "results.json").read_text())["tasks"]["find_object"]["policies"]
    found = read_scores(folder, make_plan(folder), Setting("find_object", False))
    assert found["find_object-off/mlp"] == want["N"]
    assert found["bayesian"] == want["bayesian"]


def test_weights_of_a_table_are_checked_by_name(folder, tmp_path, capsys):
    """What was exported is what the table lists; another network under a name is noticed."""
    out = tmp_path / "weights"
    reproduce(folder, "--table", "1", "--weights", str(out))
    names = [f"{setting.name}/mlp" for setting in SETTINGS]
    listed = json.loads((out / "weights.json").read_text())
    assert list(listed["networks"]) == names
    assert listed["networks"][names[0]]["title"] == "NEP-MLP"
    assert (out / names[0] / "weights.safetensors").is_file()
    stored = str(folder / "out" / "table_1.json")
    capsys.readouterr()
    main(["--check_weights", str(out), "--stored", stored])
    lines = capsys.readouterr().out.splitlines()
    assert [line.partition(":")[0] for line in lines] == names
    assert all(line.endswith("as listed") for line in lines)
    load_exported(out / names[0])

    first, second = out / names[0], out / names[1]
    first.rename(out / "kept")
    shutil.copytree(second, first)  # the network of another setting under this name
    refused(["--check_weights", str(out)], f"checkpoint_sha256 of {names[0]} must be", capsys)
    shutil.rmtree(first)
    (out / "kept").rename(first)
    content = json.loads(Path(stored).read_text())
    content["checkpoints"] = {}
    other = tmp_path / "table_1.json"
    other.write_text(json.dumps(content))
    refused(
        ["--check_weights", str(out), "--stored", str(other)], "must be that of the table", capsys
    )
    (out / "weights.json").write_text('{"networks": {"../x": {}}}')
    refused(["--check_weights", str(out)], "weights.json must list the networks of its", capsys)


def refused(arguments, message, capsys):
    with pytest.raises(SystemExit):
        main(arguments)
    assert message in capsys.readouterr().err


def test_finished_parts_are_not_run_again(folder):
    """The figure needs what Table 1 has; written again, files are the same bytes."""
    plan = make_plan(folder, "--table", "1")
    assert list_jobs(plan) == list_plays(plan) == []
    before = read_times(folder)
    files = {path: path.read_bytes() for path in (folder / "out").iterdir()}
    reproduce(folder, "--table", "1")
    reproduce(folder, "--table", "figure")
    assert read_times(folder) == before
    assert all(path.read_bytes() == content for path, content in files.items())
    image = (folder / "out" / "figure_4.png").read_bytes()
    reproduce(folder, "--table", "figure")
    assert (folder / "out" / "figure_4.png").read_bytes() == image


def test_what_has_changed_is_run_again(folder):
    plan = make_plan(folder, "--table", "figure", "--steps", "5")
    assert list_jobs(plan) == []
    players = (*POLICIES, "predict_location-on/mlp")
    assert list_plays(plan) == [f"predict_location-on {who}" for who in players]
    jobs = list_jobs(make_plan(folder, "--table", "figure", "--epochs", "2"))
    assert [job.name for job in jobs] == [
        "collect predict_location-on",
        "train predict_location-on/mlp",
    ]
    assert [job.after for job in jobs] == [(), (jobs[0].name,)]


def test_the_released_codes_homes_are_learnt_and_played_in(tmp_path):
    """24 places in training and test; what was played in other homes is not taken for it."""
    plan = make_plan(tmp_path, "--table", "figure", "--homes", "paper")
    (training,) = plan.list_trainings(enter(plan.models[0], ABLATION_SETTING))
    home = FitCLI(training.list_all_options()).datamodule.train_config.homes.home
    assert (home.furniture_per_room, home.objects_per_furniture, home.max_looks) == (6, 5, 10)
    games = plan.list_games()
    play_all(
        games, lambda game: list_contestants(game.setting.task, ["random"], []), plan.runs / SCORES
    )
    assert "predict_location-on random" not in list_plays(plan)
    text = make_plan(tmp_path, "--table", "figure")
    assert "predict_location-on random" in list_plays(text)
    assert "--homes paper" in plan.describe("1").command


def test_several_trainings_play_the_same_homes(tmp_path):
    """Three trainings of seeds that follow each other; the first one is that of a single one."""
    plan = make_plan(tmp_path, "--table", "figure", "--seed", "4", "--seeds", "3")
    trainings = plan.list_trainings(enter(plan.models[0], ABLATION_SETTING))
    assert [training.seed for training in trainings] == [4, 5, 6]
    assert len({training.folder for training in trainings}) == 3
    alone = make_plan(tmp_path, "--table", "figure", "--seed", "4")
    assert alone.list_trainings(enter(plan.models[0], ABLATION_SETTING)) == trainings[:1]
    assert {game.seed for game in plan.list_games().values()} == {4}
    assert len({plan.name_training(training) for training in trainings}) == 3
    names = [job.name for job in list_jobs(plan)]
    assert [name for name in names if name.startswith("train")] == [
        "train predict_location-on/mlp",
        "train seed_5/predict_location-on/mlp",
        "train seed_6/predict_location-on/mlp",
    ]
    assert "--seeds 3" in plan.describe("1").command


def test_a_table_of_one_column_trains_and_plays_for_that_alone(tmp_path):
    plan = make_plan(tmp_path, "--table", "1", "--settings", "find_object-off", "--tiny")
    networks = plan.list_networks()
    assert {network.setting.name for network in networks} == {"find_object-off"}
    names = [job.name for job in list_jobs(plan)]
    assert [name for name in names if name.startswith("collect")] == ["collect find_object-off"]
    assert all("find_object-off" in name for name in names)
    assert "--settings find_object-off" in plan.describe("1").command
    assert plan.describe("1").title == "Table 1"


def test_a_table_is_called_otherwise(tmp_path):
    told = make_plan(tmp_path, "--table", "1", "--called", "Two weeks").describe("1")
    assert told.title == "Two weeks"
    assert told.command.endswith("--called 'Two weeks' --tiny")


def test_the_figure_has_its_column_whichever_ones_table_1_has(tmp_path):
    plan = make_plan(tmp_path, "--table", "all", "--settings", "find_object-off")
    assert [own.name for own in plan.settings] == ["find_object-off"]
    played = [own.name for own in plan.list_settings()]
    assert played == ["find_object-off", ABLATION_SETTING.name]
    every = make_plan(tmp_path, "--table", "all")
    assert every.list_settings() == every.settings == SETTINGS


def test_heat_plus_without_the_belief_is_told_no_rules(tmp_path):
    (model,) = find_models(["heat_plus_no_belief"])
    training = Training(enter(model, SETTINGS[0]), 0, (), tmp_path, tmp_path)
    data = FitCLI(training.list_all_options()).datamodule
    assert not data.hparams["features"]["belief"]
    assert data.train_config.policy == "bayesian"


def test_a_damaged_checkpoint_is_trained_again(folder):
    training = make_training(folder)
    content = training.checkpoint.read_bytes()
    training.checkpoint.write_bytes(content[:-1])
    try:
        assert not training.is_done()
    finally:
        training.checkpoint.write_bytes(content)
    assert training.is_done()


def make_training(folder: Path) -> Training:
    plan = make_plan(folder, "--table", "figure")
    return plan.list_trainings(enter(plan.models[0], ABLATION_SETTING))[0]


def test_killed_and_resumed_is_as_if_never_stopped(folder, tmp_path, python):
    """The command is killed without warning while its first network is in training."""
    training = make_training(tmp_path)
    one = ["--table", "figure", "--workers", "1"]
    command = [python, "-m", "nep.reproduce", *TINY, *one]
    process = subprocess.Popen([*command, *map(str, list_folders(tmp_path))], cwd=ROOT)
    try:
        while not training.folder.exists():
            assert process.poll() is None
            time.sleep(0.02)
    finally:
        process.kill()
        process.wait()
    time.sleep(0.5)  # workers end with it
    assert not training.is_done()
    left = [job.name for job in list_jobs(make_plan(tmp_path, "--table", "figure"))]
    assert "train predict_location-on/mlp" in left
    reproduce(tmp_path, *one)
    assert training.is_done()
    want, got = (
        torch.load(make_training(where).checkpoint, weights_only=True)["state_dict"]
        for where in (folder, tmp_path)
    )
    assert all(torch.equal(value, got[key]) for key, value in want.items())
    plan = make_plan(tmp_path)
    assert read_scores(folder, plan) == read_scores(tmp_path, plan)


def test_table_2_shares_the_full_models_with_table_1(folder):
    plan = make_plan(folder, "--table", "all")
    networks = [network.key for network in plan.list_networks()]
    assert len(networks) == len(set(networks)) == 6 + 2 + 12  # MLP is in Table 1 already
    names = [job.name for job in list_jobs(plan)]
    assert sum(name.startswith("train ") for name in names) == 2 + 12
    assert "train predict_location-on/heat-no_prior" in names
    assert "train predict_location-on/mlp" not in names


def test_configs_keep_what_they_say(tmp_path):
    """Only the setting is overridden; a seed may be said by a config."""
    (heat,) = find_models(["heat"])
    training = Training(
        enter(heat, SETTINGS[-1]), 3, ("--trainer.max_epochs=1",), tmp_path, tmp_path
    )
    wanted = (
        "--seed_everything=3 --data.seed=3 --config=heat.yaml --data.task=find_object "
        "--data.home.dynamic_nodes=false --trainer.max_epochs=1"
    )
    assert training.list_options() == wanted.split()
    configs = training.describe()["configs"]
    assert list(configs) == ["paper.yaml", "heat.yaml"]  # what it builds on, too
    assert "  learning_rate: 1.0e-4" in configs["paper.yaml"]
    assert not any(line.startswith("#") for lines in configs.values() for line in lines)
    defaults = {model.name for model in find_models(None)}
    assert {"hms", "mlp", "gcn", "heat"} <= defaults
    assert not {"hgt", "han"} & defaults  # only where they are named


def test_a_config_by_path_is_a_model_by_its_name(tmp_path):
    """Its lines are compared, not where it lies: a folder may be moved."""
    folders = [tmp_path / "here", tmp_path / "there"]
    settings = []
    for folder in folders:
        folder.mkdir()
        (folder / "mine.yaml").write_text("# ours\nmodel:\n  learning_rate: 0.1\n")
        models = find_models(["heat.yaml", "hgt", str(folder / "mine.yaml"), "heat_finder.yaml"])
        assert [model.name for model in models] == ["hgt", "heat", "mine", "heat_finder"]
        training = Training(enter(models[2], SETTINGS[0]), 0, (), tmp_path, tmp_path)
        assert training.contestant.key == "predict_location-on/mine"
        assert f"--config={folder / 'mine.yaml'}" in training.list_all_options()
        settings.append(training.describe())
    assert settings[0] == settings[1]
    assert settings[0]["configs"] == {"mine.yaml": ["model:", "  learning_rate: 0.1"]}
    assert models[1].config == ""
    FitCLI(Training(enter(models[3], SETTINGS[0]), 0, (), tmp_path, tmp_path).list_all_options())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--table", "3"], "table must be one of 1, 2, figure, all, got '3'. Choose one of"),
        (["--models", "gat"], "model must be one of hms, mlp, .*, got 'gat'. Choose one"),
        (["--models", "no.yaml"], "config must be a file or a packaged config, got 'no.yaml'. Ch"),
        (["--models", "a/mlp.yaml"], "must be named otherwise than models, .*, got 'a/mlp.yaml'"),
        (["--settings", "moved"], "settings must be one of predict_location-on, .*, got 'moved'."),
        (["--num_homes", "0"], "num_homes must be at least 1, got 0. Raise it."),
        (["--steps", "0"], "steps must be at least 1, got 0. Raise it."),
        (["--epochs", "0"], "epochs must be at least 1, got 0. Raise it."),
        (["--workers", "0"], "workers must be at least 1, got 0. Raise it."),
        (["--seed", "-1"], "seed must be non-negative, got -1. Choose 0 or more."),
    ],
)
def test_bad_input_ends_with_a_message(tmp_path, capsys, options, message):
    with pytest.raises(SystemExit) as stop:
        reproduce(tmp_path, *options)
    assert stop.value.code == 2
    assert re.search(message, " ".join(capsys.readouterr().err.split()))
    assert not list(tmp_path.iterdir())


def test_a_folder_in_which_another_command_works_is_refused(folder, capsys):
    before = read_times(folder)
    with FileLock(folder / "runs" / LOCK), pytest.raises(SystemExit) as stop:
        reproduce(folder, "--table", "figure", "--steps", "5")
    assert stop.value.code == 1
    error = " ".join(capsys.readouterr().err.split())
    assert f"at a time, got {folder / 'runs'}, where another one does. Wait until it" in error
    assert read_times(folder) == before
    reproduce(folder, "--table", "1")  # it has ended


def test_a_failed_job_is_named_with_its_log(tmp_path, capsys):
    """Data of other settings lie where the collection should go."""
    training = make_training(tmp_path)
    data = FitCLI(training.list_all_options()).datamodule
    stranger = data.get_folder(data.train_config) / "stranger.txt"
    stranger.parent.mkdir(parents=True)
    stranger.write_text("not ours")
    with pytest.raises(SystemExit) as stop:
        reproduce(tmp_path, "--table", "figure", "--workers", "1")
    assert stop.value.code == 1
    error = capsys.readouterr().err
    assert "collect predict_location-on: ValueError: output folder must be empty" in error
    assert "collect-predict_location-on.log" in error
    assert "train predict_location-on/mlp: it needs another job, which failed" in error
    assert not (tmp_path / "out" / "figure_4.png").exists()
    assert read_scores(tmp_path, make_plan(tmp_path)).keys() == {*POLICIES}  # others went on
