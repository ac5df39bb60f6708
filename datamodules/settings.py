"""Settings of the data module, with their defaults and checks."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field, replace
from itertools import product
from typing import Any

from datamodules.features import FeatureConfig, list_recorded
from sgm.checks import check_at_least
from sgm.messages import shorten
from simulator.collect.settings import CollectConfig
from simulator.home_options import HomeOptions, MakeSource
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task
from simulator.world.config import HomeConfig
from simulator.world.source import HomeSource, SampledSource


@dataclass(frozen=True)
class HomesConfig:
    """Which homes are trained and validated in; `SGMDataModule` says what each is."""

    homes: MakeSource = SampledSource
    also_homes: list[MakeSource] | None = None
    val_homes: MakeSource | None = None
    home: HomeConfig = field(default_factory=HomeConfig)
    prior: str | None = None
    trace: list[str] | None = None
    val_trace: list[str] | None = None
    step_seconds: float | None = None
    by_day: bool = False
    replays: int = 1

    def __post_init__(self) -> None:
        """Raise ValueError if recorded homes are there for training or for validation alone."""
        if (self.trace is None) != (self.val_trace is None):
            raise ValueError(
                "trace and val_trace must come together, and step_seconds and by_day with them,"
                f" got trace {self.trace} and val_trace {self.val_trace}. Name folders for both."
            )

    def make(self) -> tuple[HomeSource, HomeSource, list[HomeSource]]:
        """Make the sources of training and validation homes, and those that are trained on, too.

        Raises:
            ValueError: if a file cannot be read or is malformed, an option is out of range, or the
                same recorded homes are to train on and to validate on.
        """
        trace = None if self.trace is None else tuple(self.trace)
        options = HomeOptions(
            self.homes, self.home, self.prior, trace, self.step_seconds, self.by_day, self.replays
        )
        source = val_source = options.make()
        if self.val_trace is not None or self.val_homes is not None:
            val_source = replace(
                options,
                homes=self.val_homes or self.homes,
                trace=None if self.val_trace is None else tuple(self.val_trace),
            ).make()
        also = [replace(options, homes=make, trace=None).make() for make in self.also_homes or ()]
        source.check_disjoint(val_source)
        return source, val_source, also


@dataclass(frozen=True)
class CollectionConfig:
    """How memories are collected in these homes; `SGMDataModule` says what each is."""

    data_dir: str = "data"
    num_homes: int = 100
    steps: int = 100
    num_val_homes: int = 20
    policy: str = "bayesian"
    task: str = "predict_location"
    also_policies: list[str] | None = None
    also_tasks: list[str] | None = None
    asked: QuestionShares | None = None
    relevance: bool = False
    seed: int = 0
    workers: int | None = None

    def make(
        self, homes: HomesConfig, features: FeatureConfig
    ) -> tuple[CollectConfig, CollectConfig, list[CollectConfig]]:
        """Say what to collect to train on, to validate on, and to train on, too.

        Raises:
            ValueError: if a count or a name is out of range, or as `HomesConfig.make`.
        """
        source, val_source, also = homes.make()
        tasks = (self.task, *(self.also_tasks or ()))
        if self.asked is not None and all(find_task(task).shares is None for task in tasks):
            raise ValueError(
                f"asked must come with a task that takes shares of questions, got {shorten(tasks)}."
                " Take simulator.tasks.ask_anything:AskAnything."
            )
        recorded: dict[str, Any] = dict.fromkeys(list_recorded(features), True)
        train = CollectConfig(
            homes=source,
            num_homes=source.num_homes or self.num_homes,
            steps=source.num_steps or self.steps,
            policy=self.policy,
            task=self.task,
            asked=self._choose_shares(self.task),
            seed=self.seed,
            **{"relevance": self.relevance, **recorded},
        )
        val = replace(
            train,
            homes=val_source,
            split="val",
            num_homes=val_source.num_homes or self.num_val_homes,
            steps=val_source.num_steps or self.steps,
        )
        policies = (self.policy, *(self.also_policies or ()))
        played = list(enumerate(product(policies, tasks)))
        more = [
            replace(
                train,
                homes=where,
                policy=policy,
                task=task,
                asked=self._choose_shares(task),
                seed=self.seed + number,
            )
            for where in (source, *also)
            for number, (policy, task) in played
        ]
        return train, val, more[1:]  # the first is `train`

    def _choose_shares(self, task: str) -> QuestionShares | None:
        return None if find_task(task).shares is None else self.asked


@dataclass(frozen=True)
class LoadingConfig:
    """How memories are read; `SGMDataModule` says what each is."""

    batch_size: int = 100
    train_snapshots: int | None = None
    val_snapshots: int | None = None

    def __post_init__(self) -> None:
        """Check the numbers."""
        check_at_least(1, **asdict(self))
