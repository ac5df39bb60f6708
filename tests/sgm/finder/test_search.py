"""Searches in a home with habits: everything that is there is found, whatever the policy."""

import itertools
import re

import numpy as np
import pytest

from sgm.belief import Detector, compute_stay
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian, Frequentist, Priors

MOST_LOOKS = 30


def make_home_of_places(number):
    """A memory of a study with so many shelves."""
    memory = SceneGraphMemory()
    room = memory.add_room("study")
    for place in range(number):
        memory.add_furniture("shelf", room, f"shelf {place}")
    return memory


def search(home, finder, thing, **arguments):
    """Look as docs/robot/search.md does, until it is found or given up; return the search."""
    looking = finder.search(home.memory, thing, **arguments)
    while (look := looking.next()) is not None:
        if looking.seen(home.look(look.place.furniture)):
            break
    return looking


FINDERS = {
    "rule": lambda: Finder(Adaptive()),
    "counts": lambda: Finder(Bayesian()),
    "network": ObjectFinder.load,
    "detector": lambda: Finder(Adaptive(), Detector(miss_rate=0.1)),
}


@pytest.mark.parametrize("steps_per_look", [0, 1])
@pytest.mark.parametrize("num_places", [1, 4, 7])
@pytest.mark.parametrize("name", FINDERS)
def test_a_search_through_some_places_takes_as_many_looks(name, num_places, steps_per_look):
    """Wherever the thing has gone since it was seen, and where it is nowhere."""
    finder = FINDERS[name]()
    for true_place in (None, *range(num_places)):
        memory = make_home_of_places(num_places)
        memory.observe(0, [Sighting("mug"), Sighting("bowl")])
        for place in range(1, num_places):
            memory.observe(place, [])
        memory.step()
        looking, visited = finder.search(memory, "mug"), []
        while (look := looking.next()) is not None:
            memory.step(steps_per_look)
            visited.append(look.place.furniture)
            if looking.seen([Sighting("mug")] if visited[-1] == true_place else []):
                break
        assert len(set(visited)) == len(visited), visited
        assert looking.is_found or true_place is None or looking.ranking.elsewhere >= 0.9
        assert looking.is_found or len(visited) == num_places or looking.ranking.elsewhere >= 0.9


def test_who_says_that_looks_are_independent_gets_a_second_look():
    memory = make_home_of_places(4)
    memory.observe(0, [Sighting("mug")])
    memory.step()
    looking = Finder(Adaptive(), Detector(0.25, repeated_share=0.0)).search(memory, "mug")
    for _ in range(2):
        assert looking.next().place.furniture == 0
        looking.not_found()


def test_what_is_no_look_worth_is_said_with_its_reason():
    memory = make_home_of_places(2)
    for _ in range(30):
        for place in range(2):
            memory.observe(place, [Sighting("bowl")] if place else [])
        memory.step()
    looking = Finder(Adaptive()).search(memory, "scissors")
    assert looking.next() is None
    assert re.fullmatch(
        r"scissors: no look is likely to find it, elsewhere \d+%: it was never seen here",
        looking.outcome,
    )


@pytest.mark.parametrize("policy", [Bayesian, Frequentist, Priors])
def test_what_is_there_is_found(make_home, policy):
    """The documented loop got stuck: it found 54 of 108 in 30 looks."""
    home, num_looks = make_home(), []
    finder = Finder(policy())
    for _ in range(4):
        home.pass_time()
        for thing in list(home.at)[:27]:
            looking = search(home, finder, thing)
            assert looking.is_found, thing
            num_looks.append(looking.num_looks)
    assert len(num_looks) == 108
    assert max(num_looks) <= 3 * len(home.furniture)
    assert np.mean(np.array(num_looks) <= 8) > 0.95
    if policy is Bayesian:
        assert sum(num_looks) / 108 < 4  # 9.5 at random


def test_a_detector_that_misses_takes_a_second_round(make_home):
    home = make_home(seed=1, miss_rate=0.25)
    finder = Finder(Bayesian(), Detector(0.25, repeated_share=0.2))
    found = [search(home, finder, thing) for thing in home.at]
    assert sum(one.is_found for one in found) >= 27  # thrice missed: one in 64
    assert max(one.num_looks for one in found) <= 3 * len(home.furniture)


def test_the_next_look_has_the_best_gain():
    """After a look that missed it, a place of 95 % is still the best one; then less so."""
    home = make_home_of_places(23)
    home.observe(0, [Sighting("mug")])
    home.step()
    finder = Finder(Bayesian(), Detector(repeated_share=0.2))
    looking, offered = finder.search(home, "mug"), []
    for _ in range(10):
        gains = {p.furniture: p.probability * p.detection for p in finder.rank(home, "mug")}
        look = looking.next()
        assert gains[look.place.furniture] == max(gains.values())
        offered.append(look.place.furniture)
        looking.not_found()
    assert offered[:2] == [0, 0]  # all others were offered before it was looked at again
    assert 2 <= offered.count(0) <= 5  # the share of systematic misses: no staring
    assert len(set(offered)) >= 6


@pytest.mark.parametrize("detector", [Detector(0.25, 0.2), Detector(0.25, 0.0), Detector(0.4, 0.2)])
def test_without_ways_no_other_order_finds_it_sooner(detector):
    """All 6^5 orders of five looks at six places, by the belief before the first of them."""
    home = make_home_of_places(6)
    home.observe(0, [Sighting("mug")])
    home.observe(1, [Sighting("mug")])
    home.step(20)
    finder = Finder(Bayesian(), detector)
    places = {place.furniture: place.probability for place in finder.rank(home, "mug")}
    looking, offered = finder.search(home, "mug"), []
    for _ in range(5):
        offered.append(looking.next().place.furniture)
        looking.not_found()

    missed = detector.compute_miss(np.arange(6)).tolist()  # by none to five looks at a place

    def find(order):
        """Probability that each look of an order is the first that finds it, in closed form."""
        found = []
        for number, place in enumerate(order):
            before = order[:number].count(place)
            found.append(places[place] * (missed[before] - missed[before + 1]))
        return np.cumsum(found)

    best = np.max([find(order) for order in itertools.product(places, repeat=5)], axis=0)
    assert find(tuple(offered)) == pytest.approx(best)  # after each number of looks


def test_what_has_left_is_not_toured_for(make_home):
    home = make_home()
    looking = Finder(Bayesian()).search(home.memory, "wrench")
    while (look := looking.next()) is not None:
        looking.seen(home.look(look.place.furniture))
    assert looking.num_looks < len(home.furniture)  # in a fortnight of looks nobody saw one
    assert re.match(
        r"wrench: (given up|no look is likely to find it), elsewhere (9\d|100)%", looking.outcome
    )
    assert looking.ranking.elsewhere >= 0.9


def test_give_up_at_one_ends_with_the_budget_alone(make_home):
    home = make_home()
    looking = Finder(Bayesian()).search(home.memory, "wrench", give_up_at=1)
    offered = []
    while (look := looking.next()) is not None:
        offered.append(look.place.furniture)
        looking.not_found()
    assert len(offered) == 3 * len(home.furniture)
    assert set(offered) == set(home.furniture)


@pytest.mark.parametrize("budget", [1, 4, 7.5])
def test_a_budget_of_looks(make_home, budget):
    looking = Finder(Bayesian()).search(make_home().memory, "scissors", budget=budget)
    while looking.next() is not None:
        looking.not_found()
    assert looking.num_looks == int(budget)
    assert looking.cost == looking.num_looks
    assert looking.outcome.startswith(f"scissors: budget of {budget:g} spent, elsewhere ")


def test_a_budget_of_metres():
    """At 1, 2 and 10 m from the start, in a line; a look costs half a metre."""
    home = make_home_of_places(3)
    metres = {0: 10.0, 1: 1.0, 2: 2.0}
    home.observe(0, [Sighting("mug")])
    home.step()

    def distance(here, there):
        return abs(metres.get(here, 0.0) - metres[there])

    looking = Finder(Bayesian()).search(
        home, "mug", "door", distance, look_cost=0.5, give_up_at=1, budget=5.0
    )
    costs, offered = [], []
    while (look := looking.next()) is not None:
        costs.append(look.cost)
        offered.append(look.place.furniture)
        looking.not_found()
    assert set(offered) == {1, 2}  # what is too far is never offered, however likely
    assert looking.cost == pytest.approx(sum(costs))
    assert 4.5 <= looking.cost <= 5.0
    tiny = Finder(Bayesian()).search(home, "mug", "door", distance, budget=1.5)
    assert tiny.next() is None  # the nearest is a metre away, and a look costs 1
    assert re.match(r"mug: budget of 1.5 too small for any look, elsewhere \d", tiny.outcome)
    with pytest.raises(ValueError, match=r"budget must be a number above 0, got 0"):
        Finder(Bayesian()).search(home, "mug", budget=0)


def test_a_budget_for_hopeless_places_alone_ends_the_search():
    """The mug is 10 m away; what a budget of 5 reaches holds next to nothing."""
    home = make_home_of_places(3)
    metres = {0: 10.0, 1: 1.0, 2: 2.0}
    for place in metres:
        home.observe(place, [Sighting("mug")] if place == 0 else [])

    def distance(here, there):
        return abs(metres.get(here, 0.0) - metres[there])

    finder = Finder(Bayesian())
    looking = finder.search(home, "mug", "door", distance, look_cost=0.5, budget=5.0)
    held = sum(place.probability for place in looking.ranking if place.furniture != 0)
    assert 0 < held < 0.1
    assert looking.next() is None
    shelf = looking.ranking[0].probability
    assert looking.outcome == (
        f"mug: budget of 5 too small for shelf 0 in study ({shelf:.0%}, cost 10.5, 5.0 left), "
        f"within it {held:.1%} after 0 looks"
    )
    enough = finder.search(home, "mug", "door", distance, look_cost=0.5, budget=11.0)
    assert enough.next().place.furniture == 0
    patient = finder.search(
        home, "mug", "door", distance, look_cost=0.5, budget=5.0, give_up_at=1 - held / 2
    )
    assert patient.next().place.furniture in {1, 2}


def test_looks_that_cost_nothing_are_no_staring():
    home = make_home_of_places(3)
    home.observe(0, [Sighting("mug")])
    home.step()
    looking = Finder(Bayesian()).search(
        home, "mug", "door", lambda here, there: 1.0, look_cost=0, give_up_at=1
    )
    offered = []
    for _ in range(8):
        offered.append(looking.next().place.furniture)
        looking.not_found()
    rows = [len(list(same)) for _, same in itertools.groupby(offered)]
    assert max(rows) <= 3
    assert len(set(offered)) == 3


def test_looks_of_earlier_steps_are_remembered_by_the_search():
    """A thing that was missed in three steps is as likely hidden as one missed thrice in one."""
    home = make_home_of_places(5)
    home.observe(0, [Sighting("mug")])
    home.step()
    detector = Detector(repeated_share=0.2)
    looking = Finder(Bayesian(), detector).search(home, "mug")
    detections = []
    for _ in range(3):
        look = looking.next()
        assert look.place.furniture == 0
        detections.append(look.place.detection)
        looking.not_found()
        home.step()
    # 1 - miss(n + 1) / miss(n) of what has stayed, the detection of a first look of what has come:
    # 3 % in a step at first.
    stay = float(compute_stay(home.batch, np.array(1)))
    first, second, third = detector.compute_detection(np.array([0, 1, 1 + stay]))
    expected = [first, *(stay * again + (1 - stay) * first for again in (second, third))]
    assert detections == pytest.approx(expected, abs=0.01)


def test_a_search_for_one_thing_alone_learns_too(make_home):
    """Without any sighting, of a thing that was never seen."""
    memory = make_home().memory
    looking = Finder(Bayesian()).search(memory, "wrench", give_up_at=0.5)
    elsewhere = [looking.ranking.elsewhere]
    while looking.next() is not None:
        looking.not_found()
        elsewhere.append(looking.ranking.elsewhere)
    assert all(before < after for before, after in itertools.pairwise(elsewhere))
    assert elsewhere[-1] >= 0.5
    assert "wrench" not in memory.descriptions


def test_what_was_learnt_survives_a_restart_and_a_step(make_home, tmp_path):
    home = make_home()
    finder = Finder(Bayesian())
    looking = finder.search(home.memory, "scissors")
    for _ in range(6):
        looking.next()
        looking.not_found()
    before = looking.ranking
    home.memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert finder.rank(copy, "scissors") == before
    for memory in (home.memory, copy):
        memory.step()
    after = finder.rank(copy, "scissors")
    assert after == finder.rank(home.memory, "scissors")
    never_looked, other = make_home().memory, make_home().memory
    assert finder.rank(never_looked, "scissors").elsewhere < before.elsewhere
    looking = finder.search(other, "scissors")
    for _ in range(6):
        looking.next()
        looking.seen([])
    other.step()  # looks that showed nothing at all say the same of it
    assert after.elsewhere == pytest.approx(finder.rank(other, "scissors").elsewhere, abs=0.01)


def test_a_place_twice_in_vain_cannot_stay_the_best():
    memory = SceneGraphMemory()
    room = memory.add_room("bedroom")
    desk, *others = [memory.add_furniture(label, room) for label in ("desk", "bed", "sofa", "sink")]
    memory.observe(desk, [Sighting("mug")])
    for _ in range(2):
        memory.step()
        memory.observe(desk, [])
    ranking = Finder(Bayesian()).rank(memory, "mug")
    of = {place.furniture: place.probability for place in ranking}
    assert of[desk] < 0.25
    assert others


@pytest.mark.slow
def test_a_closed_room_and_a_place_without_a_way(make_home):
    home = make_home()
    bathroom = home.furniture[13:16]
    looking = Finder(Bayesian()).search(
        home.memory,
        "wrench",
        start="door",
        exclude=bathroom[:2],
        give_up_at=1,
        distance=lambda a, b: float("inf") if b == bathroom[2] else 1.0,
    )
    offered = set()
    while (look := looking.next()) is not None:
        offered.add(look.place.furniture)
        looking.not_found()
    assert offered == set(home.furniture) - set(bathroom)


def test_found_at_once(make_home):
    home = make_home()
    finder = Finder(Bayesian())
    looking = finder.search(home.memory, "the keys")
    look = looking.next()
    looking.found()
    assert looking.next() is None
    assert looking.outcome == f"the keys: found at {look.place.name} after 1 look"
    ranking = finder.rank(home.memory, "keys")
    assert ranking[0].furniture == look.place.furniture
    assert ranking[0].probability >= 0.95


def test_misuse_is_told(make_home):
    looking = Finder(Bayesian()).search(make_home().memory, "keys")
    with pytest.raises(RuntimeError, match=r"a look must follow next\(\), got one before it"):
        looking.not_found()
    with pytest.raises(ValueError, match=r"give_up_at must lie above 0 and at most at 1, got 0"):
        Finder(Bayesian()).search(make_home().memory, "keys", give_up_at=0)


def test_what_is_behind_a_closed_door_is_said():
    """Keys were seen in the hall: with it closed, looking elsewhere finds them with 3 %."""
    memory = SceneGraphMemory()
    hall, kitchen = memory.add_room("hall"), memory.add_room("kitchen")
    rack = memory.add_furniture("shoe rack", hall)
    reached = [memory.add_furniture(label, kitchen) for label in ("fridge", "sink")]
    memory.observe(rack, [Sighting("keys")])
    search = Finder(Bayesian()).search(memory, "keys", exclude=[rack])
    assert search.next() is None
    assert "shoe rack in hall, which cannot be reached, 9" in search.outcome  # per cent
    search = Finder(Bayesian()).search(memory, "keys", exclude=[rack], give_up_at=1)
    looked = []
    while (look := search.next()) is not None:
        looked.append(look.place.furniture)
        search.not_found()
    assert set(looked) == set(reached)
    assert "shoe rack in hall, which cannot be reached, 9" in search.outcome


def test_a_search_plans_when_it_is_asked_where_to_go():
    """It planned twice before its first look."""
    home, asked = make_home_of_places(14), []

    def distance(here, there):
        asked.append(here)
        return float(abs(there - (here if isinstance(here, int) else -1)))

    looking = Finder(Bayesian()).search(home, "mug", "door", distance)
    assert set(asked) == {"door"}  # no way from place to place
    look = looking.next()
    assert look is not None
    assert set(asked) > {"door"}
