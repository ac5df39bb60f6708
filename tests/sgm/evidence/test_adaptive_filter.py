"""The adaptive filter: hand-worked looks, its closed form against small steps, and laws."""

import numpy as np
import pytest

from sgm.evidence.adaptive_filter import (
    FILTERS,
    FilterSettings,
    Rates,
    compute_beliefs,
    follow_looks,
)
from sgm.evidence.expected_places import Expected, compute_destinations
from sgm.evidence.question import Question
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
ROOM = np.array([[0, 0, 1, 2]])  # the last place, elsewhere, is no room
GOES = np.array([[0.5, 0.2, 0.2, 0.1]])


def follow(looks=(), last=(0, 0), now=1, rate=0.0, crossing=1.0, moved=0.0, miss=0.2, hours=1.0):
    """One object and one filter; looks are (place, time), last is (place, time) or None."""
    times = np.full((1, 3, 4), -1)
    for number, (place, time) in enumerate(looks):
        times[0, place, number] = time
    place, time = last or (-1, -1)
    return follow_looks(
        destination=GOES,
        room=ROOM,
        num_rooms=3,
        look_times=times.astype(np.int32),
        look_row=np.array([0]),
        last_place=np.array([place]),
        last_time=np.array([time]),
        now=now,
        hours=np.array([hours]),
        rate=np.array([[rate]]),
        crossing=np.array([[crossing]]),
        moved=np.array([[moved]]),
        miss=np.array([miss]),
    )[0, 0]


def test_a_sighting_leaves_a_little_doubt():
    np.testing.assert_allclose(follow(), 0.97 * np.array([1, 0, 0, 0]) + 0.03 * GOES[0])


def test_looks_that_miss_it_by_hand():
    """0.985 x 0.2 = 0.197 of 0.197 + 0.015; a second look: 0.0394 of 0.0544."""
    assert follow([(0, 1)])[0] == pytest.approx(0.197 / 0.212)
    assert follow([(0, 1), (0, 2)], now=3)[0] == pytest.approx(0.0394 / 0.0544)
    # The look that saw it is none that missed it; another place in that step says nothing new.
    assert follow([(0, 0)])[0] == pytest.approx(0.985)


def test_an_object_that_was_never_seen_is_where_nobody_looked():
    weights = np.array([0.5 * 0.2 * 0.2, 0.2 * 0.2, 0.2, 0.1])
    seen = follow([(0, 1), (0, 2), (1, 1)], last=None, now=5)
    np.testing.assert_allclose(seen, weights / weights.sum())


def test_closed_form_is_many_small_steps():
    """db/dt = rate (crossing goes + (1 - crossing) mass of the room x share - b), by Euler."""
    rate, crossing, hours, now = 0.3, 0.4, 0.5, 6
    belief = 0.97 * np.eye(4)[1] + 0.03 * GOES[0]
    total = np.array([GOES[0][ROOM[0] == room].sum() for room in ROOM[0]])
    step = 1e-4
    for _ in range(round(now * hours / step)):
        mass = np.array([belief[ROOM[0] == room].sum() for room in ROOM[0]])
        into = crossing * GOES[0] + (1 - crossing) * mass * GOES[0] / total
        belief = belief + step * rate * (into - belief)
    found = follow(last=(1, 0), now=now, rate=rate, crossing=crossing, hours=hours)
    np.testing.assert_allclose(found, belief, atol=1e-4)


def test_with_time_it_is_anywhere_it_goes_or_stays_in_its_room():
    np.testing.assert_allclose(follow(now=10**6, rate=0.1), GOES[0], atol=1e-9)
    inside = follow(now=10**6, rate=0.1, crossing=0.0)
    assert inside[:2].sum() == pytest.approx(0.97 + 0.03 * 0.7)
    assert inside[0] / inside[1] == pytest.approx(0.5 / 0.2)


def test_asked_for_because_it_has_just_moved():
    """Surely moved: from 0 to the others by destination; within the room, only place 1 is left.

    Seen with 0.97 at 0, the rest of 0.03 x goes: to 1 comes goes_1 x sum of b_f / (1 - goes_f).
    """
    start = 0.97 * np.eye(4)[0] + 0.03 * GOES[0]
    leaves = start / (1 - GOES[0])
    np.testing.assert_allclose(follow(moved=1.0), GOES[0] * (leaves.sum() - leaves))
    assert follow(moved=1.0, crossing=0.0)[1] == pytest.approx(start[0])
    np.testing.assert_allclose(follow(moved=1.0, now=0), start)  # seen in this very step


def test_probabilities_sum_to_one_whatever_was_seen():
    rng = np.random.default_rng(0)
    for _ in range(50):
        looks = [(int(rng.integers(3)), int(rng.integers(1, 9))) for _ in range(4)]
        last = None if rng.random() < 0.3 else (int(rng.integers(3)), int(rng.integers(4)))
        belief = follow(
            looks, last, now=9, rate=rng.exponential(), crossing=rng.random(), moved=rng.random()
        )
        assert belief.sum() == pytest.approx(1)
        assert (belief >= 0).all()


@pytest.fixture
def rollout(make_tiny_homes):
    """Forty steps of three homes."""
    rollout = Rollout(make_tiny_homes(3), Adaptive())
    for _ in predict_locations(rollout, 40):
        pass
    return rollout


def ask_all(memory, home):
    """Ask for every object of a home."""
    objects = memory.objects
    rows = np.flatnonzero(objects["home"] == home)
    return memory.query(
        objects["home"][rows], objects["key"][rows], objects["label"][rows], objects["type"][rows]
    )


def test_destinations_by_hand(rollout):
    """Sightings, plus the prior as one, plus 0.3 / 6 of a sighting everywhere."""
    memory = rollout.memory
    queries = ask_all(memory, 0)
    asked = Question.gather(memory, queries)
    found = compute_destinations(asked, Expected.by_prior(asked))
    weight = asked.counts.num_true + queries.prior.sum(axis=2) + 0.05
    expected = weight / (weight.sum(axis=1, keepdims=True) + 0.05)
    np.testing.assert_allclose(found[:, :-1], expected, rtol=1e-6)


def test_rates_by_hand(rollout):
    memory = rollout.memory
    queries = ask_all(memory, 1)
    rates = Rates.estimate(Question.gather(memory, queries))
    counters, objects = memory.history.counters, memory.objects
    home = (counters["num_moved"][1] + 0.5) / (counters["time_followed"][1] + 15)
    np.testing.assert_allclose(rates.home, home)
    row = queries.object[0]
    known = objects["last_observed"][row] - objects["first_observed"][row]
    own = (objects["num_moved"][row] + 1.5) / (known + 1.5 / home)
    assert rates.thing[0] == pytest.approx(own)


def test_a_home_does_not_depend_on_its_neighbours(make_tiny_homes):
    homes = make_tiny_homes(3)
    together = Rollout(homes, Adaptive())
    alone = Rollout(make_tiny_homes(homes=[2]), Adaptive())
    for both in zip(predict_locations(together, 25), predict_locations(alone, 25), strict=True):
        np.testing.assert_array_equal(both[0].scores[2], both[1].scores[0])


def test_elsewhere_grows_as_places_are_ruled_out(make_tiny_memory):
    memory = make_tiny_memory()
    ask = tuple(np.array([value]) for value in (0, 7, 11, 0))
    policy, none = Adaptive(), np.zeros(0, dtype=int)
    elsewhere = []
    for furniture in range(6):
        queries = memory.query(*ask)
        elsewhere.append(policy.follow(memory, queries)[0, -1])
        memory.observe(np.array([0]), np.array([furniture]), none, none)
    assert elsewhere == sorted(elsewhere)
    assert elsewhere[-1] > 2 * elsewhere[0]


def test_finds_more_than_bayes_in_the_papers_homes(make_default_homes):
    """0.39 against 0.33 over 30 homes; here over six, the same ones for both."""

    def play(policy):
        rollout = Rollout(make_default_homes(6, seed=1), policy)
        return np.mean([step.is_correct.mean() for step in predict_locations(rollout, 100)])

    assert play(Adaptive()) > play(Bayesian()) + 0.02


def test_hours_matter_if_they_are_asked_for(rollout):
    """In a home without a clock there are none, and the setting changes nothing."""
    queries = ask_all(rollout.memory, 0)
    by_hour = Adaptive(FilterSettings(asks_moved=0.5, hours=0.7))
    plain = Adaptive()
    np.testing.assert_array_equal(
        by_hour.scores(rollout.memory, queries), plain.scores(rollout.memory, queries)
    )


def test_filters_that_share_a_rate_are_each_as_if_followed_alone(rollout):
    """They differ in the move just before the question, also after looks in that very step."""
    memory, filters = rollout.memory, list(FILTERS.values())
    for looks in range(3):
        for number in range(looks):
            rollout.look(np.full(memory.num_homes, number))
        asked = Question.gather(memory, ask_all(memory, 0))
        rates = Rates.estimate(asked)
        goes = compute_destinations(asked, Expected.by_prior(asked))
        together = compute_beliefs(asked, rates, goes, filters)
        for number, settings in enumerate(filters):
            alone = compute_beliefs(asked, rates, goes, [settings])
            np.testing.assert_array_equal(alone[:, 0], together[:, number])
        assert (together[:, 2] != together[:, 7]).any()  # "learnt" and "asked": of one rate
