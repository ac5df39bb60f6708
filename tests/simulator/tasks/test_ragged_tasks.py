"""Tasks in homes of different sizes in lockstep: each is played as it is alone."""

import numpy as np
import pytest

from sgm.policies.policy import Policy
from simulator.policies import make_policy
from simulator.tasks.registry import TASKS
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

CONFIGS = (
    HomeConfig(furniture_per_room=2),
    HomeConfig(rooms=("kitchen",), furniture_per_room=3, objects_per_furniture=2),
    HomeConfig(rooms=("bedroom", "kitchen"), furniture_per_room=(7, 3)),
)
SIZES = (8, 3, 10)


class NoOpinion(Policy):
    """Says nothing about any place, not even that it is no place."""

    def __init__(self, score):
        self._score = score

    def scores(self, memory, queries):
        return np.full((len(queries.home), memory.num_furniture), self._score)


def play(task, homes, policy, num_steps=12):
    """Scores (H, T), and (choices, answers) of every home."""
    game = TASKS[task](homes, policy)
    chosen = [[] for _ in range(homes.num_homes)]

    def keep(answer):
        for home, choice in zip(answer.queries.home, answer.choice, strict=True):
            chosen[home].append(int(choice))
        assert not (answer.answers & ~homes.is_furniture[answer.queries.home]).any()

    game.on_answer = keep
    return np.stack(list(game.run(num_steps)), axis=1), chosen


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("name", ["random", "bayesian", "last_seen_prior"])
def test_a_home_is_played_as_it_is_alone(default_prior, task, name):
    homes = SampledHomes(default_prior, CONFIGS, Streams(4, "val", range(3)))
    values, chosen = play(task, homes, make_policy(name, homes))
    for number, config in enumerate(CONFIGS):
        own = SampledHomes(default_prior, config, Streams(4, "val", [number]))
        alone, looked = play(task, own, make_policy(name, own))
        np.testing.assert_allclose(values[number], alone[0])
        assert chosen[number] == looked[0]


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("score", [0.0, -np.inf])
def test_what_is_no_place_is_never_chosen(default_prior, task, score):
    """Ties of all places are ties of the places of the home."""
    homes = SampledHomes(default_prior, CONFIGS, Streams(0, "val", range(3)))
    _, chosen = play(task, homes, NoOpinion(score), 40)
    for places, size in zip(chosen, SIZES, strict=True):
        assert set(places) == set(range(size))
