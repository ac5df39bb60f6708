"""Idle connections: as many as the process may have, and the longest idle go first."""

import http.client
import os
import socket
import subprocess
import sys
import time

import pytest

from sgm.serve import connections
from sgm.serve.connections import count_connections

from .conftest import Client, open_service, run_server

resource = pytest.importorskip("resource", reason="Windows has no limit of files")
pytest.importorskip("uvicorn", reason="uvicorn is not installed")
HEALTH = b"GET /health HTTP/1.1\r\nHost: localhost\r\n\r\n"


def connect(port):
    return socket.create_connection(("127.0.0.1", port), timeout=20)


def is_closed(connection):
    """Whether the server has closed it."""
    connection.settimeout(20)
    try:
        return connection.recv(1) == b""
    except ConnectionResetError:
        return True


def test_the_longest_idle_make_room_and_one_line_says_so(tmp_path, capfd):
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, tools=False, most_connections=5) as running:
        client = Client(running.port)
        assert client.send("GET", "/health").status == 200
        idle = [connect(running.port) for _ in range(30)]
        assert all(is_closed(one) for one in idle[:25])
        with pytest.raises((OSError, http.client.HTTPException)):  # it was idle for longest
            client.send("GET", "/health")
        for _ in range(3):  # who asks is answered
            assert client.send("GET", "/health").status == 200
        client.close()
        idle[-1].sendall(HEALTH)  # the last one that came is still there
        assert idle[-1].recv(12) == b"HTTP/1.1 200"
        for one in idle:
            one.close()
    lines = capfd.readouterr().err.splitlines()
    assert len(lines) == 1
    assert lines[0].startswith("warning: 5 connections are open, and no more may be")


def test_one_that_is_answered_is_not_closed(tmp_path):
    _home, service = open_service(tmp_path / "home.sgm")
    with run_server(service, tools=False, most_connections=4) as running:
        listening = [connect(running.port) for _ in range(3)]
        for one in listening:
            one.sendall(b"GET /v1/feed HTTP/1.1\r\nHost: localhost\r\n\r\n")
            assert one.recv(12) == b"HTTP/1.1 200"
        idle = [connect(running.port) for _ in range(10)]
        assert all(is_closed(one) for one in idle[:-1])
        service.observe("desk", [])
        for one in listening:
            text = b""
            while b"event: observe" not in text:
                text += one.recv(65536)
        idle[-1].sendall(b"GET /v1/feed HTTP/1.1\r\nHost: localhost\r\n\r\n")
        assert idle[-1].recv(12) == b"HTTP/1.1 200"
        with connect(running.port) as late:  # all are at work
            assert late.recv(12) == b"HTTP/1.1 503"
        for one in (*listening, *idle):
            one.close()


@pytest.mark.parametrize(("limit", "most"), [(1 << 20, 500), (200, 200), (60, 60)])
def test_the_bound_follows_the_limit_of_the_process(monkeypatch, limit, most):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (limit, limit))
    monkeypatch.setattr(os, "listdir", lambda _: ["0"] * 12)
    assert count_connections() == min(most, limit - 12 - connections._OTHER_FILES)


def test_a_limit_without_room_is_told(monkeypatch):
    monkeypatch.setattr(resource, "getrlimit", lambda _: (32, 32))
    with pytest.raises(OSError, match=r"must be allowed to open \d+ files, got 32. Raise it: ul"):
        count_connections()
    monkeypatch.setattr(resource, "getrlimit", lambda _: (resource.RLIM_INFINITY,) * 2)
    assert count_connections() == connections.MOST_CONNECTIONS


@pytest.mark.slow
@pytest.mark.parametrize(("limit", "number"), [(64, 120), (1024, 900)])
def test_more_idle_connections_than_files(tmp_path, limit, number):
    """The command under `ulimit -n`: others are answered at once, and standard error is short."""
    script = f"ulimit -n {limit}; exec {sys.executable} -m sgm.serve home.sgm --new --port 0 "
    with (
        (tmp_path / "said").open("wb") as said,
        subprocess.Popen(
            ["bash", "-c", script + "--finder bayesian"],
            stdout=subprocess.PIPE,
            stderr=said,
            text=True,
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        ) as process,
    ):
        port = int(process.stdout.readline().rstrip("/\n").rpartition(":")[2])
        idle = []
        try:
            for _ in range(number):
                idle.append(connect(port))
            begin = time.monotonic()
            client = Client(port)
            for row in range(5):
                assert client.send("GET", "/health").status == 200
                client.close() if row % 2 else None
            client.call("add_room", label="kitchen")
            client.close()
            assert time.monotonic() - begin < 10, "a client with a time-out would have left"
            assert process.poll() is None
        finally:
            process.terminate()
            process.wait(30)
            for one in idle:
                one.close()
    lines = (tmp_path / "said").read_text().splitlines()
    assert 1 <= len(lines) <= 2, lines[:10]
    assert all(line.startswith("warning: ") and "connections" in line for line in lines)
