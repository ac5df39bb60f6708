"""Bayes' rule over places and elsewhere, by hand and by its laws."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sgm.belief import (
    SEEN_NOW,
    Belief,
    Detector,
    compute_miss,
    compute_miss_over_steps,
    compute_stay,
)
from sgm.belief.posterior import compute_log_likelihood, see
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.seen_places import Looks
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian

NOTHING = np.zeros(3)
MEMORY = SceneGraphMemory()
MEMORY.add_furniture("desk", MEMORY.add_room("study"))


def make_looks(negative=NOTHING, sought=NOTHING, sought_ago=(np.inf,) * 3, seen=NOTHING) -> Looks:
    """Looks for one thing at three places."""
    once = (np.array(values, dtype=float)[..., None] for values in (sought, sought_ago))
    columns = (negative, *once, seen, np.array(seen) > 0)
    return Looks(*(np.array(values, dtype=float)[None] for values in columns))


def update(places, elsewhere, looks, detector):
    """Fold looks into the belief about one thing, as a finder does."""
    belief = Belief.of(np.atleast_2d(places), elsewhere)
    belief = belief.look(compute_log_likelihood(looks, MEMORY.batch, detector))
    places, elsewhere = see(belief, looks.seen.clip(0, SEEN_NOW))
    return places[0], elsewhere[0]


def test_a_negative_look_by_hand():
    # .6 x .25 = .15 at the place looked at; .3 and elsewhere .1 stay; all over .55.
    places, elsewhere = update(
        np.array([0.6, 0.3, 0.0]), 0.1, make_looks([1, 0, 0]), Detector(miss_rate=0.25)
    )
    assert places == pytest.approx([0.15 / 0.55, 0.3 / 0.55, 0])
    assert elsewhere == pytest.approx(0.1 / 0.55)


def test_looks_of_several_things_are_one_call_of_the_same_numbers():
    detector = Detector(0.3)
    one = make_looks([1, 0, 2.5], [1, 0, 0], [3, np.inf, np.inf], seen=[0, 0.8, 0])
    other = make_looks([0, 0, 0])
    both = Looks(
        *(np.concatenate([getattr(own, name) for own in (one, other)]) for name in Looks.__slots__)
    )

    def weigh(own):
        likelihood = compute_log_likelihood(own, MEMORY.batch, detector)
        return np.stack([likelihood, detector.weigh_seen(own)])

    together = weigh(both)  # (2, V, F)
    np.testing.assert_array_equal(together, np.concatenate([weigh(one), weigh(other)], axis=1))


def test_another_of_the_same_name_was_missed_where_its_like_was_seen():
    looks = make_looks([1, 0, 0], seen=[0, 0.8, 0])
    taken = looks.take([0, 0], [False, True])
    assert taken.negative.tolist() == [[1, 0, 0], [1, 1, 0]]
    assert taken.seen.tolist() == [[0, 0.8, 0], [0, 0, 0]]
    assert taken.num_seen.tolist() == [[0, 1, 0], [0, 0, 0]]
    assert looks.negative.tolist() == [[1, 0, 0]]  # they stay as they are


def test_an_estimate_joins_counts_with_usual_rates():
    memory = SceneGraphMemory()
    desk = memory.add_furniture("desk", memory.add_room("study"))
    at_first = Detector.estimate(memory)
    assert at_first == Detector()
    own = Detector(0.1, 0.5)
    assert Detector.estimate(memory, own) == own
    shown = [Sighting("mug")]
    for is_seen in (True, *[True] * 30, *[False, True] * 10):
        memory.observe(desk, shown if is_seen else [])
        memory.step()
    found = Detector.estimate(memory)
    # Of fifty looks ten missed it, those of long ago count less: 17.5 of 80 to 7.5 of 30.
    assert 17.5 / 80 < found.miss_rate < 0.25
    assert found.repeated_share == Detector().repeated_share
    missed, looks = found.counted
    assert 0 < missed < 10 < looks < 51
    assert str(found) == (
        f"a look misses {found.miss_rate:.0%} of what is there, learnt from {looks:.0f} looks that "
        f"missed {missed:.0f}; another look in the same step repeats 95% of the misses"
    )
    assert "learnt" not in str(at_first)
    steady = SceneGraphMemory()
    desk = steady.add_furniture("desk", steady.add_room("study"))
    for _ in range(50):
        steady.observe(desk, shown)
        steady.step()
    # 7.5 of 79 looks, each of which counts a little less than one.
    learnt = Detector.estimate(steady).miss_rate
    assert 7.5 / 79 <= learnt < 7.5 / 60
    # A finder without a detector has it, too: so does its probability that one look finds the mug.
    place = Finder(Bayesian()).rank(steady, "mug")[0]
    assert place.detection == pytest.approx(1 - learnt)


def test_detection_falls_from_look_to_look():
    # h = .2 x .25 = .05, a = .2 / .95: miss(1) = .25, miss(2) = .05 + .95 a^2 = .0921,
    # miss(3) = .0589, so that one more look shows it with .75, 1 - .0921 / .25, 1 - .0589 / .0921.
    detector = Detector(repeated_share=0.2)
    assert detector.miss_again == pytest.approx(0.2 / 0.95)
    found = detector.compute_detection(np.arange(3))
    assert found == pytest.approx([0.75, 0.6316, 0.3609], abs=1e-4)
    # The chance to be first falls by a: miss(n) - miss(n + 1) = .75 a^n.
    missed = detector.compute_miss(np.arange(6))
    assert missed[:-1] - missed[1:] == pytest.approx(0.75 * detector.miss_again ** np.arange(5))
    assert Detector(0.25, 0.0).compute_detection(np.arange(4)) == pytest.approx([0.75] * 4)
    assert Detector(0.0).compute_detection(np.arange(2)) == pytest.approx([1, 0])
    assert Detector(0.25, 1.0).compute_detection(np.arange(2)) == pytest.approx([0.75, 0])


def test_a_visit_is_a_look_however_many_frames_it_has():
    """By default ten looks of a step say hardly more than one: .95 x .25 is missed by all."""
    missed = Detector().compute_miss(np.array([1, 2, 10]))
    assert missed == pytest.approx([0.25, 0.2375, 0.2375], abs=1e-3)
    assert Detector().compute_detection(np.array([0, 1, 9])) == pytest.approx(
        [0.75, 1 - 0.2377 / 0.25, 0], abs=1e-3
    )


def test_looks_after_a_sighting_count_against_it():
    # Seen with .97; one later look of the step missed it: .97 x .25 / (.97 x .25 + .03) = .8899.
    looks = make_looks([1, 0, 0], seen=[1.0, 0, 0.6])
    assert Detector().weigh_seen(looks)[0] == pytest.approx([0.2425 / 0.2725, 0, 0.6])
    memory = SceneGraphMemory()
    desk = memory.add_furniture("desk", memory.add_room("study"))
    chances = []
    for seen in ([Sighting("mug")], [], [], [Sighting("mug")]):
        memory.observe(desk, seen)
        chances.append(Finder(Bayesian()).rank(memory, "mug")[0].probability)
    assert chances[0] == chances[3] == pytest.approx(SEEN_NOW)
    assert chances[1] == pytest.approx(0.2425 / 0.2725)
    assert chances[2] < chances[1]  # it stayed at 97 % beside "not in the latest look"


def test_half_a_view_is_half_a_look():
    # 1 - .5 x .75 = .625 of the things there are missed.
    places, _ = update(
        np.array([0.5, 0.5, 0.0]), 0.0, make_looks([0.5, 0, 0]), Detector(miss_rate=0.25)
    )
    assert places[0] / places[1] == pytest.approx(0.625)


def test_looks_of_one_step_by_hand():
    # A fifth of .25 is missed by every look, h = .05, the others by each anew: i = .2 / .95.
    # Two looks: .05 + .95 (.2 / .95)^2; one and a half: half way from .25 to that.
    two = 0.05 + 0.04 / 0.95
    looks = np.array([0, 1, 1.5, 2, 100])
    expected = [1, 0.25, (0.25 + two) / 2, two, 0.05]
    assert compute_miss(looks, 0.25, 0.2) == pytest.approx(expected)
    assert compute_miss(looks, 0.25, 0.0)[3] == pytest.approx(0.25**2)
    assert compute_miss(looks, 0.25, 1.0)[1:] == pytest.approx(0.25)
    assert compute_miss(looks, 0.0, 0.5).tolist() == [1, 0, 0, 0, 0]


def test_ten_frames_of_one_look_do_not_rule_a_place_out():
    # .97 x .05 = .0485 to .03 elsewhere: 62 %; independent looks would say .97 x .25^10, nothing.
    looks = make_looks([10, 0, 0])
    places, _ = update([0.97, 0.0, 0.0], 0.03, looks, Detector(repeated_share=0.2))
    assert places[0] == pytest.approx(0.0485 / 0.0785, abs=1e-3)
    independent, _ = update(
        [0.97, 0.0, 0.0], 0.03, make_looks([10, 0, 0]), Detector(repeated_share=0.0)
    )
    assert independent[0] < 1e-4


@given(st.floats(0, 0.99), st.floats(0, 1), st.floats(0, 20), st.floats(0, 20))
def test_more_looks_never_miss_more(miss_rate, share, some, more):
    few, many = compute_miss(np.array([some, some + more]), miss_rate, share)
    assert 0 <= many <= few + 1e-12
    assert few <= 1
    assert many >= share * miss_rate - 1e-12


def test_a_look_for_it_alone_says_less_the_longer_it_is_ago():
    # Half a look, which misses .625, at each of two places of .45: 1 - .375 stay of them is left.
    # A thing moves .5 times in 15 hours before anything was seen, and a step is an hour.
    belief = np.array([0.45, 0.45, 0.0])
    for ago in (2, 20):
        looks = make_looks(sought=[0.5, 0.5, 0], sought_ago=[ago, ago, np.inf])
        assert compute_stay(MEMORY.batch, np.array(ago)) == pytest.approx(np.exp(-ago / 30))
        left = 0.9 * (1 - 0.375 * np.exp(-ago / 30))
        places, elsewhere = update(belief, 0.1, looks, Detector(0.25))
        assert elsewhere == pytest.approx(0.1 / (0.1 + left))
        assert places == pytest.approx([0.5 * left / (0.1 + left)] * 2 + [0])


def test_seen_now_is_known_now():
    places, elsewhere = update(
        np.array([0.01, 0.09, 0.0]), 0.9, make_looks(seen=[1, 0, 0]), Detector()
    )
    assert places[0] == SEEN_NOW >= 0.95
    # The rest keeps its proportions, .09 to .9.
    assert places[1] == pytest.approx(0.03 * 0.09 / 0.99)
    assert elsewhere == pytest.approx(0.03 * 0.9 / 0.99)
    doubtful, _ = update(np.array([0.2, 0.3, 0.4]), 0.1, make_looks(seen=[0.6, 0, 0]), Detector())
    assert doubtful[0] == pytest.approx(0.6)


def test_a_doubtful_sighting_at_the_only_place_leaves_the_rest_elsewhere():
    places, elsewhere = see(Belief(np.array([[0.0, -np.inf]])), np.array([[0.6]]))
    assert places.tolist() == [[0.6]]
    assert elsewhere.tolist() == pytest.approx([0.4])


def test_weights_and_logits_by_hand():
    belief = Belief.of(np.array([[1.0, 3.0], [0.0, 0.0]]), np.array([0.2, 0.2]))
    assert belief.probabilities[0] == pytest.approx([0.2, 0.6, 0.2])
    assert belief.probabilities[1].tolist() == [0, 0, 1]  # where nothing has weight: elsewhere
    logits = np.array([[7.0, 7.0 + np.log(3)], [-np.inf, -np.inf]])
    same = Belief.of_logits(logits, np.array([0.2, 0.2]))
    np.testing.assert_allclose(same.probabilities, belief.probabilities, atol=1e-12)
    assert belief.take([1, 0, 0]).elsewhere.tolist() == pytest.approx([1, 0.2, 0.2])


SHARE = st.floats(0, 1)
ROW = st.lists(SHARE, min_size=3, max_size=3)


@given(ROW, SHARE, ROW, ROW, st.floats(0, 0.99))
def test_probabilities_sum_to_one(places, elsewhere, negative, sought, miss_rate):
    total = sum(places) + elsewhere
    if total < 1e-6:
        return
    belief = np.array(places) / total
    looks = make_looks(negative, sought, [2, 5, np.inf])
    new, gone = update(belief, elsewhere / total, looks, Detector(miss_rate))
    assert (new >= 0).all()
    if new.sum() + gone > 0:  # a detector that never misses can rule everything out
        assert new.sum() + gone == pytest.approx(1)
    if sum(places) > 1e-6:
        same, _ = update(belief, elsewhere / total, make_looks(), Detector())
        assert same == pytest.approx(belief)


@pytest.mark.parametrize("value", [-0.1, 1.0, float("nan")])
def test_bad_rates_are_named(value):
    with pytest.raises(ValueError, match=r"miss_rate must lie in \[0, 1\), got"):
        Detector(miss_rate=value)


def test_misses_in_other_time_steps_by_hand():
    """Of mean .2, correlated by a tenth: .2, then .2 .28, then .2 .28 .345..., and never zero.

    The next look misses with (1.8 + n) / (9 + n), after n that did.
    """
    looks = np.array([[0, 1, 2, 3, 12, 10**9]])
    missed = compute_miss_over_steps(looks, np.array([[0.2]]))[0]
    assert missed[:4] == pytest.approx([1, 0.2, 0.2 * 0.28, 0.2 * 0.28 * 3.8 / 11])
    assert 0 < missed[5] < 1e-6 < missed[4] < 1e-4
    assert compute_miss_over_steps(looks, np.array([[0.0]])).tolist() == [[1, 0, 0, 0, 0, 0]]
    drawn = np.random.default_rng(0).beta(1.8, 7.2, 100_000)  # the things' own miss rates
    assert (drawn**3).mean() == pytest.approx(missed[3], rel=0.05)
