"""Where a look tells most of where things are."""

from itertools import product

import numpy as np
import pytest

from sgm.belief import Detector
from sgm.finder.finder import Finder
from sgm.finder.patrol import choose_looks
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from tests.sgm.finder.test_questions_write_nothing import capture_memory


def make_memory(num_places=3, is_looked_at=True):
    """Places that have been looked at, one thing at the first."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(f"shelf {number}", room) for number in range(num_places)]
    for place in places if is_looked_at else ():
        memory.observe(place, [Sighting("mug")] if place == places[0] else [])
    memory.step()
    return memory, places


def choose(places, shown, k, memory=None):
    """Positions and gains of looks, for beliefs that are given, (V, F) each."""
    memory = make_memory(np.shape(places)[1])[0] if memory is None else memory
    believed = np.array(places, dtype=float), np.array(shown, dtype=float)
    looks = choose_looks(memory, k, (), lambda things: (memory.ask(things), *believed))
    return [look.furniture for look in looks], [look.gain for look in looks]


def compute_information(places, shown, looked):
    """Mutual information of where a thing is and what looks show, by summing over all outcomes."""
    elsewhere = 1 - places.sum()
    joint = {}
    for where, chance in enumerate([*places, elsewhere]):
        for outcome in product((False, True), repeat=len(looked)):
            likely = chance
            for place, is_seen in zip(looked, outcome, strict=True):
                sees = shown[place] if place == where else 0.0
                likely *= sees if is_seen else 1 - sees
            joint[where, outcome] = likely
    told = {}
    for (_, outcome), chance in joint.items():
        told[outcome] = told.get(outcome, 0.0) + chance
    prior = [*places, elsewhere]
    return sum(
        chance * np.log(chance / (prior[where] * told[outcome]))
        for (where, outcome), chance in joint.items()
        if chance > 0
    )


def test_the_gain_is_the_entropy_of_what_a_look_shows():
    # A detector that misses nothing: the gain is h(p). h(.5) = ln 2 = .693, h(.25) = .562.
    places, gains = choose([[0.5, 0.25, 0.25]], [[1.0, 1.0, 1.0]], 2)
    assert places[0] == 0
    assert gains[0] == pytest.approx(np.log(2))
    # It is not at the first with .5; then at either of the others with .5: .5 ln 2.
    assert gains[1] == pytest.approx(0.5 * np.log(2))


def test_a_look_that_may_miss_tells_less():
    # h(.5 * .8) - .5 h(.8) = .673 - .5 * .500 = .423.
    _, (gain,) = choose([[0.5, 0.0, 0.5]], [[0.8, 0.8, 0.8]], 1)
    assert gain == pytest.approx(0.423, abs=5e-4)


def test_gains_of_things_add_up_and_what_is_certain_adds_nothing():
    one, two = [0.5, 0.1, 0.4], [0.0, 0.5, 0.5]
    shown = [[0.9] * 3] * 3
    _, (gain,) = choose([one, two, [1.0, 0.0, 0.0]], shown, 1)
    _, (first,) = choose([[0.4, 0.1, 0.5]], [[0.9] * 3], 1)
    _, (second,) = choose([[0.5, 0.0, 0.5]], [[0.9] * 3], 1)
    assert gain > max(first, second)
    assert choose([[1.0, 0.0, 0.0]], [[0.9] * 3], 3)[1] == pytest.approx([0.0] * 3, abs=1e-9)


@pytest.mark.parametrize("seed", range(20))
def test_gains_of_several_looks_are_what_they_tell_together(seed):
    rng = np.random.default_rng(seed)
    places = rng.dirichlet(np.ones(5), size=2)[:, :4]
    shown = rng.uniform(0.3, 1.0, (2, 4))
    looked, gains = choose(places, shown, 4)
    assert sorted(looked) == [0, 1, 2, 3]
    for number in range(1, 5):
        told = sum(
            compute_information(p, s, looked[:number]) for p, s in zip(places, shown, strict=True)
        )
        assert sum(gains[:number]) == pytest.approx(told, abs=1e-9)
    first = [
        sum(compute_information(p, s, [place]) for p, s in zip(places, shown, strict=True))
        for place in range(4)
    ]
    assert looked[0] == int(np.argmax(first))


def test_places_that_were_never_looked_at_come_first():
    memory, places = make_memory()
    new = memory.add_furniture("desk", 0)
    looks = Finder(Adaptive()).next_looks(memory, k=9)
    assert looks[0].furniture == new
    assert [look.is_new for look in looks] == [True, False, False, False]
    assert looks[0].name == "desk in kitchen"
    assert str(looks[0]).endswith(" nats, never looked at")
    assert sorted(look.furniture for look in looks) == [*places, new]


def test_it_looks_where_things_are_less_certain():
    """The mug was missed by the last look, the plate has always been at its place."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    mugs, plates = memory.add_furniture("rack", room), memory.add_furniture("shelf", room)
    for _ in range(5):
        memory.observe(mugs, [Sighting("mug")])
        memory.observe(plates, [Sighting("plate")])
        memory.step()
    memory.observe(mugs, [])
    memory.step()
    finder = Finder(Adaptive(), Detector(miss_rate=0.3))
    looks = finder.next_looks(memory, k=2)
    assert looks[0].furniture == mugs
    # The same probabilities as `rank`: h(p d) - p h(d), of both things.
    gain = 0.0
    for thing in ("mug", "plate"):
        (place,) = [place for place in finder.rank(memory, thing) if place.furniture == mugs]
        p, d = place.probability, place.detection
        gain += sum(
            share * (-x * np.log(x) - (1 - x) * np.log(1 - x))
            for share, x in ((1.0, p * d), (-p, d))
        )
    assert looks[0].gain == pytest.approx(gain, abs=1e-6)


def test_a_look_of_this_step_tells_what_it_has_told():
    memory, (first, *_) = make_memory()
    finder = Finder(Adaptive())
    gains = {look.furniture: look.gain for look in finder.next_looks(memory, k=3)}
    memory.observe(first, [Sighting("mug")])
    after = {look.furniture: look.gain for look in finder.next_looks(memory, k=3)}
    assert after[first] < gains[first]


def test_excluded_places_are_not_visited_and_k_is_checked():
    memory, (first, second, third) = make_memory()
    finder = Finder(Adaptive())
    looks = finder.next_looks(memory, k=9, exclude=[first])
    assert {look.furniture for look in looks} == {second, third}
    assert len(finder.next_looks(memory)) == 1
    for k in (0, None, 1.5):
        with pytest.raises(ValueError, match="k must be at least 1"):
            finder.next_looks(memory, k)
    with pytest.raises(ValueError, match="exclude must be furniture ids"):
        finder.next_looks(memory, 1, ["x"])
    with pytest.raises(ValueError, match="memory must have furniture"):
        finder.next_looks(SceneGraphMemory())


def test_a_memory_without_things_is_explored():
    memory, places = make_memory(is_looked_at=False)
    looks = Finder(Adaptive()).next_looks(memory, k=3)
    assert sorted(look.furniture for look in looks) == places
    assert [(look.gain, look.is_new) for look in looks] == [(0.0, True)] * 3


def test_asking_writes_nothing():
    memory, _ = make_memory()
    before = capture_memory(memory)
    Finder(Adaptive()).next_looks(memory, k=2)
    assert capture_memory(memory) == before


def test_a_service_says_where_to_stand():
    memory, _ = make_memory()
    memory.add_furniture("desk", 0, position=(1.0, 2.0))
    service = MemoryService(memory, Finder(Adaptive()), None)
    listed = service.next_looks(2)
    assert (listed.status, len(listed.rows), listed.left_out) == ("ok", 2, 2)
    assert listed.rows[0].name == "desk in kitchen"
    assert listed.rows[0].position[:2] == (1.0, 2.0)
    assert MemoryService(SceneGraphMemory(), service.finder, None).next_looks().rows == ()
