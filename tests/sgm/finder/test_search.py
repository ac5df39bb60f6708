"""Searches in a home with habits: everything that is there is found, whatever the policy."""

import itertools

import pytest

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian, Frequentist, Priors

MOST_LOOKS = 30


def search(home, finder, thing, **arguments):
    """Look as docs/robot.md does, until it is found or given up; return the search."""
    looking = finder.search(home.memory, thing, **arguments)
    while (look := looking.next()) is not None:
        if looking.seen(home.look(look.place.furniture)):
            break
    return looking


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
    assert max(num_looks) <= len(home.furniture)
    if policy is Bayesian:
        assert sum(num_looks) / 108 < 4  # 9.5 at random


def test_a_detector_that_misses_takes_a_second_round(make_home):
    home = make_home(seed=1, miss_rate=0.25)
    finder = Finder(Bayesian())
    found = [search(home, finder, thing) for thing in home.at]
    assert sum(one.is_found for one in found) >= 27  # thrice missed: one in 64
    assert max(one.num_looks for one in found) <= 3 * len(home.furniture)


def test_no_place_twice_before_all_were_looked_at(make_home):
    home = make_home()
    looking = Finder(Bayesian()).search(home.memory, "wrench")
    offered = []
    while (look := looking.next()) is not None:
        offered.append(look.place.furniture)
        looking.seen(home.look(look.place.furniture))
        if len(offered) % 5 == 0:
            home.pass_time()
    num = len(home.furniture)
    assert len(set(offered[:num])) == num
    assert not looking.is_found
    assert looking.outcome.startswith("wrench: all that can be reached was looked at, elsewhere ")
    assert looking.ranking.elsewhere > 0.8


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
    never_looked = finder.rank(make_home().memory, "scissors").elsewhere
    assert never_looked < after.elsewhere < before.elsewhere


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


def test_a_closed_room_and_a_place_without_a_way(make_home):
    home = make_home()
    bathroom = home.furniture[13:16]
    looking = Finder(Bayesian()).search(
        home.memory, "wrench", start="door", exclude=bathroom[:2],
        distance=lambda a, b: float("inf") if b == bathroom[2] else 1.0,
    )  # fmt: skip
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


def test_what_is_behind_a_closed_door_is_not_looked_for_again_and_again():
    """Keys were seen in the hall; with it closed, one round elsewhere is enough, and it is said."""
    memory = SceneGraphMemory()
    hall, kitchen = memory.add_room("hall"), memory.add_room("kitchen")
    rack = memory.add_furniture("shoe rack", hall)
    reached = [memory.add_furniture(label, kitchen) for label in ("fridge", "sink")]
    memory.observe(rack, [Sighting("keys")])
    search = Finder(Bayesian()).search(memory, "keys", exclude=[rack])
    looked = []
    while (look := search.next()) is not None:
        looked.append(look.place.furniture)
        search.not_found()
    assert sorted(looked) == reached
    assert "shoe rack in hall, which cannot be reached, 9" in search.outcome  # per cent
