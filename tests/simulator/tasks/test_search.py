"""One search per home, look by look; the small prior of conftest.py: furniture 0-5."""

import numpy as np
import pytest

from sgm.policies.heuristics import Random
from simulator.policies import make_policy
from simulator.tasks.rollout import Rollout
from simulator.tasks.search import ByScore, Search, SearchOrder


class Always(SearchOrder):
    """The same furniture in every home, whatever is open; -1 to give up."""

    def __init__(self, furniture):
        self._furniture = furniture

    def choose(self, homes, scores, is_open, uniform):
        return np.full(len(homes), self._furniture)


@pytest.fixture
def search(make_tiny_homes):
    """Three homes with a perfect detector and the objects of the first question."""
    homes = make_tiny_homes(3, detection_error=0)
    rollout = Rollout(homes, Random())
    return Search(rollout, *rollout.ask())


def test_a_home_whose_search_is_over_is_asked_no_more(search):
    places = np.argmax(search.answers, axis=1)
    search.look(np.array([1]), places[[1]])
    assert search.is_found.tolist() == search.is_over.tolist() == [False, True, False]
    assert search.homes.tolist() == [0, 2]
    answer = search.choose(ByScore())
    assert answer.queries.home.tolist() == [0, 2]
    assert answer.is_repeat
    np.testing.assert_array_equal(answer.answers, search.answers[[0, 2]])


def test_the_first_look_is_no_repeat(search):
    assert not search.choose(ByScore()).is_repeat


def test_a_second_look_is_counted_and_changes_nothing(search):
    wrong = np.argmin(search.answers, axis=1)
    homes = np.arange(3)
    seen = search.look(homes, wrong)
    memory = search.rollout.memory
    before = memory.edges["num_observed"].copy()
    assert seen.furniture.tolist() == wrong.tolist()
    again = search.look(homes, wrong)
    assert len(again.furniture) == 0
    np.testing.assert_array_equal(memory.edges["num_observed"], before)
    assert memory.furniture_num_observed.sum() == 3
    assert search.num_looks.tolist() == [2, 2, 2]
    assert search.is_open.sum(axis=1).tolist() == [5, 5, 5]


def test_an_order_that_offers_a_place_twice_is_refused(search):
    wrong = np.argmin(search.answers, axis=1)
    search.look(np.arange(3), wrong)
    with pytest.raises(ValueError, match=rf"open place, got furniture {wrong[0]} in home 0\. Choo"):
        search.choose(Always(wrong[0]))


def test_who_gives_up_has_not_found_it(search):
    answer = search.choose(Always(-1))
    assert not answer.is_correct.any()
    search.look(np.arange(3)[1:], answer.choice[1:])
    assert search.gave_up.tolist() == search.is_over.tolist() == [False, True, True]
    assert not search.is_found.any()
    assert search.num_looks.tolist() == [0, 0, 0]


def test_where_no_place_is_left_the_search_is_given_up(search):
    search.answers[:] = False  # nobody has it
    search.max_looks = 99
    for _ in range(6):
        answer = search.choose(ByScore())
        search.look(search.homes, answer.choice)
    assert not search.is_open.any()
    answer = search.choose(ByScore())
    assert answer.choice.tolist() == [-1, -1, -1]
    search.look(search.homes, answer.choice)
    assert search.is_over.all()
    assert search.num_looks.tolist() == [6, 6, 6]


def test_max_looks_ends_a_search(make_tiny_homes):
    rollout = Rollout(make_tiny_homes(2), Random())
    search = Search(rollout, *rollout.ask(), 2)
    search.answers[:] = False
    for turn in range(2):
        assert not search.is_over.any(), turn
        search.look(search.homes, search.choose(ByScore()).choice)
    assert search.is_over.all()
    assert not search.is_found.any()


@pytest.mark.parametrize(("detection_error", "is_found"), [(0.0, True), (1.0, False)])
def test_by_sight_only_what_the_detector_sees_is_found(make_tiny_homes, detection_error, is_found):
    rollout = Rollout(make_tiny_homes(3, detection_error=detection_error), Random())
    codes, queries = rollout.ask()
    search = Search(rollout, codes, queries, ends_when_seen=True)
    search.look(np.arange(3), np.argmax(search.answers, axis=1))
    assert search.is_found.tolist() == [is_found] * 3
    # By truth it is found either way.
    search = Search(rollout, codes, queries)
    search.look(np.arange(3), np.argmax(search.answers, axis=1))
    assert search.is_found.all()


def test_scores_of_some_homes_are_rows_of_those_of_all(make_default_homes):
    homes = make_default_homes(4)
    rollout = Rollout(homes, make_policy("prior_filter", homes))
    search = Search(rollout, *rollout.ask())
    some = np.array([1, 3])
    np.testing.assert_array_equal(search.scores(some), search.scores()[some])


def test_an_object_that_is_nowhere_is_searched_for_and_not_found(make_tiny_homes):
    homes = make_tiny_homes(2)
    rollout = Rollout(homes, Random())
    rollout.evolve()
    present = set(homes.object_code[homes.is_present].tolist())
    code = next(c for c in range(homes.object_descriptions.num_descriptions) if c not in present)
    codes = np.full(2, code)
    search = Search(rollout, codes, rollout.query(np.arange(2), codes))
    while len(search.homes):
        search.look(search.homes, search.choose(ByScore()).choice)
    assert not search.is_found.any()
    assert search.num_looks.tolist() == [6, 6]
