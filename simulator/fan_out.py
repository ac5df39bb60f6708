"""Fans jobs out to processes of this machine, or to a cluster."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from typing import Any, TypeVar

from sgm.checks import check_at_least, check_choice
from sgm.messages import needed_to

BACKENDS = ("processes", "ray")
_JOBS_PER_ROUND = 4  # per worker, where results come round by round
_pool_size: int | None = None  # of the processes that the latest call has left for the next

Result = TypeVar("Result")


def fan_out(
    function: Callable[..., Result],
    jobs: Sequence[tuple[Any, ...]],
    workers: int,
    backend: str = "processes",
) -> Iterator[tuple[int, Result]]:
    """Call a function once per job, several at a time.

    What had not returned when a worker was killed is done once more, by new processes.

    Args:
        function: what to do; a job that is done twice must return the same.
        jobs: its arguments, job by job.
        workers: jobs at a time; one works in this process.
        backend: "processes" of this machine, unless a `joblib.parallel_config` around the call
            says otherwise, or "ray": the cluster at RAY_ADDRESS, or one started on this machine.

    Yields:
        The number of a job and what it returned, as the jobs are finished.

    Raises:
        ValueError: if there is no such backend, or it is not installed.
        joblib.externals.loky.process_executor.TerminatedWorkerError: if a worker is killed again.
    """
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    left = dict(enumerate(jobs))
    for is_last in (False, True):
        try:
            for number, result in _run(function, left, workers, backend):
                del left[number]
                yield number, result
            return
        except TerminatedWorkerError:  # loky may take a resting worker for a killed one
            if is_last:
                raise


def _run(
    function: Callable[..., Result], jobs: Mapping[int, tuple[Any, ...]], workers: int, backend: str
) -> Iterator[tuple[int, Result]]:
    """Call a function once per job, as `fan_out` says, and give up where a worker is killed."""
    from joblib import Parallel, delayed  # here, as half of what importing the package would take
    from joblib.parallel import get_active_backend

    calls = [delayed(_call)(function, number, arguments) for number, arguments in jobs.items()]
    num_workers = min(workers, len(calls))
    if backend == "processes" and num_workers > 1:
        _end_pool_of_other_size(num_workers)
    with _choose_backend(backend):
        # Ray hands back a whole round of results at once: many small rounds, for what is finished
        # to be known, but not so small that workers often wait for the last of a round.
        streams = get_active_backend()[0].supports_return_generator
        at_once = len(calls) if streams else workers * _JOBS_PER_ROUND
        return_as = "generator_unordered" if streams else "list"
        # joblib replaces a worker that holds 300 MB more than after its first job, without losing
        # any: homes of many steps take as much, and so does what a later job imports.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
        with Parallel(n_jobs=num_workers, return_as=return_as) as parallel:
            for first in range(0, len(calls), at_once):
                yield from parallel(calls[first : first + at_once])


def _end_pool_of_other_size(num_workers: int) -> None:
    """End the processes that an earlier call has left, if it had another number of them.

    joblib would resize their pool, and waits for ever if one of them ends just then, as it does
    after five minutes without work.
    """
    global _pool_size  # joblib has one pool per process, too
    if _pool_size not in (None, num_workers):
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor().shutdown(wait=True)
    _pool_size = num_workers


def check_workers(workers: int, backend: str) -> None:
    """Raise ValueError unless there is a worker, and the backend is known and installed."""
    check_at_least(1, workers=workers)
    _choose_backend(backend)


def _call(
    function: Callable[..., Result], number: int, arguments: tuple[Any, ...]
) -> tuple[int, Result]:
    return number, function(*arguments)


def _choose_backend(backend: str) -> AbstractContextManager[Any]:
    check_choice("backend", backend, BACKENDS)
    if backend == "processes":
        return nullcontext()
    os.environ.setdefault("RAY_USAGE_STATS_ENABLED", "0")  # a setting of the user's stays
    with needed_to("share work out with backend ray", extra="cluster"):
        from joblib import parallel_config
        from ray.util.joblib import register_ray
    register_ray()
    return parallel_config(backend="ray")
