"""Forged requests to the page: each gets a line or an answer, and nothing is imported or logged."""

import http.client
import json
import logging
import sys
from urllib.parse import urlsplit

import pytest

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from nep.view.server import CALLS, MOST_BYTES, PageServer
from simulator import SceneGraphMemory, Sighting
from simulator.story.past_memory import StillMemory

HEADERS = {"host": "127.0.0.1:8050", "content-type": "application/json"}
# A good value of each argument, at step 6 of the log.
GOOD = {"step": 6, "since": 0, "words": "red mug", "judge": "bayesian", "furniture": 2}


def nest(levels, inner=None):
    for _ in range(levels):
        inner = [inner]
    return inner


FORGED = [
    None, True, False, -1, 0.5, 1.5, 2**53 + 1, 10**18, 10**30, 10**400, 1e308, -1e308, "",
    "x" * 5000, [], {}, [[]], nest(90), ["x"], [0, 1, 2, 3], {"points": []}, {"evilmod:P": 5},
]  # fmt: skip
NO_NAMES = [
    "nobody",
    "none",
    "evilmod:P",
    "os:system",
    ".:",
    "..x:y",
    "nep.view.server:PageServer",
    "\ud800",
    "\0",
    "../../x",
    "<b>x</b>",
]
RAW = [
    "",
    "null",
    "[]",
    "1",
    '"x"',
    "NaN",
    "-Infinity",
    "1e999",
    "9" * 5000,
    "[" * 9000,
    "{",
    "'x'",
    '{"call": "watch", "call": "names"}',
    b"\xff\xfe{\0}\0",
]


@pytest.fixture
def server(desk, tmp_path, monkeypatch):
    """The page, run where a module lies that must not be imported."""
    (tmp_path / "evilmod.py").write_text("import pathlib\npathlib.Path('ran').touch()\nP = dict\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    with PageServer(desk) as server:
        yield server


@pytest.fixture
def post(server, caplog, tmp_path):
    """Send a body; what comes back is an answer or a line, never a traceback."""
    caplog.set_level(logging.WARNING)

    def send(body):
        content = (
            body
            if isinstance(body, bytes)
            else body.encode()
            if isinstance(body, str)
            else json.dumps(body).encode()
        )
        status, _, answer = server.respond("POST", "/", HEADERS, content)
        assert caplog.records == [], content[:300]
        assert "evilmod" not in sys.modules, content[:300]
        if status == 400:
            assert len(answer) < 1000, content[:300]
            assert answer.count(b"\n") == 1
            assert b" must " in answer
        else:
            assert status == 200
            json.loads(answer)
        return status

    yield send
    assert not (tmp_path / "ran").exists()


def make_body(call, **changed):
    return {"call": call, **{name: GOOD[name] for name in CALLS[call][0]}, **changed}


@pytest.mark.parametrize("call", CALLS)
def test_what_the_page_sends_is_answered(call, post):
    assert post(make_body(call)) == 200


@pytest.mark.parametrize("call", CALLS)
def test_every_value_is_checked(call, post):
    for name in CALLS[call][0]:
        for value in FORGED:
            assert post(make_body(call, **{name: value})) == 400, (name, str(value)[:100])
        for value in NO_NAMES:
            found = post(make_body(call, **{name: value}))
            assert found == (200 if name == "words" else 400), (name, value)


def test_the_frame_of_a_request_is_checked(post):
    for call in CALLS:
        assert post({**make_body(call), "more": 1}) == 400
        for name in CALLS[call][0]:
            body = make_body(call)
            del body[name]
            assert post(body) == 400, (call, name)
    for call in [*FORGED, *NO_NAMES, "answer ", "__class__"]:
        assert post({"call": call}) == 400, str(call)[:100]
    for text in RAW:
        assert post(text) == 400, text[:20]
    assert post(json.dumps(make_body("watch")) + " " * MOST_BYTES) == 400


def test_a_step_that_there_is_not_is_said(server):
    for call in ("state", "answer", "changes", "plan", "furniture"):
        body = json.dumps(make_body(call, step=7)).encode()
        status, _, answer = server.respond("POST", "/", HEADERS, body)
        assert status == 200
        assert json.loads(answer)["problem"].startswith("step must lie in 0 to 6, got 7")


def test_other_paths_methods_and_pages_are_refused(server):
    body = json.dumps(make_body("watch")).encode()
    for path in ("/x", "/../page.js", "//", "/page.js", "/favicon.ico"):
        assert server.respond("GET", path, HEADERS, b"")[0] == 404
        assert server.respond("POST", path, HEADERS, body)[0] == 404
    assert server.respond("PUT", "/", HEADERS, body)[0] == 404
    for name, value in (
        ("host", "somewhere.example:80"),
        ("origin", "http://somewhere.example"),
        ("sec-fetch-site", "cross-site"),
    ):
        assert server.respond("POST", "/", {**HEADERS, name: value}, body)[0] == 403, name
        assert server.respond("GET", "/", {**HEADERS, name: value}, b"")[0] == 403, name


def test_a_request_without_a_length_or_with_too_much_is_refused(desk, serve):
    place = urlsplit(serve(desk)).netloc
    for length in (None, "x", "-1", str(MOST_BYTES + 1), "9" * 30):
        connection = http.client.HTTPConnection(place)
        connection.putrequest("POST", "/")
        if length is not None:
            connection.putheader("Content-Length", length)
        connection.endheaders()
        answer = connection.getresponse()
        assert answer.status == 413, length
        assert b"must have a length of at most" in answer.read()
        connection.close()


def test_a_browser_that_leaves_is_no_error(server, capsys):
    for error in (BrokenPipeError(), ConnectionResetError()):
        try:
            raise error
        except OSError:
            server.handle_error(None, "127.0.0.1")
    assert capsys.readouterr().err == ""


def test_a_judge_that_is_not_offered_is_not_imported(desk):
    for name in ("evilmod:P", "evilmod.P", "os:system", "", "nobody"):
        with pytest.raises(ValueError, match="policy must be one of bayesian, last"):
            desk.judges.get(name)
    assert "evilmod" not in sys.modules


def test_a_page_whose_story_went_on_is_told_and_not_broken():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
    memory.observe(shelf, [Sighting("red mug")])
    desk = Desk(Stage(lambda: StillMemory(memory.copy(), "home"), lambda: memory.time), Judges())
    desk.judges.names = ["bayesian", "last_seen_prior"]
    with PageServer(desk) as server:

        def send(call, **values):
            body = json.dumps({"call": call, **values}).encode()
            status, _, answer = server.respond("POST", "/", HEADERS, body)
            assert status == 200
            return json.loads(answer)

        question = {"words": "red mug", "judge": "bayesian"}
        assert send("answer", step=0, **question)["rows"][1]["furniture"] == shelf
        memory.step(6)
        assert send("watch") == {"version": 1, "first": 6, "last": 6, "problem": ""}
        assert "step must be 6" in send("answer", step=0, **question)["problem"]
        assert send("answer", step=6, **question)["rows"][1]["furniture"] == shelf
