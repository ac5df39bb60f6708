"""The shipped prior: what it promises."""

from collections import Counter, defaultdict

import numpy as np
import pytest

from sgm.prior.prior_graph import SHIPPED, PriorGraph
from simulator.priors.types import load_types


def rank(values):
    """Ranks with ties averaged."""
    _, inverse, counts = np.unique(values, return_inverse=True, return_counts=True)
    return (np.cumsum(counts) - (counts - 1) / 2)[inverse]


@pytest.fixture(scope="module")
def default():
    return PriorGraph.default()


def test_sizes(default):
    assert default.rooms == ("kitchen", "living room", "bedroom", "bathroom")
    assert len(default.furniture) >= 44
    assert len({row.label for row in default.furniture}) == 22
    assert len(default.objects) == 108
    assert 900 <= len(default.placements) <= 1200
    places = defaultdict(set)
    for row in default.placements:
        places[row.room, row.object].add(row.furniture)
    assert np.mean([len(furniture) for furniture in places.values()]) == pytest.approx(6, abs=0.6)


@pytest.mark.parametrize("make", SHIPPED.values(), ids=SHIPPED)
def test_all_objects_are_reachable_and_sum_to_one(make):
    prior, totals = make(), Counter()
    for row in prior.placements:
        totals[row.object] += row.prob
    assert set(totals) == {row.label for row in prior.objects}
    assert all(abs(total - 1) < 1e-4 for total in totals.values())


def test_all_furniture_has_three_objects_and_a_chance(default):
    objects = defaultdict(set)
    for row in default.placements:
        objects[row.room, row.furniture].add(row.object)
    for node in default.furniture:
        assert len(objects[node.room, node.label]) >= 3, node.label
        assert 0 < node.prob <= 1


def test_relations_sources_and_counts(default):
    for row in default.placements:
        inside = row.furniture in ("fridge", "top cabinet", "sink")
        assert row.relation == ("in" if inside else "onTop")
        assert row.source.split(" ")[0] in ("procthor", "behavior")
        assert row.count >= 1


def test_checksum_entry_and_provenance(default):
    assert default.metadata["checksum"] == default.checksum
    assert default.metadata["num_houses"] == 30_000
    assert default.metadata["seed"] == 0
    assert any("procthor 0.0.1.dev2" in source for source in default.metadata["sources"])
    assert any("bddl 3.6.0" in source for source in default.metadata["sources"])


def test_common_sense(default):
    places = defaultdict(dict)
    for row in default.placements:
        places[row.object][row.room, row.furniture] = row.prob
    best = {label: max(probs, key=probs.get) for label, probs in places.items()}
    assert best["egg"] == best["milk"] == ("kitchen", "fridge")
    assert best["teddy bear"] == ("bedroom", "bed")
    assert best["toilet paper"] == ("bathroom", "toilet")
    assert best["toaster"][0] == best["pan"][0] == "kitchen"


def test_number_of_edges_ranks_types_as_in_the_paper(default):
    """The appendix gives the edges of each type in the paper's own (coarse) graph."""
    types = load_types()
    edges = {(row.furniture, row.object) for row in default.placements}
    by_object = Counter(label for _, label in edges)
    paper = np.array([row.num_edges for row in types.objects.values()], dtype=float)
    ours = np.array([by_object[label] for label in types.objects], dtype=float)
    assert np.corrcoef(rank(paper), rank(ours))[0, 1] > 0.7
