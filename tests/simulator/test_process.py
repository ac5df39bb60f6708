"""Commands whose output nobody reads to the end, or that may not write what they would."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

COMMANDS = {
    "usage": ["simulator.trace", "--help"],
    "table by rich": ["simulator.priors", "show", "--no_picture"],
    "options": ["nep.evaluate", "--help"],
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "unbuffered"),
    [("usage", ""), ("usage", "1"), ("table by rich", ""), ("options", "")],
)
def test_a_command_ends_in_silence_where_nobody_reads_on(python, command, unbuffered):
    reading, writing = os.pipe()
    os.close(reading)  # before anything is printed, which `| head -1` may be too late for
    interpreter = sys.executable if unbuffered else python
    done = subprocess.run(
        [interpreter, "-m", *COMMANDS[command]],
        stdout=writing,
        stderr=subprocess.PIPE,
        text=True,
        env=os.environ | {"PYTHONUNBUFFERED": unbuffered},
        check=False,
    )
    os.close(writing)
    assert done.stderr == ""
    assert done.returncode in (0, 1)


def test_every_command_is_run_by_it():
    commands = [
        path
        for package in ("simulator", "nep")
        for path in (ROOT / package).rglob("*.py")
        if '__name__ == "__main__"' in path.read_text("utf-8")
    ]
    assert len(commands) > 10
    assert [p for p in commands if "    run_main(" not in p.read_text("utf-8")] == []


def test_another_broken_pipe_is_not_hidden(tmp_path):
    script = tmp_path / "command.py"
    script.write_text(
        "from simulator.process import run_main\n"
        "def main():\n"
        "    raise BrokenPipeError('to a worker')\n"
        "run_main(main)\n"
    )
    done = run(script)
    assert done.returncode == 1
    assert "BrokenPipeError: to a worker" in done.stderr


def test_letters_that_the_encoding_has_not_are_replaced(tmp_path):
    script = tmp_path / "command.py"
    script.write_text(
        "import sys\n"
        "from simulator.process import run_main\n"
        "def main():\n"
        "    print('caf\\u00e9 \\U0001f4a1')\n"
        "    print('\\u5bb6', file=sys.stderr)\n"
        "    return 3\n"
        "run_main(main)\n"
    )
    done = run(script, PYTHONIOENCODING="ascii", PYTHONUTF8="0")
    assert (done.returncode, done.stdout, done.stderr) == (3, "caf? ?\n", "?\n")


@pytest.mark.parametrize(
    ("first", "has_used_it"),
    [
        ("from simulator.caches import keep_home_clean; keep_home_clean()", False),
        ("from simulator.caches import keep_home_clean; keep_home_clean()", True),
        ("import datamodules", False),
        ("import nep", False),
    ],
)
def test_matplotlib_writes_at_home_only_where_it_did_before(tmp_path, first, has_used_it):
    home = tmp_path / "home"
    cache = home / ".cache" / "matplotlib"
    (cache if has_used_it else home).mkdir(parents=True)
    script = tmp_path / "draw.py"
    script.write_text(f"{first}\nimport matplotlib\nprint(matplotlib.get_cachedir())\n")
    done = run(script, HOME=str(home))
    found = done.stdout.strip()
    assert done.stderr == ""
    if has_used_it:
        assert found == str(cache)
    else:
        assert list(home.iterdir()) == []
        assert not os.path.exists(found)  # gone with the process


def run(script, **variables):
    """Run a script with other variables, and without those that say where files are kept."""
    left_out = ("MPLCONFIGDIR", "XDG_CACHE_HOME", "XDG_CONFIG_HOME")
    environment = {name: text for name, text in os.environ.items() if name not in left_out}
    return subprocess.run(
        [sys.executable, str(script)],
        capture_output=True,
        text=True,
        check=False,
        env=environment | {"PYTHONPATH": str(ROOT)} | variables,
    )


AT_WORK = """
import atexit
from threading import Event, Thread

from sgm.network.shipped import find_trained
from simulator.process import run_main

begun = Event()


def work():
    import onnxruntime

    path = str(find_trained("any_home") / "network.onnx")
    while True:
        onnxruntime.InferenceSession(path, providers=["CPUExecutionProvider"])
        begun.set()


def main():
    Thread(target=work, daemon=True).start()
    begun.wait()
    atexit.register(print, "cleared up")
    print("ends")
    return 3


run_main(main, leaves_threads=True)
"""


@pytest.mark.slow
def test_threads_at_work_do_not_abort_a_command_that_ends():
    """Without `leaves_threads`: "terminate called without an active exception", status -6."""
    for _ in range(3):
        done = subprocess.run(
            [sys.executable, "-c", AT_WORK], capture_output=True, text=True, check=False, cwd=ROOT
        )
        assert (done.returncode, done.stdout, done.stderr) == (3, "ends\ncleared up\n", "")
