"""Searches in homes, some without a find, and how far the probabilities in them can be believed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sgm.belief import Belief, Detector
from sgm.evidence.elsewhere import ELSEWHERE
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.policy import Policy
from sgm.schema import NEVER
from simulator.tasks.metrics import compute_calibration_error, compute_nll
from simulator.tasks.rollout import Rollout, sample_query
from simulator.tasks.search import Search, SearchOrder
from simulator.world.homes import Homes
from simulator.world.streams import sample_categorical


@dataclass(frozen=True, slots=True)
class Decisions:
    """The state of searches before each of their looks, n of them.

    As in the finder, the network is asked before the first look of a search; what the looks of the
    search say is Bayes' rule.

    Attributes:
        scores: logits of the places before the first look, (n, F).
        asked_again: logits when the network is asked again, with the looks so far in the memory,
            (n, F).
        is_absent: places looked at in this time step without seeing the object, bool (n, F).
        answers: furniture that holds the object, and last whether none does, bool (n, F + 1).
        num_looks: looks of the search so far, (n,).
    """

    scores: np.ndarray
    asked_again: np.ndarray
    is_absent: np.ndarray
    answers: np.ndarray
    num_looks: np.ndarray


def play_searches(
    homes: Homes,
    policy: Policy,
    num_searches: int,
    *,
    max_looks: int = 8,
    elsewhere_share: float = ELSEWHERE,
    on_search: Callable[[], None] = lambda: None,
) -> Decisions:
    """Let a policy search every home, once per time step, and keep what it thought.

    An object is asked for as in the tasks (docs/design.md, ruling 9); or, with probability
    `elsewhere_share`, one that is not in the home: half of them have been seen and left, the others
    are any descriptions that the home does not have. The best candidate that was not looked at yet
    is looked at, until the object is seen there (the detector may miss it), none is left or
    `max_looks` are spent.

    Args:
        homes: the true homes, H.
        policy: gives logits.
        num_searches: per home.
        max_looks: looks per search.
        elsewhere_share: of objects that are not in the home.
        on_search: called after each search of all homes.
    """
    rollout = Rollout(homes, policy)
    memory, order = rollout.memory, ByLogit()
    parts: dict[str, list[np.ndarray]] = {
        name: [] for name in ("scores", "asked_again", "is_absent", "answers", "num_looks")
    }
    for _ in range(num_searches):
        rollout.evolve()
        codes = _sample_codes(rollout, elsewhere_share)
        queries = rollout.query(np.arange(homes.num_homes), codes)
        first = np.full((homes.num_homes, homes.num_furniture), -np.inf)
        search = Search(rollout, codes, queries, max_looks, ends_when_seen=True)
        answers = np.concatenate(
            [search.answers, ~search.answers.any(axis=1, keepdims=True)], axis=1
        )
        while len(searching := search.homes):
            answer = search.choose(order)
            is_first = search.num_looks[searching] == 0
            first[searching[is_first]] = answer.scores[is_first]
            parts["scores"].append(first[searching])
            parts["asked_again"].append(answer.scores)
            parts["is_absent"].append(find_absent(memory, answer.queries))
            parts["answers"].append(answers[searching])
            parts["num_looks"].append(search.num_looks[searching])
            search.look(searching, answer.choice)
        on_search()
    return Decisions(**{name: np.concatenate(values) for name, values in parts.items()})


def measure_calibration(decisions: Decisions, *, asks_again: bool = False) -> dict[str, float]:
    """Measure how far probabilities can be believed.

    Args:
        decisions: the searches.
        asks_again: whether the softmax of the network after every look is measured, which has no
            "elsewhere". Else it is asked once, a share of `ELSEWHERE` is
            elsewhere, and looks are folded in by Bayes' rule.

    Returns:
        "nll": mean negative log likelihood of the truth, in nats. "ece": expected calibration error
        of the likeliest answer, "elsewhere" among them. "ece_first": the same of first looks.
        "ece_elsewhere": of the probability of "elsewhere". "elsewhere_there", "elsewhere_gone":
        its mean where the object is at a known place, and where it is not; 0 without such ones.
    """
    if asks_again:
        belief = Belief.of_logits(decisions.asked_again, 0.0)
    else:
        belief = Belief.of_logits(decisions.scores, ELSEWHERE).look(
            np.log(Detector().compute_miss(decisions.is_absent.astype(float)))
        )
    probability, truth = belief.probabilities, decisions.answers
    choice = probability.argmax(axis=1)
    rows = np.arange(len(choice))
    confidence, is_right = probability[rows, choice], truth[rows, choice]
    first = decisions.num_looks == 0
    elsewhere, is_gone = probability[:, -1], truth[:, -1]
    return {
        "nll": compute_nll((probability * truth).sum(axis=1)),
        "ece": compute_calibration_error(confidence, is_right),
        "ece_first": compute_calibration_error(confidence[first], is_right[first]),
        "ece_elsewhere": compute_calibration_error(elsewhere, is_gone),
        "elsewhere_there": _mean(elsewhere[~is_gone]),
        "elsewhere_gone": _mean(elsewhere[is_gone]),
    }


def _mean(values: np.ndarray) -> float:
    return float(values.sum() / max(len(values), 1))


class ByLogit(SearchOrder):
    """The highest score first, the first place of equal ones; gives up where none has a score."""

    def choose(
        self, homes: np.ndarray, scores: np.ndarray, is_open: np.ndarray, uniform: np.ndarray
    ) -> np.ndarray:
        """Choose the open candidate of the highest score."""
        left = np.where(is_open, scores, -np.inf)
        return np.where(np.isfinite(left).any(axis=1), left.argmax(axis=1), -1)


def find_absent(memory: MemoryBatch, queries: Queries) -> np.ndarray:
    """Mark furniture looked at in this time step without seeing the query object, bool (Q, F)."""
    is_absent = memory.furniture_last_observed[queries.home] == memory.time
    query, edge = memory.edges_of(queries)
    edges = memory.edges
    is_seen = edges["is_true"][edge] & (edges["last_observed"][edge] == memory.time)
    is_absent[query[is_seen], edges["furniture"][edge[is_seen]]] = False
    return is_absent


def _sample_codes(rollout: Rollout, elsewhere_share: float) -> np.ndarray:
    """Draw the description code that each home is searched for, (H,)."""
    homes, objects = rollout.homes, rollout.memory.objects
    present = homes.object_code[np.arange(homes.num_homes), sample_query(homes)]
    uniform = homes.streams.rows("search elsewhere", 2).take()  # (H, 2)
    shape = (homes.num_homes, homes.object_descriptions.num_descriptions)
    is_present = np.zeros(shape, dtype=bool)
    home, slot = np.nonzero(homes.is_present)
    is_present[home, homes.object_code[home, slot]] = True
    was_seen = np.zeros(shape, dtype=bool)
    seen = objects["last_observed"] != NEVER
    was_seen[objects["home"][seen], objects["key"][seen]] = True
    has_left = was_seen & ~is_present
    asks_for_left = (uniform[:, 0] < elsewhere_share / 2) & has_left.any(axis=1)
    weights = np.where(asks_for_left[:, None], has_left, ~is_present)
    lacks_some = np.asarray(weights.any(axis=1))  # a recorded home may have all that is described
    weights[~lacks_some] = True
    missing = sample_categorical(weights.astype(float), uniform[:, 1])
    return np.where(lacks_some & (uniform[:, 0] < elsewhere_share), missing, present)
