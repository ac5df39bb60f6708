"""Bayes' rule over places and elsewhere, by hand and by its laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.memory.asking import Looks
from simulator.robot.belief import SEEN_NOW, Detector, join_beliefs, update_belief

NOTHING = np.zeros(3)


def make_looks(
    in_vain=NOTHING, before=NOTHING, ago=NOTHING, seen=NOTHING, remembered=(True, True, True)
) -> Looks:
    """One earlier look at each place at most, `ago` steps ago, with a weight of `before`."""
    columns = (in_vain, np.array(ago)[:, None], np.array(before)[:, None], seen)
    return Looks(*(np.array(values, dtype=float) for values in columns), np.array(remembered))


def test_a_look_in_vain_by_hand():
    # .6 x .25 = .15 at the place looked at; .3 and elsewhere .1 stay; all over .55.
    places, elsewhere = update_belief(
        np.array([0.6, 0.3, 0.0]), 0.1, make_looks([1, 0, 0]), Detector(miss_rate=0.25)
    )
    assert places == pytest.approx([0.15 / 0.55, 0.3 / 0.55, 0])
    assert elsewhere == pytest.approx(0.1 / 0.55)


def test_half_a_view_is_half_a_look():
    places, _ = update_belief(
        np.array([0.5, 0.5, 0.0]), 0.0, make_looks([0.5, 0, 0]), Detector(miss_rate=0.25)
    )
    assert places[0] / places[1] == pytest.approx(0.25**0.5)


def test_an_old_look_says_less():
    # One look in vain: 1 - .75 x .9^s.
    belief = np.array([0.5, 0.5, 0.0])
    for ago in (1, 5, 50):
        looks = make_looks(before=[1, 0, 0], ago=[ago, 0, 0])
        places, _ = update_belief(belief, 0.0, looks, Detector(0.25, leave_rate=0.1))
        assert places[0] / places[1] == pytest.approx(1 - 0.75 * 0.9**ago)
        # Whoever made the belief has counted it: all of it, or half.
        same, _ = update_belief(belief, 0.0, looks, Detector(0.25, 0.1), looks_counted=1)
        assert same == pytest.approx(belief)
        half, _ = update_belief(belief, 0.0, looks, Detector(0.25, 0.1), looks_counted=0.5)
        assert half[0] / half[1] == pytest.approx((1 - 0.75 * 0.9**ago) ** 0.5)
        # Nobody has counted it where the thing was never seen.
        never = make_looks(before=[1, 0, 0], ago=[ago, 0, 0], remembered=[False] * 3)
        all_of_it, _ = update_belief(belief, 0.0, never, Detector(0.25, 0.1), looks_counted=0.5)
        assert all_of_it == pytest.approx(places)


def test_seen_now_is_known_now():
    places, elsewhere = update_belief(
        np.array([0.01, 0.09, 0.0]), 0.9, make_looks(seen=[1, 0, 0]), Detector()
    )
    assert places[0] == SEEN_NOW >= 0.95
    # The rest keeps its proportions, .09 to .9.
    assert places[1] == pytest.approx(0.03 * 0.09 / 0.99)
    assert elsewhere == pytest.approx(0.03 * 0.9 / 0.99)
    doubtful, _ = update_belief(
        np.array([0.2, 0.3, 0.4]), 0.1, make_looks(seen=[0.6, 0, 0]), Detector()
    )
    assert doubtful[0] == pytest.approx(0.6)


def test_any_of_two_by_hand():
    # At least one of two at the first place: 1 - .5 x .8; none anywhere: .1 x .2.
    places, elsewhere = join_beliefs(np.array([[0.5, 0.4], [0.2, 0.6]]), np.array([0.1, 0.2]))
    assert places == pytest.approx([0.6, 1 - 0.6 * 0.4])
    assert elsewhere == pytest.approx(0.02)


SHARE = st.floats(0, 1)
ROW = st.lists(SHARE, min_size=3, max_size=3)


@given(ROW, SHARE, ROW, ROW, st.floats(0, 0.99), st.floats(0, 0.99))
def test_probabilities_sum_to_one(places, elsewhere, in_vain, before, miss_rate, leave_rate):
    total = sum(places) + elsewhere
    if total < 1e-6:
        return
    belief = np.array(places) / total
    looks = make_looks(in_vain, before, [3, 0, 7])
    new, gone = update_belief(belief, elsewhere / total, looks, Detector(miss_rate, leave_rate))
    assert (new >= 0).all()
    if new.sum() + gone > 0:  # a detector that never misses can rule everything out
        assert new.sum() + gone == pytest.approx(1)
    order = update_belief(belief, elsewhere / total, make_looks(), Detector())[0]
    assert order == pytest.approx(belief)


@pytest.mark.parametrize("value", [-0.1, 1.0, float("nan")])
def test_bad_rates_are_named(value):
    with pytest.raises(ValueError, match=r"miss_rate must lie in \[0, 1\), got"):
        Detector(miss_rate=value)
    with pytest.raises(ValueError, match=r"leave_rate must lie in \[0, 1\), got"):
        Detector(leave_rate=value)
