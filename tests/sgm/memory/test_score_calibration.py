"""Scores of detectors as probabilities: the curve, its fit, and what a memory does with it."""

import math
import warnings

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_event import read_events
from sgm.memory.score_calibration import ScoreCalibration
from sgm.policies import Bayesian
from sgm.replay.confirmed_scores import fit_from_log
from sgm.replay.replay import replay
from simulator import SceneGraphMemory, Sighting

OPEN = ScoreCalibration.open_vocabulary()


def make_home(**options):
    memory = SceneGraphMemory(**options)
    kitchen, office = memory.add_room("kitchen"), memory.add_room("office")
    counter = memory.add_furniture("counter", kitchen)
    return memory, counter, memory.add_furniture("desk", office)


def list_probabilities(memory, name):
    ranking = Finder(Bayesian()).rank(memory, name)
    return {place.furniture: place.probability for place in ranking}


def test_the_curve_is_logistic_over_logits():
    # logit(.3) = ln(3/7) = -.8473; 2 + 1.1 (-.8473) = 1.068; 1 / (1 + e^-1.068) = .7442.
    assert OPEN(0.3) == pytest.approx(0.7442, abs=1e-4)
    assert OPEN(0.5) == pytest.approx(1 / (1 + math.exp(-2)))
    assert (OPEN(0), OPEN(1)) == (0, 1)  # no scores of a detector
    grid = [OPEN(score) for score in np.linspace(0.01, 0.99, 50)]
    assert grid == sorted(grid)
    assert ScoreCalibration()(0.37) == pytest.approx(0.37)


@pytest.mark.parametrize(("slope", "offset"), [(0.7, 1.5), (2.0, -1.0), (1.1, 2.0)])
def test_labels_of_a_curve_give_the_curve_back(slope, offset):
    rng, true = np.random.default_rng(0), ScoreCalibration(slope, offset)
    scores = rng.uniform(0.02, 0.98, 4000)
    right = rng.random(4000) < [true(score) for score in scores]
    fitted = ScoreCalibration.fit(scores, right)
    assert fitted.slope == pytest.approx(slope, abs=0.15)
    assert fitted.offset == pytest.approx(offset, abs=0.2)


def test_the_fit_is_where_the_gradient_is_zero():
    scores, right = np.linspace(0.1, 0.9, 40), np.arange(40) % 3 > 0
    fitted = ScoreCalibration.fit(scores, right)
    logits = np.log(scores / (1 - scores))
    wrong = np.array([fitted(score) for score in scores]) - right
    # One sighting's weight pulls to slope 1 and offset 0.
    assert wrong @ logits + (fitted.slope - 1) == pytest.approx(0, abs=1e-4)
    assert wrong.sum() + fitted.offset == pytest.approx(0, abs=1e-4)


def test_labels_that_are_all_alike_give_a_curve():
    fitted = ScoreCalibration.fit([0.2] * 30, [1] * 30)
    assert 0.8 < fitted(0.2) < 1


@pytest.mark.parametrize(
    ("scores", "right", "message"),
    [
        ([0.5] * 3, [1] * 3, "at least 20, got 3"),
        ([0.5] * 30, [1] * 29, "as many as the scores, got 29 for 30"),
        ([1.5] * 30, [1] * 30, "scores must be numbers from 0 to 1"),
        (["high"] * 30, [1] * 30, "scores must be numbers from 0 to 1"),
        ([0.5] * 30, [math.nan] * 30, "is_right must be numbers from 0 to 1"),
    ],
)
def test_bad_labels_are_one_line(scores, right, message):
    with pytest.raises(ValueError, match=message):
        ScoreCalibration.fit(scores, right)


@pytest.mark.parametrize("values", [(0, 0), (-1, 0), (math.nan, 0), (1, math.inf), ("1", 0)])
def test_a_curve_out_of_range_is_refused(values):
    with pytest.raises(ValueError, match=r"slope must|offset must"):
        ScoreCalibration(*values)


def test_a_score_of_an_open_vocabulary_detector_is_a_sighting():
    memory, counter, desk = make_home(score_calibration=OPEN)
    memory.observe(desk, [Sighting("cup", confidence=0.3)])
    found = list_probabilities(memory, "cup")
    assert found[desk] == pytest.approx(OPEN(0.3), abs=0.02)
    assert found[desk] > 2 * found[counter]
    memory, counter, desk = make_home()
    with pytest.warns(UserWarning, match="1 of 1 confidences"):
        memory.observe(desk, [Sighting("cup", confidence=0.3)])
    found = list_probabilities(memory, "cup")
    assert found[desk] < found[counter]


def test_low_scores_are_warned_of_once_in_a_memory():
    memory, counter, desk = make_home()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        memory.observe(desk, [Sighting("cup", confidence=0.9), Sighting("pen", confidence=0.3)])
        memory.observe(desk, [Sighting("cup", confidence=0.0)])  # no score
    with pytest.warns(UserWarning, match=r"2 of 3 .*ScoreCalibration.open_vocabulary"):
        memory.observe(
            desk, [Sighting(name, confidence=0.2 + n / 4) for n, name in enumerate("abc")]
        )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        memory.observe(counter, [Sighting("cup", confidence=0.1)])
        memory.copy().observe(counter, [Sighting("cup", confidence=0.1)])


def test_the_curve_is_saved_with_the_memory_and_copied(tmp_path):
    memory, _, desk = make_home(score_calibration=OPEN)
    memory.observe(desk, [Sighting("cup", confidence=0.3)])
    memory.save(tmp_path / "home.sgm")
    again = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert again.score_calibration == memory.copy().score_calibration == OPEN
    np.testing.assert_array_equal(again.batch.edges["confidence"], memory.batch.edges["confidence"])
    other = ScoreCalibration(2.0, 0.5)
    changed = SceneGraphMemory.load(tmp_path / "home.sgm", score_calibration=other)
    assert changed.score_calibration == other
    assert make_home()[0].score_calibration is None
    with pytest.raises(TypeError, match="score_calibration must be a ScoreCalibration"):
        SceneGraphMemory(score_calibration=0.5)


def test_a_log_holds_the_scores_and_replays_to_the_memory(tmp_path):
    path = tmp_path / "looks.sgm"
    memory, counter, desk = make_home(score_calibration=OPEN, path=path)
    memory.observe(desk, [Sighting("cup", confidence=0.3)])
    memory.step()
    memory.observe(counter, [Sighting("pan", confidence=0.15)])
    looks = [event.values["seen"] for event in read_events(path) if event.kind == "look"]
    assert [look[0][2] for look in looks] == [0.3, 0.15]
    *_, (again, _, _) = replay(read_events(path))
    assert again.score_calibration == OPEN
    np.testing.assert_array_equal(again.batch.edges["confidence"], memory.batch.edges["confidence"])
    np.testing.assert_array_equal(again.batch.edges["missed"], memory.batch.edges["missed"])


@pytest.mark.slow
def test_scores_are_fitted_from_looks_that_later_ones_confirm(tmp_path):
    """A detector that is right more often than it says: 90 % of what is there is seen again."""
    path, rng = tmp_path / "looks.sgm", np.random.default_rng(0)
    true = ScoreCalibration(1.0, 1.5)
    memory, _, desk = make_home(score_calibration=ScoreCalibration(), path=path)
    for turn in range(300):
        score = rng.uniform(0.05, 0.95)
        name = f"thing {turn}"
        memory.observe(desk, [Sighting(name, confidence=score)])
        memory.step()
        confirmed = rng.random() < 0.9 * true(score)
        memory.observe(desk, [Sighting(name)] if confirmed else [])
        memory.step()
        memory.remove_object(name) if name in memory.descriptions else None
    fitted = fit_from_log(path)
    for score in (0.2, 0.4, 0.6):
        assert fitted(score) == pytest.approx(true(score), abs=0.12)


def test_a_log_without_scores_says_so(tmp_path):
    path = tmp_path / "looks.sgm"
    memory, _, desk = make_home(path=path)
    for _ in range(30):
        memory.observe(desk, [Sighting("cup")])
        memory.step()
    with pytest.raises(ValueError, match=r"at least 20 scores .* got 0"):
        fit_from_log(path)
