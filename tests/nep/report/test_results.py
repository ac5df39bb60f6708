"""`results.json`: what is written is read; what it does not say is refused."""

import json
import re

import numpy as np
import pytest

from nep.report.results import RESULTS_VERSION, Results, ScoreSummary, list_versions
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
    assert content["results_version"] == RESULTS_VERSION
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
        (lambda c: c | {"results_version": 1}, r"results_version 2, got 1 in .*\. Make them again"),
        (lambda c: [c], r"results_version 2, got None"),
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
