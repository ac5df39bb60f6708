"""What `python -m nep.bench claims` has trained and played so far, and what it has not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from nep.bench.paper.experiments import SETTINGS, Setting
from nep.bench.paper.paper_game import PaperGame
from nep.report.results import ScoreSummary, unpack_summary
from tools.claims.plan import LOCATION, ORDER, PAPER_POLICIES, SOURCES, ClaimsPlan


class ClaimsScores:
    """Scores as far as they are there.

    Attributes:
        plan: what is wanted.
        cache: what has been played.
        table_1: scores by title in every setting, from Table 1 if that is given.
        missing: what was asked for and is not there, for a list of what was not run.
    """

    def __init__(self, plan: ClaimsPlan) -> None:
        """Read them, and Table 1."""
        self.plan, self.cache = plan, plan.load_cache()
        self.table_1 = {setting: plan.load_table_1(setting, self.cache) for setting in SETTINGS}
        self.missing: list[str] = []

    def load_trainings(
        self, source: str, nodes: str, configs: Sequence[str], seeds: Sequence[int]
    ) -> dict[int, ScoreSummary]:
        """Return the scores of trainings by seed."""
        found = {}
        for seed in seeds:
            name = "-".join(configs)
            if self.plan.is_in_table_1(source, seed) and name in ORDER:
                found[seed] = self.table_1[LOCATION[nodes]][ORDER[name]]
                continue
            training = self.plan.make_training(source, nodes, configs, seed)
            player = self.plan.name_training(training)
            played = self.find(self.plan.make_game(source, LOCATION[nodes]), player)
            if played is not None:  # of Table 1, too, the means of homes are all there is
                found[seed] = ScoreSummary(unpack_summary(played).home_values[:, None], {})
            else:
                line = f"{name}, {SOURCES[source]}, dynamic nodes {nodes}, seed {seed}"
                self.missing.append(line)
        return found

    def load_changed(
        self, by_network: Mapping[str, Sequence[str]]
    ) -> dict[str, ScoreSummary | None]:
        """Return the scores of one training of each network, of the seed of changes.

        Args:
            by_network: configs of each network; None is returned for one that has not played.
        """
        seed = self.plan.switch_seed
        return {
            name: self.load_trainings("sampled", "on", configs, [seed]).get(seed)
            for name, configs in by_network.items()
        }

    def load(
        self, source: str, setting: Setting, name: str, crosses: bool = False
    ) -> ScoreSummary | None:
        """Return what a policy has scored; None if it has not played."""
        if source == "sampled" and not crosses and name in self.table_1[setting]:
            return self.table_1[setting][name]
        played = self.find(self.plan.make_game(source, setting, crosses), name)
        if played is not None:
            return unpack_summary(played)
        where = ", moves over the whole home" if crosses else ""
        self.missing.append(f"{name}, {SOURCES[source]}, {setting.title}{where}")
        return None

    def load_readings(self, source: str, nodes: str) -> dict[str, dict[str, float]]:
        """Return the mean under every reading of the likelihood metric, by contestant."""
        plan = self.plan
        game = plan.make_reading(source, nodes)
        players = {name: name for name in (*PAPER_POLICIES, "ceiling")}
        for name, title in ORDER.items():
            training = plan.make_training(source, nodes, (name,), plan.switch_seed)
            players[title] = plan.name_training(training)
        found = {}
        for name, player in players.items():
            played = self.find(game, player)
            if played is not None:
                found[name] = {key: float(np.mean(values)) for key, values in played.items()}
            else:
                self.missing.append(f"{name}, readings, {SOURCES[source]}, dynamic nodes {nodes}")
        return found

    def find(self, game: PaperGame, player: str) -> Any:
        """Return what a player has scored, as it is kept; None if it has not played."""
        return self.cache.scores.get(game.name, {}).get(player)


def list_homes(scores: ScoreSummary) -> list[float]:
    """Return the score in each home for a file."""
    values: list[float] = scores.home_values.round(4).tolist()
    return values


def round_all(values: Mapping[str, float]) -> dict[str, Any]:
    """Round for a file."""
    return {name: round(value, 4) for name, value in values.items()}
