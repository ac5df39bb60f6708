import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from joblib.externals.loky.process_executor import TerminatedWorkerError

from simulator.collect import folder as collect_module
from simulator.collect.folder import collect
from simulator.collect.settings import CollectConfig
from simulator.fan_out import check_workers, fan_out
from simulator.policies import POLICIES
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def divide(numerator: int, denominator: int) -> float:
    return numerator / denominator


@pytest.mark.parametrize("workers", [1, 2])
def test_every_job_is_done_once_and_named(workers):
    jobs = [(number, 2) for number in range(5)]
    found = dict(fan_out(divide, jobs, workers))
    assert found == {0: 0.0, 1: 0.5, 2: 1.0, 3: 1.5, 4: 2.0}


def name_process(seconds: float) -> int:
    time.sleep(seconds)  # so that every process gets some
    return os.getpid()


@pytest.mark.slow
def test_a_pool_is_taken_up_again_but_never_resized():
    """joblib waits for ever where a process ends while its pool is resized."""
    by_pool = [
        set(dict(fan_out(name_process, [(0.1,)] * 8, workers)).values()) for workers in (3, 3, 2)
    ]
    assert os.getpid() not in set.union(*by_pool)
    assert by_pool[0] & by_pool[1]
    assert not by_pool[1] & by_pool[2]


@pytest.mark.slow
def test_the_error_of_a_job_arrives():
    with pytest.raises(ZeroDivisionError):
        list(fan_out(divide, [(1, 1), (1, 0)], 2))


def end_process_once(path: Path, number: int) -> int:
    """End this process, as if killed, if no other one has done so before."""
    try:
        path.touch(exist_ok=False)
    except FileExistsError:
        return number
    os._exit(0)


@pytest.mark.slow
def test_jobs_of_a_killed_process_are_done_once_more(tmp_path):
    jobs = [(tmp_path / "ended", number) for number in range(6)]
    assert sorted(fan_out(end_process_once, jobs, 2)) == [(number, number) for number in range(6)]


@pytest.mark.slow
def test_a_job_that_ends_each_process_is_told():
    with pytest.raises(TerminatedWorkerError):
        list(fan_out(os._exit, [(1,), (1,)], 2))


def test_workers_and_backend_are_checked(monkeypatch):
    with pytest.raises(ValueError, match=r"workers must be at least 1, got 0\. Raise it"):
        check_workers(0, "processes")
    with pytest.raises(ValueError, match=r"one of processes, ray, got 'spark'\. Choose one"):
        check_workers(1, "spark")
    monkeypatch.setitem(sys.modules, "ray.util.joblib", None)  # as where Ray is not installed
    with pytest.raises(ModuleNotFoundError, match=r"package ray .* pip install ./core '.\[clu"):
        check_workers(1, "ray")


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "task"), [("bayesian", "find_object"), ("oracle", None)])
def test_evaluation_is_the_same_for_any_number_of_workers(default_prior, policy, task):
    task = task or "predict_location"
    settings = (POLICIES[policy].make, SampledSource(default_prior))
    alone = evaluate_policy(*settings, Streams(0, "val", range(5)), 4, task=task)
    shared = evaluate_policy(*settings, Streams(0, "val", range(5)), 4, task=task, workers=2)
    for name in ("values", "is_correct", "has_candidate", "is_away", "confidence", "likelihood"):
        np.testing.assert_array_equal(getattr(shared, name), getattr(alone, name), err_msg=name)


def test_the_manifest_is_not_written_for_every_home(tmp_path, monkeypatch):
    """With 100 % more homes each time: after 1, 2, 4 and 8 of 12 homes, and at the end."""
    written = []
    save = collect_module.save_manifest
    monkeypatch.setattr(collect_module, "_HOMES_PER_JOB", 1)
    monkeypatch.setattr(collect_module, "_MANIFEST_SHARE", 1.0)
    monkeypatch.setattr(
        collect_module,
        "save_manifest",
        lambda out, settings, shards: (written.append(len(shards)), save(out, settings, shards)),
    )
    collect(CollectConfig(num_homes=12, steps=1), tmp_path / "data", progress=False)
    assert written == [0, 1, 2, 4, 8, 12]


@pytest.mark.parametrize(("value", "expected"), [(None, "0"), ("1", "1")])
def test_ray_reports_no_usage_unless_the_user_says_so(monkeypatch, value, expected):
    if value is None:
        monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", "x")  # put back at the end
        monkeypatch.delenv("RAY_USAGE_STATS_ENABLED")
    else:
        monkeypatch.setenv("RAY_USAGE_STATS_ENABLED", value)
    monkeypatch.setitem(sys.modules, "ray", None)  # as if not installed: it is set before
    with pytest.raises(ModuleNotFoundError, match="package ray must be installed"):
        check_workers(2, "ray")
    assert os.environ["RAY_USAGE_STATS_ENABLED"] == expected
