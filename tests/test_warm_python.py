"""The interpreter of the fixture `python` does what a fresh one does, and has torch at hand."""

import os
import signal
import subprocess
import sys
import time

import pytest

pytestmark = pytest.mark.slow

SHOW = (
    "import json, os, sys; print(json.dumps([sys.argv, os.getcwd(), os.environ.get('ANSWER'), "
    "__name__, sys.stdin.read(), sys.path[:2], sys.stdout.encoding]), flush=True); "
    "sys.stdout.reconfigure(errors='replace'); print('caf\u00e9', file=sys.stderr)"
)


@pytest.fixture(params=["fresh", "forked"])
def interpreter(request, python):
    return sys.executable if request.param == "fresh" else python


def run(*command, **options):
    return subprocess.run(command, capture_output=True, text=True, check=False, **options)


@pytest.mark.parametrize("kind", ["code", "module", "script"])
def test_it_answers_as_a_fresh_one(python, tmp_path, kind):
    (tmp_path / "show.py").write_text(SHOW)
    start = {"code": ["-c", SHOW], "module": ["-m", "show"], "script": ["show.py"]}[kind]
    environment = os.environ | {"ANSWER": "4\u00b2", "PYTHONPATH": str(tmp_path / "more")}
    said = [
        run(which, *start, "--option", "a b", cwd=tmp_path, env=environment, input="typed")
        for which in (sys.executable, python)
    ]
    assert said[0].stdout == said[1].stdout != ""
    assert said[0].stderr == said[1].stderr == "caf\u00e9\n"


def test_large_packages_are_there_and_ours_are_not(python):
    code = "import sys; print([n in sys.modules for n in ('torch', 'simulator', 'nep')])"
    assert run(python, "-c", code).stdout == "[True, False, False]\n"


@pytest.mark.parametrize(
    ("code", "status", "said"),
    [
        ("import sys; sys.exit(3)", 3, ""),
        ("raise SystemExit('no')", 1, "no\n"),
        ("1 / 0", 1, "ZeroDivisionError: division by zero\n"),
        ("import os; os.kill(os.getpid(), 9)", -signal.SIGKILL, ""),
        ("import atexit, sys; atexit.register(print, 'last', file=sys.stderr)", 0, "last\n"),
    ],
)
def test_it_ends_as_a_fresh_one(interpreter, code, status, said):
    done = run(interpreter, "-c", code)
    assert done.returncode == status
    assert done.stderr.endswith(said)
    assert bool(done.stderr) == bool(said)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_signals_arrive(interpreter, number):
    code = "import os, time\nprint(os.getpid(), flush=True)\ntime.sleep(100)"
    with subprocess.Popen([interpreter, "-c", code], stdout=-1, stderr=-1, text=True) as process:
        child = int(process.stdout.readline())
        process.send_signal(number)
        assert process.wait(10) == -number
    for _ in range(100):
        if not os.path.exists(f"/proc/{child}"):
            return
        time.sleep(0.05)
    raise AssertionError("it goes on")


def test_what_it_starts_is_forked_too(python):
    """By multiprocessing, joblib, or the path that it knows of itself."""
    code = (
        "import joblib, multiprocessing, subprocess, sys\n"
        'look = \'"torch" in __import__("sys").modules\'\n'
        "with multiprocessing.get_context('spawn').Pool(1) as pool:\n"
        "    print(pool.apply(eval, [look]))\n"
        "print(joblib.Parallel(2)(joblib.delayed(eval)(text) for text in [look] * 3))\n"
        "print(subprocess.check_output([sys.executable, '-c', f'print({look})'], text=True))\n"
    )
    done = run(python, "-c", code)
    assert done.stdout.split() == ["True", "[True,", "True,", "True]", "True"]
    assert done.stderr == ""
