"""The policy that collects for a network: in each home it looks about in another way."""

import numpy as np
import pytest

from sgm.policies import exploring
from sgm.policies.adaptive import Adaptive
from sgm.policies.exploring import Exploring, hash_homes, mix_bits
from simulator.tasks.rollout import Rollout
from simulator.testing import check_policy


def test_keeps_the_contract():
    check_policy(Exploring.make)


def _explore(homes, num_steps=60):
    """Return how often its first choice was the filter's, and the share of places it never saw."""
    rollout = Rollout(homes, Adaptive())
    same = []
    for _ in range(num_steps):
        _, queries = rollout.ask()
        belief = Adaptive().scores(rollout.memory, queries)
        choice = Exploring().scores(rollout.memory, queries).argmax(axis=1)
        same.append(belief.argmax(axis=1) == choice)
        rollout.look(choice)
    return np.mean(same, axis=0), (rollout.memory.furniture_num_observed == 0).mean(axis=1)


def test_half_of_the_homes_have_noise_and_half_of_the_questions_there(
    make_default_homes, monkeypatch
):
    monkeypatch.setattr(exploring, "_SHARES_OF_NEW", np.ones(1))
    homes = make_default_homes(40)
    rollout = Rollout(homes, Adaptive())
    is_noisy = hash_homes(rollout.memory) % np.uint64(2) == 0
    assert 10 <= is_noisy.sum() <= 30  # 20, with a deviation of 3.2
    same, _ = _explore(homes)
    assert (same[~is_noisy] == 1).all()
    assert (same[is_noisy] < 1).all()
    assert 0.5 < same[is_noisy].mean() < 0.9


@pytest.mark.slow
def test_who_believes_less_in_new_places_leaves_more_of_them_alone(make_default_homes, monkeypatch):
    monkeypatch.setattr(exploring, "_TEMPERATURES", np.zeros(1))
    unseen = []
    for share in (1.0, 0.3, 0.03):
        monkeypatch.setattr(exploring, "_SHARES_OF_NEW", np.array([share]))
        unseen.append(_explore(make_default_homes(8))[1].mean())
    assert unseen[0] + 0.05 < unseen[1] < unseen[2] - 0.05


def test_a_home_has_its_way_whatever_else_is_in_the_batch(make_default_homes):
    many = hash_homes(Rollout(make_default_homes(8), Adaptive()).memory)
    few = hash_homes(Rollout(make_default_homes(3), Adaptive()).memory)
    assert len(set(many.tolist())) == 8
    assert (many[:3] == few).all()


def test_the_hash_spreads_evenly():
    """Of 100,000 consecutive numbers, each of ten bins holds 10,000 within four deviations."""
    uniform = (mix_bits(np.arange(100_000, dtype=np.uint64)) >> np.uint64(11)) * 2.0**-53
    counts = np.bincount((uniform * 10).astype(int), minlength=10)
    assert (np.abs(counts - 10_000) < 4 * np.sqrt(9_000)).all()
