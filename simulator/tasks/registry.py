"""The tasks and metrics by name, or by import path."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any

from sgm.messages import shorten
from simulator.tasks.find_object import FindObject
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from simulator.tasks.predict_location import PredictLocation
from simulator.tasks.relative_likelihood import RelativeLikelihood
from simulator.tasks.task import Task

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
    if name in TASKS:
        return TASKS[name]
    found = _import("task", name, TASKS, "MyTask")
    if not (isinstance(found, type) and issubclass(found, Task)):
        raise ValueError(
            f"task must be a subclass of simulator.tasks.task.Task, got {shorten(name)}. Derive it "
            "from Task, or check the name."
        )
    if getattr(found, "metric", None) not in STEP_METRICS or not hasattr(found, "title"):
        raise ValueError(
            f"task must have a title and a metric among {', '.join(STEP_METRICS)}, got "
            f"{shorten(name)}. Add both to the class."
        )
    return found


def check_task(name: str) -> None:
    """Check the name of a task.

    Raises:
        ValueError: if there is no task of that name.
    """
    find_task(name)


def find_metric(name: str) -> Metric:
    """Find a metric of answers by name, or import one of your own: "my_module:my_metric".

    Args:
        name: that name; of one's own, that of a `Metric`, or of a function that gets `TaskScores`
            and returns a number, of which more is better.

    Raises:
        ValueError: if there is no metric of that name.
    """
    if name in METRICS:
        return METRICS[name]
    found = _import("metric", name, METRICS, "my_metric")
    if isinstance(found, Metric):
        return Metric(name, found.title, found.format, found.is_higher_better, found.compute)
    if not callable(found):
        raise ValueError(
            "metric must be a Metric, or a function of TaskScores, got "
            f"{shorten(name)}, which is {type(found).__name__}. Check the name."
        )
    return Metric(name, name.partition(":")[2], ".3f", True, found)


def make_file_name(task: str) -> str:
    """Return what files and folders of a task are called; those of one's own have no colon."""
    return task.replace(":", ".")


def _import(what: str, name: str, known: Mapping[str, Any], example: str) -> Any:
    """Import what "module:name" says.

    Raises:
        ValueError: if there is nothing of that name.
    """
    module, separator, attribute = name.partition(":")
    if not separator:
        raise ValueError(
            f"{what} must be one of {', '.join(known)}, got {shorten(name)}. Choose one of these, "
            f"or name one of your own as my_module:{example}."
        )
    try:
        return getattr(importlib.import_module(module), attribute)
    except (ImportError, TypeError, ValueError, AttributeError) as error:
        raise ValueError(
            f"{what} must be in a module that can be imported, got {shorten(name)}: {error}. Run "
            "the command in the folder of the module, or install its package."
        ) from error
