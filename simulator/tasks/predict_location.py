"""Task "Predict Object Location": where is the object with this description?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sgm.memory.queries import Queries
from simulator.tasks.answer import Answer
from simulator.tasks.rollout import Rollout, compute_answers
from simulator.tasks.task import Task
from simulator.world.streams import sample_best


class PredictLocation(Task):
    """A home scores 1 if the chosen furniture holds the object.

    Source: paper section 5.2; docs/design.md, ruling 10.
    """

    title = "Predict Object Location"
    metric = "accuracy"

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each tells whether the homes' answers were right, 0 or 1 (H,)."""
        for answer in predict_locations(self.rollout, num_steps):
            self.on_answer(answer)
            yield answer.is_correct.astype(float)


def predict_locations(rollout: Rollout, num_steps: int) -> Iterator[Answer]:
    """Ask one question per home and step; each answer is yielded before its look is remembered.

    The furniture of the highest score is chosen, ties broken at random, and looked at, unless the
    rules of the home say that the robot looks elsewhere (`HomeConfig.looks`); a policy without any
    opinion (all -inf) chooses among all furniture of the home.
    """
    for _ in range(num_steps):
        answer = answer_queries(rollout, *rollout.ask())
        yield answer
        rollout.look_around(answer.choice)


def answer_queries(
    rollout: Rollout, codes: np.ndarray, queries: Queries, asks_moved: np.ndarray | None = None
) -> Answer:
    """Answer one question per home about descriptions, (H,); see `Answer` for `asks_moved`."""
    homes, scores = rollout.homes, rollout.score(queries)
    uniform = homes.streams.rows("ties", 1).take()[:, 0]
    choice = sample_best(scores, rollout.memory.is_furniture, uniform)
    answers = compute_answers(homes, codes)
    return Answer(queries, answers, scores, choice, asks_moved=asks_moved)
