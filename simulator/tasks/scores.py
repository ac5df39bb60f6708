"""What a policy scored in a task, and how it answered: the raw columns of all metrics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from sgm.arrays.week import DAY_SECONDS, HOUR_SECONDS, compute_week_seconds
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Queries
from sgm.policies.policy import Policy, compute_probabilities
from sgm.schema import NEVER
from simulator.tasks.answer import Answer
from simulator.tasks.task import Task
from simulator.tasks.usual_places import UsualPlaces


@dataclass(frozen=True, slots=True)
class TaskScores:
    """What a policy scored in H homes over T steps of a task, and how it answered A queries.

    Predict Object Location has one query a step, so that A is the number of steps; Find Object
    counts the first look of each search. `simulator.tasks.metrics` computes from these columns.

    Attributes:
        values: the task's own score of each step (`Task.metric`), (H, T).
        is_correct: whether the chosen furniture held an object asked for, bool (H, A).
        has_candidate: whether the policy gave a true place any score above -inf, which for NEP
            means that it was among the query's candidate edges, bool (H, A).
        is_away: whether the object was not where the agent had last seen it, bool (H, A).
        confidence: probability that the policy gave to its choice, (H, A).
        likelihood: probability that it gave to the true places together, (H, A).
        rank: of the best true place among the places of the home, (H, A). Places of equal score
            share their ranks: n of them, m of which are true, behind b better ones, have a true one
            at b + (n + 1) / (m + 1) on average. Places without a score (-inf) come last and tie.
        is_out_of_place: whether the object was not where such objects had been most of the time
            so far, see `UsualPlaces`; the same for every policy, bool (H, A).
        hour: of the day when it was asked, 0 to 23, -1 where it is unknown, (H, A).
    """

    values: np.ndarray
    is_correct: np.ndarray
    has_candidate: np.ndarray
    is_away: np.ndarray
    confidence: np.ndarray
    likelihood: np.ndarray
    rank: np.ndarray
    is_out_of_place: np.ndarray
    hour: np.ndarray

    @property
    def home_values(self) -> np.ndarray:
        """Mean score per home, (H,)."""
        return self.values.mean(axis=1)

    @classmethod
    def join(cls, homes: Sequence[Sequence[int]], parts: Sequence[TaskScores]) -> TaskScores:
        """Put the scores of groups of homes together, in the order of the homes' numbers."""
        order = np.argsort(np.concatenate(homes), kind="stable")
        columns = {
            field.name: np.concatenate([getattr(part, field.name) for part in parts])[order]
            for field in fields(cls)
        }
        return cls(**columns)

    def take(self, home: int) -> TaskScores:
        """Return the scores of one home."""
        return TaskScores(*(getattr(self, field.name)[home : home + 1] for field in fields(self)))

    def skip(self, num_steps: int) -> TaskScores:
        """Return the scores without those of the first steps."""
        num_left = self.values.shape[1] - num_steps
        columns = {field.name: getattr(self, field.name) for field in fields(self)}
        for name, column in columns.items():
            num_answers = column.shape[1] * num_left // self.values.shape[1]
            columns[name] = column[:, column.shape[1] - num_answers :]
        return TaskScores(**columns)


class AnswerLog:
    """Listens to a task and keeps what `TaskScores` says about its answers.

    Looks that go on a search are left out.
    """

    def __init__(self, game: Task, policy: Policy) -> None:
        """Listen to a task that `policy` plays."""
        self._memory = game.rollout.memory
        self._kind = policy.score_kind
        self._usual = UsualPlaces(game.rollout.homes)
        self._rows: list[dict[str, np.ndarray]] = []
        game.on_answer = self._add

    def finish(self) -> dict[str, np.ndarray]:
        """Return the columns, (H, A) each."""
        names = self._rows[0]
        return {name: np.concatenate([part[name] for part in self._rows], axis=1) for name in names}

    def _add(self, answer: Answer) -> None:
        if answer.is_repeat:
            return
        scores, answers = answer.scores, answer.answers  # (Q, F) each
        is_furniture = self._memory.is_furniture[answer.queries.home]
        probability = compute_probabilities(scores, self._kind, is_furniture)
        columns = {
            "is_correct": answer.is_correct,
            "has_candidate": (np.isfinite(scores) & answers).any(axis=1),
            "is_away": compute_away(self._memory, answer.queries, answers),
            "confidence": probability[np.arange(len(answer.choice)), answer.choice],
            "likelihood": (probability * answers).sum(axis=1),
            "rank": compute_rank(scores, answers, is_furniture),
            "is_out_of_place": self._usual.compute_out_of_place(
                answer.queries.home, self._memory.objects["key"][answer.queries.object], answers
            ),
            "hour": compute_hours(self._memory, answer.queries.home),
        }
        self._usual.count()
        num_homes = self._memory.num_homes
        self._rows.append({name: column.reshape(num_homes, -1) for name, column in columns.items()})


def compute_rank(scores: np.ndarray, answers: np.ndarray, is_place: np.ndarray) -> np.ndarray:
    """Return the mean rank of the best true place over all orders of tied places, float (Q,).

    Scores (Q, F) are -inf for no opinion; `answers` marks the true places among those that are
    ranked, `is_place`, bool (Q, F) each.
    """
    best = np.where(answers, scores, -np.inf).max(axis=1, keepdims=True)  # (Q, 1)
    is_tied = is_place & (scores == best)
    num_better = (is_place & (scores > best)).sum(axis=1)
    ranks: np.ndarray = num_better + (is_tied.sum(axis=1) + 1) / (
        (is_tied & answers).sum(axis=1) + 1
    )
    return ranks


def compute_hours(memory: MemoryBatch, home: np.ndarray) -> np.ndarray:
    """Return the hour of the day that it is in homes (Q,), -1 where it is unknown, int (Q,)."""
    hours = np.full(len(home), -1)
    if memory.clock is not None:
        clock = memory.clock[home]
        is_known = ~np.isnan(clock[:, 0])
        seconds = compute_week_seconds(clock[is_known], np.full(is_known.sum(), memory.time))
        hours[is_known] = seconds % DAY_SECONDS // HOUR_SECONDS
    return hours


def compute_away(memory: MemoryBatch, queries: Queries, answers: np.ndarray) -> np.ndarray:
    """Mark the queries whose object was seen before and is not where it was last seen, bool (Q,).

    What an agent has seen depends on its policy, and so does which objects are away for it. The
    memory is that before the look that follows; `answers` marks the true places, bool (Q, F).
    """
    last = memory.objects["last_furniture"][queries.object]
    return (last != NEVER) & ~answers[np.arange(len(last)), last]
