"""The tasks by name."""

from __future__ import annotations

from collections.abc import Mapping

from sgm.messages import shorten
from simulator.tasks.find_object import FindObject
from simulator.tasks.predict_location import PredictLocation
from simulator.tasks.relative_likelihood import RelativeLikelihood
from simulator.tasks.task import Task

# Every task by the name that command lines, folders and tables use.
TASKS: Mapping[str, type[Task]] = {
    "predict_location": PredictLocation,
    "relative_likelihood": RelativeLikelihood,
    "find_object": FindObject,
}


def check_task(name: str) -> None:
    """Check the name of a task.

    Raises:
        ValueError: if there is no task of that name.
    """
    if name not in TASKS:
        raise ValueError(
            f"task must be one of {', '.join(TASKS)}, got {shorten(name)}. Choose one of these."
        )
