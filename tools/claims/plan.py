"""What is trained and played to settle what the paper claims: `python -m tools.claims`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from nep.bench.paper.experiments import SETTINGS, Contestant, Setting
from nep.bench.paper.readings import ReadingScores
from nep.bench.paper.stages import Job
from nep.bench.paper.stored_scores import Evaluation
from nep.bench.paper.training import Training, collect_data
from nep.report.results import ScoreSummary, pack_summary
from sgm.files import read_json
from simulator.policies import POLICIES
from simulator.policies.informed import Informed
from simulator.tasks.evaluation import evaluate_policy
from simulator.tasks.scores import TaskScores
from simulator.world.homes import Homes
from simulator.world.streams import Streams

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
    "sum": (
        "sums instead of averages of neighbours",
        {"gcn": ("gcn_sum",), "heat": ("heat_sum",)},
    ),
    "two_heads": (
        "two heads, the input added to the output",
        {"heat": ("heat_two_heads",)},
    ),
    "two_convolutions": (
        "two convolutions, not one",
        {name: (name, "two_convolutions") for name in ("gcn", "heat")},
    ),
    "alike": (
        "edges between furniture of one label and room",
        {name: (name, "alike") for name in ("gcn", "heat")},
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
class ClaimsPlan:
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

    def list_trainings(self) -> list[Training]:
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
        first = [row for row in orders if row.contestant.setting == LOCATION["on"]]
        return [*first, *switches, *rates, *(row for row in orders if row not in first)]

    def is_in_table_1(self, source: str, seed: int) -> bool:
        """Tell whether Table 1 has the networks of this seed."""
        return self.table_1 is not None and (source, seed) == ("sampled", 0)

    def list_in_table_1(self, source: str) -> set[str]:
        """Return the policies whose scores Table 1 has, but for the one that is compared."""
        if self.table_1 is None or source != "sampled":
            return set()
        return {*read_json(self.table_1)["settings"][LOCATION["on"].name]} - {CHECKED}

    def evaluate(self, training: Training) -> Evaluation:
        """Return the evaluation of a network in test homes like those of its training."""
        setting, name = training.contestant.setting, training.contestant.name
        path = training.runs / setting.name / "scores" / f"{name}.json"
        return self._evaluate(setting, name, path, training.source, training.checkpoint)

    def play(
        self, source: str, setting: Setting, policy: str, cross_room_moves: bool = False
    ) -> Evaluation:
        """Return the evaluation of a policy."""
        folder = self.runs / (f"{source}-cross_room" if cross_room_moves else source)
        path = folder / setting.name / "scores" / f"{policy}.json"
        evaluation = self._evaluate(setting, policy, path, source, None)
        return replace(evaluation, cross_room_moves=cross_room_moves)

    def play_informed(self, source: str, setting: Setting) -> InformedScores:
        """Return the evaluation of `Informed`."""
        own = self.play(source, setting, INFORMED)
        return InformedScores(**{field.name: getattr(own, field.name) for field in fields(own)})

    def read(self, source: str, nodes: str, policy: str) -> ReadingScores:
        """Return a policy's rankings under every reading of the likelihood metric."""
        path = self.runs / source / LIKELIHOOD[nodes].name / "readings" / f"{policy}.json"
        return ReadingScores(self._evaluate(LIKELIHOOD[nodes], policy, path, source, None))

    def read_network(self, training: Training) -> ReadingScores:
        """Return the same of a network that was trained for Predict Object Location."""
        nodes, name = training.contestant.setting.nodes, training.contestant.name
        path = training.runs / LIKELIHOOD[nodes].name / "readings" / f"{name}.json"
        own = self._evaluate(LIKELIHOOD[nodes], name, path, training.source, training.checkpoint)
        return ReadingScores(own)

    def _evaluate(
        self, setting: Setting, name: str, path: Path, source: str, checkpoint: Path | None
    ) -> Evaluation:
        return Evaluation(
            setting, name, checkpoint, self.num_homes, self.steps, 0, path, source=source
        )

    def load_table_1(self, setting: Setting) -> dict[str, ScoreSummary]:
        """Return what all have scored in Table 1, by title; nothing without the file.

        Raises:
            ValueError: if Table 1 was not played in these test homes.
        """
        if self.table_1 is None:
            return {}
        settings = read_json(self.table_1)["settings"]
        for nodes in LOCATION.values():  # other tasks are played in the same homes
            own = self.play("sampled", nodes, CHECKED).load().home_values
            theirs = np.array(settings[nodes.name][CHECKED]["mean_of_each_home"])
            if len(own) != len(theirs) or not np.allclose(own, theirs):
                raise ValueError(
                    f"table_1 must be of the same test homes, got one in which {CHECKED} has other "
                    f"scores in {self.table_1}. Leave it out."
                )
        return {
            title: ScoreSummary(np.array(row["mean_of_each_home"])[:, None], {})
            for title, row in settings[setting.name].items()
        }


@dataclass(frozen=True)
class InformedScores(Evaluation):
    """What `Informed` scores, some homes at a time, and the effective sample size of its draws."""

    def play(self) -> dict[str, Any]:
        """Return the summary, and quantiles 0, .1, ... 1 of the effective sample sizes."""
        sizes, parts = [], []
        groups = [
            range(first, min(first + _HOMES_AT_ONCE, self.num_homes))
            for first in range(0, self.num_homes, _HOMES_AT_ONCE)
        ]
        for homes in groups:
            policies: list[Informed] = []

            def make(homes: Homes, made: list[Informed] = policies) -> Informed:
                made.append(Informed.make(homes))
                return made[-1]

            streams = Streams(self.seed, "test", homes)
            parts.append(evaluate_policy(make, self.make_source(), streams, self.steps))
            sizes += policies[0].effective_sizes
        summary = pack_summary(ScoreSummary.of(TaskScores.join(groups, parts)))
        return {**summary, "sizes": np.quantile(sizes, np.linspace(0, 1, 11)).round(1).tolist()}


def plan_claims(plan: ClaimsPlan, trains: bool) -> tuple[list[Job], list[Job], list[Job]]:
    """List what is not done yet: collections, then trainings, then all that is played.

    Args:
        plan: what is wanted.
        trains: whether networks are trained; if not, those that are there play.
    """
    collections: list[Job] = []
    trainings: list[Job] = []
    games: list[Job] = []

    def add(
        jobs: list[Job], name: str, run: Callable[[], object], after: Sequence[str] = ()
    ) -> None:
        log = plan.runs / "logs" / f"{name.replace(' ', '-').replace('/', '-')}.log"
        jobs.append(Job(name, run, log, tuple(after)))

    for training in plan.list_trainings():
        name = f"{training.source} {training.contestant.key}-seed_{training.seed}"
        is_done = training.is_done()
        if not is_done and not trains:
            continue
        after = []
        if not is_done:
            add(collections, f"collect {name}", partial(collect_data, [training]))
            add(trainings, f"train {name}", training.run, [f"collect {name}"])
            after = [f"train {name}"]
        played: list[Evaluation | ReadingScores] = [plan.evaluate(training)]
        if training.contestant.name in ORDER and training.seed == plan.switch_seed:
            played.append(plan.read_network(training))
        for own in played:
            if after or not own.is_done():
                add(games, f"play {name} {own.path.parent.name}", own.run, after)
    for nodes, setting in LOCATION.items():
        for source in SOURCES:
            known = plan.list_in_table_1(source)
            for policy in POLICIES:
                own = plan.play(source, setting, policy)
                if policy not in known and not own.is_done():
                    add(games, f"play {source} {setting.name} {policy}", own.run)
            for policy in (*PAPER_POLICIES, "ceiling"):
                reading = plan.read(source, nodes, policy)
                if not reading.is_done():
                    add(games, f"read {source} {nodes} {policy}", reading.run)
        for source in SOURCES:
            informed = plan.play_informed(source, setting)
            if not informed.is_done():
                add(games, f"play {source} {setting.name} {INFORMED}", informed.run)
    for setting in SETTINGS:
        for policy in PAPER_POLICIES:
            for crosses in (True, False):
                own = plan.play("sampled", setting, policy, crosses)
                is_known = not crosses and (
                    setting in LOCATION.values() or policy in plan.list_in_table_1("sampled")
                )
                if not is_known and not own.is_done():
                    where = " over rooms" if crosses else ""
                    add(games, f"play {setting.name} {policy}{where}", own.run)
    return collections, trainings, games
