"""The contract between a task and what records or scores it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from typing import ClassVar

import numpy as np

from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.policies.policy import Policy
from simulator.tasks.answer import Answer
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.rollout import Rollout
from simulator.world.homes import Homes


class Task(ABC):
    """A task as one policy plays it in H homes in lockstep.

    Each step evolves the homes, asks, hands every batch of answers to `on_answer`, folds the
    looks into the memory and gives each home its score.

    Attributes:
        title: of tables and figures.
        asks_moved: share of its questions that are about what has moved in the step, if anything
            has; docs/design.md, ruling 9.
        shares: of the kinds of its questions, which a command may set before it is run; None where
            they are fixed.
        metric: name of what a step is scored with, see `simulator.tasks.metrics.STEP_METRICS`.
        rollout: the homes, the memory and the policy.
        on_answer: called with every batch of answers before the looks change the memory.
    """

    title: ClassVar[str]
    metric: ClassVar[str]
    asks_moved: ClassVar[float] = TASKS_ASK_MOVED
    shares: QuestionShares | None = None

    def __init__(self, homes: Homes, policy: Policy) -> None:
        """Start at t = 0 with an empty memory."""
        self.rollout = Rollout(homes, policy, self.asks_moved)
        self.on_answer: Callable[[Answer], None] = lambda answer: None

    @abstractmethod
    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each gives the score of every home, (H,)."""
