"""Persistence filters: by hand, against the filter of the paper that they come from, and EM."""

import numpy as np
import pytest

from sgm.policies.persistence import Persistence, compute_presence
from simulator.policies import make_policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

FRIDGE, SHELF, TABLE, BED, BEDROOM_SHELF, DESK = range(6)
MUG = 0  # in: shelf 0.4; on: table 0.4, desk 0.2


class OneKind(Persistence):
    """Objects that all stay ten steps, which is known for sure."""

    stays = (10.0,)
    prior_departures = 1e12
    prior_stays = 1e12


def look(policy, memory, furniture, is_seen, key=7):
    row = memory.ensure_objects(*(np.array([value]) for value in (0, key, 11, MUG)))[: int(is_seen)]
    change = memory.observe(np.array([0]), np.array([furniture]), row, np.ones(len(row), int))
    policy.observe(memory, change)


def ask(policy, memory, key=7):
    """Return the probability of every place."""
    queries = memory.query(*(np.array([value]) for value in (0, key, 11, MUG)))
    odds = policy.scores(memory, queries)[0]
    return odds / (1 + odds)


def wait(memory, steps):
    for _ in range(steps):
        memory.step()


def test_what_was_never_seen_is_where_the_prior_says(make_tiny_memory):
    """What it excludes is there once in a thousand; a look in vain leaves a quarter.

    It comes back with e^-0.1 per step: after 5 steps of 0.4, 0.4 x (1 - 0.75 e^-0.5).
    """
    memory = make_tiny_memory()
    policy = OneKind(0.25)
    policy.reset(memory)
    prior = np.array([1e-3, 0.4, 0.4, 1e-3, 1e-3, 0.2])
    np.testing.assert_allclose(ask(policy, memory), prior, rtol=1e-6)
    memory.step()
    look(policy, memory, SHELF, False)
    wait(memory, 5)
    prior[SHELF] *= 1 - 0.75 * np.exp(-0.5)
    np.testing.assert_allclose(ask(policy, memory), prior, rtol=1e-6)


def test_a_sighting_persists_and_a_miss_raises_doubt(make_tiny_memory):
    """Seen on the desk: leaves at 0.1, comes at 0.1 x 0.2 / 0.8 = 0.025: e^-0.125D of the rest.

    After 8 steps 0.2 + 0.8 e^-1 = 0.49430; looked at without seeing it: a quarter of that,
    0.12358 / (0.12358 + 0.50570).
    """
    memory = make_tiny_memory()
    policy = OneKind(0.25)
    policy.reset(memory)
    memory.step()
    look(policy, memory, DESK, True)
    np.testing.assert_allclose(ask(policy, memory)[DESK], 1, atol=1e-5)
    wait(memory, 8)
    np.testing.assert_allclose(ask(policy, memory)[DESK], 0.494304, atol=1e-5)
    look(policy, memory, DESK, False)
    np.testing.assert_allclose(ask(policy, memory)[DESK], 0.196376, atol=1e-5)


def filter_by_rosen(times, seen, leave, miss, false):
    """The recursion of Rosen et al. (2016), algorithm 1, with an exponential survival time."""

    def survives(time):
        return np.exp(-leave * time)

    likelihood, lower, evidence, before = 1.0, 0.0, 1.0, 0.0
    for time, is_seen in zip(times, seen, strict=True):
        lower += likelihood * (survives(before) - survives(time))
        lower *= false if is_seen else 1 - false
        likelihood *= 1 - miss if is_seen else miss
        evidence = lower + likelihood * survives(time)
        before = time
    return likelihood * survives(times[-1]) / evidence


def test_without_emergence_it_is_the_persistence_filter(make_tiny_memory):
    """Nothing comes back, and it was there for sure at first: Rosen's recursion."""
    memory = make_tiny_memory()
    policy = OneKind(0.25, false_rate=0.05)
    policy.reset(memory)
    look(policy, memory, BED, True)
    pairs = policy._pairs["pair"]
    pairs["presence"] = 1.0
    pairs["prior"] = 1e-12
    rng = np.random.default_rng(0)
    times, seen = [], []
    for _ in range(12):
        gap = int(rng.integers(1, 6))
        wait(memory, gap)
        is_seen = bool(rng.random() < 0.6)
        look(policy, memory, BED, is_seen)
        times.append(memory.time)
        seen.append(is_seen)
        expected = filter_by_rosen(times, seen, 0.1, 0.25, 0.05)
        assert policy._pairs["pair"]["presence"][0, 0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.slow
def test_rates_are_learnt_from_the_home(make_tiny_memory):
    """Half of the objects leave their place at 0.3 a step, half at 0.01; all come at 0.05.

    They are looked at every second step with a miss rate of 0.2. The slowest kind must find the
    slow half, the fastest the fast half, and an object's own history tells of which half it is.
    In incremental EM the first looks, which were explained by rates not yet learnt, count forever.
    """
    rng = np.random.default_rng(0)
    memory = make_tiny_memory()
    policy = Persistence(0.2)
    policy.reset(memory)
    leave = np.repeat([0.3, 0.01], 40)
    rows = memory.ensure_objects(np.zeros(80, int), np.arange(80), np.full(80, 11), np.full(80, -1))
    is_there = rng.random(80) < 0.5
    for time in range(2000):
        if time % 2 == 0:
            seen = rows[is_there & (rng.random(80) > 0.2)]
            change = memory.observe(np.array([0]), np.array([BED]), seen, np.ones(len(seen), int))
            policy.observe(memory, change)
        memory.step()
        is_there = rng.random(80) < compute_presence(is_there.astype(float), leave, 0.05, 1.0)
    fast, _, slow = policy.compute_leave_rates()[0]
    assert fast == pytest.approx(0.3, rel=0.15)
    assert slow == pytest.approx(0.01, rel=0.2)
    pairs = policy._pairs["pair"]
    objects = np.array([place[0] for place in policy._pair_of_place])
    is_slow = pairs["share"][:, 2] > pairs["share"][:, 0]
    assert (is_slow == (objects >= 40)).mean() > 0.95
    _, comes = policy._compute_rates(pairs)
    assert np.median(comes) == pytest.approx(0.05, rel=0.3)


def test_presence_is_as_frequent_as_it_says(make_tiny_memory):
    """Objects that obey its prior: among places believed with p, a share p holds the object."""
    rng = np.random.default_rng(3)
    memory = make_tiny_memory()
    policy = OneKind(0.25)
    policy.reset(memory)
    num = 400
    rows = memory.ensure_objects(
        np.zeros(num, int), np.arange(num), np.full(num, 11), np.full(num, MUG)
    )
    come = 0.1 * 0.2 / 0.8  # for the desk, to be there a fifth of the time
    is_there = rng.random(num) < 0.2
    said, truth = [], []
    for _ in range(60):
        memory.step()
        is_there = rng.random(num) < compute_presence(is_there.astype(float), 0.1, come, 1.0)
        zeros = np.zeros(num, dtype=int)
        queries = memory.query(zeros, np.arange(num), zeros + 11, zeros + MUG)
        odds = policy.scores(memory, queries)[:, DESK]
        said.append(odds / (1 + odds))
        truth.append(is_there.copy())
        if rng.random() < 0.4:
            seen = rows[is_there & (rng.random(num) > 0.25)]
            change = memory.observe(np.array([0]), np.array([DESK]), seen, np.ones(len(seen), int))
            policy.observe(memory, change)
    said, truth = np.concatenate(said[20:]), np.concatenate(truth[20:])
    for low in np.arange(0, 1, 0.2):
        is_in = (said >= low) & (said < low + 0.2)
        if is_in.sum() > 300:
            assert said[is_in].mean() == pytest.approx(truth[is_in].mean(), abs=0.05)


def test_it_answers_better_than_counting(make_default_homes):
    accuracy = {}
    for name in ("frequentist", "persistence"):
        homes = make_default_homes(24, seed=5)
        rollout = Rollout(homes, make_policy(name, homes))
        accuracy[name] = np.mean(
            [answer.is_correct for answer in predict_locations(rollout, 60)], axis=0
        )
    gain = accuracy["persistence"] - accuracy["frequentist"]
    assert gain.mean() > 2 * gain.std() / np.sqrt(len(gain))
