"""The tasks by name, all behind one interface."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from simulator.policies import Policy
from simulator.tasks.find_object import FindObject, Looks
from simulator.tasks.relative_likelihood import RelativeLikelihood
from simulator.tasks.rollout import Rollout
from simulator.tasks.task import Answered, Task
from simulator.world.homes import Homes


class PredictLocationTask(Task):
    """Predict Object Location: a home scores 1 if the chosen furniture holds the object.

    Source: paper section 5.2; docs/design.md, ruling 10.
    """

    title = "Predict Object Location"
    metric = "accuracy"

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each tells whether the homes' answers were right, 0 or 1 (H,)."""
        for step in self.rollout.run(num_steps):
            self.on_answer(Answered(step.queries, step.answers, step.scores, step.choice))
            yield step.is_correct.astype(float)


class FindObjectTask(Task):
    """Find Object: a home's score is the number of looks until the object is found.

    Source: paper section 5.2; docs/design.md, ruling 18.
    """

    title = "Find Object"
    metric = "looks"

    def start(self, homes: Homes, policy: Policy) -> Rollout:
        """Prepare searches in which every place may be looked at."""
        self._search = FindObject(homes, policy)
        self._search.on_look = self._hand_on
        return self._search.rollout

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play episodes; each gives the number of looks of every home, (H,)."""
        episodes = self._search.run(num_steps)
        for _ in range(num_steps):
            self._is_first = True
            yield next(episodes).num_looks.astype(float)

    def _hand_on(self, looks: Looks) -> None:
        self.on_answer(
            Answered(
                looks.queries, looks.answers, looks.scores, looks.furniture, not self._is_first
            )
        )
        self._is_first = False


# Every task by the name that command lines, folders and tables use.
TASKS: Mapping[str, type[Task]] = {
    "predict_location": PredictLocationTask,
    "relative_likelihood": RelativeLikelihood,
    "find_object": FindObjectTask,
}


def check_task(name: str) -> None:
    """Check the name of a task.

    Raises:
        ValueError: if there is no task of that name.
    """
    if name not in TASKS:
        raise ValueError(
            f"task must be one of {', '.join(TASKS)}, got {name!r}. Choose one of these."
        )
