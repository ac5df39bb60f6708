import re
import subprocess
import sys

import pygame
import pytest
from PIL import Image

from simulator.igridson.__main__ import main

pytestmark = pytest.mark.slow


def test_video_writes_film_and_still(tmp_path):
    film, still = tmp_path / "search.gif", tmp_path / "search.png"
    args = [
        "video",
        "--policy",
        "bayesian",
        "--searches",
        "1",
        "--warm-up",
        "1",
        "--tile",
        "32",
        "--out",
        str(film),
        "--still",
        str(still),
    ]
    assert main(args) == 0
    with Image.open(film) as image:
        assert image.format == "GIF"
    with Image.open(still) as image:
        assert image.size[0] == 22 * 32


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["run", "--runs", "150"], "command must be one of play, video, got 'run'"),
        (["play", "--policy", "nep"], "policy must be one of random, .*got 'nep'.*nep.igridson"),
        (["play", "--seed", "-1"], "seed must be non-negative, got -1"),
        (["video", "--out", "film.gif", "--seed", "-1"], "seed must be non-negative, got -1"),
        (["video", "--out", "film.avi"], "got 'film.avi'"),
    ],
)
def test_bad_arguments_end_with_their_message_alone(args, message, capsys):
    assert main(args) == 2
    error = capsys.readouterr().err
    assert error.startswith("error: ")
    assert error.count("\n") == 1
    assert re.search(message, error)


@pytest.mark.parametrize("policy", [None, "bayesian"])
def test_play_takes_keys_until_it_is_left(monkeypatch, policy, capsys):
    from simulator.igridson.env import IGridsonEnv

    keys = [
        pygame.K_UP,
        pygame.K_LEFT,
        pygame.K_UP,
        pygame.K_UP,
        pygame.K_SPACE,
        pygame.K_x,
        pygame.K_n,
        pygame.K_h,
        pygame.K_RIGHT,
        pygame.K_q,
    ]
    events = [pygame.event.Event(pygame.KEYUP, key=pygame.K_UP)]
    events += [pygame.event.Event(pygame.KEYDOWN, key=key) for key in keys]
    monkeypatch.setattr(pygame.event, "wait", lambda: events.pop(0))
    taken, beliefs = [], []
    step = IGridsonEnv.step

    def record(env, action):
        taken.append(int(action))
        beliefs.append(env.belief is not None)
        return step(env, action)

    monkeypatch.setattr(IGridsonEnv, "step", record)
    assert main(["play", *([] if policy is None else ["--policy", policy])]) == 0
    assert events == []
    assert taken == [2, 0, 2, 2, 3, 1]
    assert all(belief == (policy is not None) for belief in beliefs)
    assert "space: look" in capsys.readouterr().out


def test_import_simulator_does_not_need_minigrid():
    code = "import sys, simulator, simulator.tasks.find_object; print(sorted(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    for name in ("minigrid", "gymnasium", "pygame", "PIL"):
        assert f"'{name}'" not in done.stdout


def test_a_missing_extra_is_named():
    code = "import sys; sys.modules['gymnasium'] = None; import simulator.igridson"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "pip install ./core '.[igridson]'" in done.stderr


def test_the_banner_of_pygame_stays_away():
    done = subprocess.run(
        [sys.executable, "-m", "simulator.igridson", "--help"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert done.stdout.startswith("usage: python -m simulator.igridson")
    assert "pygame" not in done.stdout
