"""docs/rl.md: the environments are what Stable-Baselines3 asks for."""

import warnings

import pytest

pytest.importorskip("sb3_contrib", reason="sb3_contrib is not installed: extra rl")
pytest.importorskip("minigrid", reason="minigrid is not installed: extra igridson")

import gymnasium
from minigrid.wrappers import ImgObsWrapper
from stable_baselines3.common.env_checker import check_env

from simulator.gym.wrappers import FlatPlaces
from simulator.igridson.wrappers import GoAndLook

pytestmark = pytest.mark.slow

FIND, GRID = "simulator.gym:FindObject-v0", "simulator.igridson:iGridson-v0"


@pytest.mark.parametrize(
    "make",
    [
        lambda: FlatPlaces(gymnasium.make(FIND)),
        lambda: FlatPlaces(gymnasium.make(GRID)),
        lambda: FlatPlaces(GoAndLook(gymnasium.make(GRID))),
    ],
)
def test_stable_baselines_accepts_it_without_a_warning(make):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(make())


def test_the_image_alone_is_smaller_than_its_networks_expect():
    with pytest.warns(UserWarning, match="minimal resolution"):
        check_env(ImgObsWrapper(gymnasium.make(GRID)))
