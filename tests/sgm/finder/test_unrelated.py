"""What has nothing to do with a thing takes little of its answer, with every policy."""

import numpy as np
import pytest

from sgm import Adaptive, ObjectFinder, SceneGraphMemory, Sighting
from sgm.belief import Belief
from sgm.finder.finder import Finder
from sgm.finder.judged import UNRELATED, believe_bounded, find_unrelated
from sgm.policies import Bayesian, Frequentist, Priors
from tests.sgm.finder.session_machine import IRRELEVANT, ask

FINDERS = {
    "network": ObjectFinder.load,
    "adaptive": lambda: Finder(Adaptive()),
    "bayesian": lambda: Finder(Bayesian()),
    "frequentist": lambda: Finder(Frequentist()),
    "priors": lambda: Finder(Priors()),
}
KITCHEN = ("table", "cabinet", "shelf", "fridge")


def make_home(num_places=1, steps=30_000, thing="mug"):
    """A kitchen where all was looked at, and a thing was on the table."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    for label in KITCHEN[:num_places]:
        memory.add_furniture(label, room)
    for place in range(num_places):
        memory.observe(place, [Sighting(thing)] if place == 0 else [])
    memory.step(steps)
    return memory


def add(memory, label="washing machine", room="bathroom"):
    other = memory.copy()
    other.add_furniture(label, other.add_room(room))
    return other


@pytest.mark.parametrize("steps", [100, 30_000])
@pytest.mark.parametrize("num_places", [1, 2, 3, 4])
@pytest.mark.parametrize("name", FINDERS)
def test_a_washing_machine_changes_little_of_where_a_mug_is(name, num_places, steps):
    """It took .08 of the network and of `Adaptive` in a home of one place."""
    finder, memory = FINDERS[name](), make_home(num_places, steps)
    kept = [*range(num_places), -2, -1]  # the new place has the last id
    before = ask(finder, memory, "mug")
    after = ask(finder, add(memory), "mug")
    assert np.abs(after[kept] - before).max() <= IRRELEVANT
    more = ask(finder, add(add(memory), "toilet"), "mug")
    assert np.abs(more[[*range(num_places + 1), -2, -1]] - after).max() <= IRRELEVANT


def test_of_two_beliefs_the_change_is_bounded():
    """d = max(.8 - .6, .2 - .1) = .2; .03 / .2 = .15 of the change is left."""
    asked = add(make_home()).ask(["mug"])

    def believe(_, queries):
        rows = [[0.8, 0.0, 0.2] if left else [0.6, 0.3, 0.1] for left in mark_left_out(queries)]
        with np.errstate(divide="ignore"):
            return Belief(np.log(rows))

    assert UNRELATED == 0.03
    found = believe_bounded(believe, asked.batch, asked.queries).probabilities
    np.testing.assert_allclose(found, [[0.8 - 0.15 * 0.2, 0.15 * 0.3, 0.2 - 0.15 * 0.1]])


def mark_left_out(queries):
    none = np.zeros(queries.prior.shape[:2], dtype=bool)
    return (none if queries.left_out is None else queries.left_out).any(axis=1)


def list_unrelated(memory, thing):
    asked = memory.ask([thing])
    return np.flatnonzero(find_unrelated(asked.batch, asked.queries)[0]).tolist()


def test_what_has_to_do_with_a_thing_is_not_bounded():
    memory = add(make_home())
    assert list_unrelated(memory, "mug") == [1]
    assert list_unrelated(add(memory, "counter top", "kitchen"), "mug") == [1]  # kept there
    looked = memory.copy()
    looked.observe(1, [])
    looked.step()
    assert list_unrelated(looked, "mug") == []
    missed = memory.copy()
    missed.observe(0, [])
    missed.step()
    assert list_unrelated(missed, "mug") == []  # it may be anywhere
    assert list_unrelated(memory, "bowl") == []  # never seen
    sought = memory.copy()
    sought.note_absent(1, "mug")
    sought.step()
    assert list_unrelated(sought, "mug") == []


@pytest.mark.parametrize(("policy", "tolerance"), [("adaptive", 1e-9), ("network", 0.02)])
@pytest.mark.parametrize("num_places", [1, 2, 4])
def test_a_place_that_is_left_out_is_as_if_the_home_had_none(policy, tolerance, num_places):
    """The network reads few sums over all that is known, in which such places are counted."""
    finder, memory = FINDERS[policy](), make_home(num_places, 100)
    asked, other = memory.ask(["mug"]), add(memory).ask(["mug"])
    left_out = find_unrelated(other.batch, other.queries)
    rows = other.queries.take(np.array([0]))
    queries = rows.join(type(rows)(rows.home, rows.object, rows.prior, left_out=left_out))
    finder._policy.reset(asked.batch)
    finder._policy.reset(other.batch)
    expected = finder._policy.believe(asked.batch, asked.queries).probabilities[0]
    found = finder._policy.believe(other.batch, queries).probabilities[1]
    assert found[num_places] == 0
    np.testing.assert_allclose(np.delete(found, num_places), expected, atol=tolerance)
