import gc
import multiprocessing
import os
import shlex
import signal
import socket
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest
from filelock import FileLock
from hypothesis import settings

# The variables that our packages set on import, for tests that import the dependency first.
os.environ.setdefault("DGLBACKEND", "pytorch")
os.environ.setdefault("MPLBACKEND", "Agg")

pytest_plugins = ["tests.homes"]

# A shell that starts the tests in its background ignores Ctrl-C, and commands would inherit that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# The same examples on every run, and no time limit per example: a busy machine is not a failure.
settings.register_profile("repeatable", derandomize=True, deadline=None)
settings.load_profile("repeatable")

# What pytest writes where nobody has said why a test is skipped.
_NO_REASON = ("could not import", "unconditional skip", "condition:")


def _refuse_unnamed_skip(report):
    """Let a skip without a reason of its own fail: who reads the summary must know what to do."""
    if report.skipped and not hasattr(report, "wasxfail"):
        reason = str(report.longrepr[2]).removeprefix("Skipped: ").strip()
        if reason in ("", "Skipped") or reason.startswith(_NO_REASON):
            report.outcome = "failed"
            report.longrepr = (
                f"a skip must have a named reason, got {reason!r}. Say what is missing, and how to "
                "get it: reason='spark_dsg is not installed: extra spark'."
            )
    return report


def pytest_runtest_setup(item):
    """Skip what is marked `dgl` where there is none."""
    if item.get_closest_marker("dgl") and find_spec("dgl") is None:
        pytest.skip("dgl is not installed: it has no wheels beyond Python 3.11")


@pytest.hookimpl(wrapper=True)
def pytest_collection():
    """Let the garbage collector wait while imports make what stays: a fifth of their time."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.enable()


def pytest_collection_finish():
    """Let it leave alone what they made: torch alone is a million objects."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def python(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Path of an interpreter that has torch and the like at hand, for commands of the tests.

    Each command is forked from one process that has imported them; all else is as in a fresh
    interpreter. What processes of the tests start by multiprocessing is forked, too. A command
    whose imports are looked at, or what they read in the environment, takes `sys.executable`.
    """
    if not hasattr(os, "pidfd_open"):  # not on Linux
        return sys.executable
    folder, session = tmp_path_factory.getbasetemp(), os.getpid()
    if "PYTEST_XDIST_WORKER" in os.environ:  # one for all of its workers
        folder, session = folder.parent, os.getppid()
    launcher = folder / "python"
    with FileLock(folder / "python.lock"):
        if not launcher.exists():
            _start_server(folder, session)
    multiprocessing.set_executable(str(launcher))
    return str(launcher)


def _start_server(folder: Path, session: int) -> None:
    code = Path(__file__).parent / "warm_python"
    launcher = folder / "python"
    with socket.socket(socket.AF_UNIX) as listener, (folder / "python.log").open("w") as log:
        listener.bind(str(folder / "python.socket"))
        listener.listen(64)  # who connects waits until the server has imported the packages
        command = [sys.executable, str(code / "server.py"), str(session), str(launcher)]
        files = ((listener, 0), (log, 1), (log, 2))
        os.posix_spawn(
            command[0],
            command,
            os.environ | {"OMP_NUM_THREADS": "1"},
            setsid=True,
            file_actions=[(os.POSIX_SPAWN_DUP2, file.fileno(), number) for file, number in files],
        )
    words = (sys.executable, "-IS", code / "client.py", folder / "python.socket", sys.executable)
    launcher.write_text(f'#!/bin/sh\nexec {shlex.join(map(str, words))} "$@"\n')
    launcher.chmod(0o755)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item, call):
    return _refuse_unnamed_skip((yield))


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report(collector):
    return _refuse_unnamed_skip((yield))
