"""Searches are what they say, and how far probabilities can be believed is worked by hand."""

import numpy as np
import pytest

from nep.players.calibration_searches import (
    Decisions,
    find_absent,
    measure_calibration,
    play_searches,
)
from sgm.evidence.elsewhere import ELSEWHERE
from sgm.policies.policy import Policy
from simulator import HomeConfig, PriorGraph, SampledHomes, SceneGraphMemory, Sighting, Streams
from simulator.policies import make_policy


def make_decisions(scores, is_absent, answers, num_looks):
    return Decisions(scores, scores, is_absent, answers, np.array(num_looks))


def test_negative_looks_are_bayes_rule():
    # Logits ln 4 and 0: 4 : 1, and elsewhere 1/10: 36 : 9 : 5 of 50. A look at the first place that
    # does not show it leaves a quarter of it, the miss rate: 9 : 9 : 5 of 23. The truth is there.
    scores = np.log([[4.0, 1.0], [4.0, 1.0]])
    is_absent = np.array([[False, False], [True, False]])
    answers = np.array([[True, False, False], [True, False, False]])
    got = measure_calibration(make_decisions(scores, is_absent, answers, [0, 1]))
    assert got["nll"] == pytest.approx(-(np.log(36 / 50) + np.log(9 / 23)) / 2)
    assert got["elsewhere_there"] == pytest.approx((5 / 50 + 5 / 23) / 2)


def test_what_is_ruled_out_everywhere_is_elsewhere():
    scores = np.array([[0.0, np.log(3), -np.inf], [-np.inf] * 3])
    answers = np.array([[False, True, False, False], [False, False, False, True]])
    decisions = make_decisions(scores, np.zeros((2, 3), bool), answers, [0, 0])
    # Three quarters of .9 for the second place; and elsewhere for sure.
    got = measure_calibration(decisions)
    assert got["nll"] == pytest.approx(-np.log(0.9 * 3 / 4) / 2)
    assert got["elsewhere_gone"] == pytest.approx(1)
    assert got["elsewhere_there"] == pytest.approx(ELSEWHERE)


def test_measures_worked_by_hand():
    # Two decisions, asked again, logits ln 3 and 0, without elsewhere: (3/4, 1/4). The first
    # is right, the second wrong: nll = -(ln 3/4 + ln 1/4) / 2, and .75 said for .5 right.
    scores = np.log(np.array([[3.0, 1.0], [3.0, 1.0]]))
    answers = np.array([[True, False, False], [False, True, False]])
    searches = make_decisions(scores, np.zeros((2, 2), dtype=bool), answers, [0, 1])
    got = measure_calibration(searches, asks_again=True)
    assert got["nll"] == pytest.approx(-np.log(3 / 16) / 2)
    assert got["ece"] == pytest.approx(0.25)
    assert got["ece_first"] == pytest.approx(0.25)  # .75 said, 1 right
    assert (got["elsewhere_there"], got["elsewhere_gone"]) == (0, 0)


def test_absent_is_what_this_time_step_has_looked_for_in_vain():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    places = [memory.add_furniture("counter top", kitchen) for _ in range(3)]
    memory.observe(places[0], [])
    memory.step()
    memory.observe(places[1], [])
    memory.observe(places[2], [Sighting("mug")])
    assert find_absent(memory.batch, memory.query("mug")).tolist() == [[False, True, False]]
    assert find_absent(memory.batch, memory.query("cup")).tolist() == [[False, True, True]]
    memory.step()
    assert not find_absent(memory.batch, memory.query("cup")).any()


def test_searches_in_homes():
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", range(8)))
    policy = make_policy("bayesian", homes)
    searches = play_searches(homes, policy, 30, max_looks=5, elsewhere_share=0.3)
    first = searches.num_looks == 0
    assert first.sum() == 8 * 30
    assert searches.num_looks.max() == 4
    assert not searches.is_absent[first].any()
    # No place is looked at twice: after n looks in vain, n places are absent.
    assert (searches.is_absent.sum(axis=1) == searches.num_looks).all()
    assert (searches.answers.any(axis=1)).all()
    gone = searches.answers[:, -1]
    assert not searches.answers[gone, :-1].any()
    # 240 searches, three standard deviations of .03
    assert gone[first].mean() == pytest.approx(0.3, abs=0.09)
    # What is not there is searched to the end more often.
    assert gone[searches.num_looks == 4].mean() > 1.3 * gone[first].mean()


def test_the_same_homes_give_the_same_searches():
    def play():
        homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(3, "val", range(2)))
        return play_searches(homes, make_policy("bayesian", homes), 4)

    one, other = play(), play()
    np.testing.assert_array_equal(one.scores, other.scores)
    np.testing.assert_array_equal(one.answers, other.answers)


class NoOpinion(Policy):
    """Says nothing about any place, not even that it is no place."""

    def scores(self, memory, queries):
        return np.zeros((len(queries.home), memory.num_furniture))


def test_a_search_ends_when_all_of_a_small_home_was_looked_at():
    """Nobody sees anything: 3 looks in a home of 3 places beside a home of 10."""
    configs = [
        HomeConfig(rooms=("kitchen",), furniture_per_room=size, detection_error=1.0)
        for size in (3, 10)
    ]
    homes = SampledHomes(PriorGraph.default(), configs, Streams(0, "val", range(2)))
    found = play_searches(homes, NoOpinion(), 5, max_looks=8)
    # Decisions of a search: one per look, and a last one where no place was left before 8 looks.
    assert len(found.scores) == 5 * (4 + 8)
    assert found.is_absent.sum(axis=1).max() == 7
