"""The end of a server over standard streams: its client goes, or a signal comes."""

import json
import signal
import subprocess
import time

import pytest

import sgm
from sgm.memory.scene_graph_memory import SceneGraphMemory

pytest.importorskip("mcp", reason="mcp is not installed: extra serve")

pytestmark = pytest.mark.slow
PATIENCE = 60.0  # seconds of waiting for what comes in one


class Streams:
    """A client without a library: requests are lines, and so are answers."""

    def __init__(self, python, path, *options):
        arguments = ["-m", "sgm.serve", str(path), "--stdio", "--new", "--finder", "bayesian"]
        pipes = dict.fromkeys(("stdin", "stdout", "stderr"), subprocess.PIPE)
        self.process = subprocess.Popen([python, *arguments, *options], text=True, **pipes)
        client = {"name": "test", "version": "1"}
        self.send("initialize", protocolVersion="2025-06-18", capabilities={}, clientInfo=client)
        about = self.receive()["serverInfo"]
        assert (about["name"], about["version"]) == ("scene-graph-memory", sgm.__version__)

    def send(self, method, **parameters):
        request = {"jsonrpc": "2.0", "id": 1, "method": method, "params": parameters}
        self.process.stdin.write(json.dumps(request) + "\n")
        self.process.stdin.flush()

    def receive(self):
        return json.loads(self.process.stdout.readline())["result"]

    def add_table(self):
        for arguments in (
            {"change": "add_room", "label": "kitchen"},
            {"change": "add_place", "label": "table", "room": "kitchen"},
        ):
            self.send("tools/call", name="change_map", arguments=arguments)
            assert not self.receive()["isError"]

    def end(self):
        """Status, and what it said on its error stream."""
        said = self.process.stderr.read()
        return self.process.wait(PATIENCE), said


@pytest.fixture
def start(python):
    begun = []

    def begin(path, *options):
        begun.append(Streams(python, path, *options))
        return begun[-1]

    yield begin
    for streams in begun:
        streams.process.kill()
        for pipe in (streams.process.stdin, streams.process.stdout, streams.process.stderr):
            pipe.close()
        streams.process.wait()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_while_its_client_is_silent(tmp_path, start, number):
    path = tmp_path / "home.sgm"
    streams = start(path)
    streams.add_table()
    streams.process.send_signal(number)
    assert streams.end() == (0, "")
    assert SceneGraphMemory.load(path).num_furniture == 1


def test_a_client_that_reads_no_longer_ends_it(tmp_path, start):
    path = tmp_path / "home.sgm"
    streams = start(path)
    streams.add_table()
    streams.process.stdout.close()
    streams.send("tools/list")
    streams.process.stdin.close()
    assert streams.end() == (0, "")
    assert SceneGraphMemory.load(path).num_furniture == 1


def test_time_passes_without_a_call(tmp_path, start):
    """As with HTTP: the file is kept, and written to the disk, beside the calls."""
    path = tmp_path / "home.sgm"
    streams = start(path, "--step_seconds", "1")
    end = time.monotonic() + PATIENCE
    while SceneGraphMemory.load(path).time < 2:
        assert time.monotonic() < end, "no time has passed"
        time.sleep(0.2)
    streams.process.stdin.close()
    assert streams.end() == (0, "")
