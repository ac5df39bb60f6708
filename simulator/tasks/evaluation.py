"""Play a task with a policy and keep every score."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from sgm.policies.policy import Policy
from simulator.fan_out import check_workers, fan_out
from simulator.tasks.registry import check_task, find_task
from simulator.tasks.scores import AnswerLog, TaskScores
from simulator.world.homes import Homes
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


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
    """Play games, each a maker of a policy and a task's name, in the same homes.

    The scores are equal for any number of workers if the policy answers every home alone, as all
    that come with the package do. Arguments and errors are those of `evaluate_policy`; but
    `on_step` is given the number of the game, at the end of the game where workers play. One
    worker is this process.

    Returns:
        The scores of each game, in the order of the numbers of the homes.
    """
    for _, task in games:
        check_task(task)
    check_workers(workers, backend)
    source.check_steps(num_steps)
    groups = [group.homes for group in source.list_groups(streams.homes)]
    if workers == 1:
        return [
            TaskScores.join(
                groups,
                [
                    play_task(
                        make,
                        source.make(streams.select(group)),
                        num_steps,
                        partial(on_step, number),
                        task,
                    )
                    for group in groups
                ],
            )
            for number, (make, task) in enumerate(games)
        ]
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
        TaskScores.join(homes, [found[first + part] for part in range(len(homes))])
        for first in range(0, len(jobs), len(homes))
    ]


def _play_part(
    make: Callable[[Homes], Policy], source: HomeSource, streams: Streams, num_steps: int, task: str
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
    own_class = find_task(task)
    policy = make(homes)
    game = own_class(homes, policy)
    log = AnswerLog(game, policy)
    values = []
    for value in game.run(num_steps):
        values.append(value)
        on_step()
    return TaskScores(values=np.stack(values, axis=1), **log.finish())
