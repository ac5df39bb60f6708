"""Homes in which policies and networks play the tasks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np

from nep.games.game import Game
from nep.players.contestants import Checkpoint, MakePolicy, list_contestants
from simulator.policies.registry import list_policies
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.metrics import METRICS, compute_accuracy_among
from simulator.tasks.scores import TaskScores
from simulator.world.source import HomeSource
from simulator.world.streams import Streams

# What is kept of every home, so that players can be compared home by home; "looks" are kept, too.
HOME_METRICS = ("accuracy", "nll")
SHARED_METRICS = ("calibration_error", "away_accuracy", "out_of_place_accuracy")

# By game, player and column.
GameScores = Mapping[str, Mapping[str, Mapping[str, Sequence[float]]]]


@dataclass(frozen=True)
class TaskGame(Game):
    """Homes of one kind, and for how long the tasks are played there.

    Attributes:
        title: of its table.
        sources: where its homes come from; all homes of each are played.
        num_homes: homes of a source that has as many as wanted.
        num_steps: time steps of Predict Object Location.
        num_searches: searches of Find Object; 0 for none.
        seeds: of homes, or of questions and misses in homes that are recorded.
        num_warm_up: of the steps and searches, the first ones, which are played but not scored.
    """

    title: str
    sources: tuple[HomeSource, ...]
    num_homes: int
    num_steps: int
    num_searches: int
    seeds: tuple[int, ...] = (0,)
    num_warm_up: int = 0

    scored_by: ClassVar[tuple[str, ...]] = (
        "tools.bench.task_game",
        "simulator.tasks.metrics",
        "simulator.tasks.scores",
    )

    @property
    def is_recorded(self) -> bool:
        """Whether its homes are households that are played from recordings."""
        return any(source.list_units([0]) is not None for source in self.sources)

    def describe(self) -> dict[str, Any]:
        """Return everything that scores depend on but the player, as JSON values."""
        numbers = (self.num_homes, self.num_steps, self.num_searches, self.num_warm_up)
        sources = [source.describe() for source in self.sources]
        return {"sources": sources, "seeds": list(self.seeds), "numbers": list(numbers)}

    def list_units(self) -> list[str]:
        """Name what each score of a player is of: a home that was drawn, or a household.

        A household that is played with several seeds, or several times, is one unit.
        """
        units: list[str] = []
        for number, source in enumerate(self.sources):
            homes = range(source.num_homes or self.num_homes)
            known = source.list_units(homes)
            for seed in self.seeds:
                drawn = [f"home {home} of source {number}, seed {seed}" for home in homes]
                units += drawn if known is None else known
        return units

    def tell(self) -> dict[str, Any]:
        """Return title and units, and whether the homes are recorded."""
        return {
            "title": self.title,
            "is_recorded": self.is_recorded,
            "units": self.list_units(),
        }

    def list_players(self, checkpoints: Sequence[Checkpoint]) -> dict[str, MakePolicy]:
        """Return what makes each policy that can play in these homes, and each network."""
        names = [set(list_policies(source)) for source in self.sources]
        common = [
            name
            for name in list_policies(self.sources[0])
            if all(name in playable for playable in names)
        ]
        return list_contestants("predict_location", common, checkpoints)

    def play(self, players: Mapping[str, MakePolicy]) -> dict[str, dict[str, list[float]]]:
        """Let players answer and search in all homes.

        Returns:
            By player: `HOME_METRICS` and "looks", a number per home each, and `SHARED_METRICS`, one
            number each; without "looks" where there is no search. Where all homes have a clock,
            "by_hour", too: the share of right first guesses in each hour of the day, nan where
            nothing was asked.
        """
        return {name: self._score(make) for name, make in players.items()}

    def _score(self, make: MakePolicy) -> dict[str, list[float]]:
        located = self.play_task(make, "predict_location", self.num_steps)
        columns = {name: METRICS[name].by_home(located).tolist() for name in HOME_METRICS}
        columns |= {name: [METRICS[name].compute(located)] for name in SHARED_METRICS}
        if self.num_searches:
            searched = self.play_task(make, "find_object", self.num_searches)
            columns["looks"] = searched.home_values.tolist()
        if (located.hour >= 0).all():
            columns["by_hour"] = [
                compute_accuracy_among(located.is_correct, located.hour == hour)
                for hour in range(24)
            ]
        return columns

    def play_task(self, make: MakePolicy, task: str, num_steps: int) -> TaskScores:
        """Play a task in all homes of all sources with all seeds, one after the other."""
        parts = []
        for source in self.sources:
            num_homes = source.num_homes or self.num_homes
            for seed in self.seeds:
                streams = Streams(seed, "test", range(num_homes))
                scores = evaluate_policy(make, source, streams, num_steps, task=task)
                parts.append(scores.skip(self.num_warm_up))
        sizes = np.cumsum([0, *(len(part.values) for part in parts)])
        homes = [list(range(first, end)) for first, end in pairwise(sizes.tolist())]
        return TaskScores.join(homes, parts)
