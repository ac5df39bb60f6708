"""A share of `make fuzz`: some cases of every kind, each ending well or with one line."""

import hashlib
import importlib.util
import os
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

FUZZ = Path(__file__).parent
CASES = 2  # of each kind; `.ci/run` tries twelve


def load_fuzz():
    """The command as a module."""
    spec = importlib.util.spec_from_file_location("fuzz", FUZZ / "__main__.py")
    fuzz = importlib.util.module_from_spec(spec)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", list(sys.path))
        spec.loader.exec_module(fuzz)
    return fuzz


@pytest.mark.slow
def test_nothing_is_found(python):
    command = [python, str(FUZZ), "--cases", str(CASES)]
    done = subprocess.run(
        command, capture_output=True, text=True, timeout=1200, cwd=FUZZ.parents[1], check=False
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"{len(load_fuzz().KINDS) * CASES} cases tried, 0 findings" in done.stdout


@pytest.mark.slow
def test_every_argument_of_the_server_has_a_good_value():
    from sgm.serve.calls import CALLS

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "path", [str(FUZZ), *sys.path])
        good = importlib.import_module("serve_requests").GOOD
    arguments = {one.name: one for call in CALLS for one in call.arguments}
    assert set(good) == set(arguments)
    for name, argument in arguments.items():
        argument.rule.read(name, good[name])


def _spin(_):
    while True:
        pass


def _wait(folder):
    os.mkfifo(folder / "fifo")
    (folder / "fifo").read_bytes()


def _wait_outside_python(folder):
    signal.pthread_sigmask(signal.SIG_BLOCK, signal.valid_signals())
    _wait(folder)


def _count_outside_python(_):
    hashlib.pbkdf2_hmac("sha256", b"x", b"x", 10**9)


def _hide(_):
    try:
        bytearray(4 << 30)
    except MemoryError:
        raise ValueError("x must be y, got z. Pass y.") from None


def _refuse(_):
    raise ValueError("x must be y, got z. Pass y.")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("use", "outcome"),
    [
        (lambda _: None, "accepted"),
        (_refuse, "refused"),
        (lambda _: {}["x"], "traceback"),
        (lambda _: np.ones(1 << 28), "memory"),  # 2 GB
        (_hide, "memory"),
        (_spin, "hang"),
        (_wait, "hang"),
        pytest.param(_wait_outside_python, "process ended", marks=pytest.mark.slow),
        pytest.param(_count_outside_python, "process ended", marks=pytest.mark.slow),
        (lambda _: os.kill(os.getpid(), signal.SIGKILL), "process ended"),
    ],
)
def test_a_fault_is_found(use, outcome, monkeypatch):
    fuzz = load_fuzz()
    monkeypatch.setattr(fuzz, "_SECONDS", 0.1)
    monkeypatch.setattr(fuzz, "_IDLE_SECONDS", 0.3)
    monkeypatch.setattr(fuzz, "_PATIENCE", 1)
    target = SimpleNamespace(  # only cases have the file "case"
        make=lambda folder: None,
        change=lambda folder, rng: (folder / "case").touch(),
        use=lambda folder: use(folder) if (folder / "case").exists() else None,
    )
    monkeypatch.setitem(sys.modules, "registry", SimpleNamespace(TARGETS={"odd": target}))
    counts, findings = Counter(), []
    seed, last = 7, 9
    while seed < last:
        seed = fuzz._run_batch("odd", seed, last - seed, counts, findings)
    assert counts == {outcome: 2}
    assert len(findings) == (0 if outcome in ("accepted", "refused") else 2)
    assert all(f"odd --seed {7 + i}: " in finding for i, finding in enumerate(findings))


def test_who_waits_for_a_busy_machine_does_not_hang(tmp_path, monkeypatch):
    """It writes from time to time, or waits for a processor."""
    fuzz = load_fuzz()
    seconds = [7.0]
    monkeypatch.setattr(fuzz.signal, "signal", lambda *_: None)
    monkeypatch.setattr(fuzz, "_count_active", lambda _: seconds[0])
    watch = fuzz.Watch()
    watch._stop_waiting()
    for _ in range(3):
        (tmp_path / "saved").write_text("x")
        watch._stop_waiting()
    for _ in range(3):
        seconds[0] += 1
        watch._stop_waiting()
    with pytest.raises(fuzz.Hang):
        watch._stop_waiting()


def test_seconds_count_that_other_threads_use():
    fuzz = load_fuzz()
    before, used = fuzz._count_active("self"), time.process_time()
    thread = threading.Thread(target=lambda: sum(range(3_000_000)))
    thread.start()
    thread.join()
    used = time.process_time() - used
    assert fuzz._count_active("self") - before > 0.5 * used - 0.03
