"""Machine code that is kept is as old as what it was made of, and nobody waits for it unawares."""

import os
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest

from sgm.layout.box import Box
from simulator.box_world.ray_kernel import Solids
from simulator.compile import compile_all
from simulator.kernel import KERNELS
from simulator.kernel_store import is_kept, list_fields

ROOT = Path(__file__).resolve().parents[2]
TUPLES = """
from typing import NamedTuple
import numpy as np

FACTOR = 10.0

class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray
"""
LOOPS = """
from simulator.kernel import kernel
from simulator.probe_tuples import FACTOR

@kernel
def _subtract(pair):
    return pair.first[0] - pair.second[0]

@kernel
def subtract(pairs):
    return FACTOR * _subtract(pairs[0])
"""
CALL = """
import numpy as np
from simulator import probe_loops, probe_tuples
pair = probe_tuples.Pair(second=np.ones(1), first=np.full(1, 4.0))
print(probe_loops.subtract((pair, pair)))
"""


class Probe:
    """A process with two more modules of the simulator, as files that a test may change."""

    def __init__(self, folder):
        self.folder, self.store = folder, folder / "store"
        self.files = {"probe_tuples": TUPLES, "probe_loops": LOOPS}

    def call(self, before=""):
        """What it printed, and what it said on standard error."""
        for name, text in self.files.items():
            (self.folder / f"{name}.py").write_text(text)
        code = f"import simulator; simulator.__path__.append({str(self.folder)!r})\n{before}{CALL}"
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(self.store)}
        # -B: Python keeps what it compiled by a file's time and size, which a test may leave as
        # they were.
        command = [sys.executable, "-B", "-c", code]
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        return float(done.stdout), done.stderr

    def change(self, name, old, new):
        assert old in self.files[name]
        self.files[name] = self.files[name].replace(old, new)


@pytest.fixture
def probe(tmp_path):
    return Probe(tmp_path)


SAYS = "simulator: inner loops are compiled, a minute or two, once for this version."


@pytest.mark.slow
def test_whoever_waits_for_the_compiler_is_told_once_and_the_next_does_not_wait(probe):
    found, said = probe.call()
    assert found == 30
    assert said.count("\n") == 1
    assert said.startswith(SAYS)
    assert probe.call() == (30, "")


@pytest.mark.slow
def test_fields_of_a_named_tuple_may_change_places(probe):
    """All is built by keyword, so that the answer stays."""
    assert probe.call()[0] == 30
    probe.change("probe_tuples", "first: np.ndarray\n    second", "second: np.ndarray\n    first")
    found, said = probe.call()
    assert found == 30
    assert said.startswith(SAYS)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "old", "new", "expected"),
    [
        ("probe_tuples", "FACTOR = 10.0", "FACTOR = 20.0", 60),
        ("probe_loops", "first[0] - ", "first[0] + ", 50),
    ],
)
def test_what_a_loop_reads_may_change(probe, name, old, new, expected):
    """A number of another file, and the function that it calls, though its file looks as old."""
    probe.call()
    times = {file: file.stat() for file in probe.folder.glob("*.py")}
    probe.change(name, old, new)
    for file, text in probe.files.items():
        (probe.folder / f"{file}.py").write_text(text)
    for file, old_time in times.items():
        os.utime(file, ns=(old_time.st_atime_ns, old_time.st_mtime_ns))
    assert probe.call()[0] == expected


@pytest.mark.slow
def test_what_cannot_be_written_is_read_and_else_there_is_a_warning(probe):
    probe.call()
    read_only = "import simulator.kernel_store as store; store._can_write = lambda folder: False\n"
    assert probe.call(read_only) == (30, "")
    probe.store = probe.folder / "file"
    probe.store.write_text("no folder")
    found, said = probe.call()
    assert found == 30
    assert said.count("UserWarning") == 1
    assert "must be kept in a folder that can be written, got " in said
    assert "Run `python -m simulator.compile` once as its owner, or set NUMBA_CACHE_DIR" in said


def test_fields_of_named_tuples_are_found_within_tuples():
    solids = Solids.of_boxes([Box((2.5, 0.0, 1.0), (1.0, 1.0, 1.0))], owner=0)
    kinds = tuple(numba.typeof(value) for value in (1, (solids, np.ones(2)), (solids, solids)))
    assert list_fields(kinds) == [Solids._fields] * 2


@pytest.mark.slow
def test_all_inner_loops_can_be_compiled_ahead():
    """Every one of them is kept afterwards, and a second time there is nothing to do."""
    compile_all(progress=False)
    # Other tests make loops of their own, some of them in no module.
    modules = [(made.__wrapped__, made.__module__ or "") for made in KERNELS]
    functions = [function for function, module in modules if module.startswith("simulator.")]
    assert len(functions) > 50
    assert [function.__name__ for function in functions if not is_kept(function)] == []
    assert compile_all(progress=False) == 0
