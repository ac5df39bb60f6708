"""Runs jobs in worker processes, each with a log of its own and after those that it needs."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeElapsedColumn,
)

_THREAD_VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


@dataclass(frozen=True, slots=True)
class Job:
    """Work for one process.

    Attributes:
        name: for progress and messages.
        run: the work; it must pickle.
        log: file that gets what the work prints.
        after: names of the jobs that must have ended well before.
    """

    name: str
    run: Callable[[], object]
    log: Path
    after: tuple[str, ...] = ()


def run_jobs(jobs: Sequence[Job], workers: int, console: Console) -> dict[str, str]:
    """Run jobs in order of the list, as far as what they need has ended.

    A job that fails does not stop those that do not need it. Where this process ends, for
    whatever reason, its workers end too.

    Args:
        jobs: what to run.
        workers: processes, one CPU thread each.
        console: shows what runs, and one line for each job that has ended.

    Returns:
        what went wrong, by name of the job.

    Raises:
        concurrent.futures.process.BrokenProcessPool: if a worker was killed.
    """
    failed: dict[str, str] = {}
    done: set[str] = set()
    waiting = list(jobs)
    running: dict[Future[str | None], _Running] = {}
    columns = (
        TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    )  # fmt: skip
    with _start_pool(workers) as pool, Progress(*columns, console=console, transient=True) as bars:
        overall = bars.add_task("all jobs", total=len(jobs))
        while waiting or running:
            for job in list(waiting):
                if failed.keys() & job.after:
                    failed[job.name] = "it needs another job, which failed"
                    waiting.remove(job)
                elif len(running) < workers and done.issuperset(job.after):
                    future = pool.submit(_run_logged, job.run, job.log)
                    bar = bars.add_task(job.name, total=None)
                    running[future] = _Running(job, bar, time.monotonic())
                    waiting.remove(job)
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                ended = running.pop(future)
                bars.remove_task(ended.bar)
                bars.advance(overall)
                error = future.result()
                seconds = f"{time.monotonic() - ended.start:.0f} s"
                if error is None:
                    done.add(ended.job.name)
                    bars.console.print(f"{ended.job.name}: {seconds}", highlight=False)
                else:
                    failed[ended.job.name] = f"{error} (see {ended.job.log})"
                    bars.console.print(f"{ended.job.name}: failed", highlight=False)
    return failed


@dataclass(frozen=True, slots=True)
class _Running:
    job: Job
    bar: TaskID
    start: float


@contextmanager
def _start_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Start processes that compute with one thread; they are stopped if anything is raised."""
    others = multiprocessing.active_children()
    context = multiprocessing.get_context("spawn")
    with (
        _one_thread(),
        ProcessPoolExecutor(workers, mp_context=context, initializer=_start_worker) as pool,
    ):
        try:
            yield pool
        except BaseException:
            for child in multiprocessing.active_children():
                if child not in others:
                    child.terminate()
            raise


@contextmanager
def _one_thread() -> Iterator[None]:
    """Set what numpy, torch and dgl read when a worker imports them."""
    before = {name: os.environ.get(name) for name in _THREAD_VARIABLES}
    os.environ.update(dict.fromkeys(_THREAD_VARIABLES, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _start_worker() -> None:
    """Leave Ctrl-C to the parent, and end when it ends, even if it was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def follow() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=follow, daemon=True).start()


def _run_logged(run: Callable[[], object], log: Path) -> str | None:
    """Run in a worker; return what went wrong, None if nothing did."""
    log.parent.mkdir(parents=True, exist_ok=True)
    with log.open("w", encoding="utf-8") as file:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
            os.dup2(file.fileno(), stream.fileno())
    try:
        run()
    except SystemExit as stop:  # a command line that refused something has printed why
        sys.stderr.flush()
        lines = log.read_text(encoding="utf-8").split("\n")
        return next((line for line in reversed(lines) if line), "") if stop.code else None
    except Exception as error:
        traceback.print_exc()
        return f"{type(error).__name__}: {error}"
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
    return None
