"""A home of many objects: remembered, saved, loaded, and the shipped network is asked."""

import numpy as np
import pytest

from nep import ObjectFinder
from simulator import Bayesian, PriorGraph, SceneGraphMemory, Sighting

NUM_FURNITURE, PER_FURNITURE = 1_000, 20  # benchmarks/growth has the home of 100,000 objects

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def memory():
    """20,000 objects on 1,000 furniture nodes, each of which was looked at once."""
    prior = PriorGraph.default()
    memory = SceneGraphMemory(prior)
    rooms = {label: memory.add_room(label) for label in prior.rooms}
    for number in range(NUM_FURNITURE):
        node = prior.furniture[number % len(prior.furniture)]
        memory.add_furniture(node.label, rooms[node.room], f"{node.label} {number}")
    for number, furniture in enumerate(memory.furniture_ids):
        keys = range(number * PER_FURNITURE, (number + 1) * PER_FURNITURE)
        texts = [f"number {key} {prior.objects[key % len(prior.objects)].label}" for key in keys]
        memory.observe(furniture, [Sighting(text) for text in texts])
    memory.step()
    return memory


def test_what_was_seen_is_found_again(memory):
    assert memory.num_furniture == NUM_FURNITURE
    assert len(memory.descriptions) == NUM_FURNITURE * PER_FURNITURE
    description = memory.descriptions[77]  # on the fourth node: 77 // 20 = 3
    assert memory.last_seen(description).furniture == 3
    assert memory.rank(Bayesian(), description)[0][0] == 3
    home = memory.to_dict()
    counts = [len(node["objects"]) for room in home["rooms"] for node in room["furniture"]]
    assert counts == [PER_FURNITURE] * NUM_FURNITURE


def test_the_shipped_network_answers(memory):
    finder = ObjectFinder.load("heat")
    assert finder.rank(memory, memory.descriptions[77], k=5).places[0].furniture == 3
    ranking = finder.rank(memory, "purple gizmo")  # may be at all places, in or on top
    assert len(ranking.places) == NUM_FURNITURE
    total = sum(place.probability for place in ranking.places) + ranking.elsewhere
    assert total == pytest.approx(1)


def test_saved_and_loaded_it_answers_the_same(memory, tmp_path):
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for description in (memory.descriptions[77], "purple gizmo"):
        assert copy.rank(Bayesian(), description) == memory.rank(Bayesian(), description)
    for name in memory.batch.edges:
        np.testing.assert_array_equal(copy.batch.edges[name], memory.batch.edges[name])
