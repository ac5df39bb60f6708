"""A second process that answers what only reads: the same answers, also after writes; its end."""

import asyncio
import json
import os
import signal
import time
from contextlib import closing
from datetime import timedelta
from types import SimpleNamespace

import pytest

from sgm.finder.answers import write_json
from sgm.serve.caller import MOST_QUEUED, Caller
from sgm.serve.calls import BY_NAME, CALLS
from sgm.serve.reader import Reader

from .conftest import ALIASES, START, Client, open_service, run_server

pytest.importorskip("uvicorn", reason="uvicorn is not installed")
pytest.importorskip("mcp", reason="mcp is not installed")


@pytest.fixture
def served(tmp_path):
    """A server whose process for reading is ready: `client`, `service`, `home`, `reader`, `told`.

    `asked` are the calls that the process has answered; `times` is what the clock says.
    """
    aliases, told, asked = write_aliases(tmp_path), [], []
    times = [START]
    home, service = open_service(tmp_path / "home.sgm", aliases, lambda: times[0])
    arguments = ["--finder", "bayesian", "--timeout", "10", "--aliases", str(aliases)]
    reader = Reader(arguments, told.append)
    ask = reader.ask

    async def note(name, *args):
        answer = await ask(name, *args)
        asked.append(name)
        return answer

    reader.ask = note
    with run_server(service, reader=reader) as running:
        client = Client(running.port)
        wait_until(lambda: reader.is_ready)
        yield SimpleNamespace(
            client=client,
            service=service,
            home=home,
            reader=reader,
            told=told,
            asked=asked,
            times=times,
        )
        client.close()


def write_aliases(folder):
    path = folder / "aliases.csv"
    rows = [f"scissors,,{';'.join(ALIASES['scissors'])}", "paper knife,,thing to cut paper"]
    path.write_text("\n".join(["name,kind,aliases", *rows]) + "\n")
    return path


def wait_until(is_so):
    end = time.monotonic() + 600  # only so that it ends
    while not is_so():
        assert time.monotonic() < end
        time.sleep(0.01)


def ask(served, name, **arguments):
    """What the process answers, which must be what this one does."""
    before = len(served.asked)
    answer = served.client.call(name, **arguments)
    assert served.asked[before:] == [name]
    call = BY_NAME[name]
    expected = call.run(served.service, call.read(arguments))
    assert answer == json.loads(write_json(expected))
    return answer


def ask_all(served):
    for thing in ("mug", "glasses", "thing to cut paper", "milk", "hammer"):
        ask(served, "where_is", thing=thing)
        ask(served, "where_is", thing=thing, at="2026-11-16T18:30", k=3)
        ask(served, "history", thing=thing)
    for place in ("desk", "white fridge"):
        ask(served, "list_things", place=place)
        ask(served, "expect", place=place)
        ask(served, "expect", place=place, at="2026-11-16T18:30", k=3)
    ask(served, "list_places", room="kitchen")
    ask(served, "learnt")
    ask(served, "next_looks", k=2)
    ask(served, "changes", since=0)
    ask(served, "changes", since="2026-11-16T07:30")


def test_calls_that_only_read_are_those_of_a_copy():
    assert {call.name for call in CALLS if call.only_reads} == {
        "ask",
        "where_is",
        "list_places",
        "list_things",
        "history",
        "changes",
        "expect",
        "learnt",
        "next_looks",
    }


@pytest.mark.parametrize(
    ("num_waiting", "has_asked"), [(MOST_QUEUED - 1, True), (MOST_QUEUED, False)]
)
def test_this_process_answers_too_while_the_other_has_too_much(tmp_path, num_waiting, has_asked):
    asked = []

    async def ask(*args):
        asked.append(args)
        return write_json(service.where_is("milk"))

    home, service = open_service(tmp_path / "home.sgm")
    with closing(home):
        caller = Caller(service, reader=SimpleNamespace(num_waiting=num_waiting, ask=ask))
        answer = asyncio.run(caller.answer(BY_NAME["where_is"], {"thing": "milk"}))
        assert answer == write_json(service.where_is("milk"))
        assert bool(asked) == has_asked


@pytest.mark.slow
def test_answers_are_the_same_after_every_write(served):
    call = served.client.call
    ask_all(served)
    call("observe", place="desk", seen=["eyeglasses", {"thing": "pen", "confidence": 0.8}])
    assert ask(served, "where_is", thing="pen")["places"][0]["name"] == "desk in study"
    call("note_moved", thing="pen", place="white fridge", by="anna")
    ask(served, "where_is", thing="pen")
    call("picked_up", thing="scissors")
    assert ask(served, "where_is", thing="scissors")["with_robot"] > 0.9
    call("put_down", thing="scissors", place="counter top")
    call("rename", thing="pen", name="fountain pen")
    call("add_place", label="shelf", room="study")
    call("observe", place="shelf", seen=["book"], coverage=0.5)
    call("forget", thing="milk")
    search = call("search_start", thing="wine glass")
    call("search_next", search_id=search["search_id"], result="not_found")
    served.times[0] += timedelta(minutes=30)
    assert served.service.let_time_pass() == 3
    ask_all(served)
    served.home.save(served.home.path)  # another snapshot
    call("observe", place="desk", seen=["eyeglasses"])
    ask_all(served)


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:looks must be few in a time step")
def test_who_reads_next_knows_what_was_written(served):
    for number in range(100):
        place = ("desk", "white fridge")[number % 2]
        served.client.call("observe", place=place, seen=[f"thing {number}"])
        answer = served.client.call("where_is", thing=f"thing {number}")
        assert answer["last_seen"]["name"].startswith(place)
    assert served.asked == ["where_is"] * 100


@pytest.mark.slow
def test_what_is_refused_is_refused_in_the_same_line(served):
    for name, arguments in (("list_things", {"place": 99}), ("where_is", {"thing": "?"})):
        call = BY_NAME[name]
        with pytest.raises((KeyError, ValueError)) as raised:
            call.run(served.service, call.read(arguments))
        answer = served.client.send("POST", f"/v1/{name}", json.dumps(arguments))
        assert answer.status in (400, 404)
        assert json.loads(answer.text)["error"] == raised.value.args[0]
    assert served.asked == []


@pytest.mark.slow
def test_without_it_the_server_answers_itself(served):
    os.kill(served.reader._process.pid, signal.SIGKILL)
    wait_until(lambda: not served.reader.is_ready)
    served.client.call("observe", place="desk", seen=["pen"])
    assert served.client.call("where_is", thing="pen")["places"][0]["name"] == "desk in study"
    assert served.asked == []
    assert served.told == [
        "the process that answers what only reads has ended: this one does so now"
    ]


def test_it_ends_with_the_server(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm", None)
    told = []
    reader = Reader(["--finder", "bayesian", "--timeout", "10"], told.append)
    with run_server(service, reader=reader):  # ended before it is ready, perhaps
        wait_until(lambda: reader._process is not None)
    assert reader._process.returncode is not None
    assert told == []
