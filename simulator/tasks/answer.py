"""What a policy answered: the one record that tasks hand on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sgm.memory.queries import Queries


@dataclass(frozen=True, slots=True)
class Answer:
    """Q queries answered at once, before the looks that they lead to.

    Attributes:
        queries: what was asked; homes ascending, each as often as it was asked.
        answers: furniture that truly holds an object asked for, bool (Q, F); none where there is no
            such object in the home now.
        scores: what the policy said, -inf where it has no opinion, (Q, F).
        choice: the furniture that it leads to, (Q,); -1 where a search gives up.
        is_repeat: whether the same was asked earlier in this step: a search that goes on.
        relevance: of each place to the query, where the task knows it, (Q, F).
        asks_moved: whether each question is one of the paper's tasks, half of which are about what
            has moved in this very step, bool (Q,); None where all are as the task says
            (`Task.asks_moved`).
    """

    queries: Queries
    answers: np.ndarray
    scores: np.ndarray
    choice: np.ndarray
    is_repeat: bool = False
    relevance: np.ndarray | None = None
    asks_moved: np.ndarray | None = None

    @property
    def is_correct(self) -> np.ndarray:
        """Whether the chosen furniture holds an object asked for, bool (Q,)."""
        return self.answers[np.arange(len(self.choice)), self.choice] & (self.choice >= 0)
