"""docs/rl.md: the environment as it stands there, and real agents of Stable-Baselines3, briefly."""

import re
import runpy
import shlex
import sys
import warnings
from pathlib import Path

import pytest

pytest.importorskip("sb3_contrib", reason="sb3_contrib is not installed: extra rl")
pytest.importorskip("minigrid", reason="minigrid is not installed: extra igridson")

import gymnasium
import torch
from minigrid.wrappers import ImgObsWrapper
from stable_baselines3.common.env_checker import check_env

from nep import evaluate
from simulator.gym.wrappers import FlatPlaces
from simulator.igridson.wrappers import GoAndLook

pytestmark = pytest.mark.slow

PAGE = Path(__file__).parents[1].joinpath("docs", "rl.md").read_text(encoding="utf-8")
FIND, GRID = "simulator.gym:FindObject-v0", "simulator.igridson:iGridson-v0"
# As the page, but small.
SMALLER = {
    r"learn\(\w+\)": "learn(256)",
    "n_envs=8": "n_envs=2",
    r"n_steps=\d+": "n_steps=64",
    "batch_size=256": "batch_size=64",
    "num_homes=10, num_searches=20": "num_homes=1, num_searches=2",
}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with the files of the page, shrunk; the commands are run there."""
    for name, text in re.findall(r"this as `(\S+)`.*?\n```python\n(.*?)```", PAGE, re.DOTALL):
        for long, short in SMALLER.items():
            text = re.sub(long, short, text)
        (tmp_path / name).write_text(text, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    torch.set_num_threads(1)
    yield tmp_path
    for name in ("trained", "train_grid"):
        sys.modules.pop(name, None)


def run_script(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        runpy.run_path(name, run_name="__main__")


def test_the_environment_is_as_shown():
    block = re.search(r"^```python\n(.*?)^```$", PAGE, re.MULTILINE | re.DOTALL)
    exec(compile(block[1], "rl.md", "exec"), {})


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


def test_an_agent_learns_find_object_and_plays_beside_others(folder, capsys):
    run_script("train_find_object.py")
    (command,) = re.findall(r"^python -m nep\.evaluate (.*)$", PAGE, re.MULTILINE)
    evaluate.main([*shlex.split(command), "--num_homes", "2", "--steps", "2"])
    assert re.search(r"trained:Trained +\d\.\d\d", capsys.readouterr().out)


def test_an_agent_learns_on_the_grid(folder, capsys):
    run_script("train_grid.py")
    run_script("score_grid.py")
    rows = re.findall(r"^\| (\w+) \| \d\.\d{3} \| [\d.]+% \| ", capsys.readouterr().out, re.M)
    assert rows == ["MaskablePPO", "random", "bayesian", "prior_filter"]
