"""The contract between a task and what records or scores it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.memory.memory_batch import Queries
from simulator.policies import Policy
from simulator.tasks.rollout import Rollout
from simulator.world.homes import Homes


@dataclass(frozen=True, slots=True)
class Answered:
    """Q queries answered at once, before the looks that they lead to.

    Attributes:
        queries: what was asked; homes ascending, each as often as it was asked.
        answers: furniture that truly holds an object asked for, bool (Q, F).
        scores: what the policy said, -inf where it has no opinion, (Q, F).
        choice: the furniture that it leads to, (Q,).
        is_repeat: whether the same was asked earlier in this step: a search that goes on.
        grades: what each place is worth, where the task grades places, (Q, F).
    """

    queries: Queries
    answers: np.ndarray
    scores: np.ndarray
    choice: np.ndarray
    is_repeat: bool = False
    grades: np.ndarray | None = None

    @property
    def is_correct(self) -> np.ndarray:
        """Whether the chosen furniture holds an object asked for, bool (Q,)."""
        return self.answers[np.arange(len(self.choice)), self.choice]


class Task(ABC):
    """A task as one policy plays it in H homes in lockstep.

    Each step evolves the homes, asks, hands every batch of answers to `on_answer`, folds the
    looks into the memory and gives each home its score.

    Attributes:
        title: of tables and figures.
        metric: name of what a step is scored with, see `simulator.tasks.metrics.STEP_METRICS`.
        rollout: the homes, the memory and the policy.
        on_answer: called with every batch of answers before the looks change the memory.
    """

    title: ClassVar[str]
    metric: ClassVar[str]

    def __init__(self, homes: Homes, policy: Policy) -> None:
        """Start at t = 0 with an empty memory.

        Args:
            homes: the true homes.
            policy: who answers.
        """
        self.rollout = self.start(homes, policy)
        self.on_answer: Callable[[Answered], None] = lambda answered: None

    def start(self, homes: Homes, policy: Policy) -> Rollout:
        """Make the rollout that the task is played in."""
        return Rollout(homes, policy)

    @abstractmethod
    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each gives the score of every home, (H,)."""
