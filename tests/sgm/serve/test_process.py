"""The command: kills lose nothing that was answered, signals end it well, one owner at a time."""

import http.client
import json
import os
import random
import signal
import subprocess
import sys
import threading
import time

import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.serve import __main__ as server_main
from sgm.serve.__main__ import main

from .conftest import Client, open_service

pytest.importorskip("uvicorn", reason="uvicorn is not installed")
pytest.importorskip("mcp", reason="mcp is not installed")

# Imports what a server needs once, then becomes a server again and again, so that a start costs a
# fork: for each line of its input it forks a process that runs the command, and prints its number.
FORGE = """
import os, sys
from sgm.serve import server, tools
from sgm.serve.__main__ import main
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        os._exit(main(line.split()))
    print("process", child, flush=True)
    print("status", os.waitpid(child, 0)[1], flush=True)
"""


class Forge:
    """Starts servers."""

    def __init__(self):
        self._process = subprocess.Popen(
            [sys.executable, "-c", FORGE], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def start(self, path, *options):
        """Start one; returns its port and process number."""
        line = f"{path} --port 0 --finder bayesian --new {' '.join(options)}\n"
        self._process.stdin.write(line)
        self._process.stdin.flush()
        number = int(self._read("process"))
        return int(self._read("serving").rstrip("/").rpartition(":")[2]), number

    def wait(self):
        """Wait until it has ended; returns how."""
        return int(self._read("status"))

    def _read(self, begin):
        while line := self._process.stdout.readline():
            if line.startswith(begin):
                return line.split()[-1]
        raise AssertionError("the process has ended")

    def close(self):
        self._process.stdin.close()
        self._process.wait(20)
        self._process.stdout.close()


@pytest.fixture(scope="module")
def forge():
    forge = Forge()
    yield forge
    forge.close()


def write_until_killed(port, process, number, seconds):
    """Write until the server is killed; returns what was answered, and what was sent last."""
    client = Client(port)
    killer = threading.Timer(seconds, os.kill, (process, signal.SIGKILL))
    answered, sent = [], None
    killer.start()
    try:
        while True:
            number += 1
            sent = f"thing {number}"
            client.call("observe", place="desk", seen=[sent])
            answered.append(sent)
            time.sleep(0.005)  # so that memories stay small
    except (OSError, http.client.HTTPException):
        pass
    finally:
        killer.join()
        client.close()
    return answered, sent


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:looks must be few in a time step")
def test_kills_lose_nothing_that_was_answered(tmp_path, forge):
    kills = int(os.environ.get("SGM_KILLS", "8"))  # 40 and more where there is time
    path = tmp_path / "home.sgm"
    home, _ = open_service(path)
    home.save(home.path)
    del home, _  # the lock goes with it
    rng = random.Random(kills)
    answered, maybe = [], set()
    for number in range(kills):
        port, process = forge.start(path, "--snapshot_seconds", "0.05")
        seconds = rng.uniform(0.0, 0.4)
        new, sent = write_until_killed(port, process, 1000 * number, seconds)
        assert forge.wait() == signal.SIGKILL
        answered += new
        maybe.add(sent)
        home = SceneGraphMemory.open(path)
        things = set(home.descriptions)
        assert things >= set(answered)
        known = things - set(answered) - maybe
        assert not [name for name in known if name.startswith("thing ")]
        # Snapshot and events are the memory to the bit.
        before = json.dumps(home.parts.state.get_content_to_save().to_json())
        again = SceneGraphMemory.load(path).parts.state.get_content_to_save().to_json()
        assert json.dumps(again) == before
        del home
    assert answered


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_with_a_snapshot(tmp_path, forge, number):
    path = tmp_path / "home.sgm"
    port, process = forge.start(path)
    client = Client(port)
    client.call("add_room", label="kitchen")
    client.call("add_place", label="table", room="kitchen")
    feed = http.client.HTTPConnection("127.0.0.1", port, timeout=20)
    feed.request("GET", "/v1/feed")  # whoever listens does not keep it
    events = feed.getresponse()
    os.kill(process, number)
    assert forge.wait() == 0
    events.read()
    events.close()
    feed.close()
    client.close()
    assert [file.name for file in tmp_path.iterdir()] == ["home.sgm"]
    assert SceneGraphMemory.load(path).num_furniture == 1


@pytest.mark.slow
def test_a_second_server_is_refused(tmp_path, forge, capsys):
    path = tmp_path / "home.sgm"
    _, process = forge.start(path)
    assert main([str(path), "--port", "0", "--finder", "bayesian"]) == 2
    line = capsys.readouterr().err
    assert line.startswith("error: memory file must be written by one process at a time")
    assert line.count("\n") == 1
    os.kill(process, signal.SIGTERM)
    assert forge.wait() == 0


BAD = [
    ([], "memory file must be one that can be read"),
    (["--new", "--host", "0.0.0.0"], "--host must be this machine alone without a token"),
    (["--new", "--port", "70000"], "--port must be 0 to 65535"),
    (["--new", "--timeout", "0"], "--timeout must be a number above 0"),
    (["--new", "--rate", "nan"], "--rate must be a number above 0"),
    (["--new", "--token_file", "none"], "No such file"),
    (["--new", "--finder", "none"], "none"),
    (["--new", "--aliases", "none.csv"], "none.csv"),
    (["--new", "--step_seconds", "-1"], "--step_seconds must be a number above 0"),
]


@pytest.mark.parametrize(("options", "line"), BAD)
def test_bad_options_are_one_line(tmp_path, monkeypatch, capsys, options, line):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("SGM_TOKEN", raising=False)
    assert main(["home.sgm", *options]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ")
    assert line in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("missing", ["uvicorn", "mcp"])
def test_without_its_extra_the_line_says_what_an_index_has(tmp_path, monkeypatch, capsys, missing):
    """The name of the distribution is on no index: only the folder of a checkout installs it."""

    def find(name):
        return None if name == missing else name

    monkeypatch.setattr(server_main, "find_spec", find)
    assert main([str(tmp_path / "home.sgm"), "--new"]) == 2
    said = capsys.readouterr().err
    assert said.startswith(
        f"error: package {missing} must be installed to serve a memory, got none."
    )
    assert said.endswith("Run pip install './core[serve]'.\n")
    assert list(tmp_path.iterdir()) == []


def test_a_short_token_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setenv("SGM_TOKEN", "short")
    assert main([str(tmp_path / "home.sgm"), "--new", "--host", "0.0.0.0"]) == 2
    assert "token must be 16 to 500 printable characters" in capsys.readouterr().err


def test_an_address_in_use_is_told(tmp_path, capsys):
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    with server.open_socket("127.0.0.1", 0) as listening:
        port = listening.getsockname()[1]
        options = ["--new", "--port", str(port), "--finder", "bayesian"]
        assert main([str(tmp_path / "home.sgm"), *options]) == 2
    assert f"for 127.0.0.1:{port}. Choose another --port." in capsys.readouterr().err


LOADED = """
import sys
from pathlib import Path
from sgm.finder.service import MemoryService
from sgm.serve.finders import make_finder, warm_up
from tests.sgm.serve.conftest import START, open_service

finder = make_finder(sys.argv[1])
warm_up(finder)
home, _ = open_service(Path(sys.argv[2]))
service = MemoryService(home, finder, lambda: START)
before = set(sys.modules)
for thing in ("milk", "red mug", "hammer"):
    assert service.where_is(thing).status != "ambiguous"
assert service.search_start("milk").next is not None
assert set(sys.modules) == before, set(sys.modules) - before
"""


@pytest.mark.slow
@pytest.mark.parametrize("finder", ["bayesian", "adaptive", "any_home"])
def test_nothing_is_left_to_load_for_the_first_questions(finder, tmp_path):
    arguments = [sys.executable, "-c", LOADED, finder, str(tmp_path / "home.sgm")]
    subprocess.run(arguments, check=True, timeout=600)
