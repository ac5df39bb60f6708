"""The tasks by name, or by import path."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sgm.messages import shorten
from simulator.world.parts import ClassesByName

if TYPE_CHECKING:
    from simulator.tasks.task import Task

# Every task by the name that command lines, folders and tables use.
TASKS: ClassesByName[Task] = ClassesByName(
    "task",
    "simulator.tasks.task.Task",
    predict_location="simulator.tasks.predict_location.PredictLocation",
    relative_likelihood="simulator.tasks.relative_likelihood.RelativeLikelihood",
    find_object="simulator.tasks.find_object.FindObject",
)


def find_task(name: str) -> type[Task]:
    """Find a task by name, or import one of your own: "my_module:MyTask".

    Raises:
        ValueError: if there is no task of that name, or its `metric` is unknown.
    """
    from simulator.tasks.metrics import STEP_METRICS  # loads all that scores, as the task does

    found = TASKS.find(name)
    if getattr(found, "metric", None) not in STEP_METRICS or not hasattr(found, "title"):
        raise ValueError(
            f"task must have a title and a metric among {', '.join(STEP_METRICS)}, got "
            f"{shorten(name)}. Add both to the class."
        )
    return found


def check_task(name: str) -> None:
    """Raise ValueError if there is no task of that name, as `find_task` does."""
    find_task(name)


def make_file_name(task: str) -> str:
    """Return what files and folders of a task are called; those of one's own have no colon."""
    return task.replace(":", ".")
