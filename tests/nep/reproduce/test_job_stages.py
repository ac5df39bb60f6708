"""Stages of jobs in worker processes: order, failure, logs."""

import json
import os
from functools import partial

from rich.console import Console

from nep.reproduce.job_stages import Job, run_stages
from sgm.files import write_whole

CONSOLE = Console(quiet=True)


def test_order_logs_and_failures(tmp_path):
    """Pickled work must be importable in a worker: functions of the library stand in for it."""
    file = tmp_path / "made.json"
    first = [
        Job("make", partial(write_whole, file, b"[]"), tmp_path / "make.log"),
        Job("say", partial(print, "hello"), tmp_path / "logs" / "say.log"),
        Job("bad", partial(json.loads, "{"), tmp_path / "bad.log"),
        Job("refuse", partial(exec, "raise SystemExit(2)"), tmp_path / "refuse.log"),
        Job("end", partial(exec, "raise SystemExit(0)"), tmp_path / "end.log"),
    ]
    second = [
        Job("read", partial(os.stat, file), tmp_path / "read.log", after=("make",)),
        Job("later", partial(print), tmp_path / "later.log", after=("bad",)),
    ]
    third = [Job("last", partial(print), tmp_path / "last.log", after=("later", "say"))]
    failed = run_stages([first, second, third], 2, CONSOLE)
    assert failed.keys() == {"bad", "refuse", "later", "last"}
    assert failed["bad"].startswith("JSONDecodeError: Expecting property name")
    assert str(tmp_path / "bad.log") in failed["bad"]
    assert "Traceback" in (tmp_path / "bad.log").read_text()
    assert failed["later"] == failed["last"] == "it needs another job, which failed"
    assert (tmp_path / "logs" / "say.log").read_text() == "hello\n"
    assert not (tmp_path / "later.log").exists()


def test_workers_have_one_thread_and_the_caller_keeps_its_own(tmp_path, monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    log = tmp_path / "env.log"
    jobs = [Job("env", partial(os.system, "echo $OMP_NUM_THREADS"), log)]
    run_stages([jobs], 1, CONSOLE)
    assert log.read_text() == "1\n"
    assert os.environ["OMP_NUM_THREADS"] == "7"
