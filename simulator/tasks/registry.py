"""The tasks and metrics by name, or by import path."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from sgm.messages import shorten
from simulator.tasks.find_object import FindObject
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from simulator.tasks.predict_location import PredictLocation
from simulator.tasks.relative_likelihood import RelativeLikelihood
from simulator.tasks.task import Task
from simulator.world.parts import find_named, find_subclass

# Every task by the name that command lines, folders and tables use.
TASKS: Mapping[str, type[Task]] = {
    "predict_location": PredictLocation,
    "relative_likelihood": RelativeLikelihood,
    "find_object": FindObject,
}


def find_task(name: str) -> type[Task]:
    """Find a task by name, or import one of your own: "my_module:MyTask".

    Raises:
        ValueError: if there is no task of that name, or its `metric` is unknown.
    """
    found: type[Task] = find_subclass("task", name, TASKS, Task)
    if getattr(found, "metric", None) not in STEP_METRICS or not hasattr(found, "title"):
        raise ValueError(
            f"task must have a title and a metric among {', '.join(STEP_METRICS)}, got "
            f"{shorten(name)}. Add both to the class."
        )
    return found


def check_task(name: str) -> None:
    """Raise ValueError if there is no task of that name, as `find_task` does."""
    find_task(name)


def find_metric(name: str) -> Metric:
    """Find a metric of answers by name, or import one of your own: "my_module:my_metric".

    Args:
        name: that name; of one's own, that of a `Metric`, or of a function that gets `TaskScores`
            and returns a number, of which more is better.

    Raises:
        ValueError: if there is no metric of that name.
    """
    found = find_named("metric", name, METRICS, "my_metric")
    if isinstance(found, Metric):
        return replace(found, name=name)
    if not callable(found):
        raise ValueError(
            "metric must be a Metric, or a function of TaskScores, got "
            f"{shorten(name)}, which is {type(found).__name__}. Check the name."
        )
    return Metric(name, name.partition(":")[2], ".3f", True, found)


def make_file_name(task: str) -> str:
    """Return what files and folders of a task are called; those of one's own have no colon."""
    return task.replace(":", ".")
