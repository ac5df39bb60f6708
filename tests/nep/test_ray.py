"""Collecting and evaluating on Ray, one local cluster of two CPUs for both."""

import json
import os
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from nep.evaluate import main as evaluate
from simulator.collect.__main__ import main as collect

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(find_spec("ray") is None, reason="Ray is not installed: extra cluster"),
]

ROOT = Path(__file__).parents[2]
COLLECT = ["--num_homes", "5", "--steps", "4", "--seed", "3"]
EVALUATE = "--num_homes 3 --steps 4 --tasks find_object --policies bayesian ceiling".split()
CODE = """
import json, sys
import ray

ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
from nep.evaluate import main as evaluate
from simulator.collect.__main__ import main as collect

for main, arguments in zip((collect, evaluate), json.loads(sys.argv[1])):
    main([*arguments, "--workers", "2", "--backend", "ray"])
"""


@pytest.fixture(scope="module")
def on_ray(tmp_path_factory) -> Path:
    """Folders `data` and `results`, made by Ray."""
    folder = tmp_path_factory.mktemp("ray")
    commands = [
        [*COLLECT, "--out", str(folder / "data")],
        [*EVALUATE, "--out", str(folder / "results")],
    ]
    done = subprocess.run(
        [sys.executable, "-c", CODE, json.dumps(commands)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
        env=os.environ
        | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path]), "RAY_AUTH_MODE": "disabled"},
    )
    assert done.returncode == 0, done.stderr
    return folder


def test_it_collects_the_same_bytes(on_ray, tmp_path):
    collect([*COLLECT, "--out", str(tmp_path / "data")])
    found, expected = (
        {path.name: path.read_bytes() for path in (folder / "data").iterdir()}
        for folder in (on_ray, tmp_path)
    )
    assert found == expected


def test_it_gives_the_same_scores(on_ray, tmp_path):
    evaluate([*EVALUATE, "--out", str(tmp_path / "results")])
    found, expected = (
        json.loads((folder / "results" / "results.json").read_text())["tasks"]
        for folder in (on_ray, tmp_path)
    )
    assert found == expected
