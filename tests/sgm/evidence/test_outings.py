"""Things that leave the home and come back: laws, and homes in which it is plain."""

from datetime import datetime, timedelta

import numpy as np
import pytest

from sgm.evidence.leaving import Leaving
from sgm.evidence.outings import Outings, join_left
from sgm.evidence.outings_filter import follow_outings
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.clock import Clock
from sgm.policies import Adaptive, Bayesian
from sgm.prior.prior_graph import PriorGraph
from simulator import SceneGraphMemory, Sighting
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

START = datetime(2026, 11, 9, 6)  # a Monday
STEP = 1800


def live(thing="car keys", days=9, until=7.0, clock=True):
    """A home whose keys leave at 8:30 on working days and are back at 17:30.

    Everything is looked at every half hour from six to eleven.
    """
    memory = SceneGraphMemory(clock=Clock(START, STEP) if clock else None)
    hall, kitchen = memory.add_room("hall"), memory.add_room("kitchen")
    dresser = memory.add_furniture("dresser", hall)
    counter, shelf = (memory.add_furniture(label, kitchen) for label in ("counter", "shelf"))
    while True:
        now = START + memory.time * timedelta(seconds=STEP)
        hour = now.hour + now.minute / 60
        if (now - START).days >= days - 1 and hour >= until and hour >= 6:
            return memory
        if 6 <= hour < 23:
            is_out = now.weekday() < 5 and 8.5 <= hour < 17.5
            memory.observe(dresser, [] if is_out else [Sighting(thing)])
            memory.observe(counter, [Sighting("kettle"), Sighting("mug")])
            memory.observe(shelf, [Sighting("book")])
        memory.step()


@pytest.fixture(scope="module")
def memory():
    return live()  # until Tuesday of the second week, 7:00, after six working days


def say(finder, memory, thing, hour, minute, day=17):
    at = datetime(2026, 11, day, hour, minute)
    return finder.rank(memory, thing, at=at).elsewhere


@pytest.mark.parametrize(
    "make", [lambda: Finder(Bayesian()), lambda: Finder(Adaptive()), ObjectFinder.load]
)
def test_keys_are_out_on_working_mornings_and_back_in_the_evening(memory, make):
    finder = make()
    assert say(finder, memory, "car keys", 9, 50) > 0.75
    assert say(finder, memory, "car keys", 13, 0) > 0.85
    assert say(finder, memory, "car keys", 20, 0) < 0.1
    assert say(finder, memory, "car keys", 9, 50, day=21) < 0.3  # a Saturday
    assert finder.rank(memory, "car keys").elsewhere < 0.1  # seen an hour ago, at six
    for thing in ("kettle", "mug", "book"):
        assert say(finder, memory, thing, 9, 50) < 0.05


def test_it_is_learnt_and_no_matter_of_names():
    memory = live("red thing")
    assert say(Finder(Bayesian()), memory, "red thing", 9, 50) > 0.75


def test_a_negative_look_says_more_where_it_goes_out(memory):
    """Not at its place at nine on a working day: out. At seven in the evening: left, or moved."""
    said = {}
    for hour in (9, 19):
        later = live(until=8.0)  # Tuesday, seen at half past seven
        now = START + later.time * timedelta(seconds=STEP)
        later.step((hour - now.hour) * 2)
        for furniture in later.furniture_ids:
            later.observe(furniture, [])
        later.step()
        said[hour] = Finder(Bayesian()).rank(later, "car keys").elsewhere
    assert said[9] > 0.9
    assert said[9] > said[19]


def test_without_a_clock_nothing_is_out():
    memory = live(days=3, clock=False, until=7)
    asked = memory.ask(["car keys"])
    outings = Outings(asked.batch)
    out, gain = outings.compute(asked.batch, asked.queries)
    assert (out, gain) == (0, 1)


def test_what_was_never_seen_is_not_said_to_be_out(memory):
    asked = memory.ask(["piano"])
    out, gain = Outings(asked.batch).compute(asked.batch, asked.queries)
    assert (out, gain) == (0, 1)


def test_three_cases_by_bayes_rule():
    # Left for good .2, as if all else stayed in; what was seen is twice as likely if it may go out,
    # and then it is out with .75: weights .2, .8 x 2 x .75 = 1.2 and .8 x 2 x .25 = .4.
    assert join_left(np.array([0.2]), np.array([0.75]), np.array([2.0])) == pytest.approx(1.4 / 1.8)
    assert join_left(np.array([0.2]), np.array([0.0]), np.array([1.0])) == pytest.approx(0.2)


def follow(share, now, looks=(), last=0, mixing=0.0, miss=0.0, rate=0.0):
    """Follow one thing at the first of two places; steps of an hour from Monday 0:00."""
    times = np.full((1, 2, 8), -1)
    for number, (place, time) in enumerate(looks):
        times[0, place, number] = time
    out, gain = follow_outings(
        np.asarray(share, dtype=float)[None], np.array([[1.0, 0.0]]), times,
        np.array([0]), np.array([last]), now, np.array([[0.0, 3600.0]]),
        np.array([rate]), np.array([miss]), mixing,
    )  # fmt: skip
    return out[0], gain[0]


def test_shares_alone_lead_out_and_back():
    share = np.full(48, 0.99)
    share[9:17] = 0.2
    # Seen at 6:00. At the middle of the bins the share is that of the hour: at 12:30 it would be
    # .2 of .99, at 12:00 likewise between two equal bins.
    out, gain = follow(share, 12, last=6)
    assert out == pytest.approx(1 - 0.97 * 0.2 / 0.99 - 0.03 * 0.2 / 0.99, abs=0.01)
    assert gain == 0
    back, _ = follow(share, 20, last=6)
    assert back == pytest.approx(0.01, abs=0.01)
    after_a_month, _ = follow(share, 24 * 28 + 12, last=6)
    assert after_a_month == pytest.approx(0.8, abs=0.01)


def test_what_was_seen_at_noon_is_still_in_an_hour_later():
    share = np.full(48, 0.99)
    share[9:17] = 0.2
    out, _ = follow(share, 13, last=12)
    assert out == pytest.approx(0, abs=1e-9)
    forgotten, _ = follow(share, 13, last=12, mixing=0.5)
    assert forgotten == pytest.approx((1 - np.exp(-0.5)) * 0.8, abs=0.02)


def test_a_look_that_misses_nothing_says_that_it_is_out():
    share = np.full(48, 0.5)
    out, gain = follow(share, 12, looks=[(0, 12)], last=6, mixing=10.0, miss=0.1)
    # Out or in with .5 each; in, the look misses it with .1, which counts for .85 of a look.
    assert out == pytest.approx(0.5 / (0.5 + 0.5 * 0.1**0.85), abs=1e-3)
    # Had it stayed, the look would have had .1.
    assert gain == pytest.approx(np.log(0.5 + 0.5 * 0.1**0.85) - 0.85 * np.log(0.1), abs=1e-3)
    elsewhere, _ = follow(share, 12, looks=[(1, 12)], last=6, mixing=10.0, miss=0.1)
    assert elsewhere == pytest.approx(0.5, abs=0.03)  # a place where it never is


def make_homes(numbers):
    rules = RoutineDynamics(carry_share=0.9, step_seconds=3600)
    config = HomeConfig(furniture_per_room=3, objects_per_furniture=3, dynamics=rules)
    return SampledHomes(
        PriorGraph.household(), [config] * len(numbers), Streams(0, "test", numbers)
    )


def compute_all(homes, num_steps):
    rollout = Rollout(homes, Adaptive())
    for _ in predict_locations(rollout, num_steps):
        pass
    batch = rollout.memory
    rows = np.flatnonzero(batch.objects["num_observed"] > 0)
    home = batch.objects["home"][rows]
    queries = batch.query(
        home, batch.objects["key"][rows], batch.objects["label"][rows], batch.objects["type"][rows]
    )
    left = Leaving(batch).compute(batch, queries)
    return home, batch.objects["key"][rows], left, *Outings(batch).compute(batch, queries)


def test_many_homes_are_each_by_themselves_and_probabilities():
    home, key, left, out, gain = compute_all(make_homes([0, 1, 2]), 40)
    _, own_key, _, own_out, own_gain = compute_all(make_homes([1]), 40)
    is_own = home == 1
    order, own_order = np.argsort(key[is_own]), np.argsort(own_key)
    np.testing.assert_array_equal(key[is_own][order], own_key[own_order])
    np.testing.assert_allclose(out[is_own][order], own_out[own_order], atol=1e-9)
    np.testing.assert_allclose(gain[is_own][order], own_gain[own_order], rtol=1e-9)
    assert ((out >= 0) & (out <= 1) & (gain > 0)).all()
    joined = join_left(left, out, gain)
    assert ((joined >= 0) & (joined <= 1)).all()
