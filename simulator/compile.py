"""Compile all inner loops ahead, once for an installation: `python -m simulator.compile`.

Each loop is compiled by a small piece of work that calls it. Where all are kept already, it takes
a second or two. `simulator.kernel_store` says where they are kept.
"""

from __future__ import annotations

import argparse
import importlib
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from tqdm import tqdm

from sgm.camera.pinhole import Pose
from sgm.layout.box import Box
from simulator.box_world.depth_camera import DepthCamera, make_intrinsics
from simulator.box_world.ray_kernel import Solids, find_hidden
from simulator.kernel import KERNELS
from simulator.policies.registry import make_policy
from simulator.process import run_main
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.config import HomeConfig
from simulator.world.dynamics import Dynamics
from simulator.world.paper_dynamics import PaperDynamics
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.sessions.dynamics import SessionDynamics
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

PACKAGE = Path(__file__).parent


def _play(dynamics: Dynamics, *policies: str) -> None:
    source = SampledSource(home=HomeConfig(dynamics=dynamics))
    for name in policies:
        streams = Streams(0, "train", range(2))
        evaluate_policy(partial(make_policy, name), source, streams, num_steps=3)


def _shoot() -> None:
    solids = Solids.of_boxes([Box((2.5, 0.0, 1.0), (1.0, 1.0, 1.0))], owner=0)
    camera = DepthCamera(make_intrinsics(8, 8, 90.0), noise=0.0, hole_share=0.0)
    rng = np.random.default_rng(0)
    camera.shoot(solids, 1, Pose.look_at((0, 0, 1), (1, 0, 1)), rng=rng)
    find_hidden(solids, np.zeros(3), np.ones((2, 3)))


# What is done, so that it is compiled: a piece of work for each group of loops.
WORK: Mapping[str, Callable[[], None]] = {
    "homes of the paper": lambda: _play(PaperDynamics(), "random"),
    "routines": lambda: _play(RoutineDynamics(), "random"),
    "sessions": lambda: _play(SessionDynamics(), "random"),
    "filters that know the rules": lambda: _play(PaperDynamics(), "home_filter"),
    "cameras": _shoot,
}


def compile_all(progress: bool = True) -> int:
    """Compile what is not compiled yet; return how many loops were not."""
    for file in PACKAGE.rglob("*.py"):
        if "\n@kernel\n" in file.read_text("utf-8"):
            name = ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts)
            importlib.import_module(name)  # so that it is known how many loops there are
    from simulator.kernel_store import watch  # loads numba

    compiled: set[str] = set()
    with tqdm(total=len(KERNELS), desc="inner loops", unit="loop", disable=not progress) as bar:

        def count(name: str) -> None:
            compiled.add(name)
            bar.update(len(compiled) - bar.n)  # some are compiled for two kinds of arguments

        with watch(count):
            for title, work in WORK.items():
                bar.set_postfix_str(title)
                work()
        bar.update(len(KERNELS) - bar.n)  # were kept
    return len(compiled)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m simulator.compile", description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="no progress bar")
    options = parser.parse_args(arguments)
    number = compile_all(progress=not options.quiet)
    now = f"{number} were compiled now" if number else "all were there already"
    print(f"The simulator is ready: its {len(KERNELS)} inner loops are machine code, {now}.")
    return 0


if __name__ == "__main__":
    run_main(main)
