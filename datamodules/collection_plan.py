"""What a data module collects: which homes, and which policies play which tasks in them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import product
from typing import Any

from sgm.messages import shorten
from simulator.collect.settings import CollectConfig
from simulator.home_options import HomeOptions, MakeSource
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task
from simulator.world.source import HomeSource


class CollectionPlan:
    """The collections of training and validation homes.

    Attributes:
        train: first of the collections to train on.
        also: the others: every policy plays every task in all homes, each in its own.
        val: the collection to validate on.
    """

    def __init__(
        self,
        extras: Collection[str] = (),
        also_homes: list[MakeSource] | None = None,
        val_homes: MakeSource | None = None,
        val_trace: list[str] | None = None,
        num_homes: int = 100,
        steps: int = 100,
        num_val_homes: int = 20,
        policy: str = "bayesian",
        task: str = "predict_location",
        also_policies: list[str] | None = None,
        also_tasks: list[str] | None = None,
        asked: QuestionShares | None = None,
        relevance: bool = False,
        seed: int = 0,
        **of_homes: Any,
    ) -> None:
        """Plan the collections.

        Args:
            extras: what they keep beside the memory, of `simulator.collect.settings.EXTRAS`.
            also_homes: further sources, with the same words as `homes`; `num_homes` homes of each
                are trained on, too, in all tasks.
            val_homes: the same for validation; None for other homes of the same source.
            val_trace: recorded homes for validation; others than `trace`, and with it.
            num_homes: training homes; of recorded ones, all.
            steps: time steps per home, of recorded ones, all; `predict_location` takes one snapshot
                a step, `relative_likelihood` five, `find_object` one per look.
            num_val_homes: validation homes; of recorded ones, all.
            policy: the policy that collects.
            task: the task it plays.
            also_policies: further policies that collect, each in as many other homes; of a trained
                network, `nep.players.policy:NEPPolicy=FILE`.
            also_tasks: further tasks, played in as many other homes, whose snapshots are trained
                on, too.
            asked: shares of the kinds of questions, of the tasks that take them
                (`simulator.tasks.ask_anything:AskAnything`); None for those of the task.
            relevance: learn the relevance of each place instead of where the object is, for a task
                that knows it (`relative_likelihood`); the other tasks stay what they are.
            seed: of homes and collection, and of the shuffling.
            of_homes: where training homes come from: options of `HomeOptions`.

        Raises:
            ValueError: if a count or a name is out of range, or a trace is broken; if recorded
                homes are there for training or for validation alone, or the same ones for both; if
                no task takes shares of questions.
        """
        options = HomeOptions(**of_homes)
        if (options.trace is None) != (val_trace is None):
            named = None if options.trace is None else list(options.trace)
            raise ValueError(
                "trace and val_trace must come together, and step_seconds and by_day with them,"
                f" got trace {named} and val_trace {val_trace}. Name folders for both."
            )
        source = val_source = options.make()
        if val_trace is not None or val_homes is not None:
            trace = None if val_trace is None else tuple(val_trace)
            val_source = replace(options, homes=val_homes or options.homes, trace=trace).make()
        more = [replace(options, homes=make, trace=None).make() for make in also_homes or []]
        source.check_disjoint(val_source)
        kept: dict[str, Any] = {"relevance": relevance, **dict.fromkeys(extras, True)}
        first = CollectConfig(
            homes=source,
            num_homes=source.num_homes or num_homes,
            steps=source.num_steps or steps,
            policy=policy,
            task=task,
            seed=seed,
            **kept,
        )
        policies, tasks = [policy, *(also_policies or [])], [task, *(also_tasks or [])]
        if asked is not None and not any(_takes_shares(name) for name in tasks):
            raise ValueError(
                f"asked must come with a task that takes shares of questions, got {shorten(tasks)}."
                " Take simulator.tasks.ask_anything:AskAnything."
            )
        self.train, *self.also = _list_games(first, [source, *more], policies, tasks, asked)
        self.val = replace(
            self.train,
            homes=val_source,
            split="val",
            num_homes=val_source.num_homes or num_val_homes,
            steps=val_source.num_steps or steps,
        )


def _takes_shares(task: str) -> bool:
    return find_task(task).shares is not None


def _list_games(
    first: CollectConfig,
    sources: list[HomeSource],
    policies: list[str],
    tasks: list[str],
    asked: QuestionShares | None,
) -> Iterator[CollectConfig]:
    for homes in sources:
        for number, (policy, task) in enumerate(product(policies, tasks)):
            yield replace(
                first,
                homes=homes,
                policy=policy,
                task=task,
                asked=asked if _takes_shares(task) else None,
                seed=first.seed + number,
            )
