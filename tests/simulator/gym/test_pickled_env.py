"""A copy of an environment in another process goes on as the original; options are read."""

import pickle

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium", reason="gymnasium is not installed: extra gym")


def make(name):
    if "iGridson" in name:
        pytest.importorskip("minigrid", reason="minigrid is not installed: extra igridson")
    if "vector" in name:
        return gymnasium.make_vec("simulator.gym:FindObject-v0", num_envs=2)
    return gymnasium.make(name)


NAMES = ["simulator.gym:FindObject-v0", "simulator.igridson:iGridson-v0", "a vector"]


def play(env, num_steps=12):
    """What an agent gets that always takes the lowest action, over two searches."""
    found = []
    for seed in (None, 5):
        _, info = env.reset(seed=seed)
        for number in range(num_steps):
            action = np.zeros(env.num_envs, int) if hasattr(env, "num_envs") else number % 3
            _, reward, is_over, is_cut, info = env.step(action)
            found.append((np.sum(reward), np.sum(is_over), str(info.get("query"))))
            if np.any(is_over) or np.any(is_cut):
                break
    return found


@pytest.mark.parametrize("name", NAMES)
def test_a_pickled_environment_goes_on_alike(name):
    env = make(name)
    env.reset(seed=3)
    again = pickle.loads(pickle.dumps(env))
    assert play(again) == play(env)


@pytest.mark.parametrize("name", NAMES)
def test_options_that_say_nothing_are_refused(name):
    env = make(name)
    env.reset(seed=3, options={"new_home": np.bool_(True)})
    for options, kind, message in (
        ({"newhome": True}, ValueError, r"options must be some of new_home.*got 'newhome'"),
        ({"seed": 3}, ValueError, r"options must be some of new_home"),
        ({"new_home": "false"}, TypeError, r"new_home must be True or False, got 'false'"),
        ({"new_home": 1}, TypeError, r"new_home must be True or False, got 1"),
        (["new_home"], TypeError, r"options must be a mapping"),
    ):
        with pytest.raises(kind, match=message):
            env.reset(options=options)
    env.reset(options={})
