"""What the paper's metric of Predict Relative Location Likelihood may have been: readings of it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from nep.bench.paper.paper_game import PaperGame
from nep.players.contestants import MakePolicy
from sgm.policies.policy import Policy
from simulator.tasks.answer import Answer
from simulator.tasks.ndcg import compute_ndcg
from simulator.tasks.relative_likelihood import RelativeLikelihood
from simulator.world.homes import Homes


@dataclass(frozen=True, slots=True)
class LikelihoodReading:
    """A way to score a ranking of all furniture.

    Attributes:
        title: what a place counts, in tables.
        compute: gets scores (Q, F), the answer and which furniture an object asked for can move to,
            bool (Q, F), and returns a number for each query, (Q,).
    """

    title: str
    compute: Callable[[np.ndarray, Answer, np.ndarray], np.ndarray]


def compute_listed_ndcg(scores: np.ndarray, relevance: np.ndarray) -> np.ndarray:
    """Return the NDCG of lists that end where a policy has no opinion, (Q,).

    What is not listed (-inf) adds nothing, and still counts in the best ranking; `compute_ndcg`
    ranks it last instead.
    """
    listed = np.where(np.isfinite(scores), relevance, 0.0)
    discounts = 1 / np.log2(np.arange(scores.shape[1]) + 2)  # (F,)
    best, best_listed = (
        (-np.sort(-values, axis=1) * discounts).sum(axis=1) for values in (relevance, listed)
    )
    share = np.divide(best_listed, best, out=np.zeros(len(best)), where=best > 0)
    return compute_ndcg(scores, listed) * share


def _get_relevance(answer: Answer) -> np.ndarray:
    assert answer.relevance is not None  # the task knows it
    return answer.relevance


# By name: the first is ours (docs/design.md, ruling 17).
READINGS: Mapping[str, LikelihoodReading] = {
    "home": LikelihoodReading(
        "its row of T over the home", lambda s, answer, _: compute_ndcg(s, _get_relevance(answer))
    ),
    "reach": LikelihoodReading(
        "its row of T where the object can go",
        lambda s, answer, reach: compute_ndcg(s, _get_relevance(answer) * reach),
    ),
    "moved": LikelihoodReading(
        "its row of T but where it is now",
        lambda s, answer, _: compute_ndcg(s, _get_relevance(answer) * ~answer.answers),
    ),
    "here": LikelihoodReading(
        "1 where it is now, else 0", lambda s, answer, _: compute_ndcg(s, answer.answers * 1.0)
    ),
    "listed": LikelihoodReading(
        "its row of T over the home, places without an opinion left out",
        lambda s, answer, _: compute_listed_ndcg(s, _get_relevance(answer)),
    ),
    "moved_listed": LikelihoodReading(
        "its row of T but where it is now, places without an opinion left out",
        lambda s, answer, _: compute_listed_ndcg(s, _get_relevance(answer) * ~answer.answers),
    ),
}


@dataclass(frozen=True)
class ReadingGame(PaperGame):
    """The same homes; rankings are scored under every reading of the likelihood metric."""

    scored_by: ClassVar[tuple[str, ...]] = ("tools.claims.readings", "simulator.tasks.ndcg")

    @property
    def name(self) -> str:
        """Name among kept scores."""
        return f"readings of {super().name}"

    def play(self, players: Mapping[str, MakePolicy]) -> dict[str, Any]:
        """Let players play; return the mean of every home by reading."""
        scores = {}
        for name, make in players.items():
            homes = self.make_homes()
            found = play_readings(homes, make(homes), self.steps)
            scores[name] = {key: values.round(6).tolist() for key, values in found.items()}
        return scores


def play_readings(homes: Homes, policy: Policy, num_steps: int) -> dict[str, np.ndarray]:
    """Play Predict Relative Location Likelihood, and score its rankings under every reading.

    Returns:
        The mean of every home by reading, (H,).
    """
    game = RelativeLikelihood(homes, policy)
    values: dict[str, list[np.ndarray]] = defaultdict(list)

    def score(answer: Answer) -> None:
        own_scores = np.where(
            game.rollout.memory.is_furniture[answer.queries.home], answer.scores, -np.inf
        )
        reach = find_reach(homes, answer)
        for name, reading in READINGS.items():
            found = reading.compute(own_scores, answer, reach)
            values[name].append(found.reshape(homes.num_homes, -1).mean(axis=1))

    game.on_answer = score
    for _ in game.run(num_steps):
        pass
    return {name: np.mean(rows, axis=0) for name, rows in values.items()}


def find_reach(homes: Homes, answer: Answer) -> np.ndarray:
    """Mark the furniture that an object asked for can move to, or is at, bool (Q, F)."""
    room = homes.furniture_room[answer.queries.home]  # (Q, F)
    query, place = np.nonzero(answer.answers)
    is_there = np.zeros((len(room), int(room.max()) + 1), dtype=bool)
    is_there[query, room[query, place]] = True
    roams = np.array([homes.configs[home].cross_room_moves for home in answer.queries.home])
    reach = np.take_along_axis(is_there, np.maximum(room, 0), axis=1) | roams[:, None]
    return reach & (room >= 0)
