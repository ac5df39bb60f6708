"""Similar moments beside what a policy believes."""

from dataclasses import replace
from datetime import timedelta

import numpy as np
import pytest

from sgm.belief import Belief
from sgm.evidence.similar_moments import KINDS, PastMoments, SimilarMoments
from sgm.memory.moments import MISSED, SHOWN
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from sgm.policies.rhythm import TERMS, RhythmTerms, load_weights, weigh_rhythm
from tests.sgm.evidence.test_similar_moments import MONDAY, make_home

POLICIES = ("network", "adaptive")


def list_ones():
    return np.ones(len(TERMS))


def make_similar():
    """Two moments by the hour that are alike, which make the past likelier; ten of any kind."""
    shares = np.full((1, len(KINDS), 3), 1 / 3)
    shares[0, 0] = 0.2, 0.6, 0.2
    amount, gain = np.zeros((1, len(KINDS))), np.full((1, len(KINDS)), -9.0)
    amount[0, [0, -1]] = 2, 10
    gain[0, [0, -1]] = 0.3, 0.0
    return SimilarMoments(shares, amount, gain)


def make_past(states=(SHOWN,), lag=6.0, ago=6.0):
    """Moments at the first of two places, where the thing was seen last, in the order of time."""
    agos = ago + np.arange(len(states))[::-1]
    return PastMoments(
        query=np.array([0]),
        place=np.array([0]),
        ago=agos[None],
        states=np.array([states], dtype=np.uint8),
        now=np.array([12.0]),
        lag=np.array([lag]),
        last=np.array([0]),
        detection=np.array([1.0]),
        is_place=np.ones((1, 2), dtype=bool),
    )


def make_terms(**past):
    return RhythmTerms.make(np.array([[0.5, 0.2, 0.3]]), make_similar(), make_past(**past))


def test_terms_by_hand():
    """Three answers, elsewhere the last; the thing was seen at the first six hours ago."""
    terms = make_terms()
    stay = dict(zip(TERMS, terms.stay[0], strict=True))
    # By 0.3 nats in each of ten moments the hour is exp(3) times as likely as nothing.
    hour = np.exp(3) / (np.exp(3) + 1)
    gain, amount = 0.3 * hour, 2 * hour + 10 * (1 - hour)
    known = gain / (gain + 0.02)  # ten moments are too few for a thing without a rhythm
    some = amount / (amount + 2)
    share = 0.2 * hour + (1 - hour) / 3
    # Log odds of the first: of .2 by two moments, half; of a third by ten, 10 / 12.
    assert stay["hour"] == pytest.approx(np.log(0.25) / 2 * known, rel=1e-4)
    assert stay["day"] == stay["lag"] == 0
    assert stay["any"] == pytest.approx(np.log(0.5) * 10 / 12 * known, rel=1e-4)
    assert stay["all"] == pytest.approx(np.log(share / (1 - share)) * some * known, rel=1e-4)
    assert (stay["belief"], stay["bias"]) == (0, pytest.approx(some * known, rel=1e-4))
    assert terms.others[0] == pytest.approx([0, 0.4, 0.6])
    alike = np.array([0.6 * hour + (1 - hour) / 3, 0.2 * hour + (1 - hour) / 3])
    alike /= alike.sum()
    assert terms.ratios[0] == pytest.approx([0, *np.log(alike / [0.4, 0.6])])
    assert terms.rate[0] == pytest.approx(hour * some * known, rel=1e-4)  # of .3 nats


def test_weighing_changes_the_odds_of_staying_and_the_rest_by_the_rate():
    terms = replace(make_terms(), stay=np.ones((1, len(TERMS))), rate=np.array([0.5]))
    log_belief = np.log([[0.5, 0.2, 0.3]])
    weights = np.zeros(len(TERMS))
    weights[0] = np.log(3)
    said = Belief(terms.weigh(log_belief, weights)).probabilities[0]
    assert said[0] == pytest.approx(0.75, abs=1e-5)  # three times the odds of one to one
    alike = np.exp(terms.ratios[0, 1:]) * [0.4, 0.6]
    between = np.sqrt([0.4, 0.6] * alike)
    assert said[1:] == pytest.approx(0.25 * between / between.sum(), abs=1e-5)


@pytest.mark.parametrize(("hours", "share"), [(0.0, 0.0), (0.5, 0.25), (1.0, 1.0), (6.0, 1.0)])
def test_soon_after_a_look_moments_say_less(hours, share):
    """The last look at the place counts, whether it showed the thing or missed it."""
    whole, known = make_terms(states=(SHOWN, MISSED, SHOWN, MISSED)), make_terms()
    assert (whole.stay == known.stay).all()
    soon = make_terms(states=(SHOWN, MISSED, SHOWN, MISSED), ago=hours)
    assert soon.stay == pytest.approx(whole.stay * share)
    assert soon.rate == pytest.approx(whole.rate * share)


def test_what_was_never_missed_for_so_long_is_not_known_to_come_back():
    """Longest run of misses before it came back, plus one, for each miss since, plus one."""
    at = {
        (SHOWN, SHOWN): 1,
        (SHOWN, MISSED): 1 / 2,
        (SHOWN, MISSED, MISSED, MISSED): 1 / 4,
        (SHOWN, MISSED, MISSED, SHOWN, MISSED, MISSED): 1,
        (SHOWN, MISSED, 0, SHOWN, MISSED, 0, MISSED, MISSED): 2 / 4,
    }
    for states, share in at.items():
        assert make_past(states).compute_known_share().tolist() == [share]


@pytest.mark.parametrize("policy", POLICIES)
def test_weights_ship_for_each_policy(policy):
    weights = load_weights(policy)
    assert weights.shape == (len(TERMS),)
    assert np.isfinite(weights).all()
    assert weights.any()


def ask(memory, *things):
    asked = memory.ask(things)
    believed = np.log(np.tile([0.1, 0.2, 0.3, 0.4], (len(things), 1)))
    return asked, Belief(believed)


def live(memory):
    """Five days of a wallet at one place in the morning and at another one at noon."""
    for day in range(5):
        for hour, place in ((7, 0), (12, 1)):
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            for each in range(2):
                memory.observe(each, [Sighting("wallet")] if each == place else [])
    memory.step(10)


def test_without_moments_a_belief_stays_to_the_bit():
    memory, without_clock = make_home(), SceneGraphMemory()
    without_clock.add_furniture("shelf", without_clock.add_room("kitchen"))
    for each in (memory, without_clock):
        asked, belief = ask(each, "keys")
        assert weigh_rhythm(asked.batch, asked.queries, belief, list_ones()) is belief
    live(memory)
    asked, belief = ask(memory, "passport", "wallet")
    changed = weigh_rhythm(asked.batch, asked.queries, belief, list_ones())
    assert (changed.log_weights[0] == belief.log_weights[0]).all()
    assert (changed.log_weights[1] != belief.log_weights[1]).any()


def test_what_a_policy_rules_out_stays_so():
    memory = make_home()
    live(memory)
    asked, belief = ask(memory, "wallet")
    belief.log_weights[0, 0] = -np.inf
    changed = weigh_rhythm(asked.batch, asked.queries, belief, list_ones())
    assert changed.log_weights[0, 0] == -np.inf
    assert np.isfinite(changed.probabilities).all()


def test_an_answer_does_not_depend_on_what_is_asked_beside_it():
    memory = make_home()
    for day in range(5):
        for hour, place in ((7, 0), (12, 1), (20, 2)):
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            for each in range(3):
                seen = [Sighting("keys")] * (each == place) + [Sighting("milk")] * (each == 2)
                memory.observe(each, seen)
    memory.step(20)
    weights = load_weights("network")
    asked, belief = ask(memory, "keys", "milk", "passport")
    together = weigh_rhythm(asked.batch, asked.queries, belief, weights).log_weights
    for number, thing in enumerate(("keys", "milk", "passport")):
        asked, belief = ask(memory, thing)
        alone = weigh_rhythm(asked.batch, asked.queries, belief, weights).log_weights
        assert (alone[0] == together[number]).all()


def test_a_question_about_what_has_just_moved_is_answered_without():
    memory = make_home()
    live(memory)
    asked = memory.ask(("wallet",))

    def believe(asks_moved, uses_rhythm):
        policy = Adaptive(uses_rhythm=uses_rhythm).for_questions(asks_moved)
        return policy.believe(asked.batch, asked.queries).log_weights.tolist()

    assert believe(0.5, True) == believe(0.5, False)
    assert believe(0.0, True) != believe(0.0, False)
