"""Homes in which nothing follows from names: activities by hand, and the law of many homes."""

from dataclasses import replace

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.tasks.rollout import make_memory
from simulator.world.abstract import life
from simulator.world.abstract.dynamics import AbstractDynamics
from simulator.world.abstract.home_habits import Ways, draw_ways
from simulator.world.config import HomeConfig
from simulator.world.mixture.mixture import Mixture
from simulator.world.mixture.source import MixtureSource
from simulator.world.mixture.views import TRUE
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

RULES = HomeConfig(furniture_per_room=4, objects_per_furniture=3)


def make(num_homes=1, rules=None):
    config = replace(RULES, dynamics=AbstractDynamics() if rules is None else rules)
    return SampledHomes(PriorGraph.default(), config, Streams(0, "test", range(num_homes)))


def follow(homes, num_steps):
    """Return the furniture of every object at every step, (H, C, T)."""
    places = []
    for _ in range(num_steps):
        homes.evolve()
        places.append(homes.object_furniture.copy())
    return np.stack(places, axis=2)


def live_by_hand(monkeypatch, second=0, rules=None, **changes):
    """Return where the first object is in 20 days of a home with one activity, hour by hour.

    At 8 every day it takes the first object from furniture 0 to 2 for about two hours, then to 3
    for three, and back, or to a second usual place.
    """

    def draw(rng, num_places, types, *_):
        usual = np.tile([0, second], (len(types), 1))
        use = (np.arange(len(types)) == 0)[None].astype(float)
        by_hand = Ways(
            usual, np.array([[2, 3, 1]]), np.array([2]), np.array([[2.0, 3.0, 9.0]]),
            np.array([8.0]), np.array([0.5]), np.array([1.0]), use, 0.0, 0.0,
            np.full((len(types), num_places), 1 / num_places),
        )  # fmt: skip
        return replace(by_hand, **changes)

    monkeypatch.setattr(life, "draw_ways", draw)
    homes = make(rules=rules)
    first = int(np.flatnonzero(homes.is_present[0])[0])
    assert first == 0
    return follow(homes, 480)[0]


def test_an_activity_takes_its_things_through_its_places_and_back(monkeypatch):
    lived = live_by_hand(monkeypatch)
    days = lived[0].reshape(20, 24)  # column h is hour h + 1
    assert (days[:, :7] == 0).all()
    begins_at_8 = days[:, 7] == 2
    assert begins_at_8.all()
    hours_there = (days == 2).sum(axis=1)
    assert set(hours_there.tolist()) <= {1, 2, 3}
    assert len(set(hours_there.tolist())) > 1
    assert ((days == 3).sum(axis=1) == 3).all()
    assert (hours_there + 3 + (days == 0).sum(axis=1) == 24).all()
    assert (lived[1:][lived[1:, 0] >= 0] == 0).all()  # nothing else is used


@pytest.mark.parametrize("seconds", [300.0, 1800.0, 3240.0])
def test_activities_keep_their_hour_whatever_the_length_of_a_step(monkeypatch, seconds):
    rules = AbstractDynamics(start_time="2024-05-06T06:01", step_seconds=seconds)
    at_once = np.array([12.0])  # times a day: at the first step of the hour around eight
    lived = live_by_hand(monkeypatch, rules=rules, chance=at_once)[0]
    first_away = int(np.flatnonzero(lived != 0)[0]) + 1
    assert first_away == int(np.ceil(89 * 60 / seconds))  # half past seven


def test_what_is_forgotten_stays_where_it_was_used(monkeypatch):
    days = live_by_hand(monkeypatch, forgotten=1.0)[0].reshape(20, 24)
    assert set(np.unique(days)) == {2, 3}
    assert (days[:, 23] == 3).all()


def test_things_go_back_to_either_usual_place_equally_often(monkeypatch):
    days = live_by_hand(monkeypatch, second=1)[0].reshape(20, 24)
    assert set(np.unique(days)) == {0, 1, 2, 3}
    assert 4 <= (days[:, 23] == 1).sum() <= 16  # of 20, p > .99


def test_usual_places_change_where_they_settle_anew(monkeypatch):
    days = live_by_hand(monkeypatch, settles=1.0)[0].reshape(20, 24)
    assert len(np.unique(days[:, 23])) > 3


def test_moves_are_marked_and_nothing_comes_or_goes():
    homes = make(20)
    present, before = homes.is_present.copy(), homes.object_furniture.copy()
    moved = 0
    for _ in range(48):
        homes.evolve()
        np.testing.assert_array_equal(homes.object_moved, homes.object_furniture != before)
        np.testing.assert_array_equal(homes.is_present, present)
        moved += homes.object_moved.sum()
        before = homes.object_furniture.copy()
    assert moved > 100


def test_what_is_known_beforehand_is_where_things_are_in_the_long_run():
    rng = np.random.default_rng(0)
    types, freq = rng.integers(30, size=50), rng.uniform(0.1, 1, 30)
    for _ in range(50):
        ways = draw_ways(rng, 12, types, freq, 1.0, 0.05)
        np.testing.assert_allclose(ways.presence.sum(axis=1), 1)
        may_be = np.zeros((50, 12), dtype=bool)
        np.put_along_axis(may_be, ways.usual, True, axis=1)
        for activity, count in enumerate(ways.num_stages):
            taken = np.flatnonzero(ways.use[activity] > 0)
            may_be[np.ix_(taken, ways.route[activity, :count])] = True
        np.testing.assert_array_equal(ways.presence > 0, may_be)


@pytest.mark.slow
def test_the_likeliest_place_is_where_most_time_is_spent():
    homes = make(30)
    lived = follow(homes, 24 * 14)
    home, slot = np.nonzero(homes.is_present)
    most = [np.bincount(lived[h, s]).argmax() for h, s in zip(home, slot, strict=True)]
    rows = homes.transition_rows(home, homes.object_code[home, slot])
    likeliest = rows.reshape(len(rows), -1, 2).sum(axis=2).argmax(axis=1)
    assert (likeliest == most).mean() > 0.8
    by_chance = 1 / homes.num_furniture
    assert (np.roll(likeliest, 1) == most).mean() < 3 * by_chance


def test_an_agent_that_knows_the_prior_knows_that_of_this_home():
    views = {TRUE: 1.0}
    mixture = Mixture(routine_share=0, abstract_share=1, views=views, max_places=12, max_objects=40)
    homes = MixtureSource(mixture=mixture).make(Streams(0, "train", range(4)))
    memory = make_memory(homes)
    home, slot = np.nonzero(homes.is_present)
    types = homes.object_type[home, slot]
    told = memory.place_prior.rows(home, types).sum(axis=2)
    for row, number in enumerate(home):
        same = (homes.object_type[number] == types[row]) & homes.is_present[number]
        codes = homes.object_code[number, same]
        at = homes.transition_rows(np.full(len(codes), number), codes)
        possible = at.reshape(len(codes), -1, 2).sum(axis=(0, 2)) > 0
        np.testing.assert_array_equal(told[row] > 0, possible)
    absent = np.setdiff1d(np.arange(len(homes.prior.objects)), homes.object_type[0])
    assert not memory.place_prior.rows(np.zeros(len(absent), dtype=int), absent).any()


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"min_moves": 0.0}, "min_moves must be above 0 and at most max_moves"),
        ({"min_moves": 0.5}, "got 0.5 and 0.2"),
        ({"max_moves": 2.0}, "which is at most 1, got 0.01 and 2.0"),
        ({"step_seconds": -1.0}, "start_time and step_seconds must be"),
    ],
)
def test_bad_rules_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        AbstractDynamics(**fields)
