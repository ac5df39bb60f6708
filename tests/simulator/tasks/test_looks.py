"""Where the robot looks: where the policy says, on patrol, or at random."""

from dataclasses import replace

import numpy as np
import pytest

from simulator.policies import make_policy
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

RULES = HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3, objects_per_furniture=2)


def play(prior, configs, policy="bayesian", num_steps=13, homes=None):
    """Return the furniture of every look by step, home by home, and the choices of the policy."""
    numbers = range(len(configs)) if homes is None else homes
    state = SampledHomes(prior, configs, Streams(0, "test", numbers))
    rollout = Rollout(state, make_policy(policy, state))
    looks = [[] for _ in configs]
    rollout.on_change = lambda change: [
        looks[home].append((rollout.memory.time, int(place)))
        for home, place in zip(change.home, change.furniture, strict=True)
    ]
    choices = [answer.choice for answer in predict_locations(rollout, num_steps)]
    return looks, np.array(choices)


def test_the_policy_looks_where_it_guesses(tiny_prior):
    looks, choices = play(tiny_prior, [RULES])
    assert looks[0] == [(step + 1, int(choice)) for step, choice in enumerate(choices[:, 0])]


def test_a_patrol_visits_all_furniture_in_turn_whoever_answers(tiny_prior):
    rules = replace(RULES, looks="patrol")
    found = [play(tiny_prior, [rules], policy)[0] for policy in ("bayesian", "random")]
    assert found[0] == found[1]
    assert [place for _, place in found[0][0]] == [*range(6), *range(6), 0]
    twice, _ = play(tiny_prior, [replace(rules, looks_per_step=2)], num_steps=4)
    assert twice[0] == [(1, 0), (1, 1), (2, 2), (2, 3), (3, 4), (3, 5), (4, 0), (4, 1)]


@pytest.mark.slow
def test_looks_at_random_are_even_and_the_same_for_every_policy(tiny_prior):
    rules = replace(RULES, looks="random", looks_per_step=3)
    looks, _ = play(tiny_prior, [rules], num_steps=400)
    assert looks == play(tiny_prior, [rules], "random", num_steps=400)[0]
    counts = np.bincount([place for _, place in looks[0]], minlength=6)
    assert counts.sum() == 1200
    # Chi-square with 5 degrees of freedom: 20.5 is exceeded once in a thousand times.
    assert ((counts - 200) ** 2 / 200).sum() < 20.5


def test_further_looks_of_a_policy_are_at_random(tiny_prior):
    looks, choices = play(tiny_prior, [replace(RULES, looks_per_step=2)], num_steps=40)
    assert [place for _, place in looks[0][::2]] == choices[:, 0].tolist()
    assert len({place for _, place in looks[0][1::2]}) == 6


def test_homes_look_by_their_own_rules(tiny_prior):
    configs = [
        RULES,
        replace(RULES, looks="patrol", furniture_per_room=2),
        replace(RULES, looks="random", looks_per_step=3),
    ]
    together, _ = play(tiny_prior, configs)
    for home, config in enumerate(configs):
        assert together[home] == play(tiny_prior, [config], homes=[home])[0][0]


def test_bad_looks_are_refused():
    with pytest.raises(ValueError, match="looks must be one of policy, patrol, random, got 'tour'"):
        HomeConfig(looks="tour")
    with pytest.raises(ValueError, match="looks_per_step must be at least 1, got 0"):
        HomeConfig(looks_per_step=0)
