"""Plain HTTP: answers, refusals in one line, bounds of size, rate and time, other origins."""

import http.client
import json
import socket
import sqlite3
import threading
import time
from contextlib import suppress
from datetime import datetime, timedelta
from functools import partial

import numpy as np
import pytest

from sgm.finder.answers import to_json, write_json
from sgm.finder.service import MemoryService
from sgm.memory import memory_event
from sgm.memory.memory_content import MemoryContent
from sgm.serve import caller, guard
from sgm.serve.guard import LOCAL_NAMES, Guard, Refused, is_local
from sgm.store import home_file

from .conftest import Client, open_service, run_server

pytest.importorskip("uvicorn", reason="uvicorn is not installed")
TOKEN = "a token of this test"


def read_error(answer):
    """The one line of a refusal."""
    values = json.loads(answer.text)
    assert list(values) == ["error"]
    assert "\n" not in values["error"]
    assert 0 < len(values["error"]) <= 500
    assert "Traceback" not in values["error"]
    return values["error"]


def test_a_call_answers_what_the_method_does(served):
    for name, arguments in (
        ("where_is", {"thing": "mug"}),
        ("where_is", {"thing": "glasses", "k": 2}),
        ("list_places", {"room": "kitchen"}),
        ("list_things", {"place": "desk"}),
        ("history", {"thing": "milk"}),
    ):
        expected = to_json(getattr(served.service, name)(**arguments))
        assert served.client.call(name, **arguments) == expected
        query = "&".join(f"{key}={value}" for key, value in arguments.items())
        answer = served.client.send("GET", f"/v1/{name}?{query}")
        assert json.loads(answer.text) == expected


def test_where_is_has_600_bytes_at_most(served):
    for thing in ("mug", "glasses", "flux capacitor", "x" * 200, "\N{TEACUP WITHOUT HANDLE}" * 200):
        answer = served.client.send("POST", "/v1/where_is", json.dumps({"thing": thing}))
        assert answer.status == 200
        assert len(answer.text.encode()) <= 600


def test_what_is_written_is_read_at_once(served):
    before = count_events(served.home)
    assert served.client.call("observe", place="desk", seen=["keys"])["status"] == "ok"
    assert count_events(served.home) == before + 1
    (row,) = served.client.call("history", thing="keys")["rows"]
    assert row["name"] == "desk in study"
    assert served.service.memory.last_seen("keys") is not None


def test_a_search_over_http(served):
    begun = served.client.call("search_start", thing="milk", **{"from": [0, 0]})
    while not begun["is_found"]:
        is_right = begun["next"]["name"] == "white fridge in kitchen"
        result = "found" if is_right else "not_found"
        begun = served.client.call("search_next", search_id=begun["search_id"], result=result)
    assert begun["next"] is None
    assert begun["outcome"].startswith("milk: found at white fridge in kitchen")


def test_health_says_what_is_wrong_with_the_clock(tmp_path):
    wall = [datetime(2026, 11, 16, 8)]
    _home, service = open_service(tmp_path / "home.sgm")
    service = MemoryService(service.memory, service.finder, lambda: wall[0])
    wall[0] -= timedelta(hours=1)
    with pytest.warns(UserWarning, match="went back"):
        service.let_time_pass()
    with run_server(service, tools=False) as running:
        client = Client(running.port)
        health = json.loads(client.send("GET", "/health").text)
        client.close()
        assert health["status"] == "ok"
        assert "went back: it says 2026-11-16T07:00:00, 1:00:00 before" in health["clock_fault"]


def test_pages_and_health(served):
    assert served.client.send("GET", "/health").text == '{"status":"ok"}'
    assert "where_is" in served.client.send("GET", "/").text
    assert json.loads(served.client.send("GET", "/openapi.json").text)["openapi"] == "3.1.0"
    served.client.call("where_is", thing="mug")
    served.client.send("GET", "/v1/where_is")
    metrics = served.client.send("GET", "/metrics").text.splitlines()
    assert 'sgm_requests_total{call="where_is",status="200"} 1' in metrics
    assert 'sgm_requests_total{call="where_is",status="400"} 1' in metrics
    assert 'sgm_request_seconds_count{call="where_is"} 2' in metrics
    assert "sgm_places 3" in metrics
    assert f"sgm_file_bytes {served.home.parts.files.file.num_bytes}" in metrics


JSON = {"Content-Type": "application/json"}
BAD = [
    ("POST", "/v1/where_is", b"{", {}, 400, "body must be JSON"),
    ("POST", "/v1/where_is", b"\xff", {}, 400, "body must be JSON"),
    ("POST", "/v1/where_is", b"[" * 10_000, {}, 400, "body must be JSON"),
    ("POST", "/v1/where_is", b'{"thing":"a","thing":"b"}', {}, 400, "body must be JSON"),
    ("POST", "/v1/where_is", b'{"thing":NaN}', {}, 400, "body must be JSON"),
    ("POST", "/v1/where_is", b"[]", {}, 400, "arguments of where_is must be one JSON object"),
    ("POST", "/v1/where_is", b'{"thing":"\\ud800"}', {}, 400, "description must not hold"),
    ("POST", "/v1/where_is", b'{"thing":"a\\nb"}', {}, 400, "description must be one line"),
    ("POST", "/v1/where_is", b'{"thing":"mug","at":"2001-01-01"}', {}, 400, "at must not be"),
    ("POST", "/v1/where_is", b"{}", {"Content-Type": "text/plain"}, 415, "Content-Type must be"),
    ("POST", "/v1/where_is", b"x" * 300_000, {}, 413, "body must have at most"),
    ("POST", "/v1/observe", b'{"place":77,"seen":[]}', {}, 404, "furniture must be an id"),
    ("GET", "/v1/observe?place=desk", None, {}, 405, "must be POST, got GET. Use POST."),
    ("PUT", "/v1/where_is", b"{}", {}, 405, "Use GET or POST."),
    ("GET", "/v1/where_is?thing=a&thing=b", None, {}, 400, "query must name an argument once"),
    ("GET", "/v1/where_is?thing=%ff", None, {}, 400, "query must be name=value pairs"),
    ("GET", "/v1/where_is?" + "a=1&" * 30, None, {}, 400, "query must be name=value pairs"),
    ("GET", "/v1/nothing", None, {}, 404, "path must be one that /openapi.json lists"),
    ("GET", "/v1/../etc/passwd", None, {}, 404, "path must be one that /openapi.json lists"),
    ("GET", "/v1/whereis?thing=mug", None, {}, 404, "Did you mean /v1/where_is?"),
    ("GET", "/v1/where_is/?thing=mug", None, {}, 404, "path must be one that /openapi.json lists"),
    ("POST", "/openapi.json", b"", {}, 405, "/openapi.json must be GET, got POST. Use GET."),
    ("PATCH", "/v1/feed", b"", {}, 405, "method of /v1/feed must be GET, got PATCH. Use GET."),
    ("POST", "/health", b"", {}, 405, "method of /health must be GET, got POST. Use GET."),
    ("GET", "/health", None, {"Host": "evil.example"}, 403, "Host must be a name of this server"),
    ("GET", "/health", None, {"Host": ""}, 403, "Host must be a name of this server"),
    ("GET", "/", None, {"Origin": "http://evil.example"}, 403, "Origin must be this server's own"),
    ("GET", "/", None, {"Origin": "null"}, 403, "Origin must be this server's own"),
]


@pytest.mark.parametrize(("method", "path", "body", "headers", "status", "line"), BAD)
def test_a_bad_request_is_refused_in_one_line(served, method, path, body, headers, status, line):
    answer = served.client.send(method, path, body, headers)
    assert answer.status == status
    assert line in read_error(answer)
    if status == 405:
        allowed = answer.headers["Allow"].split(", ")
        assert method not in allowed
        assert line.endswith(f"Use {' or '.join(allowed)}.")
    assert served.client.send("GET", "/health").status == 200


def test_the_head_of_a_feed_is_refused(served):
    """A feed has no end: one that sends nothing would wait for good."""
    for path in ("/v1/feed", "/health", "/v1/where_is?thing=mug"):
        answer = served.client.send("HEAD", path)
        assert answer.status == 405
        assert "HEAD" not in answer.headers["Allow"]
    assert served.application.feed.num_listeners == 0


def test_a_page_of_another_origin_neither_reads_nor_writes(served):
    """What a browser sends for such a page, and that no answer lets it read."""
    before = count_events(served.home)
    other = {"Origin": "http://127.0.0.1:9", "Sec-Fetch-Site": "cross-site"}
    body = json.dumps({"place": "desk", "seen": []})
    for headers in (
        other,  # another port of this machine is another origin
        {"Origin": f"http://localhost:{served.port}"},  # and so is another name of it
        {"Origin": "http://evil.example", "Host": f"evil.example:{served.port}"},  # DNS rebinding
        {"Sec-Fetch-Site": "cross-site"},  # of an image: no Origin is sent
        {"Sec-Fetch-Site": "same-site"},
        {"Content-Type": "text/plain"},  # of a form: a browser asks nobody before it sends it
        {"Content-Type": "application/x-www-form-urlencoded", **other},
    ):
        assert served.client.send("POST", "/v1/observe", body, headers).status in (403, 415)
        if "Content-Type" not in headers:
            for path in ("/v1/where_is?thing=mug", "/v1/feed", "/metrics"):
                assert served.client.send("GET", path, None, headers).status == 403
    # What a browser asks before it sends JSON, and what every answer would have to allow.
    asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "*"}
    assert served.client.send("OPTIONS", "/v1/observe", None, {**other, **asked}).status == 403
    assert served.client.send("OPTIONS", "/v1/observe", None, asked).status == 405
    own = {"Origin": f"http://127.0.0.1:{served.port}", "Sec-Fetch-Site": "same-origin"}
    answer = served.client.send("GET", "/v1/where_is?thing=mug", None, own)
    assert answer.status == 200
    assert not [name for name in answer.headers if name.lower().startswith("access-control")]
    assert answer.headers["Cross-Origin-Resource-Policy"] == "same-origin"
    assert count_events(served.home) == before


def test_another_address_needs_the_token(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, Guard((), TOKEN), tools=False) as running:
        client = Client(running.port)
        for headers in ({}, {"Authorization": "Bearer x"}, {"Authorization": TOKEN}):
            answer = client.send("GET", "/v1/where_is?thing=mug", None, headers)
            assert answer.status == 401
            assert "Authorization must be Bearer" in read_error(answer)
            assert answer.headers["WWW-Authenticate"] == "Bearer"
            assert client.send("GET", "/metrics", None, headers).status == 401
        assert client.send("GET", "/health").status == 200
        known = Client(running.port, TOKEN)
        assert known.send("GET", "/", None, {"Host": "robot.lan"}).status == 200
        assert known.call("where_is", thing="mug")["status"] == "ok"
        for one in (client, known):
            one.close()
    with pytest.raises(ValueError, match="server must have names or a token"):
        Guard(())


def test_a_guard_counts_requests_of_each_address():
    now = [0.0]
    guard = Guard(LOCAL_NAMES, rate=10, time=lambda: now[0])
    headers = {"host": "localhost:8600"}
    for _ in range(20):
        guard.check("a", "/", headers)
    with pytest.raises(Refused, match="requests must be at most 10 a second") as caught:
        guard.check("a", "/", headers)
    assert caught.value.status == 429
    guard.check("b", "/", headers)
    now[0] = 0.5
    for _ in range(5):
        guard.check("a", "/", headers)
    with pytest.raises(Refused):
        guard.check("a", "/", headers)
    for number in range(3000):
        guard.check(str(number), "/", headers)
    assert len(guard._clients) <= 1000


@pytest.mark.parametrize("host", ["localhost", "localhost:1", "127.0.0.1:80", "[::1]:80", "[::1]"])
def test_names_of_this_machine(host):
    Guard().check("a", "/", {"host": host})


@pytest.mark.parametrize("host", ["", "localhost.evil", "127.0.0.1.evil:80", "::1", "localhost, x"])
def test_other_names(host):
    with pytest.raises(Refused, match="Host must be"):
        Guard().check("a", "/", {"host": host})


def test_addresses_of_this_machine():
    assert [is_local(host) for host in ("127.0.0.1", "127.8.1.1", "::1", "localhost")] == [True] * 4
    assert [is_local(host) for host in ("0.0.0.0", "::", "10.0.0.1", "robot")] == [False] * 4


def test_a_call_that_takes_too_long_ends(tmp_path, monkeypatch):
    _home, service = open_service(tmp_path / "home.sgm")
    go_on = threading.Event()
    rank = service.finder.rank

    def wait(*arguments, **named):
        go_on.wait(20)
        return rank(*arguments, **named)

    monkeypatch.setattr(service.finder, "rank", wait)
    with run_server(service, tools=False, timeout=0.05) as running:
        client = Client(running.port)
        answer = client.send("GET", "/v1/where_is?thing=mug")
        assert answer.status == 503
        assert "a call must take at most 0.05 s" in read_error(answer)
        monkeypatch.setattr(caller, "MOST_WAITING", 1)
        answer = client.send("GET", "/v1/where_is?thing=mug")
        assert "calls must be at most 1 at once" in read_error(answer)
        go_on.set()
        client.close()


def test_a_request_that_does_not_arrive_ends(tmp_path, monkeypatch):
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    monkeypatch.setattr(server.BoundedProtocol, "head_seconds", 0.1)
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, tools=False, body_seconds=0.1) as running:
        for content, begin in (
            (b"", b""),  # nothing at all
            (b"POST /v1/observe HTTP/1.1\r\nHost: localhost\r\nX:", b""),  # half a head
            (
                b"POST /v1/observe HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json"
                b"\r\nContent-Length: 100\r\n\r\n{",
                b"HTTP/1.1 408",
            ),
        ):
            with socket.create_connection(("127.0.0.1", running.port), timeout=20) as waiting:
                waiting.sendall(content)
                answer = b""
                while part := waiting.recv(65536):
                    answer += part
                assert answer.startswith(begin)


@pytest.mark.parametrize("path", ["/v1/where_is", "/mcp"])
def test_a_client_that_sends_too_much_reads_why(served, path):
    """The rest of its body is read and dropped, so that no reset overtakes the answer."""
    answer = served.client.send("POST", path, b"x" * 16_000_000, JSON)
    assert answer.status == 413
    assert served.client.send("GET", "/health").status == 200


def send_chunks(connection):
    """Send a body that does not end."""
    while True:
        connection.sendall(b"10000\r\n" + b"x" * 65536 + b"\r\n")


def test_a_body_without_end_is_cut(tmp_path, monkeypatch):
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    monkeypatch.setattr(server.BoundedProtocol, "head_seconds", 0.1)
    _home, service = open_service(tmp_path / "home.sgm")
    with (
        run_server(service, tools=False) as running,
        socket.create_connection(("127.0.0.1", running.port), timeout=20) as sending,
    ):
        sending.sendall(
            b"POST /v1/observe HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
            b"Transfer-Encoding: chunked\r\n\r\n"
        )
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            send_chunks(sending)


def send_requests(connection):
    """Send requests without end."""
    while True:
        connection.sendall(b"GET /openapi.json HTTP/1.1\r\nHost: localhost\r\n\r\n" * 100)


def test_a_client_that_reads_no_answer_is_left(tmp_path, monkeypatch):
    """Else its connection, and what waits to be sent on it, would stay for good."""
    server = pytest.importorskip("sgm.serve.server", reason="uvicorn is not installed")
    monkeypatch.setattr(server.BoundedProtocol, "head_seconds", 0.1)
    _home, service = open_service(tmp_path / "home.sgm")
    with (
        run_server(service, Guard(rate=1e9), tools=False) as running,
        socket.create_connection(("127.0.0.1", running.port), timeout=20) as sending,
    ):
        with pytest.raises((ConnectionResetError, BrokenPipeError)):
            send_requests(sending)


def test_a_full_disk_is_answered_and_nothing_was_changed(served, monkeypatch):
    before = json.dumps(served.service.memory.to_dict())

    def refuse(*_):
        raise sqlite3.OperationalError("database or disk is full")

    with monkeypatch.context() as patch:
        patch.setattr("sgm.store.home_file.insert_event", refuse)
        body = json.dumps({"place": "desk", "seen": []})
        answer = served.client.send("POST", "/v1/observe", body)
    assert answer.status == 507
    assert "disk must take" in read_error(answer)
    assert json.dumps(served.service.memory.to_dict()) == before
    assert served.client.call("observe", place="desk", seen=[])["status"] == "ok"


def read_events(connection, number):
    """So many events of a feed."""
    events, lines = [], {}
    while len(events) < number:
        line = connection.readline().decode().rstrip("\n")
        if line.startswith(":"):
            continue
        if line:
            key, _, value = line.partition(": ")
            lines[key] = value
        elif lines:
            events.append(lines)
            lines = {}
    return events


def test_a_feed_tells_of_every_change(served):
    connection = http.client.HTTPConnection("127.0.0.1", served.port, timeout=20)
    connection.request("GET", "/v1/feed")
    feed = connection.getresponse()
    assert feed.headers["Content-Type"].startswith("text/event-stream")
    assert feed.readline() == b": sgm feed\n"
    served.client.call("observe", place="desk", seen=["keys"])
    served.client.call("where_is", thing="keys")
    served.client.call("observe", place="counter top", seen=[])
    first, second = read_events(feed, 2)
    assert first["event"] == "observe"
    happened = json.loads(first["data"])
    assert happened["said"] == "1 thing seen at desk in study"
    assert ("new", "keys") in [(row["what"], row["thing"]) for row in happened["changes"]]
    assert int(second["id"]) == int(first["id"]) + 1
    assert served.application.feed.num_listeners == 1
    feed.close()
    connection.close()
    for _ in range(1000):  # until the server has noticed
        if not served.application.feed.num_listeners:
            break
        served.client.send("GET", "/health")
    assert served.application.feed.num_listeners == 0


def test_a_feed_ends_with_the_server(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, tools=False) as running:
        connection = http.client.HTTPConnection("127.0.0.1", running.port, timeout=20)
        connection.request("GET", "/v1/feed")
        feed = connection.getresponse()
        feed.readline()
    assert feed.read() == b"\n"
    feed.close()
    connection.close()


def make_bad_request(rng):
    """A request that is malformed somewhere: its head, its JSON, a value, a path."""
    good = {"thing": "mug", "place": "desk", "seen": ["cup"], "coverage": 0.5, "k": 3}
    odd = [
        None,
        True,
        -1,
        10**40,
        10**400,
        1.5,
        "",
        "x" * 5000,
        [],
        {},
        [[]],
        {"a": {}},
        "\ud800",
        "\0",
    ]
    names = ["where_is", "observe", "search_start", "search_next", "list_things", "history", "x"]
    call = str(rng.choice(names))
    values = {key: value for key, value in good.items() if rng.random() < 0.5}
    values[str(rng.choice([*good, "none", "search_id"]))] = odd[int(rng.integers(len(odd)))]
    body = json.dumps(values).encode()
    head = [b"Host: localhost", b"Content-Type: application/json"]
    line = b"POST /v1/%s HTTP/1.1" % call.encode()
    kind = rng.integers(8)
    if kind == 0:
        body = bytes(rng.integers(0, 256, int(rng.integers(1, 200)), dtype=np.uint8))
    elif kind == 1:
        cut = int(rng.integers(len(body)))
        body = body[:cut] + bytes([int(rng.integers(256))]) + body[cut + 1 :] + b"]"
    elif kind == 2:
        head[0] = b"Host: " + bytes(rng.integers(33, 127, 20, dtype=np.uint8))
    elif kind == 3:
        line = bytes(rng.integers(0, 256, 30, dtype=np.uint8)).replace(b"\n", b"") or b"x"
    elif kind == 4:
        line = b"%s /%s HTTP/1.1" % (rng.choice([b"PUT", b"TRACE", b"FOO", b"HEAD"]), call.encode())
    elif kind == 5:
        body = b"[" * int(rng.choice([10, 1000, 100_000]))
    elif kind == 6:
        head.append(b"Origin: http://evil.example")
    head.append(b"Content-Length: %d" % len(body))
    head.append(b"Connection: close")
    return b"\r\n".join([line, *head, b"", body])


def send_raw(port, content):
    """The status and body of the answer to bytes."""
    with socket.create_connection(("127.0.0.1", port), timeout=20) as connection:
        try:
            connection.sendall(content)
            answer = b""
            while part := connection.recv(65536):
                answer += part
        except ConnectionError:  # it was refused before all was sent
            pass
    head, _, body = answer.partition(b"\r\n\r\n")
    return int(head.split()[1]), body


@pytest.mark.parametrize("number", [150, pytest.param(1000, marks=pytest.mark.slow)])
def test_malformed_requests_are_refused_in_one_line_and_nothing_grows(served, capfd, number):
    rng = np.random.default_rng(number)
    before, size = json.dumps(served.service.memory.to_dict()), count_events(served.home)
    num_threads, answered = threading.active_count(), 0
    for _ in range(number):
        status, body = send_raw(served.port, make_bad_request(rng))
        if status == 200:  # what was changed was left out or is allowed: it is a good request
            answered += 1
            continue
        assert 400 <= status < 500, body
        assert b"\n" not in body
        assert b"Traceback" not in body
        assert len(body) < 700
    assert answered < number / 5
    if json.dumps(served.service.memory.to_dict()) == before:
        assert count_events(served.home) == size
    # The client's threads may be ending; a server that grew would have one for each request.
    assert threading.active_count() <= num_threads + 8
    assert len(served.service._searches) <= 100
    assert "Traceback" not in "".join(capfd.readouterr())
    assert served.client.send("GET", "/health").status == 200


def count_events(memory):
    """How many events a file has, also those beside it."""
    return len(memory_event.read_events(memory.path))


def suppressed(doing):
    """Do something whose disk was taken away."""

    def do():
        with suppress(AttributeError):
            doing()

    return do


def test_the_bound_of_a_body_is_that_of_the_tools():
    assert guard.MOST_BYTES == 256 << 10


def test_readers_do_not_wait_for_the_disk(served, monkeypatch):
    """While a snapshot or a sync is on its way to the disk, calls are answered."""
    begun, go_on, path = threading.Event(), threading.Event(), served.home.path

    def wait(*_, **__):
        begun.set()
        go_on.wait(20)
        return 0

    monkeypatch.setattr(home_file, "_LONG_BYTES", 0)
    monkeypatch.setattr("sgm.store.home_file.os.fsync", wait)
    monkeypatch.setattr("sgm.store.home_file.connect", wait)
    monkeypatch.setattr(MemoryContent, "to_snapshot", wait)
    files = served.home.parts.files
    for doing in (files.sync, files.checkpoint, partial(served.home.save, path)):
        saving = threading.Thread(target=suppressed(doing))
        saving.start()
        begun.wait(20)
        assert served.client.call("where_is", thing="mug")["status"] == "ok"
        assert served.client.call("observe", place="desk", seen=[])["status"] == "ok"
        go_on.set()
        saving.join(20)
        begun.clear()
        go_on.clear()
    monkeypatch.undo()


def test_a_write_that_waits_for_the_disk_keeps_nobody_else_waiting(tmp_path, monkeypatch):
    """With `--sync answer`; writes that come meanwhile share the next sync."""
    _home, service = open_service(tmp_path / "home.sgm")
    go_on, num_syncs, num_answered = threading.Event(), [], []
    sync = service.memory.sync

    def wait():
        num_syncs.append(1)
        go_on.wait(20)
        sync()

    monkeypatch.setattr(service.memory, "sync", wait)
    with run_server(service, tools=False, sync="answer") as running:

        def write(number):
            client = Client(running.port)
            client.call("observe", place="desk", seen=[f"cup {number}"])
            num_answered.append(number)
            client.close()

        writing = [threading.Thread(target=write, args=(number,)) for number in range(5)]
        for thread in writing:
            thread.start()
        client = Client(running.port)
        for _ in range(1000):
            if running.caller.num_writes == 5:
                break
            assert client.call("where_is", thing="mug")["status"] == "ok"
        assert running.caller.num_writes == 5
        assert (num_answered, num_syncs) == ([], [1])
        go_on.set()
        for thread in writing:
            thread.join(20)
        client.close()
    assert sorted(num_answered) == list(range(5))
    assert len(num_syncs) <= 3  # the first, that of all who waited, and one for who came between


@pytest.mark.slow
def test_time_is_measured_from_the_first_byte(served):
    begin = time.perf_counter()
    served.client.call("where_is", thing="mug")
    seconds = time.perf_counter() - begin
    (line,) = [
        line
        for line in served.client.send("GET", "/metrics").text.splitlines()
        if line.startswith('sgm_request_seconds_sum{call="where_is"}')
    ]
    assert 0 < float(line.split()[1]) <= seconds


def test_json_of_an_answer_is_compact():
    assert write_json({"a": (0.12345, None)}) == b'{"a":[0.123,null]}'


def test_an_answer_is_one_packet_that_waits_for_no_other(served, monkeypatch):
    """Two would be 40 ms apart where the client acknowledges late (Nagle's algorithm)."""
    from sgm.serve import server

    sent, options = [], []
    send = server.JoinedWrites._send
    made = server.BoundedProtocol.connection_made

    def note(self):
        sent.append(b"".join(self._written))
        send(self)

    def look(self, transport):
        connection = transport.get_extra_info("socket")
        options.append(connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY))
        made(self, transport)

    monkeypatch.setattr(server.JoinedWrites, "_send", note)
    monkeypatch.setattr(server.BoundedProtocol, "connection_made", look)
    client = Client(served.port)
    answer = client.send("GET", "/health")
    client.close()
    assert options == [1]
    (packet,) = filter(None, sent)
    assert packet.startswith(b"HTTP/1.1 200")
    assert packet.endswith(answer.text.encode())


def test_a_write_that_is_sent_again_with_its_key_is_made_once(served):
    client, body = served.client, {"place": "desk", "seen": ["stapler"], "key": "a1"}
    first = client.call("observe", **body)
    assert client.call("observe", **body) == first
    rows = client.call("list_things", kind="stapler")["rows"]
    assert rows[0]["times_seen"] == 1
    text = json.dumps({"place": "desk", "seen": ["ruler"]})
    answers = [
        client.send("POST", "/v1/observe", text, {"Idempotency-Key": "b2"}).text for _ in range(3)
    ]
    assert len(set(answers)) == 1
    assert client.call("list_things", kind="ruler")["rows"][0]["times_seen"] == 1
    refused = client.send("POST", "/v1/add_room", '{"label":"hall","key":"b2"}')
    assert refused.status == 400
    assert "key must be of one write" in refused.text


def test_a_write_that_was_given_up_is_made_once(tmp_path):
    """Its client got a 503, and sends it again while the first one is still being made."""
    _home, service = open_service(tmp_path / "home.sgm")
    observe, may_go_on = service.memory.observe, threading.Event()

    def wait(*args):
        may_go_on.wait(20)
        observe(*args)

    service.memory.observe = wait
    with run_server(service, tools=False, timeout=0.5) as running:
        client = Client(running.port)
        text = json.dumps({"place": "desk", "seen": ["stapler"], "key": "c3"})
        given_up = client.send("POST", "/v1/observe", text)
        assert given_up.status == 503
        assert "send it again with the same key" in given_up.text
        may_go_on.set()
        while (again := client.send("POST", "/v1/observe", text)).status == 503:
            pass
        assert again.status == 200
        assert client.call("list_things", kind="stapler")["rows"][0]["times_seen"] == 1
        client.close()


def test_a_step_of_a_search_that_is_sent_again_is_noted_once(served):
    client = served.client
    begun = client.call("search_start", thing="stapler")
    body = {"search_id": begun["search_id"], "result": "not_found", "look": begun["next"]["look"]}
    first = client.call("search_next", **body)
    assert client.call("search_next", **body) == first
    assert first["looks"] == 1
    assert client.call("search_next", **{**body, "look": 2})["looks"] == 2


def test_a_map_by_calls_has_eyes_and_costs(served):
    client = served.client
    client.call("add_room", name="hall")
    extents = {"center": [4, 4, 0.5], "size": [1, 0.5, 1], "yaw": 0, "interior": "door"}
    noted = client.call("add_place", label="sideboard", room="hall", **extents, open_cost=3)
    assert noted["position"] == [4, 4, 0.5]
    assert served.service.memory.boxes[noted["place"]].has_door
    row = next(row for row in client.call("list_places")["rows"] if row["place"] == noted["place"])
    assert (row["box"]["interior"], row["open_cost"]) == ("door", 3)
    assert client.call("where_is", thing="milk", k=9)["places"][0]["position"] == [1, 4, 0]
    start = row["position"]  # three numbers, as they were told
    begun = client.call("search_start", thing="milk", **{"from": start})
    assert begun["next"]["pose"][:2] == [1, 4]
