"""iGridson with a network: that of a very short fit is enough."""

import json
import re
from pathlib import Path

import pytest

from nep import fit
from nep.igridson import main
from tools.bench.__main__ import main as bench


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory):
    folder = tmp_path_factory.mktemp("fit")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        fit.main(
            (
                "--config mlp.yaml --trainer.max_epochs=1 --data.num_homes=1 --data.steps=4 "
                "--data.num_val_homes=1 --data.batch_size=4 --data.workers=1 --online.num_homes=1 "
                "--online.steps=2 --trainer.log_every_n_steps=1 "
                "--trainer.enable_progress_bar=false"
            ).split()
        )
    return folder / "runs" / "mlp" / "version_0" / "checkpoints" / "last.ckpt"


def read_scores(out):
    """Scores by player, of the only game."""
    (scores,) = json.loads(out.with_suffix(".json").read_text("utf-8"))["scores"].values()
    return scores


def search(out, *options):
    bench(["igridson", "--queries-per-home", "4", "--out", str(out), *options])


@pytest.mark.slow
def test_a_table_goes_on_and_is_written_again(checkpoint, tmp_path, capsys):
    """Who has played does not play again."""
    out = tmp_path / "sub" / "grid.md"
    options = ["--queries-per-home", "4", "--out", str(out)]
    bench(["igridson", "--policy", "random", "--runs", "12", *options])
    text = out.read_text("utf-8")
    assert "## At most 10 looks: 12 searches, 3 unseen homes x 4 queries" in text
    assert "| 0.57 | 9.36 ± 4.09 | 141.7 ± 63.9 |" in text  # the paper's random row
    first = read_scores(out)["random"]
    assert 0 < first["num_actions_standard_error"] < 2
    players = ["--checkpoint", f"nep={checkpoint}", "--policy", "random", "nep", "nep+travel"]
    bench(["igridson", *players, "--runs", "12", *options])
    played = [line for line in capsys.readouterr().out.splitlines() if "attempts: " in line]
    assert [line.rpartition(": ")[2] for line in played] == ["random", "nep", "nep+travel"]
    assert read_scores(out)["random"] == first
    text = out.read_text("utf-8")
    assert "| nep | " in text
    assert "- Network `nep`: SHA-256 `" in text
    search(
        out,
        "--play",
        "false",
        "--runs",
        "12",
        "--checkpoint",
        "nep",
        "--policy",
        "random",
        "nep",
        "nep+travel",
    )
    assert out.read_text("utf-8") == text


@pytest.mark.slow
def test_workers_give_the_same_scores(tmp_path):
    options = ["--policy", "random", "bayesian+travel", "--runs", "8"]
    search(tmp_path / "a.md", *options)
    search(tmp_path / "b.md", *options, "--workers", "2")
    assert read_scores(tmp_path / "a.md") == read_scores(tmp_path / "b.md")


def test_stored_scores_give_the_table_that_ships(tmp_path, monkeypatch):
    folder = Path(__file__).parents[2] / "results"
    (tmp_path / "igridson.json").write_bytes((folder / "igridson.json").read_bytes())
    monkeypatch.chdir(tmp_path)
    bench(["igridson", "--play", "false", "--checkpoint", "nep"])
    assert (tmp_path / "igridson.md").read_bytes() == (folder / "igridson.md").read_bytes()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--policy", "nep"], "policy must be one of random, .*got 'nep'.*nep.igridson"),
        (["--runs", "150"], "runs must be a multiple of the 100 queries per home, got 150"),
        (["--attempts", "40"], "attempts must be at most the 21 furniture nodes, got 40"),
        (["--layout", "missing.txt"], "No such file"),
        (["--out", "runs.json"], "out must be a page, got runs.json, which is its file of scores"),
        (["--workers", "0"], "workers must be at least 1, got 0. Raise it."),
        (["--checkpoint", "no.ckpt"], "no.ckpt.* must be a file|must be a file .*no.ckpt"),
    ],
)
def test_bad_options_end_with_one_line(options, message, capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as stop:
        bench(["igridson", *options])
    assert stop.value.code == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1
    assert re.search(message, error)


def test_the_shipped_network_plays(tmp_path):
    out = tmp_path / "grid.md"
    search(out, "--checkpoint", "nep=heat", "--policy", "nep", "--runs", "4")
    assert [*read_scores(out)] == ["nep"]


def test_the_network_is_in_the_help_and_its_options_are_checked(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["video", "--help"])
    assert stop.value.code == 0
    text = " ".join(capsys.readouterr().out.split())
    assert "the network: a checkpoint, an exported folder or one that ships" in text
    assert main(["play", "--threads", "0"]) == 2
    assert capsys.readouterr().err == "error: threads must be at least 1, got 0. Raise it.\n"
