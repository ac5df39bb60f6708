"""Calibration: known parameters are found again, and searches are what they say."""

import numpy as np
import pytest

from nep.players.calibration_searches import Decisions, find_absent, play_searches
from nep.players.fit_calibration import Calibration, fit_calibration, measure_calibration
from sgm.policies.policy import Policy
from simulator import HomeConfig, PriorGraph, SampledHomes, SceneGraphMemory, Sighting, Streams
from simulator.policies import make_policy


def sample_searches(truth: Calibration, count: int, seed: int) -> Decisions:
    """Decisions whose outcome is drawn from the probabilities of a known calibration."""
    rng = np.random.default_rng(seed)
    scores = rng.normal(0, 3, (count, 8))
    is_absent = rng.random((count, 8)) < 0.2
    probability = truth.compute_probabilities(scores, is_absent)
    choice = (probability.cumsum(axis=1) > rng.random((count, 1))).argmax(axis=1)
    answers = choice[:, None] == np.arange(9)
    return Decisions(
        scores, scores, is_absent, answers, np.arange(count) % 3, truth.elsewhere_share
    )


@pytest.mark.slow
def test_known_parameters_are_found_again():
    truth = Calibration(temperature=1.7, elsewhere_share=0.1)
    found = fit_calibration(sample_searches(truth, 40_000, seed=0))
    assert found.temperature == pytest.approx(1.7, abs=0.1)
    assert found.elsewhere_share == 0.1
    assert found.best_slope == pytest.approx(0, abs=0.15)  # three standard errors
    unseen = sample_searches(truth, 20_000, seed=1)
    before, after = measure_calibration(unseen, Calibration()), measure_calibration(unseen, found)
    assert after["nll"] < before["nll"]
    assert before["ece"] > 0.1  # overconfident, and never elsewhere
    assert after["ece"] < 0.02
    assert after["ece_elsewhere"] < 0.02


def test_elsewhere_is_likelier_without_a_good_place():
    # Logits ln 3 and 0: best 3/4; three of 0: best 1/3. With a share of 1/5, odds 1/4, slope 1 and
    # a mean of ln(1/2): odds 1/4 * 2/3 = 1/6, elsewhere 1/7; and 1/4 * 3/2 = 3/8, elsewhere 3/11.
    calibration = Calibration(elsewhere_share=0.2, best_slope=1.0, best_mean=np.log(0.5))
    scores = np.array([[np.log(3), 0, -np.inf], [0, 0, 0], [-np.inf] * 3])
    probability = calibration.compute_probabilities(scores)
    np.testing.assert_allclose(probability[:, -1], [1 / 7, 3 / 11, 1])
    np.testing.assert_allclose(probability[0, :3], [6 / 7 * 3 / 4, 6 / 7 / 4, 0])
    assert Calibration(best_slope=3.0).compute_probabilities(scores)[0, -1] == 0  # nothing fitted


def test_one_share_for_all_questions_has_no_slope():
    truth = Calibration(elsewhere_share=0.1, best_slope=0.8, best_mean=np.log(0.7))
    found = fit_calibration(sample_searches(truth, 4_000, seed=4), alike=True)
    assert found == Calibration(found.temperature, 0.1)


@pytest.mark.slow
def test_a_known_slope_is_found_again():
    best = 0.7  # about the mean of max(p) of these scores
    truth = Calibration(elsewhere_share=0.1, best_slope=0.8, best_mean=np.log(best))
    found = fit_calibration(sample_searches(truth, 40_000, seed=2))
    assert found.best_slope == pytest.approx(0.8, abs=0.1)
    # it helps in searches that it was not fitted to
    unseen = sample_searches(truth, 20_000, seed=3)
    flat = Calibration(found.temperature, found.elsewhere_share)
    after, before = measure_calibration(unseen, found), measure_calibration(unseen, flat)
    assert after["nll"] < before["nll"]
    assert after["ece_elsewhere"] < 0.02


def test_one_right_decision_hardly_changes_the_temperature():
    # Logits 1 and 0, right: alone, temperature 0 would be best. With x = ln T and the prior,
    # log(1 + exp(-exp(-x))) + 50 x^2 is least where x = -.01 exp(-1) / (1 + exp(-1)) = -.0027.
    logits = np.array([[1.0, 0.0]])
    one = Decisions(
        logits, logits, np.zeros((1, 2), bool), np.array([[True, False, False]]),
        np.array([0]), 0.1,
    )  # fmt: skip
    assert fit_calibration(one).temperature == pytest.approx(0.9973, abs=0.0005)


def test_negative_looks_are_bayes_rule():
    # Logits ln 4 and 0: 4 : 1, and elsewhere 1/2, as 4 : 1 : 5. A look in vain at the first place
    # makes a quarter of it, the miss rate: 1 : 1 : 5.
    calibration = Calibration(elsewhere_share=0.5)
    scores = np.log([[4.0, 1.0], [4.0, 1.0]])
    is_absent = np.array([[False, False], [True, False]])
    probability = calibration.compute_probabilities(scores, is_absent)
    np.testing.assert_allclose(probability[0], np.array([4, 1, 5]) / 10)
    np.testing.assert_allclose(probability[1], np.array([1, 1, 5]) / 7)
    # Elsewhere 1/4: 12 : 3 : 5 before, 3 : 3 : 5 after.
    rare = calibration.with_share(0.25).compute_probabilities(scores, is_absent)
    np.testing.assert_allclose(rare[:, 2], [5 / 20, 5 / 11])


def test_what_older_networks_say_of_looks_is_left_out():
    old = {
        "temperature": 0.9, "absent_logit": -1.2, "elsewhere_logit": -2.1, "elsewhere_slope": 2.0,
        "elsewhere_share": 0.1,
    }  # fmt: skip
    assert Calibration.from_json(old) == Calibration(0.9, 0.1)


def test_measures_worked_by_hand():
    # Two decisions, temperature 1, logits ln 3 and 0, elsewhere impossible: (3/4, 1/4). The first
    # is right, the second wrong: nll = -(ln 3/4 + ln 1/4) / 2, and .75 said for .5 right.
    scores = np.log(np.array([[3.0, 1.0], [3.0, 1.0]]))
    answers = np.array([[True, False, False], [False, True, False]])
    searches = Decisions(
        scores, scores, np.zeros((2, 2), dtype=bool), answers, np.array([0, 1]), 0.1
    )
    got = measure_calibration(searches, Calibration())
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
    assert searches.elsewhere_share == pytest.approx(gone[first].mean())
    # 240 searches, three standard deviations of .03
    assert searches.elsewhere_share == pytest.approx(0.3, abs=0.09)
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
