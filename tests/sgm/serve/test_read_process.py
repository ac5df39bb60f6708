"""Questions to the reading process take turns; a slow one passes its turn on."""

import json
from io import BytesIO
from threading import Event
from types import SimpleNamespace

import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Bayesian

pytest.importorskip("mcp", reason="mcp is not installed")

from sgm.finder.finder import Finder
from sgm.serve import read_process
from sgm.serve.read_process import ReadProcess
from sgm.serve.reader import HEAD, SECONDS, Kind, pack

SLOW, QUICK, WRONG = "slow", "quick", "wrong"


class Output:
    """What the process writes, frame by frame."""

    def __init__(self):
        self.frames = []
        self.came = {number: Event() for number in range(10)}

    def write(self, frame):
        kind, number, size = HEAD.unpack_from(frame)
        assert len(frame) == HEAD.size + size
        self.frames.append((kind, number, frame[HEAD.size :]))
        self.came[number].set()

    def flush(self):
        """Nothing is kept back."""


class Calls:
    """Calls that note when they run beside another."""

    def __init__(self):
        self.release, self.begun = Event(), Event()
        self.num_running = self.most_running = 0
        self.order = []

    def run(self, name):
        self.num_running += 1
        self.most_running = max(self.most_running, self.num_running)
        self.order.append(name)
        try:
            if name == SLOW:
                self.begun.set()
                assert self.release.wait(20)
            if name == WRONG:
                raise KeyError(name)
        finally:
            self.num_running -= 1
        return name


@pytest.fixture
def ask(monkeypatch):
    """Asks calls by their names, numbered from 1; returns the output and the calls."""
    calls = Calls()

    def make(name):
        return SimpleNamespace(read=lambda values: values, run=lambda *_: calls.run(name))

    monkeypatch.setattr(
        read_process, "BY_NAME", {name: make(name) for name in (SLOW, QUICK, WRONG)}
    )

    def run(names, timeout=10.0):
        output = Output()
        reads = SimpleNamespace(finder=Finder(Bayesian()), memory=SceneGraphMemory())
        followed = SimpleNamespace(catch_up=lambda: None)
        bodies = [json.dumps([name, {}]).encode() for name in names]
        frames = [pack(Kind.QUESTION, n, body) for n, body in enumerate(bodies, 1)]
        ReadProcess(followed, reads, timeout, output).run(BytesIO(b"".join(frames)))
        return output, calls

    return run


def test_one_answers_after_the_other(ask):
    output, calls = ask([QUICK, WRONG, QUICK, QUICK])
    assert all(output.came[number].wait(20) for number in range(1, 5))
    assert calls.most_running == 1
    assert output.frames[0] == (Kind.READY, 0, b"")
    answered = {number: (kind, body[SECONDS.size :]) for kind, number, body in output.frames}
    assert answered[1] == answered[3] == answered[4] == (Kind.ANSWER, b'"quick"')
    assert answered[2] == (Kind.ERROR, b"")


def test_a_slow_one_passes_its_turn_on(ask):
    output, calls = ask([SLOW, QUICK, QUICK])
    assert all(output.came[number].wait(20) for number in (2, 3))
    assert not output.came[1].is_set()
    calls.release.set()
    assert output.came[1].wait(20)
    assert calls.most_running == 2


def test_what_has_waited_too_long_is_left_out(ask):
    output, calls = ask([QUICK, QUICK], timeout=-1.0)
    later, _ = ask([QUICK])
    assert later.came[1].wait(20)
    assert calls.order == [QUICK]
    assert [kind for kind, *_ in output.frames] == [Kind.READY]
