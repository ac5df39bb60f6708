"""Some of the random sessions of `make fuzz`, the same on every run."""

import pytest

from tests.sgm.finder.session_machine import MACHINES, play

# Some sightings of a session are doubtful ones, and its clock goes back, which is said.
pytestmark = [
    pytest.mark.filterwarnings("ignore:.* confidences of a look are below"),
    pytest.mark.filterwarnings("ignore::sgm.memory.memory_looks.LookPerFrameWarning"),
    pytest.mark.filterwarnings("ignore:the clock of the machine went back"),
]


@pytest.mark.slow
@pytest.mark.parametrize("machine", MACHINES, ids=lambda machine: machine.__name__)
def test_laws_of_sessions(machine, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda file: None)  # hundreds of saves, no crash to survive
    play(machine, 12)
