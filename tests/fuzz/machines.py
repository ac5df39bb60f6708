"""Sessions with a memory, a finder and a service, and their laws: Hypothesis' stateful machines.

A case is ten sessions of one machine: `--kinds machine --cases 2000` plays 20,000. In one of nine
the finder is the network; the others have rules, which cost a third of the time.
"""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from tests.sgm.finder.session_machine import MACHINES, play

SESSIONS = 10  # of a case


def make_seed(folder: Path) -> None:
    """Write the seed of the sessions that warm up."""
    (folder / "seed").write_text("0")


def change_seed(folder: Path, rng: np.random.Generator) -> None:
    """Write another seed."""
    (folder / "seed").write_text(str(rng.integers(2**62)))


def use_seed(folder: Path) -> None:
    """Play sessions; whatever they raise is a finding, a ValueError that is none of theirs, too."""
    number = int((folder / "seed").read_text())
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # some sightings are doubtful ones
            play(MACHINES[number % len(MACHINES)], SESSIONS, number)
    except (ValueError, OSError) as error:
        raise AssertionError("a session ended in an error") from error
