"""Tries what nobody would: `python tests/fuzz --cases 1000 --seed 0`; prints what was found.

Every case is of a kind and a seed: a file of that kind, changed, is loaded and used; a robot calls
a memory in any order, or several threads do; a command gets odd options; whoever writes is killed,
or has no disk; a browser sends what the page never offered; a FIFO, a device or a folder is where a
file is meant; a file is linked and moved while it is in use; connections stay idle; or names are
nearly those of things. It ends
well, or with one clear line: a ValueError or OSError. All else is a finding, printed with the kind
and the seed that give it again.

The operating system limits each case. It may take a gigabyte more than the process has before it:
the largest good case takes a third of that. Counted is memory that can be written and is shared
with nobody (`RLIMIT_DATA`), whether it is used or not; torch and numba map gigabytes of code, and a
thread reserves 64 MB of addresses, which cost nothing. Addresses have a wider limit (`RLIMIT_AS`),
for what is mapped and shared. A case has twenty seconds of a processor, which a signal of Python
ends, and after sixty the system does; one that waits for twenty seconds, neither using a processor
nor waiting for one nor writing anything, is ended, too. A busy machine or disk is no finding: a
session saves its memory often, and a busy disk takes a second each time.

This process imports everything and does nothing else; a copy of it (fork) tries up to 250 cases, so
that a case costs what it does and not what importing torch costs. A campaign is shared out or gone
on with by `--seed` and `--kinds`: cases 0 to 999 are those of `--cases 500 --seed 0` and
`--cases 500 --seed 500`.
"""

from __future__ import annotations

import argparse
import errno
import gc
import math
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import time
import traceback
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

_GIGABYTE = 1 << 30
_SECONDS = 20  # of processor time; the system ends what takes three times that
_IDLE_SECONDS = 20  # of waiting, neither for a processor nor writing
_PATIENCE = 60  # seconds; a process that has done neither in them is ended
_PER_PROCESS = 250
KINDS = (
    "memory trace prior collection exported checkpoint log results source layout command "
    "writing tensor pickle homer yaml page serve threads special links start idle import "
    "names machine"
).split()


class Hang(BaseException):
    """A case took too long."""


class Watch:
    """Limits one case after the other: memory, processor time, waiting."""

    def __init__(self) -> None:
        """Have signals end what takes too long."""
        self._before = 0.0
        self._written_before = 0
        signal.signal(signal.SIGPROF, self._stop)
        signal.signal(signal.SIGALRM, self._stop_waiting)

    def begin(self) -> None:
        """Begin a case."""
        pages = Path("/proc/self/statm").read_text().split()
        mapped, private = (int(pages[row]) * resource.getpagesize() for row in (0, 5))
        _limit(resource.RLIMIT_DATA, private + _GIGABYTE)
        _limit(resource.RLIMIT_AS, mapped + 4 * _GIGABYTE)
        _limit(resource.RLIMIT_CPU, math.ceil(time.process_time() + 3 * _SECONDS) + 1)
        self._before, self._written_before = _count_active("self"), _count_written("self")
        signal.setitimer(signal.ITIMER_PROF, _SECONDS)
        signal.setitimer(signal.ITIMER_REAL, _IDLE_SECONDS, _IDLE_SECONDS)

    def end(self) -> None:
        """End it."""
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_REAL, 0)

    def _stop(self, *_: object) -> None:
        raise Hang

    def _stop_waiting(self, *_: object) -> None:
        before, written_before = self._before, self._written_before
        self._before, self._written_before = _count_active("self"), _count_written("self")
        is_idle = self._before - before < 0.01 * _IDLE_SECONDS
        if is_idle and self._written_before == written_before:
            raise Hang


def _limit(what: int, most: int) -> None:
    _, hard = resource.getrlimit(what)
    resource.setrlimit(what, (most, hard))


def _count_active(process: int | str) -> float:
    """Return the seconds that the first thread of a process has used or waited for a processor.

    And those that the others have used.
    """
    ran, waited, _ = map(int, Path(f"/proc/{process}/schedstat").read_text().split())
    fields = _read_stat(process)  # user and system time in hundredths of a second
    return waited / 1e9 + max(ran / 1e9, (int(fields[11]) + int(fields[12])) / 100)


def _read_stat(process: int | str) -> list[str]:
    """Return the state of a process, and all that Linux lists after it."""
    return Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()


def _count_written(process: int | str) -> int:
    """Return the bytes that a process has written so far."""
    lines = Path(f"/proc/{process}/io").read_text().splitlines()
    return int(next(line for line in lines if line.startswith("wchar")).split()[1])


def run_cases(kind: str, first: int, count: int, root: Path, results: Connection) -> None:
    """Run cases in this process; sends the seed before each, and what came of it.

    Args:
        kind: of the cases.
        first: seed of the first one.
        count: of cases.
        root: an empty folder; `said` in it gets what is printed.
        results: where it goes to, as (seed, outcome, text); the outcome is "" before a case.
    """
    from registry import TARGETS

    said = os.open(root / "said", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(said, 1)
    os.dup2(said, 2)
    target = TARGETS[kind]
    good = root / "good"
    good.mkdir()
    target.make(good)
    target.use(shutil.copytree(good, root / "warm"))  # loads and compiles the rest
    gc.freeze()  # what was imported is no garbage, and not to be walked through
    watch = Watch()
    for seed in range(first, first + count):
        results.send((seed, "", ""))
        folder = shutil.copytree(good, root / f"case{seed}")
        target.change(folder, np.random.default_rng(seed))
        results.send((seed, *_use(target, folder, watch)))
        shutil.rmtree(folder)


def _use(target: object, folder: Path, watch: Watch) -> tuple[str, str]:
    try:
        watch.begin()
        target.use(folder)
    except (ValueError, OSError) as error:
        if _is_out_of_memory(error):  # and said to be something else
            return "memory", traceback.format_exc()[-3000:]
        if "x" * 201 in str(error) or len(str(error)) > 3000:  # a value, or all of many
            return "long message", str(error)[:500]
        if " must " not in str(error) and not isinstance(error, OSError):
            return "unclear message", traceback.format_exc()[-3000:]
        return "refused", ""
    except Hang:
        return "hang", traceback.format_exc()[-3500:]
    except Exception as error:
        what = "memory" if _is_out_of_memory(error) else "traceback"
        return what, traceback.format_exc()[-3000:]
    finally:
        watch.end()
    return "accepted", ""


def _is_out_of_memory(error: BaseException | None) -> bool:
    """Tell whether the system refused memory, in an exception or in what it was raised for."""
    while error is not None:
        is_full = isinstance(error, OSError) and error.errno == errno.ENOMEM
        if is_full or isinstance(error, MemoryError) or "allocate memory" in str(error):
            return True
        error = error.__cause__ or error.__context__
    return False


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=300, help="of each kind")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    options = parser.parse_args()
    import registry  # noqa: F401  # what all cases need

    findings: list[str] = []
    for kind in options.kinds:
        counts: Counter[str] = Counter()
        before, seed, last = _count_seconds(), options.seed, options.seed + options.cases
        while seed < last:
            seed = _run_batch(kind, seed, min(_PER_PROCESS, last - seed), counts, findings)
        outcomes = ", ".join(f"{n} {what}" for what, n in sorted(counts.items()))
        print(f"{kind:11}{outcomes}; {_count_seconds() - before:.0f} s of a processor", flush=True)
    print(f"{options.cases * len(options.kinds)} cases tried, {len(findings)} findings")
    sys.exit(1 if findings else 0)


def _count_seconds() -> float:
    """Return the processor time of the processes that have ended."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def _run_batch(kind: str, first: int, count: int, counts: Counter[str], findings: list[str]) -> int:
    """Run cases in a copy of this process; returns the seed to go on with."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as root:
        process = context.Process(target=run_cases, args=(kind, first, count, Path(root), sender))
        process.start()
        sender.close()
        seed, outcome, how = first - 1, "begun", ""
        try:
            assert process.pid is not None
            while _wait(receiver, process.pid):
                seed, outcome, text = receiver.recv()
                if outcome:
                    counts[outcome] += 1
                if outcome not in ("", "accepted", "refused"):
                    _report(findings, f"{kind} --seed {seed}: {outcome}\n{text}")
            how = "waits"
            process.kill()
        except EOFError:
            pass
        process.join()
        said = (Path(root) / "said").read_text(errors="replace")[-3500:]
        how = how or f"ended with {process.exitcode}"
    if seed < first:
        sys.exit(f"fuzz of {kind} must start, {how}: {said}")
    if not outcome:
        counts["process ended"] += 1
        _report(findings, f"{kind} --seed {seed}: process {how}: {said}")
    return seed + 1


def _wait(receiver: Connection, process: int) -> bool:
    """Wait for a result as long as the process works or writes; tell whether there is one."""
    before, written_before = -math.inf, -1
    while not receiver.poll(_PATIENCE):
        active, written = _count_active(process), _count_written(process)
        is_waiting = _read_stat(process)[0] not in "RD"  # for no processor, and for no disk
        if is_waiting and active - before < 0.01 * _PATIENCE and written == written_before:
            return False
        before, written_before = active, written
    return True


def _report(findings: list[str], finding: str) -> None:
    findings.append(finding)
    print(finding, end="\n\n", flush=True)


if __name__ == "__main__":
    main()
