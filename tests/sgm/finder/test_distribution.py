"""What leaves a finder is a distribution or an error, and does not depend on order or company."""

import numpy as np
import pytest

from sgm.belief import Belief, Detector
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.policies.policy import Policy, compute_probabilities

NAMES = ("lamp", "keys", "mug", "red mug", "bowl", "book", "phone", "knife", "plate", "pillow")
FURNITURE = ("counter top", "table", "desk", "shelf", "cabinet", "table", "sofa")


@pytest.fixture(scope="module")
def network():
    return ObjectFinder.load()


def play(seed, order=None):
    """Make a session in a home whose furniture is added in an order; return its places, too."""
    rng, memory = np.random.default_rng(seed), SceneGraphMemory()
    rooms = [memory.add_room(label) for label in ("kitchen", "study", "bedroom")]
    room_of = [rooms[int(rng.integers(3))] for _ in FURNITURE]
    places = {n: memory.add_furniture(FURNITURE[n], room_of[n]) for n in order or range(7)}
    for _ in range(int(rng.integers(1, 30))):
        if rng.random() < 0.4:
            memory.step(int(rng.choice([1, 2, 50, 4000])))
            continue
        seen = [
            Sighting(NAMES[int(rng.integers(10))], ("in", "onTop")[int(rng.integers(2))])
            for _ in range(rng.poisson(2))
        ]
        memory.observe(places[int(rng.integers(7))], seen)
    return memory, [places[n] for n in range(7)]


def ask(finder, memory, places, name):
    ranking = finder.rank(memory, name)
    found = {place.furniture: place.probability for place in ranking}
    return np.array([*(found[place] for place in places), ranking.elsewhere])


@pytest.mark.parametrize("steps", [1, 12, 13, 20, 200, 5000, 10**6])
def test_one_name_in_two_relations_is_one_place(network, steps):
    """A look that shows keys on and in a cabinet shows them once: at most one look in one did."""
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    cabinet, table = (memory.add_furniture(label, kitchen) for label in ("cabinet", "table"))
    memory.observe(cabinet, [Sighting("keys"), Sighting("keys", "in")])
    memory.step(steps)
    found = ask(network, memory, [cabinet, table], "keys")
    assert found.sum() == pytest.approx(1)
    assert found.argmax() == 0 or steps >= 5000


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
)
def test_answers_depend_on_no_order_and_no_company(network, seed):
    memory, places = play(seed)
    other, others = play(seed, order=[4, 2, 6, 0, 5, 1, 3])
    asked_before = ObjectFinder(network._policy.network)
    for name in NAMES:
        ask(asked_before, play(seed)[0], places, name)
    for name in NAMES:
        alone = ask(ObjectFinder(network._policy.network), memory, places, name)
        assert alone.sum() > 1 - 1e-6  # above, where several were seen at once
        assert alone.max() <= 1 + 1e-9
        np.testing.assert_array_equal(ask(asked_before, memory, places, name), alone)
        np.testing.assert_allclose(ask(network, other, others, name), alone, atol=1e-4)


class Broken(Policy):
    """Believes what is no number."""

    def __init__(self, weight):
        self.weight = weight

    def scores(self, memory, queries):
        return np.full((len(queries.object), memory.num_furniture), self.weight)


class BrokenBelief(Broken):
    def believe(self, memory, queries):
        return Belief(np.full((len(queries.object), memory.num_furniture + 1), self.weight))


@pytest.fixture
def memory():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("study"))
    memory.observe(shelf, [Sighting("mug")])
    memory.step()
    return memory


@pytest.mark.parametrize("weight", [np.nan, np.inf])
def test_a_policy_that_computes_no_number_is_an_error(memory, weight):
    with pytest.raises(ValueError, match=r"scores of a policy must be numbers, .* for question 0"):
        Finder(Broken(weight)).rank(memory, "mug")
    with pytest.raises(ValueError, match="belief of a policy must have weights that are numbers"):
        Finder(BrokenBelief(weight)).rank(memory, "mug")


def test_what_is_ruled_out_everywhere_is_an_error(memory):
    with pytest.raises(ValueError, match=r"must sum to one, got 0: .* rule all of them out"):
        Finder(BrokenBelief(-np.inf)).rank(memory, "mug")


def test_a_look_that_cannot_miss_leaves_elsewhere(memory):
    memory.observe(0, [])
    ranking = Finder(Bayesian(), Detector(miss_rate=0)).rank(memory, "mug")
    assert [place.probability for place in ranking] == [0]
    assert ranking.elsewhere == pytest.approx(1)


@pytest.mark.parametrize("num_places", [1, 3])
def test_what_looks_rule_out_wherever_it_was_believed_to_be_is_elsewhere(num_places):
    class Sure(Broken):  # of the first place, and that it is not elsewhere
        def believe(self, memory, queries):
            weights = np.full((len(queries.object), memory.num_furniture + 1), -np.inf)
            weights[:, 0] = 0.0
            return Belief(weights)

    memory = SceneGraphMemory()
    study = memory.add_room("study")
    for _ in range(num_places):
        memory.add_furniture("shelf", study)
    memory.observe(0, [Sighting("mug")])
    memory.step()
    for look in (lambda: memory.observe(0, []), lambda: memory.note_absent(0, "mug")):
        look()
        ranking = Finder(Sure(0.0), Detector(miss_rate=0)).rank(memory, "mug")
        assert [place.probability for place in ranking] == [0] * num_places
        assert ranking.elsewhere == 1


def test_scores_name_the_question_that_has_none():
    with pytest.raises(ValueError, match="for question 1"):
        compute_probabilities(np.array([[1.0, 2.0], [np.nan, 1.0]]), "logits")
