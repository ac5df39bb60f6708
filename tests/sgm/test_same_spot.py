"""Things of one name that a tracker told apart: one that is seen where another was is that one."""

import numpy as np
import pytest

from sgm import Adaptive, Bayesian, Finder, SceneGraphMemory, Sighting
from sgm.belief import compute_stay
from sgm.belief.stay import compute_same
from sgm.policies import Frequentist

AT = (1.9, 3.1, 0.95)
NEAR, FAR = (1.95, 3.1, 0.95), (1.9, 2.7, 0.95)  # 5 and 40 cm away


def make_home(second, name="mug", relation="onTop", first_is_seen=False):
    """A mug 7 at a counter, and a step later another id there."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    counter = memory.add_furniture("counter", room)
    memory.add_furniture("table", room)
    memory.observe(counter, [Sighting("mug", id="7", position=AT)])
    memory.step()
    seen = [Sighting(name, relation, id="12", position=second)]
    if first_is_seen:
        seen.append(Sighting("mug", id="7", position=AT))
    memory.observe(counter, seen)
    return memory


def find_same(memory):
    return compute_same(memory.ask(["mug"])).tolist()


def rank_counter(finder, memory):
    found = {place.furniture: place.probability for place in finder.rank(memory, "mug")}
    return found[0]


def test_by_hand():
    """With s of a step, .5 s / (.5 s + .3 (1 - s)); the newer one is none before it."""
    memory = make_home(NEAR)
    stay = float(compute_stay(memory.batch, np.array(1)))
    assert 0.5 < stay < 1
    likely = 0.5 * stay / (0.5 * stay + 0.3 * (1 - stay))
    assert find_same(memory) == pytest.approx([likely, 0])


@pytest.mark.parametrize(
    "memory",
    [
        make_home(FAR),
        make_home(None),
        make_home(NEAR, first_is_seen=True),
        make_home(NEAR, relation="in"),
        make_home(NEAR, name="plate"),
    ],
    ids=["far", "no position", "both at once", "inside", "another name"],
)
def test_without_the_evidence_they_are_two(memory):
    assert not any(find_same(memory))


@pytest.mark.parametrize("removed", [0, 1])
def test_things_whose_places_were_removed_are_ranked(removed):
    """Other things have positions; the ones that are asked for were seen nowhere that is left."""
    memory = make_home(NEAR)
    memory.observe(1, [Sighting("bowl", position=AT)])
    memory.remove_furniture(removed)
    for _ in range(2):
        for thing in ("mug", "bowl"):
            assert len(Finder(Adaptive()).rank(memory, thing)) == 1
        memory.step()


def test_one_thing_is_not_looked_for_elsewhere():
    """Where it is the same, no other mug is anywhere; else the first one has been taken away."""
    finder = Finder(Adaptive())
    near, far = (finder.rank(make_home(at), "mug") for at in (NEAR, FAR))
    assert near[0].furniture == far[0].furniture == 0
    assert near[1].probability < 0.5 * far[1].probability
    assert near.places[0].position == NEAR


def test_what_was_said_to_be_moved_is_another_one():
    memory = make_home(FAR)
    memory.picked_up("7")
    memory.step()
    memory.observe(0, [Sighting("mug", id="13", position=NEAR), Sighting("mug", id="12")])
    assert not any(find_same(memory))


@pytest.mark.parametrize("confidence", [1.0, 0.6])
@pytest.mark.parametrize("num_looks", [1, 2, 9])
@pytest.mark.parametrize("policy", [Adaptive, Bayesian, Frequentist])
def test_a_look_that_misses_both_does_not_make_them_two(policy, num_looks, confidence):
    """Else their place would become likelier by that look."""
    memory, finder = make_home(NEAR), Finder(policy())
    for _ in range(num_looks):
        seen = [Sighting("mug", confidence=confidence, id="12", position=AT)]
        memory.observe(0, seen, coverage=0.4)
    for change in (lambda: memory.note_absent(0, "mug"), lambda: memory.observe(0, [])):
        before, same = rank_counter(finder, memory), find_same(memory)
        change()
        assert rank_counter(finder, memory) < before
        assert find_same(memory) == same
