"""Play a task with a policy and keep every score."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from simulator.fan_out import check_workers, fan_out
from simulator.policies import Policy
from simulator.priors.prior_graph import PriorGraph
from simulator.tasks.registry import TASKS, check_task
from simulator.tasks.scores import AnswerLog, TaskScores
from simulator.world.config import HomeConfig
from simulator.world.homes import Homes
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams


def evaluate_policy(
    make: Callable[[Homes], Policy],
    prior: PriorGraph,
    config: HomeConfig,
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
        prior: what homes look like.
        config: the rules.
        streams: names the homes to play in: equal ones give the same homes and queries, so that
            policies can be compared home by home. None of it is used up.
        num_steps: T.
        on_step: called after each step.
        task: name of the task.
        workers: how many play at a time, see `play_games`.
        backend: where they work, see `fan_out`.

    Raises:
        ValueError: if there is no task of that name, no worker or no such backend.
    """
    (scores,) = play_games(
        [(make, task)], partial(SampledHomes, prior, config), [streams.homes], streams.seed,
        streams.split, num_steps, lambda game: on_step(), workers, backend,
    )  # fmt: skip
    return scores


def play_games(
    games: Sequence[tuple[Callable[[Homes], Policy], str]],
    make_homes: Callable[[Streams], Homes],
    groups: Sequence[Sequence[int]],
    seed: int,
    split: str,
    num_steps: int,
    on_step: Callable[[int], None] = lambda game: None,
    workers: int = 1,
    backend: str = "processes",
) -> list[TaskScores]:
    """Play games in the same homes, sampled or recorded, that may be shared out to workers.

    The scores are equal for any number of workers if the policy answers every home alone, as all
    but networks do: those sum in an order that depends on the batch, and differ by rounding.

    Args:
        games: who plays what: a function that gets homes and returns the policy, and the name of
            the task. Only oracles keep the homes.
        make_homes: gets the streams of some homes and returns these homes at t = 0.
        groups: numbers of the homes; those of a group can be played in lockstep.
        seed: of the homes.
        split: "train", "val" or "test", likewise.
        num_steps: T.
        on_step: called with the number of the game after each step of each group, or as often at
            the end of the game where workers play.
        workers: how many play at a time; one plays in this process.
        backend: where they work, see `fan_out`.

    Returns:
        The scores of each game, in the order of the numbers of the homes.

    Raises:
        ValueError: if there is no task of that name, the homes were recorded for fewer steps, or
            there is no worker or no such backend.
    """
    for _, task in games:
        check_task(task)
    check_workers(workers, backend)
    if workers == 1:
        return [
            TaskScores.join(
                groups,
                [
                    play_task(
                        make, make_homes(Streams(seed, split, group)), num_steps,
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
        (make, make_homes, Streams(seed, split, part), num_steps, task)
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
        TaskScores.join(homes, [found[first + part] for part in range(len(homes))])
        for first in range(0, len(jobs), len(homes))
    ]


def _play_part(
    make: Callable[[Homes], Policy],
    make_homes: Callable[[Streams], Homes],
    streams: Streams,
    num_steps: int,
    task: str,
) -> TaskScores:
    return play_task(make, make_homes(streams), num_steps, task=task)


def play_task(
    make: Callable[[Homes], Policy],
    homes: Homes,
    num_steps: int,
    on_step: Callable[[], None] = lambda: None,
    task: str = "predict_location",
) -> TaskScores:
    """Let a policy play a task in homes at t = 0, sampled or recorded; see `evaluate_policy`.

    Raises:
        ValueError: if there is no task of that name, or the homes were recorded for fewer steps.
    """
    check_task(task)
    policy = make(homes)
    game = TASKS[task](homes, policy)
    log = AnswerLog(game, policy)
    values = []
    for value in game.run(num_steps):
        values.append(value)
        on_step()
    return TaskScores(values=np.stack(values, axis=1), **log.finish())
