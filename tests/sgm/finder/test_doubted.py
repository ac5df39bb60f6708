"""The confidence of a sighting counts after its step, for policies and networks alike."""

import numpy as np
import pytest

from sgm.belief.posterior import find_last_word
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.policies import Adaptive, Bayesian, Frequentist
from simulator import SceneGraphMemory, Sighting


def make_home(*confidences):
    """A cup on the desk, seen with these confidences, one a step."""
    memory = SceneGraphMemory()
    kitchen, office = memory.add_room("kitchen"), memory.add_room("office")
    memory.add_furniture("counter", kitchen)
    desk, shelf = (memory.add_furniture(label, office) for label in ("desk", "shelf"))
    for confidence in confidences:
        memory.observe(desk, [Sighting("cup", confidence=confidence)])
        memory.step()
    return memory, desk, shelf


def rank(finder, memory, place):
    ranking = finder.rank(memory, "cup")
    assert sum(own.probability for own in ranking) + ranking.elsewhere == pytest.approx(1)
    return next(own.probability for own in ranking if own.furniture == place)


@pytest.mark.parametrize(
    "make", [lambda: Finder(Bayesian()), lambda: Finder(Adaptive()), ObjectFinder.load]
)
def test_a_doubtful_sighting_weighs_less_after_its_step(make):
    finder = make()
    said = []
    for confidence in (0.5, 0.7, 0.9, 1.0):
        memory, desk, _ = make_home(confidence)
        said.append(rank(finder, memory, desk))
    assert said == sorted(said)
    # P = c P(sure) + (1 - c) P(without): linear in c but for the shares of elsewhere.
    assert said[0] < 0.7 * said[-1]
    assert said[2] > 0.85 * said[-1]


def test_a_later_sure_sighting_ends_the_doubt():
    finder = Finder(Adaptive())
    memory, desk, _ = make_home(0.5, 1.0)
    assert find_last_word(memory.ask(["cup"]))[1] == [1.0]
    sure, _, _ = make_home(1.0, 1.0)
    assert rank(finder, memory, desk) == rank(finder, sure, desk)


def test_a_doubtful_last_sighting_leaves_the_earlier_ones():
    memory, desk, shelf = make_home(1.0, 1.0, 1.0)
    memory.observe(shelf, [Sighting("cup", confidence=0.5)])
    memory.step()
    last, confidence = find_last_word(memory.ask(["cup", "piano"]))
    np.testing.assert_array_equal(last, [shelf, -1])
    np.testing.assert_array_equal(confidence, [0.5, 1.0])
    finder = Finder(Adaptive())
    sure = memory.copy()
    sure.observe(shelf, [Sighting("cup")])
    assert rank(finder, memory, desk) > 2 * rank(finder, sure, desk)


@pytest.mark.parametrize("make", [Frequentist, Bayesian, Adaptive])
@pytest.mark.parametrize("others", [(), ("shelf",), ("shelf", "table")])
def test_a_doubtful_sighting_now_is_no_less_than_none(make, others):
    """A place that was as good as sure fell to the confidence, and a look that missed raised it."""
    memory, finder = SceneGraphMemory(), Finder(make())
    room = memory.add_room("office")
    desk = memory.add_furniture("desk", room)
    for label in others:
        memory.add_furniture(label, room)
    for _ in range(3):
        memory.observe(desk, [Sighting("cup")])
        memory.step()
    unseen = rank(finder, memory, desk)
    memory.observe(desk, [Sighting("cup", confidence=0.6)])
    seen = rank(finder, memory, desk)
    assert seen >= max(unseen, 0.55)
    memory.note_absent(desk, "cup")
    assert rank(finder, memory, desk) <= seen
