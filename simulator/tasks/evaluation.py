"""Play a task with a policy and keep every score."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import partial

import numpy as np

from simulator.fan_out import check_workers, fan_out
from simulator.policies import Policy
from simulator.tasks.metrics import (
    compute_away,
    compute_calibration_error,
    compute_nll,
    compute_probabilities,
)
from simulator.tasks.registry import TASKS, check_task
from simulator.tasks.task import Answered, Task
from simulator.world.homes import Homes
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


@dataclass(frozen=True, slots=True)
class Scores:
    """How a policy answered A queries in each of H homes.

    Predict Object Location has one query a step, so that A is the number of steps; Find Object
    counts the first look of each search.

    Attributes:
        is_correct: whether the chosen furniture held an object asked for, bool (H, A).
        has_candidate: whether the policy gave a true place any score above -inf, which for NEP
            means that it was among the query's candidate edges, bool (H, A).
    """

    is_correct: np.ndarray
    has_candidate: np.ndarray

    @property
    def accuracy(self) -> np.ndarray:
        """Share of correct answers per home, (H,)."""
        return self.is_correct.mean(axis=1)

    @property
    def candidate_recall(self) -> float:
        """Share of queries whose true place is a candidate (docs/design.md, ruling 12: near 1)."""
        return float(self.has_candidate.mean())


@dataclass(frozen=True, slots=True)
class TaskScores(Scores):
    """What a policy scored in H homes over T steps of a task, and how it answered.

    Attributes:
        values: the task's own score of each step (`Task.metric`), (H, T).
        is_away: whether the object was not where the agent had last seen it, bool (H, A).
        confidence: probability that the policy gave to its choice, (H, A).
        likelihood: probability that it gave to the true places together, (H, A).
    """

    values: np.ndarray
    is_away: np.ndarray
    confidence: np.ndarray
    likelihood: np.ndarray

    @property
    def home_values(self) -> np.ndarray:
        """Mean score per home, (H,)."""
        return self.values.mean(axis=1)

    @property
    def away_accuracy(self) -> float:
        """Share of correct answers about objects that have left their last known place."""
        return float(self.is_correct[self.is_away].mean()) if self.is_away.any() else float("nan")

    @property
    def calibration_error(self) -> float:
        """Expected calibration error of the answers."""
        return compute_calibration_error(self.confidence.ravel(), self.is_correct.ravel())

    @property
    def nll(self) -> float:
        """Mean negative log likelihood of the true places, in nats."""
        return compute_nll(self.likelihood.ravel())


def evaluate_policy(
    make: Callable[[Homes], Policy],
    source: HomeSource,
    streams: Streams,
    num_steps: int,
    on_step: Callable[[], None] = lambda: None,
    task: str = "predict_location",
    workers: int = 1,
    backend: str = "processes",
) -> TaskScores:
    """Let a policy play a task in fresh homes, in lockstep or shared out to workers.

    Args:
        make: gets the homes and returns the policy; only oracles keep them. Workers are sent it.
        source: where the homes come from.
        streams: names the homes to play in: equal ones give the same homes and queries, so that
            policies can be compared home by home. None of it is used up.
        num_steps: T.
        on_step: called after each step of each group of homes.
        task: name of the task.
        workers: how many play at a time, see `play_games`.
        backend: where they work, see `fan_out`.

    Raises:
        ValueError: if there is no task of that name, the source has not so many homes or steps, or
            there is no worker or no such backend.
    """
    (scores,) = play_games(
        [(make, task)], source, streams, num_steps, lambda game: on_step(), workers, backend
    )
    return scores


def play_games(
    games: Sequence[tuple[Callable[[Homes], Policy], str]],
    source: HomeSource,
    streams: Streams,
    num_steps: int,
    on_step: Callable[[int], None] = lambda game: None,
    workers: int = 1,
    backend: str = "processes",
) -> list[TaskScores]:
    """Play games in the same homes, that may be shared out to workers.

    The scores are equal for any number of workers if the policy answers every home alone, as all
    but networks do: those sum in an order that depends on the batch, and differ by rounding.

    Args:
        games: who plays what: a function that gets homes and returns the policy, and the name of
            the task. Only oracles keep the homes.
        source: where the homes come from.
        streams: names the homes.
        num_steps: T.
        on_step: called with the number of the game after each step of each group of homes, or as
            often at the end of the game where workers play.
        workers: how many play at a time; one plays in this process.
        backend: where they work, see `fan_out`.

    Returns:
        The scores of each game, in the order of the numbers of the homes.

    Raises:
        ValueError: if there is no task of that name, the source has not so many homes or steps, or
            there is no worker or no such backend.
    """
    for _, task in games:
        check_task(task)
    check_workers(workers, backend)
    source.check_steps(num_steps)
    groups = [group.homes for group in source.list_groups(streams.homes)]
    if workers == 1:
        return [
            _join(
                groups,
                [
                    play_task(
                        make, source.make(streams.select(group)), num_steps,
                        partial(on_step, number), task,
                    )
                    for group in groups
                ],
            )
            for number, (make, task) in enumerate(games)
        ]  # fmt: skip
    homes = [
        part.tolist()
        for group in groups
        for part in np.array_split(np.array(group), min(workers, len(group)))
    ]
    jobs = [
        (make, source, streams.select(part), num_steps, task)
        for make, task in games
        for part in homes
    ]
    found: dict[int, TaskScores] = {}
    num_left = [len(homes)] * len(games)
    for number, scores in fan_out(_play_part, jobs, workers, backend):
        found[number] = scores
        game = number // len(homes)
        num_left[game] -= 1
        if not num_left[game]:
            for _ in range(num_steps * len(groups)):
                on_step(game)
    return [
        _join(homes, [found[first + part] for part in range(len(homes))])
        for first in range(0, len(jobs), len(homes))
    ]


def _join(homes: Sequence[Sequence[int]], parts: Sequence[TaskScores]) -> TaskScores:
    """Put the scores of all homes together, in the order of their numbers."""
    order = np.argsort(np.concatenate(homes), kind="stable")
    columns = {
        field.name: np.concatenate([getattr(part, field.name) for part in parts])[order]
        for field in fields(TaskScores)
    }
    return TaskScores(**columns)


def _play_part(
    make: Callable[[Homes], Policy],
    source: HomeSource,
    streams: Streams,
    num_steps: int,
    task: str,
) -> TaskScores:
    return play_task(make, source.make(streams), num_steps, task=task)


def play_task(
    make: Callable[[Homes], Policy],
    homes: Homes,
    num_steps: int,
    on_step: Callable[[], None] = lambda: None,
    task: str = "predict_location",
) -> TaskScores:
    """Let a policy play a task in homes at t = 0; see `evaluate_policy`.

    Raises:
        ValueError: if there is no task of that name.
    """
    check_task(task)
    policy = make(homes)
    game = TASKS[task](homes, policy)
    log = _AnswerLog(game, policy)
    values = []
    for value in game.run(num_steps):
        values.append(value)
        on_step()
    return TaskScores(values=np.stack(values, axis=1), **log.finish())


class _AnswerLog:
    """Keeps what `TaskScores` says about answers; looks that go on a search are left out."""

    def __init__(self, game: Task, policy: Policy) -> None:
        """Listen to a task."""
        self._memory = game.rollout.memory
        self._kind = policy.score_kind
        self._columns: dict[str, list[np.ndarray]] = {
            name: []
            for name in ("is_correct", "has_candidate", "is_away", "confidence", "likelihood")
        }
        game.on_answer = self._add

    def finish(self) -> dict[str, np.ndarray]:
        """Return the columns, (H, A) each."""
        return {name: np.concatenate(parts, axis=1) for name, parts in self._columns.items()}

    def _add(self, answered: Answered) -> None:
        if answered.is_repeat:
            return
        probability = compute_probabilities(answered.scores, self._kind)
        row = {
            "is_correct": answered.is_correct,
            "has_candidate": (np.isfinite(answered.scores) & answered.answers).any(axis=1),
            "is_away": compute_away(self._memory, answered.queries, answered.answers),
            "confidence": probability[np.arange(len(answered.choice)), answered.choice],
            "likelihood": (probability * answered.answers).sum(axis=1),
        }
        for name, values in row.items():
            self._columns[name].append(values.reshape(self._memory.num_homes, -1))
