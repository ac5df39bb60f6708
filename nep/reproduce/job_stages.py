"""What a command that trains and plays for hours needs: a lock, stages of jobs, their end.

All jobs of a stage have ended before the next one begins. Unlike `simulator.fan_out`, even one
worker is a process of its own (with one CPU thread, whatever this process has), what a job prints
goes to its log, and workers end when this process is killed.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

from filelock import FileLock, Timeout
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from sgm.files import write_whole

# Held in the folder of runs by the command that works there: a training deletes what it finds of
# itself, which another command may be writing. The system frees it when the command is killed.
LOCK = ".lock"
_LOG_WIDTH = 100


def make_console() -> Console:
    """Return a console, of one width where no terminal shows it."""
    return Console() if sys.stdout.isatty() else Console(width=_LOG_WIDTH)


@contextmanager
def work_in(runs: Path) -> Iterator[None]:
    """Work in a folder of runs alone; whatever ends the work ends the command with one line."""
    try:
        with FileLock(runs / LOCK, timeout=0):
            yield
    except Timeout:
        _stop(
            f"error: runs must be a folder that one command works in at a time, got {runs}, "
            "where another one does. Wait until it has ended, or give another --runs."
        )
    except KeyboardInterrupt:
        _stop("interrupted; the same command goes on from here", status=130)
    except BrokenProcessPool:
        _stop(
            "error: workers must live, got one that was killed. If memory ran out, give fewer "
            "--workers; the same command goes on from here."
        )


def stop_if_failed(failed: Mapping[str, str]) -> None:
    """End the command if jobs have failed; `failed` says how, by name."""
    if failed:
        lines = [f"{name}: {error}" for name, error in failed.items()]
        message = "\n".join(["error: every job must end well, got", *lines])
        _stop(f"{message}\nMend it; the same command goes on from here.")


def write_files(folder: Path, files: Mapping[str, bytes], console: Console) -> None:
    """Write files by name, each whole, and say so."""
    for name, content in files.items():
        write_whole(folder / name, content)
        console.print(f"wrote {folder / name}", highlight=False, markup=False)


def _stop(message: str, status: int = 1) -> NoReturn:
    print(message, file=sys.stderr)
    sys.exit(status)


_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Job:
    """Work for one process.

    Attributes:
        name: for messages.
        run: the work; it must pickle.
        log: file that gets what the work prints.
        after: names of jobs of earlier stages that must have ended well.
    """

    name: str
    run: Callable[[], object]
    log: Path
    after: tuple[str, ...] = ()


def run_stages(stages: Sequence[Sequence[Job]], workers: int, console: Console) -> dict[str, str]:
    """Run the jobs of one stage after the other, several at a time.

    A job that fails does not stop those that do not need it. Where this process ends, for
    whatever reason, its workers end too.

    Args:
        stages: what to run.
        workers: processes, one CPU thread each.
        console: shows how far it is, and one line for each job that has ended.

    Returns:
        what went wrong, by name of the job.

    Raises:
        concurrent.futures.process.BrokenProcessPool: if a worker was killed.
    """
    failed: dict[str, str] = {}
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("jobs"), TimeElapsedColumn())
    with _start_pool(workers) as pool, Progress(*columns, console=console, transient=True) as bars:
        bar = bars.add_task("", total=sum(map(len, stages)))
        for stage in stages:
            able = [job for job in stage if not failed.keys() & job.after]
            futures = {pool.submit(_run_logged, job.run, job.log): job for job in able}
            for job in stage:
                if job not in able:
                    failed[job.name] = "it needs another job, which failed"
            for future in as_completed(futures):
                job, (error, seconds) = futures[future], future.result()
                bars.advance(bar)
                how = f"{seconds:.0f} s" if error is None else "failed"
                bars.console.print(f"{job.name}: {how}", highlight=False, markup=False)
                if error is not None:
                    failed[job.name] = f"{error} (see {job.log})"
    return failed


@contextmanager
def _start_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Start processes that compute with one thread; they are stopped if anything is raised."""
    before, others = dict(os.environ), multiprocessing.active_children()
    # Read by numpy, torch and dgl when a worker imports them.
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    context = multiprocessing.get_context("spawn")
    try:
        with ProcessPoolExecutor(workers, context, _start_worker) as pool:
            try:
                yield pool
            except BaseException:
                for child in multiprocessing.active_children():
                    if child not in others:
                        child.terminate()
                raise
    finally:
        for name in _THREAD_VARIABLES:
            del os.environ[name]
        os.environ.update({name: before[name] for name in _THREAD_VARIABLES if name in before})


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and end when it ends, even if it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _run_logged(run: Callable[[], object], log: Path) -> tuple[str | None, float]:
    """Run in a worker; return what went wrong, None if nothing did, and the seconds it took."""
    start = time.monotonic()
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as file:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.dup2(file.fileno(), stream.fileno())
    wrong = None
    try:
        run()
    except SystemExit as stop:  # a command line that refused something has printed why
        sys.stderr.flush()
        if stop.code:
            lines = log.read_text(encoding="utf-8").split("\n")
            wrong = next((line for line in reversed(lines) if line), "")
    except Exception as error:
        traceback.print_exc()
        wrong = f"{type(error).__name__}: {error}"
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return wrong, time.monotonic() - start
