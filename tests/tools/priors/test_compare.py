"""`python -m tools.priors compare`: how two priors differ."""

import json

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from tests.prior_table import build_prior
from tools.priors.__main__ import main
from tools.priors.compare import compare_priors, compute_rank_correlation


@pytest.fixture
def built(tmp_path):
    return build_prior(tmp_path)


def test_compare_finds_what_differs(built, tmp_path, capsys):
    data = json.loads(built.read_text())
    for row in data["placements"]:
        if (row["furniture"], row["object"]) == ("fridge", "egg"):
            row["prob"] = 0.25 / 3  # P(fridge | egg, kitchen) falls from .75 to .25
    data["furniture"].append({**data["furniture"][0], "label": "sink"})
    data["placements"].append({**data["placements"][0], "furniture": "sink", "object": "mug"})
    other = tmp_path / "other.json"
    other.write_text(json.dumps(data))
    result = compare_priors(PriorGraph.load(built), PriorGraph.load(other))
    assert result.only_b["furniture"] == ["sink in kitchen"]
    assert result.only_a["furniture"] == []
    difference, name = next(pair for pair in result.placement_differences if "fridge" in pair[1])
    assert (name, difference) == ("egg in fridge in kitchen", pytest.approx(-0.5))
    assert main(["compare", str(built), str(other)]) == 0
    printed = capsys.readouterr().out
    assert "only in B, furniture: sink in kitchen" in printed
    assert "-0.500  egg in fridge in kitchen" in printed


def test_a_prior_agrees_with_itself(built):
    prior = PriorGraph.load(built)
    result = compare_priors(prior, prior)
    assert result.placement_correlation == pytest.approx(1)
    assert not result.placement_differences


def test_rank_correlation_by_hand():
    # ranks 1, 2.5, 2.5, 4 and 1, 2, 3, 4: covariance 4.5 / 4, variances 4.5 / 4 and 5 / 4
    value = compute_rank_correlation(np.array([0.0, 1, 1, 9]), np.array([1.0, 2, 3, 4]))
    assert value == pytest.approx(4.5 / np.sqrt(4.5 * 5))
    assert np.isnan(compute_rank_correlation(np.array([1.0, 1]), np.array([1.0, 2])))


def test_as_many_differences_as_there_are_at_least_one(capsys):
    assert main(["compare", "default", "default", "--top=-1"]) == 1
    assert capsys.readouterr().err == "error: top must be at least 1, got -1. Raise it.\n"
