"""Tries what nobody would: `python tests/fuzz --cases 1000 --seed 0`; prints what was found.

Every case is of a kind and a seed: a file of that kind, changed, is loaded and used; a robot calls
a memory in any order; a command gets odd options; or whoever writes is killed, or has no disk. It
runs in a process that may have a gigabyte more than it has at first, and twenty seconds of a
processor: a busy machine is no finding, and what only waits is stopped later. It ends well, or with
one clear line: a ValueError or OSError. All else is a finding, printed with the kind and the seed
that give it again.

This process imports everything and does nothing else; a copy of it (fork) tries up to 250 cases, so
that a case costs what it does and not what importing torch costs. A campaign is shared out or gone
on with by `--seed` and `--kinds`: cases 0 to 999 are those of `--cases 500 --seed 0` and
`--cases 500 --seed 500`.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import resource
import shutil
import signal
import sys
import tempfile
import traceback
from collections import Counter
from multiprocessing.connection import Connection
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

_GIGABYTE = 1 << 30
_SECONDS = 20  # of processor time
_PATIENCE = 1200  # seconds of waiting for a case
_PER_PROCESS = 250
KINDS = ("memory", "trace", "prior", "collection", "exported", "checkpoint", "log",
         "results", "source", "layout", "session", "command", "writing")  # fmt: skip


class Hang(BaseException):
    """A case took too long."""


def run_cases(kind: str, first: int, count: int, root: Path, results: Connection) -> None:
    """Run cases in this process; sends the seed before each, and what came of it.

    Args:
        kind: of the cases.
        first: seed of the first one.
        count: of cases.
        root: an empty folder; `said` in it gets what is printed.
        results: where it goes to, as (seed, outcome, text); the outcome is "" before a case.
    """
    from kinds import TARGETS

    said = os.open(root / "said", os.O_WRONLY | os.O_CREAT | os.O_APPEND)
    os.dup2(said, 1)
    os.dup2(said, 2)
    target = TARGETS[kind]
    good = root / "good"
    good.mkdir()
    target.make(good)
    target.use(shutil.copytree(good, root / "warm"))  # loads and compiles the rest
    used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + _GIGABYTE, used + _GIGABYTE))
    signal.signal(signal.SIGPROF, _stop)
    for seed in range(first, first + count):
        results.send((seed, "", ""))
        folder = shutil.copytree(good, root / f"case{seed}")
        target.change(folder, np.random.default_rng(seed))
        results.send((seed, *_use(target, folder)))
        shutil.rmtree(folder)


def _stop(*_: object) -> None:
    raise Hang


def _use(target: object, folder: Path) -> tuple[str, str]:
    signal.setitimer(signal.ITIMER_PROF, _SECONDS)
    try:
        target.use(folder)
    except (ValueError, OSError) as error:
        if "x" * 201 in str(error) or len(str(error)) > 3000:  # a value, or all of many
            return "long message", str(error)[:500]
        if " must " not in str(error) and not isinstance(error, OSError):
            return "unclear message", traceback.format_exc()[-1500:]
        return "refused", ""
    except Hang:
        return "hang", ""
    except MemoryError:
        return "memory", traceback.format_exc()[-1500:]
    except Exception:
        return "traceback", traceback.format_exc()[-1500:]
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
    return "accepted", ""


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=300, help="of each kind")
    parser.add_argument("--seed", type=int, default=0, help="of the first case")
    parser.add_argument("--kinds", nargs="+", default=KINDS, choices=KINDS)
    options = parser.parse_args()
    import kinds  # noqa: F401  # what all cases need

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
            while receiver.poll(_PATIENCE):
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
        said = (Path(root) / "said").read_text(errors="replace")[-800:]
        how = how or f"ended with {process.exitcode}"
    if seed < first:
        sys.exit(f"fuzz of {kind} must start, {how}: {said}")
    if not outcome:
        counts["process ended"] += 1
        _report(findings, f"{kind} --seed {seed}: process {how}: {said}")
    return seed + 1


def _report(findings: list[str], finding: str) -> None:
    findings.append(finding)
    print(finding, end="\n\n", flush=True)


if __name__ == "__main__":
    main()
