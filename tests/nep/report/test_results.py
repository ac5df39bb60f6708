"""`results.json`: what is written is read; what it does not say is refused; which code made it."""

import json
import re
import subprocess
from importlib.metadata import version

import numpy as np
import pytest

from nep.report import results as results_file
from nep.report.results import (
    Results,
    ScoreSummary,
    describe_code,
    find_commit,
    list_versions,
)
from simulator.tasks.metrics import METRICS


@pytest.fixture
def results():
    metrics = dict.fromkeys(METRICS, 0.25) | {"away_accuracy": float("nan")}
    summary = ScoreSummary(np.array([[1.0, 2.0], [4.0, 1 / 3]]), metrics)
    return Results(
        "python -m nep.evaluate --out x",
        {"seed": 3},
        list_versions(),
        {"find_object": {"p": summary}},
    )


def test_what_is_saved_is_loaded(results, tmp_path):
    path = tmp_path / "new" / "results.json"
    results.save(path)
    content = json.loads(path.read_text())
    assert content["version"] == 1
    task = content["tasks"]["find_object"]
    assert task["metric"] == "looks"
    assert task["policies"]["p"]["values"] == [[1.0, 2.0], [4.0, 0.333333]]
    assert task["policies"]["p"]["mean"] == pytest.approx((1.5 + 13 / 6) / 2)
    assert task["policies"]["p"]["metrics"]["away_accuracy"] is None
    loaded = Results.load(path)
    assert (loaded.command, loaded.config) == (results.command, results.config)
    assert loaded.versions == results.versions
    summary = loaded.tasks["find_object"]["p"]
    np.testing.assert_allclose(summary.home_values, [1.5, 13 / 6], atol=1e-6)
    assert np.isnan(summary.metrics["away_accuracy"])
    assert summary.metrics["nll"] == 0.25


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda c: c | {"version": 2}, r"results version must be 1, got 2 in .*\. Make it again"),
        (lambda c: [c], r"results version must be 1, got None"),
        (lambda c: c | {"tasks": {"find_object": {}}}, r"got KeyError\('policies'\) .* edited\?"),
        (
            lambda c: c | {"tasks": {"find_object": {"policies": {"p": {"values": [1.0]}}}}},
            r"values must be \(homes, steps\), got 1 axes",
        ),
        (lambda c: c | {"config": 3}, r"must hold all that Results\.save writes, got TypeError"),
        (lambda c: c | {"versions": []}, r"must hold all that Results\.save writes"),
        (lambda c: c | {"tasks": {"x": {"policies": {}}}}, r"unknown tasks \['x'\]"),
    ],
)
def test_other_files_are_refused(results, tmp_path, edit, message):
    path = tmp_path / "results.json"
    results.save(path)
    path.write_text(json.dumps(edit(json.loads(path.read_text()))))
    with pytest.raises(ValueError, match=message):
        Results.load(path)


def test_no_file_and_no_json_are_refused(tmp_path):
    path = tmp_path / "results.json"
    for write in (lambda: None, lambda: path.write_text("{")):
        write()
        with pytest.raises(ValueError, match=rf"as JSON, got .* {re.escape(str(path))}"):
            Results.load(path)


def run_git(*arguments):
    done = subprocess.run(["git", *arguments], capture_output=True, text=True, check=True)
    return done.stdout.strip()


def test_a_checkout_says_its_commit():
    commit = find_commit()
    assert run_git("rev-parse", "HEAD").startswith(commit.removesuffix("+changes"))
    assert list_versions()["commit"] == commit
    assert list_versions()["numpy"] == version("numpy")
    assert describe_code().endswith(f", commit {commit}")


def test_a_repository_that_the_package_only_lies_in_is_not_taken_for_its_own(tmp_path, monkeypatch):
    find_commit.cache_clear()
    package = tmp_path / "environment" / "nep" / "report" / "results.py"
    package.parent.mkdir(parents=True)
    package.touch()
    subprocess.run(["git", "init", "-q", str(tmp_path)], check=True)
    monkeypatch.setattr(results_file, "_CHECKOUT", package.parents[2])
    monkeypatch.setattr(results_file, "__file__", str(package))
    try:
        assert find_commit() is None
        assert "commit" not in list_versions()
    finally:
        find_commit.cache_clear()


def test_an_edited_checkout_says_so(tmp_path, monkeypatch):
    find_commit.cache_clear()
    package = tmp_path / "nep" / "report" / "results.py"
    package.parent.mkdir(parents=True)
    package.touch()
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    for arguments in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "one"]):
        subprocess.run([*git, *arguments], check=True)
    monkeypatch.setattr(results_file, "_CHECKOUT", tmp_path)
    monkeypatch.setattr(results_file, "_CODE", ("nep",))
    monkeypatch.setattr(results_file, "__file__", str(package))
    try:
        clean = find_commit()
        package.write_text("# edited")
        find_commit.cache_clear()
        assert find_commit() == f"{clean}+changes"
    finally:
        find_commit.cache_clear()
