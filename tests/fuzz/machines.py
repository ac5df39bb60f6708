"""Sessions with a memory, a finder and a service, and their laws: Hypothesis' stateful machines.

A case is five sessions of one machine: `--kinds machine --cases 4000` plays 20,000.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from tests.sgm.finder.session_machine import MACHINES, play

SESSIONS = 5  # of a case


def make_seed(folder: Path) -> None:
    """Write the seed of the sessions that warm up."""
    (folder / "seed").write_text("0")


def change_seed(folder: Path, rng: np.random.Generator) -> None:
    """Write another seed."""
    (folder / "seed").write_text(str(rng.integers(2**62)))


def use_seed(folder: Path) -> None:
    """Play sessions; an AssertionError is a finding."""
    number = int((folder / "seed").read_text())
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # some sightings are doubtful ones
        play(MACHINES[number % len(MACHINES)], SESSIONS, number)
