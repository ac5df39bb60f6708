"""Plays every kind of home with every player, and keeps what was scored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType

import numpy as np

from nep.kinds.kinds import Kind
from nep.kinds.played import Played
from nep.players.contestants import Checkpoint, MakePolicy, list_contestants
from nep.report.code_version import describe_code
from simulator.policies.registry import list_policies
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS, compute_accuracy_among, compute_nll
from simulator.tasks.scores import TaskScores
from simulator.world.streams import Streams

# What is kept of every home, so that players can be compared home by home.
HOME_COLUMNS = ("accuracy", "nll", "looks")
SHARED_COLUMNS = ("calibration_error", "away_accuracy", "out_of_place_accuracy")

Scores = dict[str, dict[str, dict[str, list[float]]]]  # by kind, player and column


def list_players(kind: Kind, checkpoints: Sequence[Checkpoint]) -> dict[str, MakePolicy]:
    """Return what makes each policy that can play in homes of a kind, and each network."""
    names = [set(list_policies(source)) for source in kind.sources]
    common = [name for name in list_policies(kind.sources[0]) if all(name in own for own in names)]
    return list_contestants("predict_location", common, checkpoints)


def play_kind(kind: Kind, make: MakePolicy) -> dict[str, list[float]]:
    """Let one player answer and search in all homes of a kind.

    Returns:
        `HOME_COLUMNS`, a number per home each, and `SHARED_COLUMNS`, one number each; without
        "looks" where nobody searches. Where all homes have a clock, "by_hour", too: the share of
        right first guesses in each hour of the day, nan where nothing was asked.
    """
    located = _play(kind, make, "predict_location", kind.num_steps)
    columns = {
        "accuracy": located.is_correct.mean(axis=1).tolist(),
        "nll": [compute_nll(row) for row in located.likelihood],
        **{name: [METRICS[name].compute(located)] for name in SHARED_COLUMNS},
    }
    if kind.num_searches:
        searched = _play(kind, make, "find_object", kind.num_searches)
        columns["looks"] = searched.home_values.tolist()
    if (located.hour >= 0).all():
        columns["by_hour"] = [
            compute_accuracy_among(located.is_correct, located.hour == hour) for hour in range(24)
        ]
    return columns


def play_all(
    kinds: Mapping[str, Kind],
    checkpoints: Sequence[Checkpoint],
    path: Path,
    others: Mapping[str, MakePolicy] = MappingProxyType({}),
    checksums: Mapping[str, str] = MappingProxyType({}),
) -> Played:
    """Let everybody play what has not been played yet, and say who is done.

    Args:
        kinds: by name.
        checkpoints: networks, beside all policies that can play in a kind.
        path: file of scores, written after every player.
        others: what makes further players, by name.
        checksums: of those among them that are networks.

    Returns:
        All that has been played, of these kinds and of others.

    Raises:
        ValueError: if the file is damaged, or has scores of other games.
    """
    games = {name: kind.describe() for name, kind in kinds.items()}
    networks = {point.name: point.compute_checksum() for point in checkpoints}
    played = Played.load(path, games, {**networks, **checksums})
    scores: Scores = played.scores
    for name, kind in kinds.items():
        played.about[name] = {
            "title": kind.title,
            "is_recorded": kind.is_recorded,
            "units": kind.list_units(),
        }
        for player, make in {**list_players(kind, checkpoints), **others}.items():
            if player not in scores[name]:
                scores[name][player] = play_kind(kind, make)
                played.made[name] = describe_code()
                played.save()
            print(f"{name}: {player}")
    played.save()
    return played


def _play(kind: Kind, make: MakePolicy, task: str, num_steps: int) -> TaskScores:
    """Play a task in all homes of all sources with all seeds, one after the other."""
    parts = []
    for source in kind.sources:
        num_homes = source.num_homes or kind.num_homes
        for seed in kind.seeds:
            streams = Streams(seed, "test", range(num_homes))
            scores = evaluate_policy(make, source, streams, num_steps, task=task)
            parts.append(scores.skip(kind.num_warm_up))
    sizes = np.cumsum([0, *(len(part.values) for part in parts)])
    homes = [list(range(first, end)) for first, end in pairwise(sizes.tolist())]
    return TaskScores.join(homes, parts)
