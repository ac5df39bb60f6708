"""Orders of looks beside each other: the same misses for all, and what each of them does."""

import pytest

from sgm.belief import Detector
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian
from tools.bench.robot_life import FinderQuestion
from tools.searches.search_orders import MOST_LOOKS, SEARCHERS, search_all

# Of one whose second look shows most of what the first one missed.
SECOND_LOOKS_SHOW = Detector(0.25, repeated_share=0.2)


def make_memory() -> SceneGraphMemory:
    """A mug on the first of eight shelves, an hour ago."""
    memory = SceneGraphMemory()
    room = memory.add_room("study")
    for number in range(8):
        memory.add_furniture("shelf", room, f"shelf {number}")
    memory.observe(0, [Sighting("mug")])
    memory.step()
    return memory


def list_looks(who: str, most: int) -> list[int]:
    """Where a searcher looks if nothing shows the mug."""
    places = []
    for furniture in SEARCHERS[who](Finder(Bayesian(), SECOND_LOOKS_SHOW), make_memory(), "mug"):
        places.append(furniture)
        if len(places) == most:
            break
    return places


def test_searchers_differ_in_when_they_come_back():
    assert list_looks("everywhere first", 9)[:8] != [0] * 8
    assert sorted(list_looks("everywhere first", 8)) == list(range(8))
    assert list_looks("greedy", 4)[:2] == [0, 0]
    assert list_looks("search", 2) == [0, 0]
    assert len(set(list_looks("search", 24))) == 8
    assert len(list_looks("search", 100)) == 24  # three a place


def test_a_search_is_greedy_where_looks_are_independent_and_cost_the_same():
    """Then the best gain per cost is the likeliest place, and both know the same."""
    looks = {}
    for who in ("greedy", "search"):
        finder = Finder(Bayesian(), Detector(0.25, repeated_share=0.0))
        steps = SEARCHERS[who](finder, make_memory(), "mug")
        looks[who] = [next(steps) for _ in range(9)]
    assert looks["greedy"] == looks["search"]
    assert looks["greedy"] != list_looks("greedy", 9)  # of one that expects repeated misses


@pytest.mark.parametrize("who", SEARCHERS)
def test_a_search_that_misses_nothing_is_one_look(who):
    asked = [FinderQuestion(make_memory(), "mug", frozenset([0]))]
    scores = search_all(Finder(Bayesian()), SEARCHERS[who], asked, 0.0, 0.0, 0)
    assert scores == {"within": 1.0, "found": 1.0, "looks": 1.0}
    assert asked[0].memory.time == 1  # only read


@pytest.mark.parametrize("who", SEARCHERS)
def test_what_no_look_shows_is_not_found(who):
    asked = [FinderQuestion(make_memory(), "mug", frozenset([0]))] * 2
    scores = search_all(Finder(Bayesian()), SEARCHERS[who], asked, 1.0, 0.0, 0)
    assert (scores["within"], scores["found"]) == (0, 0)
    assert scores["looks"] <= MOST_LOOKS


def test_all_searchers_meet_the_same_misses():
    asked = [FinderQuestion(make_memory(), "mug", frozenset([0]))] * 40
    finder = Finder(Bayesian(), SECOND_LOOKS_SHOW)
    greedy, search = (
        search_all(finder, SEARCHERS[who], asked, 0.4, 0.0, 3) for who in ("greedy", "search")
    )
    # Both look at the shelf first, and again: what differs is what they do after three misses.
    assert search["looks"] <= 1.05 * greedy["looks"]
    assert search["found"] == 1.0


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_misses_are_repeated_as_often_as_is_said(share):
    """By hand: with half of the looks missing, 20 looks find all but `share` of that half."""
    asked = [FinderQuestion(make_memory(), "mug", frozenset(range(8)))] * 400

    def look_at_one(finder, memory, thing):
        while True:
            yield 0

    scores = search_all(Finder(Bayesian()), look_at_one, asked, 0.5, share, 1)
    assert scores["found"] == pytest.approx(1 - 0.5 * share, abs=0.06)
    first = search_all(Finder(Bayesian()), lambda *_: iter([0]), asked, 0.5, share, 1)
    assert first["found"] == pytest.approx(0.5, abs=0.06)
