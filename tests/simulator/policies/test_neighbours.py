"""An answer depends on the home alone, not on the homes that share the batch with it."""

import numpy as np
import pytest

from sgm.policies.policy import compute_probabilities
from simulator.policies import POLICIES, make_policy
from simulator.policies.filter_looks import FilterLooks
from simulator.policies.place_filter import PlaceFilter
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

CONFIGS = (
    HomeConfig(rooms=("kitchen", "bathroom"), furniture_per_room=(5, 6), objects_per_furniture=3),
    HomeConfig(detection_error=0.1, move_share=0.1),
    HomeConfig(rooms=("bedroom",), furniture_per_room=3, cross_room_moves=True),
    HomeConfig(rooms=("kitchen", "kitchen", "bedroom"), furniture_per_room=17, dynamic_nodes=False),
    HomeConfig(furniture_per_room=2, noise_zero_prob=0.5),
)
NUM_STEPS = 25


def play(name, prior, numbers):
    """Ask three questions a step in each home, of which one is for what it does not have."""
    configs = [CONFIGS[number] for number in numbers]
    homes = SampledHomes(prior, configs, Streams(4, "test", numbers))
    policy = make_policy(name, homes)
    rollout = Rollout(homes, policy)
    answers = []
    for step in range(NUM_STEPS):
        rollout.evolve()
        home = np.repeat(np.arange(len(numbers)), 3)
        slots = [
            np.random.default_rng([step, number]).choice(np.flatnonzero(present), 2)
            for number, present in zip(numbers, homes.is_present, strict=True)
        ]
        codes = np.concatenate(
            [[*homes.object_code[row, slot], step] for row, slot in enumerate(slots)]
        )
        queries = rollout.query(home, codes)
        scores = policy.scores(rollout.memory, queries)
        is_furniture = rollout.memory.is_furniture[home]
        probability = compute_probabilities(scores, policy.score_kind, is_furniture)
        assert not np.isnan(scores).any()
        assert (scores[~is_furniture] == -np.inf).all()
        assert not probability[~is_furniture].any()
        width = homes.home_num_furniture
        answers.append(
            [
                np.stack(
                    [part[3 * row : 3 * row + 3, : width[row]] for part in (scores, probability)]
                )
                for row in range(len(numbers))
            ]
        )
        rollout.look((7 * step + np.array(numbers)) % width)
    return answers


FILTERS = [name for name, policy in POLICIES.items() if issubclass(policy, PlaceFilter)]
CASES = [(name, FilterLooks.max_length) for name in POLICIES] + [(name, 8) for name in FILTERS]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "max_length"), CASES)
def test_answers_do_not_depend_on_who_shares_the_batch(
    default_prior, monkeypatch, name, max_length
):
    monkeypatch.setattr(FilterLooks, "max_length", max_length)  # short: cut several times
    together = play(name, default_prior, range(len(CONFIGS)))
    for number in range(len(CONFIGS)):
        alone = play(name, default_prior, [number])
        for both, own in zip(together, alone, strict=True):
            np.testing.assert_array_equal(both[number], own[0])
