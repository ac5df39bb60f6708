"""Who plays in an evaluation: policies by name, and checkpoints of networks."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import torch

from nep.policy import NEPPolicy
from simulator.homes import Homes
from simulator.policies import POLICIES, Policy, check_policy, make_policy
from simulator.tasks.registry import TASKS, check_task

MakePolicy = Callable[[Homes], Policy]


@dataclass(frozen=True, slots=True)
class Checkpoint:
    """A trained network that takes part.

    Attributes:
        name: in tables and figures.
        path: the file.
        task: the task that it plays, None for all.
    """

    name: str
    path: Path
    task: str | None = None

    @classmethod
    def parse(cls, text: str) -> Checkpoint:
        """Read `PATH`, `NAME=PATH` or `NAME@TASK=PATH`.

        A path alone is named after its folder: `runs/heat/version_0/checkpoints/last.ckpt` is
        "heat/version_0".

        Raises:
            ValueError: if there is no such file or task.
        """
        name, separator, rest = text.partition("=")
        if not separator or Path(text).is_file():
            path = Path(text)
            folder = path.absolute().parent
            run = folder.parent if folder.name == "checkpoints" else folder
            name, rest = f"{run.parent.name}/{run.name}", text
        name, separator, task = name.partition("@")
        if separator:
            check_task(task)
        if not Path(rest).is_file():
            raise ValueError(
                f"checkpoint must be a file that exists, got {rest!r}. Train one with "
                "`python -m nep.fit`, and give PATH, NAME=PATH or NAME@TASK=PATH."
            )
        return cls(name, Path(rest), task if separator else None)

    def describe(self) -> dict[str, str | None]:
        """Return name, task, path and SHA-256, as JSON values."""
        digest = hashlib.sha256(self.path.read_bytes()).hexdigest()
        return {"name": self.name, "task": self.task, "path": str(self.path), "sha256": digest}


def check_contestants(
    tasks: Sequence[str], policies: Sequence[str], checkpoints: Sequence[Checkpoint]
) -> None:
    """Check every name, and that every checkpoint can be loaded, before anything runs.

    Raises:
        ValueError: if a task or policy is unknown or named twice, two contestants of a task share
            a name, nobody plays, or a checkpoint is no fit for this version of the package.
    """
    for task in tasks:
        check_task(task)
    for policy in policies:
        check_policy(policy)
    for what, names in (("tasks", tasks), ("policies", policies)):
        if len(set(names)) < len(names):
            raise ValueError(f"{what} must differ, got {', '.join(names)}. Name each one once.")
    for task in TASKS:
        names = [point.name for point in checkpoints if point.task in (None, task)]
        for name in names:
            if name in POLICIES or names.count(name) > 1:
                raise ValueError(
                    f"names of checkpoints must differ from each other and from the policies, got "
                    f"{name!r} twice for {task}. Give NAME=PATH or NAME@TASK=PATH."
                )
    for task in tasks:
        if not policies and all(point.task not in (None, task) for point in checkpoints):
            raise ValueError(
                f"somebody must play {task}, got no policy and no checkpoint for it. Name some "
                "with --policies or --checkpoint."
            )
    for checkpoint in checkpoints:
        NEPPolicy.load(checkpoint.path)


def list_contestants(
    task: str,
    policies: Sequence[str],
    checkpoints: Sequence[Checkpoint],
    threads: int | None = None,
) -> dict[str, MakePolicy]:
    """Return what makes each player of a task, by name; networks come last.

    Args:
        task: name of the task.
        policies: names of policies.
        checkpoints: networks; those for other tasks are left out.
        threads: CPU threads that networks set wherever they play; None to leave them.
    """
    make = _make_policy_beside_networks if checkpoints else make_policy
    players: dict[str, MakePolicy] = {name: partial(make, name) for name in policies}
    for point in checkpoints:
        if point.task in (None, task):
            players[point.name] = partial(_load_network, point.path, threads)
    return players


def _make_policy_beside_networks(name: str, houses: Homes) -> Policy:
    # From this module, so that a worker imports torch with its first job. With a later one, joblib
    # would take the 300 MB for a leak, and replace the worker.
    return make_policy(name, houses)


def _load_network(path: Path, threads: int | None, houses: Homes) -> Policy:
    if threads is not None:
        torch.set_num_threads(threads)
    return NEPPolicy.load(path).with_rules(houses.prior, houses.config)
