"""Homes that are lived in while their memories are recorded."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from sgm.evidence.adaptive_filter import TASKS_ASK_MOVED
from sgm.evidence.evidence_features import compute_features
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.queries import Change, Queries
from simulator.collect.settings import CollectConfig
from simulator.policies.filters import HomeFilter
from simulator.policies.registry import make_policy
from simulator.snapshots.recorder import Recorder
from simulator.snapshots.shards import get_shard_name, save_shard
from simulator.tasks.answer import Answer
from simulator.tasks.registry import find_task
from simulator.world.streams import Streams

_WRITERS = 8  # threads that wait for the disk while others write


def collect_homes(
    config: CollectConfig, homes: Sequence[int], out: Path, play_steps: int | None = None
) -> dict[str, str]:
    """Collect some homes in lockstep; write their shards and return the checksum of each.

    The homes are lived in for `play_steps`, None for `config.steps`: so many of them, evenly
    spread, are kept, and more of long lives (`HomeSource.kept_share`).
    """
    play_steps = config.steps if play_steps is None else play_steps
    num_kept = max(config.steps, round(config.homes.kept_share * play_steps))
    num_kept = min(num_kept, play_steps)
    kept = set(np.linspace(0, play_steps - 1, num_kept).round().astype(int).tolist())
    step = 0
    state = config.homes.make(Streams(config.seed, config.split, homes))
    task_class = find_task(config.task)
    policy = make_policy(config.policy, state).for_questions(task_class.asks_moved)
    task = task_class(state, policy)
    if config.asked is not None:
        task.shares = config.asked
    recorder = Recorder(task.rollout.memory)
    if config.evidence:
        task.rollout.memory.count_history()
    # A collecting filter believes already; another policy is watched by one.
    belief_filter = policy if isinstance(policy, HomeFilter) else HomeFilter.make(state)
    watches = config.belief and belief_filter is not policy
    if watches:
        belief_filter.reset(task.rollout.memory)

    def record(answer: Answer) -> None:
        if step not in kept:
            return
        extras = {}
        if config.belief:
            memory = task.rollout.memory
            extras["belief"] = belief_filter.compute_features(memory, answer.queries)
        if config.relevance and answer.relevance is not None:
            extras["relevance"] = answer.relevance
        question_extras = {}
        if config.evidence:
            asks_moved = answer.asks_moved
            if asks_moved is None:
                asks_moved = np.full(len(answer.choice), task.asks_moved > 0)
            place, question = _compute_evidence(task.rollout.memory, answer.queries, asks_moved)
            extras["evidence"] = place.astype(np.float16)
            question_extras["evidence"] = question
            question_extras["asks_moved"] = asks_moved[:, None].astype(np.float32)
        recorder.add_snapshot(answer.queries, answer.answers, extras, question_extras)

    def record_change(change: Change) -> None:
        recorder.add_change(change)
        if watches:
            belief_filter.observe(task.rollout.memory, change)

    task.on_answer = record
    task.rollout.on_change = record_change
    for _ in task.run(play_steps):
        step += 1  # the answers of this one were recorded
    names = [get_shard_name(home) for home in homes]
    with ThreadPoolExecutor(_WRITERS) as pool:
        paths = [out / name for name in names]
        return dict(zip(names, pool.map(save_shard, paths, recorder.finish()), strict=True))


def _compute_evidence(
    memory: MemoryBatch, queries: Queries, asks_moved: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the features of places and of questions, (Q, F, D) and (Q, C), by kind of question."""
    parts = []
    for of_task in np.unique(asks_moved):
        rows = np.flatnonzero(asks_moved == of_task)
        found = compute_features(memory, queries.take(rows), TASKS_ASK_MOVED * of_task)
        parts.append((rows, found.place, found.question))
    rows, place, question = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    order = np.argsort(rows)
    return place[order], question[order]
