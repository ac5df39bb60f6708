"""What has to be trained and played for the tables of the paper, as far as it is not done yet."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from nep.bench.paper.experiments import (
    ABLATION_SETTING,
    SETTINGS,
    Contestant,
    Model,
    Setting,
    enter,
    list_ablations,
    list_full_models,
)
from nep.bench.paper.paper_tables import Provenance
from nep.bench.paper.stages import Job
from nep.bench.paper.stored_scores import Evaluation
from nep.bench.paper.training import Training, collect_data, find_config
from nep.report.code_version import list_versions
from nep.report.results import ScoreSummary
from sgm.checks import check_at_least, check_seed
from sgm.files import compute_checksum
from sgm.messages import shorten
from simulator.policies import POLICIES

TABLES = ("1", "2", "figure")


@dataclass(frozen=True, slots=True)
class Plan:
    """What is trained and played.

    Attributes:
        tables: some of `TABLES`.
        models: networks of Table 1 and the figure.
        homes, steps: test homes, and steps in each.
        seed: of the first training and of the test homes.
        fit_options: further options of every training.
        runs: folder of trainings and scores.
        data: folder of the collections.
        options: those of the command line that change what comes out, but for the table.
        encoders: modules of encoders from outside the package.
        source: name of where homes come from, see `simulator.home_options.SOURCES`.
        num_trainings: of every network, of seeds that follow each other; all play the same homes.
        settings: columns of Table 1.
    """

    tables: tuple[str, ...]
    models: tuple[Model, ...]
    num_homes: int
    steps: int
    seed: int
    fit_options: tuple[str, ...]
    runs: Path
    data: Path
    options: tuple[str, ...]
    encoders: tuple[str, ...] = ()
    source: str = "sampled"
    num_trainings: int = 1
    settings: tuple[Setting, ...] = SETTINGS

    def check(self) -> None:
        """Check what no parser has checked.

        Raises:
            ValueError: if a count or the seed is out of range, or a config is no file.
        """
        check_at_least(1, num_homes=self.num_homes, steps=self.steps, seeds=self.num_trainings)
        check_seed(self.seed)
        for config in (model.config for model in self.models if model.config):
            if not find_config(config).is_file():
                raise ValueError(
                    f"config must be a file or a packaged config, got {shorten(config)}. Check the "
                    "path."
                )

    def describe(self, table: str) -> Provenance:
        """Return what to write under a table; folders and number of jobs change nothing in it."""
        options = ["--table", table, *self.options]
        return Provenance(
            shlex.join(["python", "-m", "nep.reproduce", *options]),
            self.num_homes,
            self.steps,
            self.seed,
            list_versions(),
            {model.title: Path(model.file).name for model in self.models},
            self.num_trainings,
            self.list_test_sets(),
            self.list_checkpoints(),
        )

    def list_test_sets(self) -> tuple[str, ...]:
        """Name the test homes, those that have a name."""
        played = [self.make_evaluation(setting, "random") for setting in SETTINGS]
        return tuple(dict.fromkeys(name for own in played if (name := own.name_homes())))

    def list_checkpoints(self) -> dict[str, str]:
        """Return the SHA-256 of every network, by setting, title and seed of the training."""
        return {
            f"{network.setting.name}, {network.title}, seed {training.seed}": compute_checksum(
                training.checkpoint
            )
            for network in self.list_networks()
            for training in self.list_trainings(network)
            if training.checkpoint.is_file()
        }

    def list_settings(self) -> tuple[Setting, ...]:
        """Return the settings in which all models and policies play."""
        if "1" in self.tables:
            return self.settings
        return (ABLATION_SETTING,) if "figure" in self.tables else ()

    def list_networks(self) -> list[Contestant]:
        """Return every network that must be trained, setting by setting."""
        networks = [
            enter(model, setting) for setting in self.list_settings() for model in self.models
        ]
        if "2" in self.tables:
            networks += [network for network in list_full_models() if network not in networks]
            networks += list_ablations()
        return networks

    def list_trainings(self, network: Contestant) -> list[Training]:
        """Return the trainings of a network; those after the first are in folders of their own."""
        seeds = range(self.seed, self.seed + self.num_trainings)
        return [
            Training(
                network,
                seed,
                self.fit_options,
                self.runs if seed == self.seed else self.runs / f"seed_{seed}",
                self.data,
                self.source,
            )
            for seed in seeds
        ]

    def make_evaluation(self, setting: Setting, policy: str) -> Evaluation:
        """Return the evaluation of a policy."""
        return self._evaluate(setting, policy, None, self.runs)

    def evaluate_training(self, training: Training) -> Evaluation:
        """Return the evaluation of a network that was trained."""
        own = training.contestant
        return self._evaluate(own.setting, own.name, training.checkpoint, training.runs)

    def load_scores(self, network: Contestant) -> ScoreSummary:
        """Return what the trainings of a network have scored; one alone as it is."""
        trainings = self.list_trainings(network)
        scores = [self.evaluate_training(training).load() for training in trainings]
        return scores[0] if len(scores) == 1 else ScoreSummary.join(scores)

    def _evaluate(
        self, setting: Setting, name: str, checkpoint: Path | None, runs: Path
    ) -> Evaluation:
        path = runs / setting.name / "scores" / f"{name}.json"
        return Evaluation(
            setting, name, checkpoint, self.num_homes, self.steps, self.seed, path, self.encoders,
            self.source,
        )  # fmt: skip

    def make_job(
        self,
        what: str,
        key: str,
        run: Callable[..., object],
        *arguments: Any,
        after: Sequence[Job] = (),
    ) -> Job:
        """Return a job with a log of its own, to be done after others."""
        log = self.runs / "logs" / f"{what}-{key.replace('/', '-')}.log"
        return Job(f"{what} {key}", partial(run, *arguments), log, tuple(job.name for job in after))


def plan_stages(plan: Plan) -> tuple[list[Job], list[Job], list[Job]]:
    """List what is not done yet: collections, then trainings, then evaluations."""
    collections, trainings, evaluations = [], [], []
    networks = plan.list_networks()
    for setting in SETTINGS:
        own = [
            training
            for network in networks
            if network.setting == setting
            for training in plan.list_trainings(network)
        ]
        missing = [training for training in own if not training.is_done()]
        if missing:
            collections.append(plan.make_job("collect", setting.name, collect_data, missing))
        for training in missing:
            trainings.append(
                plan.make_job("train", _name(plan, training), training.run, after=collections[-1:])
            )
    trained = {job.name: job for job in trainings}
    for training in (row for network in networks for row in plan.list_trainings(network)):
        key = _name(plan, training)
        after = [trained[name] for name in (f"train {key}",) if name in trained]
        evaluation = plan.evaluate_training(training)
        if after or not evaluation.is_done():
            evaluations.append(plan.make_job("evaluate", key, evaluation.run, after=after))
    for setting in plan.list_settings():
        for policy in POLICIES:
            evaluation = plan.make_evaluation(setting, policy)
            if not evaluation.is_done():
                key = f"{setting.name}/{policy}"
                evaluations.append(plan.make_job("evaluate", key, evaluation.run))
    return collections, trainings, evaluations


def _name(plan: Plan, training: Training) -> str:
    """Return the name of a training in those of its jobs."""
    key = training.contestant.key
    return key if training.seed == plan.seed else f"{key}-seed_{training.seed}"
