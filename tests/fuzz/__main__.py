"""Tries what nobody would: `python tests/fuzz --cases 1000 --seed 0`; prints what was found.

Every case is of a kind and a seed: a file of that kind, changed, is loaded and used; a robot calls
a memory in any order; a command gets odd options; or whoever writes is killed, or has no disk. It
runs in a process that may have a gigabyte more than it has at first, and twenty seconds of a
processor: a busy machine is no finding, and what only waits is stopped later. It ends well, or with
one clear line: a ValueError or OSError. All else is a finding, printed with the kind and the seed
that give it again.
"""

from __future__ import annotations

import argparse
import json
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import traceback
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

_GIGABYTE = 1 << 30
_SECONDS = 20  # of processor time
_PER_PROCESS = 50
KINDS = ("memory", "trace", "prior", "collection", "exported", "checkpoint", "layout",
         "session", "command", "writing")  # fmt: skip


class Hang(BaseException):
    """A case took too long."""


def run_cases(kind: str, first: int, count: int) -> None:
    """Run cases in this process; prints a line of JSON before and after each."""
    from kinds import TARGETS

    target = TARGETS[kind]
    with tempfile.TemporaryDirectory() as root:
        good = Path(root) / "good"
        good.mkdir()
        target.make(good)
        target.use(shutil.copytree(good, Path(root) / "warm"))  # imports, compiles
        used = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (used + _GIGABYTE, used + _GIGABYTE))
        signal.signal(signal.SIGPROF, _stop)
        for seed in range(first, first + count):
            print(json.dumps({"seed": seed}), flush=True)
            folder = shutil.copytree(good, Path(root) / f"case{seed}")
            target.change(folder, np.random.default_rng(seed))
            outcome, text = _use(target, folder)
            print(json.dumps({"seed": seed, "outcome": outcome, "text": text}), flush=True)
            shutil.rmtree(folder)


def _stop(*_: object) -> None:
    raise Hang


def _use(target: object, folder: Path) -> tuple[str, str]:
    signal.setitimer(signal.ITIMER_PROF, _SECONDS)
    try:
        target.use(folder)
    except (ValueError, OSError) as error:
        if len(str(error)) > 3000:
            return "long message", str(error)[:500]
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
    parser.add_argument("--worker", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.worker:
        kind, first, count = options.worker
        run_cases(kind, int(first), int(count))
        return
    findings: list[str] = []
    for kind in options.kinds:
        counts: Counter[str] = Counter()
        seed, last = options.seed, options.seed + options.cases
        while seed < last:
            count = min(_PER_PROCESS, last - seed)
            seed = _run_worker(kind, seed, count, counts, findings)
        print(f"{kind:11}" + ", ".join(f"{n} {what}" for what, n in sorted(counts.items())))
    print(f"{options.cases * len(options.kinds)} cases tried, {len(findings)} findings")
    print(*findings, sep="\n\n")
    sys.exit(1 if findings else 0)


def _run_worker(
    kind: str, first: int, count: int, counts: Counter[str], findings: list[str]
) -> int:
    """Run cases in a process of their own; returns the seed to go on with."""
    command = [sys.executable, __file__, "--worker", kind, str(first), str(count)]
    try:
        done = subprocess.run(
            command, capture_output=True, text=True, timeout=1200 + 30 * count, check=False
        )
        out, how = done.stdout, f"ended with {done.returncode}: {done.stderr[-800:]}"
    except subprocess.TimeoutExpired as error:
        out, how = (error.stdout or b"").decode(), "hang"
    begun = first - 1
    for line in out.splitlines():
        row = json.loads(line)
        begun = row["seed"]
        if "outcome" not in row:
            continue
        counts[row["outcome"]] += 1
        if row["outcome"] not in ("accepted", "refused"):
            findings.append(f"{kind} --seed {row['seed']}: {row['outcome']}\n{row['text']}")
    if begun < first:
        sys.exit(f"fuzz of {kind} must start, {how}")
    if '"outcome"' not in out.splitlines()[-1]:
        counts["process ended"] += 1
        findings.append(f"{kind} --seed {begun}: process {how}")
    return begun + 1


if __name__ == "__main__":
    main()
