"""Sessions with a memory, a finder and a service, and their laws: Hypothesis' stateful machines.

A case is ten sessions of one machine: `--kinds machine --cases 2000` plays 20,000. In one of nine
the finder is the network; the others have rules, which cost a third of the time.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from nep.view.texts import tell_furniture, tell_step
from sgm.memory.memory_event import read_events
from simulator.story.past_memory import PastMemory
from simulator.trace.from_log import make_trace
from tests.sgm.finder.session_machine import MACHINES, MemoryMachine, play
from tests.sgm.memory.sessions import dump

SESSIONS = 10  # of a case


class ToldMachine(MemoryMachine):
    """A session whose log makes a story at its end, which can be told, and a trace."""

    def teardown(self) -> None:
        """Tell it."""
        log = getattr(self, "log", None)
        if log is not None:
            events = read_events(log)
            story = PastMemory(events, "home")
            assert dump(story.memory_at(story.num_steps)) == dump(self.memory)
            tell(story)
            error = _catch(make_trace, events)
            assert error is None or " must " in str(error), error
        super().teardown()


def _catch(call: Callable[[Any], Any], argument: Any) -> ValueError | None:
    """Return what a call refuses."""
    try:
        call(argument)
    except ValueError as error:
        return error
    return None


def tell(story: PastMemory) -> None:
    """Say in words what happened, and what was known then."""
    for step in story.choose_steps(20):
        memory = story.memory_at(step)
        assert all(tell_step(story, memory, step))
        for furniture in memory.furniture_ids:
            assert tell_furniture(story, memory, furniture)


_PLAYED = tuple(ToldMachine if machine is MemoryMachine else machine for machine in MACHINES)


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
            play(_PLAYED[number % len(_PLAYED)], SESSIONS, number)
    except (ValueError, OSError) as error:
        raise AssertionError("a session ended in an error") from error
