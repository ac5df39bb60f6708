"""What a data module collects: which homes, and which policies play which tasks in them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from sgm.messages import shorten
from simulator.collect.settings import CollectConfig
from simulator.home_options import HomeOptions, MakeSource
from simulator.tasks.question_shares import QuestionShares
from simulator.tasks.registry import find_task
from simulator.world.source import HomeSource


def make_sources(
    options: HomeOptions,
    also_homes: Sequence[MakeSource],
    val_homes: MakeSource | None,
    val_trace: Sequence[str] | None,
) -> tuple[HomeSource, HomeSource, list[HomeSource]]:
    """Make the sources of training and validation homes, and those that are trained on, too.

    Raises:
        ValueError: if a file cannot be read or is malformed, recorded homes are there for training
            or for validation alone, or the same ones for both.
    """
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
    also = [replace(options, homes=make, trace=None).make() for make in also_homes]
    source.check_disjoint(val_source)
    return source, val_source, also


def plan_collections(
    train: CollectConfig,
    also: Sequence[HomeSource],
    policies: Sequence[str],
    tasks: Sequence[str],
    asked: QuestionShares | None,
) -> list[CollectConfig]:
    """List what is trained on: every policy plays every task in all homes, each in its own.

    Args:
        train: the first of them.
        also: further sources.
        policies: that collect.
        tasks: that they play.
        asked: shares of the kinds of questions, of the tasks that take them.

    Raises:
        ValueError: if no task takes shares of questions, or a name is unknown.
    """
    taking = [task for task in tasks if find_task(task).shares is not None]
    if asked is not None and not taking:
        raise ValueError(
            f"asked must come with a task that takes shares of questions, got {shorten(tasks)}."
            " Take simulator.tasks.ask_anything:AskAnything."
        )
    return [
        replace(
            train,
            homes=homes,
            policy=policy,
            task=task,
            asked=asked if task in taking else None,
            seed=train.seed + number,
        )
        for homes in (train.homes, *also)
        for number, (policy, task) in enumerate(product(policies, tasks))
    ]
