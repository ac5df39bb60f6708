"""Task "Predict Relative Location Likelihood": which places are likely for several objects?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sgm.arrays.grouped import sum_relations
from sgm.checks import check_at_least
from sgm.policies.policy import Policy
from sgm.schema import NUM_RELATIONS
from simulator.tasks.answer import Answer
from simulator.tasks.ndcg import compute_ndcg
from simulator.tasks.rollout import compute_answers, compute_query_weights
from simulator.tasks.task import Task
from simulator.world.homes import Homes
from simulator.world.streams import sample_best, sample_categorical


class RelativeLikelihood(Task):
    """Ranks all furniture for several objects a step; the best place of each is looked at.

    A place that is best for several objects is looked at once. The score of a home is the mean
    NDCG of its rankings.

    Source: paper section 5.2; docs/design.md, ruling 17.
    """

    title = "Predict Relative Location Likelihood"
    metric = "ndcg"

    def __init__(self, homes: Homes, policy: Policy, num_queries: int = 5) -> None:
        """Start at t = 0 with an empty memory; K objects are asked for per home and step.

        Raises:
            ValueError: if `num_queries` is below 1.
        """
        check_at_least(1, num_queries=num_queries)
        super().__init__(homes, policy)
        self.num_queries = num_queries

    def run(self, num_steps: int) -> Iterator[np.ndarray]:
        """Play steps; each gives the mean NDCG of every home, (H,)."""
        rollout, homes = self.rollout, self.rollout.homes
        for _ in range(num_steps):
            rollout.evolve()
            slots = sample_queries(homes, self.num_queries)
            home = np.repeat(np.arange(homes.num_homes), self.num_queries)  # (H * K,)
            codes, queries = rollout.ask_for(home, slots.ravel())
            scores = rollout.score(queries)
            is_furniture = rollout.memory.is_furniture[home]
            uniform = homes.streams.rows("likelihood ties", self.num_queries).take().ravel()
            choice = sample_best(scores, is_furniture, uniform)
            answers = compute_answers(homes, codes, home)
            relevance = compute_relevance(homes, home, codes)
            self.on_answer(Answer(queries, answers, scores, choice, relevance=relevance))
            ndcg = compute_ndcg(scores, relevance, is_furniture)
            for furniture in list_looks(choice.reshape(slots.shape)):
                rollout.look(furniture)
            yield ndcg.reshape(slots.shape).mean(axis=1)


def sample_queries(homes: Homes, num_queries: int) -> np.ndarray:
    """Ask K questions per home; return the object slots they are about, (H, K).

    Each is drawn like a single one (docs/design.md, ruling 9), among the objects whose
    description was not asked for yet in this step; a home without any such object left is asked for
    the same again.
    """
    uniform = homes.streams.rows("queries", 2 * num_queries).take()
    uniform = uniform.reshape(homes.num_homes, num_queries, 2)
    is_open = homes.is_present.copy()
    slots = np.empty((homes.num_homes, num_queries), dtype=np.int64)
    rows = np.arange(homes.num_homes)
    for turn in range(num_queries):
        is_open = np.where(is_open.any(axis=1, keepdims=True), is_open, homes.is_present)
        weights = compute_query_weights(homes, is_open, uniform[:, turn, 0])
        slots[:, turn] = sample_categorical(weights, uniform[:, turn, 1])
        is_open &= homes.object_code != homes.object_code[rows, slots[:, turn], None]
    return slots


def compute_relevance(homes: Homes, home: np.ndarray, codes: np.ndarray) -> np.ndarray:
    """Return the relevance of each furniture node to descriptions, (n,), (n,) -> (n, F).

    The row of the true T; all objects of a description share one row.

    Source: docs/design.md, ruling 17.
    """
    rows = homes.transition_rows(home, codes).astype(float)
    return sum_relations(rows.reshape(len(rows), -1, NUM_RELATIONS))


def list_looks(choice: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the furniture that homes choose, (H, K), in turn, (H,); -1 if looked at already."""
    for turn in range(choice.shape[1]):
        furniture = choice[:, turn]
        is_known = (choice[:, :turn] == furniture[:, None]).any(axis=1)
        yield np.where(is_known, -1, furniture)
