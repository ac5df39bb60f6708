"""The filter over looks: against one that knows the probability of every place after every look."""

import numpy as np
import pytest

from sgm.evidence.adaptive_filter import LooksSince
from sgm.evidence.look_filter import Destinations, follow

NUM_PLACES, NUM_ROOMS = 7, 3


def draw(seed, num_things=1, num_filters=2, num_looks=20, hours=5.0):
    """Draw the arguments of `follow`; the last place of each second thing is none."""
    rng = np.random.default_rng(seed)
    room = rng.integers(0, NUM_ROOMS, (NUM_PLACES, num_things))
    room[-1, 1::2] = -1
    place, belief = rng.exponential(size=(2, NUM_PLACES, num_things))
    for weights in (place, belief):
        weights[-1, 1::2] = 0
        weights /= weights.sum(axis=0)
    shape = num_looks, num_things
    elapsed = rng.exponential(hours, (num_looks + 1, num_things))
    elapsed *= rng.random(elapsed.shape) < 0.7  # else in the same step
    return {
        "belief": belief[..., None],
        "goes": Destinations.of(place, room, NUM_ROOMS),
        "where": rng.integers(0, NUM_PLACES - 1, shape),
        "detection": rng.random(shape) * (rng.random(shape) < 0.8),
        "hours": np.cumsum(elapsed, axis=0),
        "rate": rng.exponential(0.1, (num_things, num_filters)),
        "crossing": rng.random((num_things, num_filters)),
    }


def follow_plainly(belief, goes, where, detection, hours, rate, crossing, thing, number):
    """One thing and filter, with the probability of every place after every look."""
    now, room, place = belief[:, thing, 0], goes.room[:, thing], goes.place[:, thing, 0]
    rate, crossing = rate[thing, number], crossing[thing, number]
    inside = lambda values: np.array([values[room == own].sum() for own in room])  # noqa: E731
    time = 0.0
    for look, until in enumerate(hours[:, thing]):
        elapsed, time = until - time, until
        total, mass = inside(place), inside(now)
        later = total * now.sum() + np.exp(-rate * crossing * elapsed) * (mass - total * now.sum())
        share = place / np.maximum(total, 1e-12)
        now = later * share + np.exp(-rate * elapsed) * (now - mass * share)
        if look < len(where):
            is_there = np.arange(len(now)) == where[look, thing]
            now = now * (1 - detection[look, thing] * is_there)
    return now


@pytest.mark.parametrize("hours", [0.0, 5.0, 3000.0, 1e6])  # of 1e6 nothing is left between looks
def test_it_is_what_following_every_place_says(hours):
    for seed in range(8):
        drawn = draw(seed, num_things=2, hours=hours)
        belief = follow(**drawn)
        assert (belief >= 0).all()
        for thing in range(2):
            for number in range(2):
                plainly = follow_plainly(**drawn, thing=thing, number=number)
                np.testing.assert_allclose(belief[:, thing, number], plainly, atol=1e-13)


@pytest.mark.parametrize("hours", [5.0, 3000.0])
def test_a_thing_is_followed_as_if_alone_to_the_bit(hours):
    """Among more than are followed in one block, and by one filter as by all."""
    drawn = draw(0, num_things=150, num_filters=3, hours=hours)
    belief, goes = follow(**drawn), drawn["goes"]
    for thing in (0, 63, 64, 149):
        chosen = slice(thing, thing + 1)
        room = np.where(goes.room[:, chosen] < NUM_ROOMS, goes.room[:, chosen], -1)
        for filters in (slice(0, 3), slice(1, 2)):
            alone = follow(
                goes=Destinations.of(goes.place[:, chosen, 0], room, NUM_ROOMS),
                **{name: drawn[name][:, chosen] for name in ("belief", "where", "detection")},
                hours=drawn["hours"][:, chosen],
                **{name: drawn[name][chosen, filters] for name in ("rate", "crossing")},
            )
            np.testing.assert_array_equal(alone, belief[:, chosen, filters])


def test_without_looks_time_passes():
    drawn = draw(1, num_looks=0, hours=1e9)
    belief = follow(**drawn)
    np.testing.assert_allclose(belief[..., 0], drawn["goes"].place[..., 0], atol=1e-12)


def test_looks_at_one_place_in_one_step_are_one_look():
    """At place 0 twice at 3; at place 1 at 2, 3 and 5; the thing was seen at place 1 at 2."""
    times = np.array([[[3, -1, 3], [5, 2, 3]]], dtype=np.int32)
    looks = LooksSince.list(times, np.array([0]), np.array([1]), np.array([2]))
    found = [each[:, 0].tolist() for each in looks]
    assert found == [[3, 3, 5], [0, 1, 1], [2, 1, 1]]
    np.testing.assert_allclose(looks.compute_detection(np.array([0.2]))[:, 0], [0.96, 0.8, 0.8])
    np.testing.assert_array_equal(looks.count_steps(np.array([2]), 6)[:, 0], [1, 1, 3, 4])


def test_homes_are_aligned_at_their_last_looks():
    """What one home has no look for counts for none, and no time passes there."""
    times = np.array([[[1, 4]], [[-1, 2]]], dtype=np.int32)
    looks = LooksSince.list(times, np.array([1, 0]), np.array([-1, -1]), np.array([-1, -1]))
    assert looks.number.tolist() == [[0, 1], [1, 1]]
    start = looks.start(np.array([-1, -1]), np.array([-1, -1]), 9)
    assert start.tolist() == [2, 1]
    assert looks.count_steps(start, 9).tolist() == [[0, 0], [0, 3], [7, 8]]
