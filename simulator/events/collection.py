"""Collects the events of many homes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from simulator.events.recorder import EventRecorder
from simulator.events.table import EventTable
from simulator.fan_out import check_workers, fan_out
from simulator.policies import make_policy
from simulator.tasks.registry import find_task
from simulator.world.source import HomeSource
from simulator.world.streams import Streams


def collect_events(
    source: HomeSource,
    streams: Streams,
    num_steps: int,
    *,
    policy: str = "bayesian",
    task: str = "predict_location",
    workers: int = 1,
    backend: str = "processes",
    on_homes: Callable[[int], None] = lambda count: None,
) -> EventTable:
    """Let a policy play a task in homes, and return what its looks have shown.

    The same arguments give the same table, for any number of workers.

    Args:
        source: where the homes come from.
        streams: names the homes.
        num_steps: time steps of each, or searches of Find Object.
        policy: who answers, and chooses looks where the rules of the homes leave that to it.
        task: name of the task.
        workers: processes that share the homes out.
        backend: where they work, see `fan_out`.
        on_homes: called with the number of homes that are done since the last call.

    Raises:
        ValueError: if there is no such policy, task or backend, or not so many homes or steps.
    """
    check_workers(workers, backend)
    source.check_steps(num_steps)
    jobs = []
    for group in source.list_groups(streams.homes):
        parts = np.array_split(np.array(group.homes), min(workers, len(group.homes)))
        jobs += [(source, streams.select(part.tolist()), num_steps, policy, task) for part in parts]
    tables = []
    for _, table in fan_out(_play, jobs, workers, backend):
        tables.append(table)
        on_homes(len(table.homes))
    return EventTable.join(tables)


def _play(
    source: HomeSource, streams: Streams, num_steps: int, policy: str, task: str
) -> EventTable:
    homes = source.make(streams)
    game = find_task(task)(homes, make_policy(policy, homes))
    recorder = EventRecorder(game, streams.homes)
    for _ in game.run(num_steps):
        pass
    return recorder.finish()
