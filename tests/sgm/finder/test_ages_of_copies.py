"""Of several things of one name, each is as fresh as its own last sighting."""

from datetime import datetime

import numpy as np
import pytest

from sgm import Adaptive, Bayesian, Clock, Finder, ObjectFinder, SceneGraphMemory, Sighting
from sgm.belief.posterior import Belief, list_copies
from sgm.belief.stay import compute_stay

FINDERS = {
    "any_home": ObjectFinder.load(),
    "adaptive": Finder(Adaptive()),
    "bayesian": Finder(Bayesian()),
}


def see_two(steps: int, at_other: int = 1) -> tuple[SceneGraphMemory, int, int]:
    """Two mugs, seen at a table and on a shelf; `steps` later one is seen at the table again."""
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 1, 5, 8), 600))
    room = memory.add_room("kitchen")
    table, shelf, _ = (memory.add_furniture(name, room) for name in ("table", "shelf", "desk"))
    for _ in range(at_other):
        memory.observe(table, [Sighting("mug"), Sighting("mug")])
        memory.step()
    memory.observe(table, [Sighting("mug")])
    memory.observe(shelf, [Sighting("mug")])
    memory.step(steps)
    memory.observe(table, [Sighting("mug")])
    return memory, table, shelf


def get_probability(name: str, memory: SceneGraphMemory, place: int) -> float:
    found = FINDERS[name].rank(memory, "mug").places
    return next(ranked.probability for ranked in found if ranked.furniture == place)


@pytest.mark.parametrize("name", FINDERS)
@pytest.mark.parametrize("steps", [6, 50, 500])
def test_an_old_sighting_stays_old_when_another_one_is_seen(name, steps):
    memory, table, shelf = see_two(steps)
    in_step = get_probability(name, memory, shelf)
    memory.step()
    assert get_probability(name, memory, shelf) <= in_step + 0.1
    memory.observe(table, [Sighting("mug")])
    assert get_probability(name, memory, shelf) <= in_step + 0.1


@pytest.mark.parametrize("name", FINDERS)
def test_the_longer_ago_the_less_likely(name):
    likely = []
    for steps in (1, 20, 100, 1000):
        memory, _, shelf = see_two(steps)
        memory.step()
        likely.append(get_probability(name, memory, shelf))
    assert likely == sorted(likely, reverse=True)
    assert likely[0] > likely[-1] + 0.1


def test_a_copy_by_hand():
    memory, _, _ = see_two(50)
    memory.step()
    asked = memory.ask(["mug"])
    belief = Belief.of(np.array([[0.8, 0.1, 0.1]]), 0.0)
    copies, *_ = list_copies(belief, asked)
    stay = float(compute_stay(asked.batch, np.array(50)))
    # Exchanged: .1, .8, .1. Not on the shelf: .5, 0, .5; it was seen at the table in three
    # looks, and on the shelf in one, which is the last there.
    gone = np.array([3 + 0.5, 0, 0.5, 0]) / 4
    assert copies.probabilities[0] == pytest.approx([0.8, 0.1, 0.1, 0])
    expected = stay * np.array([0.1, 0.8, 0.1, 0]) + (1 - stay) * gone
    assert copies.probabilities[1] == pytest.approx(expected)


def test_seen_in_one_step_all_are_as_fresh():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(name, room) for name in ("table", "shelf", "desk")]
    memory.observe(places[0], [Sighting("mug"), Sighting("mug")])
    memory.step()
    for place in places[:2]:
        memory.observe(place, [Sighting("mug")])
    memory.step(30)
    first, second = (get_probability("adaptive", memory, place) for place in places[:2])
    assert first == pytest.approx(second, abs=1e-6)
