"""The policy that collects for a network: at times it looks elsewhere."""

import numpy as np

from simulator.policies.adaptive import Adaptive
from simulator.policies.exploring import Exploring, mix_bits
from simulator.tasks.rollout import Rollout
from simulator.testing import check_policy


def test_keeps_the_contract():
    check_policy(Exploring.make)


def test_half_of_its_first_choices_are_those_of_the_filter_or_more(make_default_homes):
    rollout = Rollout(make_default_homes(8), Adaptive())
    same = []
    for _ in range(60):
        _, queries = rollout.ask()
        scores = Adaptive().scores(rollout.memory, queries)
        noisy = Exploring().scores(rollout.memory, queries)
        same.append(scores.argmax(axis=1) == noisy.argmax(axis=1))
        rollout.look(noisy.argmax(axis=1))
    assert 0.5 < np.mean(same) < 0.95


def test_the_hash_spreads_evenly():
    """Of 100,000 consecutive numbers, each of ten bins holds 10,000 within four deviations."""
    uniform = (mix_bits(np.arange(100_000, dtype=np.uint64)) >> np.uint64(11)) * 2.0**-53
    counts = np.bincount((uniform * 10).astype(int), minlength=10)
    assert (np.abs(counts - 10_000) < 4 * np.sqrt(9_000)).all()
