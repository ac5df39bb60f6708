"""Tasks and metrics of one's own, named by import path, from outside the repository."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from nep.compare import compare
from nep.evaluate import main
from nep.report.results import Results
from simulator.tasks.metrics import find_metric
from simulator.tasks.registry import find_task

ROOT = Path(__file__).parents[2]
OWN = """
import numpy as np

from simulator.tasks.metrics import Metric
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.task import Task


class TwoGuesses(Task):
    title = "Two Guesses"
    metric = "accuracy"

    def run(self, num_steps):
        for answer in predict_locations(self.rollout, num_steps):
            self.on_answer(answer)
            best = np.argsort(-answer.scores, axis=1)[:, :2]
            yield np.take_along_axis(answer.answers, best, axis=1).any(axis=1).astype(float)


class Untitled(Task):
    metric = "length"

    def run(self, num_steps):
        yield from ()


def mrr(scores):
    return (1 / scores.rank).mean()


worst = Metric("worst", "worst rank", ".1f", False, lambda scores: scores.rank.max())
number = 3
"""
SMALL = ["--num_homes", "2", "--steps", "5", "--policies", "random", "bayesian"]


@pytest.fixture
def folder(tmp_path, monkeypatch) -> Path:
    (tmp_path / "my_module.py").write_text(OWN)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(__import__("sys").modules, "my_module", raising=False)
    return tmp_path


def evaluate(folder: Path, *arguments: str) -> Path:
    main([*SMALL, "--out", str(folder / "out"), *arguments])
    return folder / "out"


@pytest.mark.slow
def test_the_command_runs_outside_the_repository(folder, python):
    arguments = ["--metrics", "my_module:mrr", "--tasks", "my_module:TwoGuesses", "--out", "out"]
    done = subprocess.run(
        [python, "-m", "nep.evaluate", *arguments, *SMALL],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)])},
    )
    assert done.returncode == 0, done.stderr
    assert "Two Guesses" in done.stdout
    assert "mrr" in done.stdout


def test_both_are_in_every_file(folder, capsys):
    out = evaluate(
        folder,
        "--tasks",
        "my_module:TwoGuesses",
        "find_object",
        "--metrics",
        "my_module:mrr",
        "my_module:worst",
    )
    content = json.loads((out / "results.json").read_text())
    task = content["tasks"]["my_module:TwoGuesses"]
    assert (task["title"], task["metric"]) == ("Two Guesses", "accuracy")
    metrics = task["policies"]["random"]["metrics"]
    # all of 32 places tie: the one true place is at 16.5 on average, two of them at 11
    assert 1 / 16.5 <= metrics["my_module:mrr"] < 0.15
    assert metrics["my_module:worst"] <= 16.5
    header = (out / "table.csv").read_text().splitlines()[0]
    assert header.endswith("candidate_recall,my_module:mrr,my_module:worst")
    assert "| mrr | worst rank |" in (out / "table.md").read_text()
    assert (out / "my_module.TwoGuesses_over_steps.png").is_file()
    assert "worst rank" in capsys.readouterr().out
    assert not (out / "my_module:TwoGuesses_over_steps.png").exists()


def test_a_file_of_results_imports_nothing(folder, monkeypatch, capsys):
    """It says the title and the metric of its task itself."""
    path = evaluate(folder, "--tasks", "my_module:TwoGuesses") / "results.json"
    (folder / "my_module.py").write_text("raise AssertionError('imported')")
    monkeypatch.delitem(__import__("sys").modules, "my_module")
    results = Results.load(path)
    assert "## Two Guesses, 2 homes x 5 steps, more is better" in compare(results, results)
    content = json.loads(path.read_text())
    content["tasks"]["my_module:TwoGuesses"]["metric"] = "my_module:mrr"
    path.write_text(json.dumps(content))
    with pytest.raises(ValueError, match=r"unknown tasks \['my_module:TwoGuesses'\]"):
        Results.load(path)


@pytest.mark.parametrize(
    ("find", "name", "message"),
    [
        (find_task, "guess", "task must be one of predict_location, .* got 'guess'.*my_module:MyT"),
        (find_task, "my_module:Guess", "task must be in a module that can be imported, got 'my_mo"),
        (find_task, "no_module:Guess", "No module named 'no_module'"),
        (find_task, "my_module:mrr", "must be a subclass of simulator.tasks.task.Task, got"),
        (find_task, "my_module:Untitled", "must have a title and a metric among accuracy"),
        (find_metric, "mrr", "metric must be one of accuracy, .* as my_module:my_metric"),
        (find_metric, "my_module:number", "must be a Metric, or a function of TaskScores, got"),
    ],
)
def test_what_is_none_is_one_line(folder, find, name, message):
    with pytest.raises(ValueError, match=message):
        find(name)
