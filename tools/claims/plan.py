"""What is trained and played to settle what the paper claims: `python -m nep.bench claims`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nep.bench.paper.experiments import SETTINGS, Contestant, Setting
from nep.bench.paper.paper_game import PaperGame
from nep.bench.paper.training import TrainedPlan, Training
from nep.bench.score_cache import ScoreCache
from nep.players.contestants import Checkpoint, MakePolicy, list_contestants
from nep.report.results import ScoreSummary, pack_summary, unpack_summary
from sgm.files import read_json
from sgm.policies.policy import Policy
from simulator.policies import POLICIES
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.scores import TaskScores
from simulator.world.homes import Homes
from simulator.world.streams import Streams
from tools.claims.informed import Informed
from tools.claims.readings import ReadingGame

LOCATION = {nodes: Setting("predict_location", nodes == "on") for nodes in ("on", "off")}
LIKELIHOOD = {nodes: Setting("relative_likelihood", nodes == "on") for nodes in ("on", "off")}
SOURCES = {"sampled": "32 places", "paper": "24 places (`--homes paper`)"}
# The networks whose order the paper claims, worst first.
ORDER = {"mlp": "NEP-MLP", "gcn": "NEP-GCN", "heat": "NEP-HEAT"}
# One change at a time: title, and by network which configs make it.
SWITCHES: Mapping[str, tuple[str, Mapping[str, tuple[str, ...]]]] = {
    "equal": (
        "as many parameters as NEP-HEAT",
        {"mlp": ("mlp_equal",), "gcn": ("gcn_equal",)},
    ),
    "no_absence": (
        "no negative evidence in the memory",
        {name: (name, "no_absence") for name in ORDER},
    ),
    "no_prior": ("no prior", {name: (name, "no_prior") for name in ORDER}),
    "homes_400": ("400 training homes, not 100", {name: (name, "homes_400") for name in ORDER}),
    "two_heads": (
        "two heads, the input added to the output",
        {"heat": ("heat_two_heads",)},
    ),
    "two_convolutions": (
        "two convolutions, not one",
        {name: (name, "two_convolutions") for name in ("gcn", "heat")},
    ),
}
# Learning rates, the paper's first, and which config makes it.
RATES: Mapping[str, tuple[str, ...]] = {
    "1e-4": (),
    "3e-4": ("rate_3e-4",),
    "1e-3": ("rate_1e-3",),
}
PAPER_POLICIES = ("random", "priors", "frequentist", "myopic", "bayesian", "oracle")
INFORMED = "informed"
CHECKED = "bayesian"  # plays although Table 1 has it, so that its test homes can be compared
_HOMES_AT_ONCE = 10  # informed keeps 40 MB of draws a home


@dataclass(frozen=True, slots=True)
class ClaimsPlan(TrainedPlan):
    """What is trained and played.

    Attributes:
        runs: folder of trainings and scores.
        data: folder of the collections.
        num_homes, steps: test homes, and steps in each.
        num_seeds: trainings of every network, of seeds 0, 1, ...
        switch_seed: that of the trainings with a change or another learning rate.
        epochs: of every training; what its config says if None.
        table_1: `table_1.json`, whose networks are the trainings of seed 0 in homes of 32 places;
            None to train them here.
    """

    runs: Path
    data: Path
    num_homes: int = 100
    steps: int = 100
    num_seeds: int = 3
    switch_seed: int = 1
    epochs: int | None = None
    table_1: Path | None = None

    def make_training(self, source: str, nodes: str, configs: Sequence[str], seed: int) -> Training:
        """Return a training for Predict Object Location."""
        files = tuple(f"{name}.yaml" for name in configs)
        contestant = Contestant(LOCATION[nodes], "-".join(configs), "", files)
        runs = self.runs / source / f"seed_{seed}"
        options = () if self.epochs is None else (f"--trainer.max_epochs={self.epochs}",)
        return Training(contestant, seed, options, runs, self.data, source)

    def list_all_trainings(self) -> list[Training]:
        """Return all trainings, the most important ones first."""
        orders = [
            self.make_training(source, nodes, (name,), seed)
            for nodes in LOCATION
            for source in SOURCES
            for seed in range(self.num_seeds)
            for name in ORDER
            if not self.is_in_table_1(source, seed)
        ]
        switches = [
            self.make_training("sampled", "on", configs, self.switch_seed)
            for _, by_network in SWITCHES.values()
            for configs in by_network.values()
        ]
        rates = [
            self.make_training("sampled", "on", (name, *configs), self.switch_seed)
            for configs in RATES.values()
            for name in ORDER
            if configs
        ]
        first = [training for training in orders if training.contestant.setting == LOCATION["on"]]
        return [
            *first,
            *switches,
            *rates,
            *(training for training in orders if training not in first),
        ]

    def is_in_table_1(self, source: str, seed: int) -> bool:
        """Tell whether Table 1 has the networks of this seed."""
        return self.table_1 is not None and (source, seed) == ("sampled", 0)

    def list_in_table_1(self, source: str) -> set[str]:
        """Return the policies whose scores Table 1 has, but for the one that is compared."""
        if self.table_1 is None or source != "sampled":
            return set()
        return {*read_json(self.table_1)["settings"][LOCATION["on"].name]} - {CHECKED}

    def make_game(self, source: str, setting: Setting, cross_room_moves: bool = False) -> PaperGame:
        """Return the test homes of a setting."""
        return PaperGame(setting, self.num_homes, self.steps, 0, source, cross_room_moves)

    def make_reading(self, source: str, nodes: str) -> ReadingGame:
        """Return those whose rankings are scored under every reading of the likelihood metric."""
        return ReadingGame(LIKELIHOOD[nodes], self.num_homes, self.steps, 0, source)

    def make_informed(self, source: str, nodes: str) -> InformedGame:
        """Return those that `Informed` plays."""
        return InformedGame(LOCATION[nodes], self.num_homes, self.steps, 0, source)

    def list_games(self) -> dict[str, PaperGame]:
        """Return all that is played, by name."""
        games: list[PaperGame] = []
        for source in SOURCES:
            for nodes, setting in LOCATION.items():
                games += [self.make_game(source, setting), self.make_reading(source, nodes)]
                games.append(self.make_informed(source, nodes))
        for setting in SETTINGS:
            games += [self.make_game("sampled", setting, crosses) for crosses in (False, True)]
        return {game.name: game for game in games}

    def list_players(
        self, game: PaperGame, trained: Mapping[str, Training]
    ) -> dict[str, MakePolicy]:
        """Return what makes each policy and each network that plays a game, by name."""
        if isinstance(game, InformedGame):
            return {INFORMED: Informed.make}
        is_read = isinstance(game, ReadingGame)
        known: set[str] = set()
        policies: Sequence[str] = PAPER_POLICIES
        if is_read:
            policies = (*PAPER_POLICIES, "ceiling")
        elif game.cross_room_moves:
            trained = {}
        else:
            known = self.list_in_table_1(game.source)
            policies = tuple(POLICIES) if game.setting in LOCATION.values() else PAPER_POLICIES
        networks = [
            Checkpoint(name, training.checkpoint)
            for name, training in trained.items()
            if training.source == game.source
            and training.contestant.setting == LOCATION[game.setting.nodes]
            and (
                training.contestant.name in ORDER and training.seed == self.switch_seed
                if is_read
                else game.setting in LOCATION.values()
            )
        ]
        names = [name for name in policies if name not in known]
        return list_contestants(game.setting.task, names, networks)

    def load_table_1(self, setting: Setting, cache: ScoreCache) -> dict[str, ScoreSummary]:
        """Return what all have scored in Table 1, by title; nothing without the file.

        Args:
            setting: of the table.
            cache: what has been played, to compare test homes.

        Raises:
            ValueError: if Table 1 was not played in these test homes.
        """
        if self.table_1 is None:
            return {}
        settings = read_json(self.table_1)["settings"]
        for nodes in LOCATION.values():  # other tasks are played in the same homes
            played = cache.scores[self.make_game("sampled", nodes).name]
            ours = unpack_summary(played[CHECKED]).home_values
            theirs = np.array(settings[nodes.name][CHECKED]["mean_of_each_home"])
            if len(ours) != len(theirs) or not np.allclose(ours, theirs):
                raise ValueError(
                    f"table_1 must be of the same test homes, got one in which {CHECKED} has other "
                    f"scores in {self.table_1}. Leave it out."
                )
        return {
            title: ScoreSummary(np.array(stored["mean_of_each_home"])[:, None], {})
            for title, stored in settings[setting.name].items()
        }


@dataclass(frozen=True)
class InformedGame(PaperGame):
    """What `Informed` plays, some homes at a time, with the effective sizes of its samples."""

    @property
    def name(self) -> str:
        """Name among kept scores."""
        return f"{INFORMED} in {super().name}"

    def play(self, players: Mapping[str, MakePolicy]) -> dict[str, Any]:
        """Return summaries, and quantiles 0, .1, ... 1 of the effective sample sizes."""
        return {name: self._play(make) for name, make in players.items()}

    def _play(self, make: MakePolicy) -> dict[str, Any]:
        sizes, parts = [], []
        groups = [
            range(first, min(first + _HOMES_AT_ONCE, self.num_homes))
            for first in range(0, self.num_homes, _HOMES_AT_ONCE)
        ]
        for homes in groups:
            policies: list[Informed] = []

            def keep(homes: Homes, made: list[Informed] = policies) -> Policy:
                policy = make(homes)
                assert isinstance(policy, Informed)
                made.append(policy)
                return policy

            streams = Streams(self.seed, "test", homes)
            parts.append(evaluate_policy(keep, self.make_source(), streams, self.steps))
            sizes += policies[0].effective_sizes
        summary = pack_summary(ScoreSummary.of(TaskScores.join(groups, parts)))
        return {**summary, "sizes": np.quantile(sizes, np.linspace(0, 1, 11)).round(1).tolist()}
