"""Forks a process for each command, after the large packages have been imported once.

`server.py PID LAUNCHER` serves the clients of the socket that is its standard input until process
PID ends. Packages of this repository are not imported here: a command does it from where it runs.
"""

from __future__ import annotations

import array
import atexit
import contextlib
import fcntl
import gc
import importlib
import io
import json
import multiprocessing
import os
import runpy
import select
import signal
import socket
import sys
import tempfile
import time
import types
from collections.abc import Callable

# What a fresh interpreter spends most of its time on.
PACKAGES = (
    "numpy scipy.stats numba torch torchmetrics lightning.pytorch.cli dgl spacy matplotlib.pyplot "
    "rich.progress joblib"
).split()

_AT_EXIT: list[Callable[[], object]] = []  # what a fork does after all others


class Stream(io.FileIO):
    """Standard output or error: a file in one process, a pipe in another."""

    def seekable(self) -> bool:
        """Say no, which a text stream asks once, at its beginning."""
        return False


def main() -> None:
    """Serve until PID ends. Goes on in forks, each of which runs a command and ends."""
    pid, launcher = sys.argv[1:]
    listener = socket.socket(fileno=0)
    watched = os.pidfd_open(int(pid))
    del sys.path[0]  # the folder of this file
    sys.executable = launcher  # what a command starts is forked, too
    for name, number in (("stdout", 1), ("stderr", 2)):
        old = getattr(sys, name)
        stream = io.BufferedWriter(Stream(number, "w", closefd=False))
        new = io.TextIOWrapper(stream, old.encoding, old.errors, line_buffering=number == 2)
        setattr(sys, name, new)
        setattr(sys, f"__{name}__", new)
    atexit.register(lambda: [call() for call in _AT_EXIT])  # the first one is called last
    for name in PACKAGES:
        with contextlib.suppress(ModuleNotFoundError):  # the tests of the core's wheel have few
            importlib.import_module(name)
    multiprocessing.set_executable(launcher)
    gc.collect()
    gc.freeze()  # nothing of this is looked at again in a fork, which would copy it
    while watched not in select.select([listener, watched], [], [])[0]:
        connection, _ = listener.accept()
        if os.fork() == 0:
            listener.close()
            os.close(watched)
            run(serve(connection))
            return
        connection.close()
        reap()


def reap() -> None:
    """Let the forks go that have ended."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def run(command: Callable[[], object]) -> None:
    """Run a command. Its process ends as any other, but does not destroy all modules: seconds."""
    status = 0

    def leave() -> None:
        if not sys.stdout.closed:
            sys.stdout.flush()  # an error of this is reported as ever, and the process goes on
        if status == -signal.SIGINT:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGINT)
        os._exit(status)

    _AT_EXIT.append(leave)
    try:
        command()
    except SystemExit as stop:
        if stop.code is not None:
            status = stop.code & 0xFF if isinstance(stop.code, int) else 1
        raise
    except KeyboardInterrupt:
        status = -signal.SIGINT
        raise
    except BaseException:
        status = 1
        raise


def serve(connection: socket.socket) -> Callable[[], object]:
    """Fork the command of a client and tell the client how it ends; returns in the fork."""
    request, files = receive(connection)
    command = os.fork()
    if command == 0:
        connection.close()
        return prepare(request, files)
    for file in files:
        os.close(file)
    ended = os.pidfd_open(command)
    while ended not in select.select([connection, ended], [], [])[0]:
        sent = connection.recv(1)  # a signal for it, or nothing from a client that was killed
        os.kill(command, sent[0] if sent else signal.SIGKILL)
        if not sent:
            break
    _, status = os.waitpid(command, 0)
    try:
        connection.sendall(os.waitstatus_to_exitcode(status).to_bytes(4, "big", signed=True))
    finally:
        os._exit(0)


def receive(connection: socket.socket) -> tuple[dict, array.array]:
    """Read what a client asks for, and take over its open files."""
    files = array.array("i")
    size, messages, _, _ = connection.recvmsg(8, socket.CMSG_SPACE(250 * files.itemsize))
    for _, _, data in messages:
        files.frombytes(data)
    with connection.makefile("rb") as stream:
        return json.loads(stream.read(int.from_bytes(size, "big"))), files


def prepare(request: dict, files: array.array) -> Callable[[], object]:
    """Become what a fresh interpreter in the place of the client would be; returns its command."""
    moved = [fcntl.fcntl(file, fcntl.F_DUPFD, 512) for file in files]
    for file in files:
        os.close(file)
    for file, number in zip(moved, request["files"], strict=True):
        os.dup2(file, number)
        os.close(file)
    os.chdir(request["folder"])
    os.environ.clear()
    os.environ.update(request["environment"])
    time.tzset()
    tempfile.tempdir = None
    multiprocessing.process.ORIGINAL_DIR = request["folder"]  # what "" means to its processes
    importlib.import_module("numpy").random.seed()  # from the system, as in every new process
    sys.stdout.reconfigure(line_buffering=os.isatty(1))
    kind, *rest = request["arguments"]
    sys.path[:0] = filter(None, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    if kind == "-m":
        sys.path.insert(0, os.getcwd())
        sys.argv = rest
        return lambda: runpy.run_module(rest[0], run_name="__main__", alter_sys=True)
    if kind == "-c":
        sys.path.insert(0, "")
        sys.argv = ["-c", *rest[1:]]
        sys.modules["__main__"] = types.ModuleType("__main__")
        code = compile(rest[0], "<string>", "exec")
        return lambda: exec(code, vars(sys.modules["__main__"]))
    sys.path.insert(0, os.path.dirname(os.path.abspath(kind)))
    sys.argv = [kind, *rest]
    return lambda: runpy.run_path(kind, run_name="__main__")


if __name__ == "__main__":
    main()
