"""Scores on disk: `results.json`, the one format that every command writes and reads.

It says which code made them: the version of the package, and the commit where there is one.
"""

from __future__ import annotations

import json
import math
import platform
import subprocess
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import VERSION, check_version, read_json, write_whole
from sgm.messages import shorten
from simulator.tasks.metrics import METRICS, STEP_METRICS, Metric
from simulator.tasks.registry import TASKS
from simulator.tasks.scores import TaskScores

_DIGITS = 6  # of the scores of single steps
_PACKAGE = "scene-graph-memory"
_DEPENDENCIES = ("numpy", "scipy", "torch", "dgl")
_CHECKOUT = Path(__file__).parents[2]
_CODE = ("nep", "simulator", "datamodules")  # folders whose changes make it another code
_COMMIT_LENGTH = 12


@dataclass(frozen=True, slots=True)
class ScoreSummary:
    """What tables and figures need to know of how a policy did in a task.

    Attributes:
        values: the task's own score of each step, (H, T); of several trainings their mean.
        metrics: what was computed of its answers, by name in `METRICS`, then those of one's own.
        trainings: mean score of each home, of every training, (S, H); None for one, or for a policy
            that needs none.
        units: what each home is a play of, (H,): replays of a recording have one name; None if all
            homes were drawn independently.
    """

    values: np.ndarray
    metrics: Mapping[str, float]
    trainings: np.ndarray | None = None
    units: tuple[str, ...] | None = None

    @classmethod
    def of(
        cls,
        scores: TaskScores,
        units: tuple[str, ...] | None = None,
        more: Mapping[str, Metric] | None = None,
    ) -> ScoreSummary:
        """Compute every metric of what a policy scored in homes that are plays of `units`."""
        metrics = {**METRICS, **(more or {})}
        found = {name: float(metric.compute(scores)) for name, metric in metrics.items()}
        return cls(scores.values, found, units=units)

    @classmethod
    def join(cls, parts: Sequence[ScoreSummary]) -> ScoreSummary:
        """Return the summary of several trainings that played in the same homes."""
        return cls(
            np.mean([part.values for part in parts], axis=0),
            {name: float(np.mean([p.metrics[name] for p in parts])) for name in parts[0].metrics},
            np.concatenate([part.by_training for part in parts]),
            parts[0].units,
        )

    @property
    def by_training(self) -> np.ndarray:
        """Mean score of each home, of every training, (S, H)."""
        return self.home_values[None] if self.trainings is None else self.trainings

    @property
    def home_values(self) -> np.ndarray:
        """Mean score per home, (H,)."""
        return self.values.mean(axis=1)


@dataclass(frozen=True, slots=True)
class TaskTitle:
    """What tables need to know of a task: title, and name of the metric of a step."""

    title: str
    metric: str


@dataclass(frozen=True, slots=True)
class Results:
    """Who played what, and how it went.

    Attributes:
        command: the command line that makes them again.
        config: everything that the scores depend on, as JSON values.
        versions: of Python and packages.
        tasks: summaries by task and by policy, all of a task in the same homes.
        titles: of tasks of one's own, which a file says and nothing is imported for.
    """

    command: str
    config: Mapping[str, Any]
    versions: Mapping[str, str]
    tasks: Mapping[str, Mapping[str, ScoreSummary]]
    titles: Mapping[str, TaskTitle] = field(default_factory=dict)

    def get_title(self, task: str) -> TaskTitle:
        """Return title and metric of a task of these results."""
        known = TASKS.get(task)
        return self.titles[task] if known is None else TaskTitle(known.title, known.metric)

    def save(self, path: Path) -> None:
        """Write the file, whole or not at all; its folder is made if needed."""
        content = {
            "version": VERSION,
            "command": self.command,
            "config": self.config,
            "versions": self.versions,
            "tasks": {
                task: {
                    **asdict(self.get_title(task)),
                    "policies": {name: pack_summary(summary) for name, summary in policies.items()},
                }
                for task, policies in self.tasks.items()
            },
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, (json.dumps(content) + "\n").encode())

    @classmethod
    def load(cls, path: Path) -> Results:
        """Read what `save` wrote.

        Raises:
            ValueError: if there is no such file, it is no file of results, or one of another
                version.
        """
        try:
            content = read_json(path)
        except (OSError, ValueError) as error:
            raise ValueError(
                f"results must be a file that can be read as JSON, got {shorten(str(error))} for "
                f"{path}. Name a results.json."
            ) from error
        found = content.get("version") if isinstance(content, dict) else None
        check_version("results", found, path)
        try:
            tasks = {
                task: {name: unpack_summary(packed) for name, packed in entry["policies"].items()}
                for task, entry in content["tasks"].items()
            }
            command, config, versions = (content[x] for x in ("command", "config", "versions"))
            if not isinstance(config, dict) or not isinstance(versions, dict):
                raise TypeError("config and versions are no objects")
            unknown = {task: entry for task, entry in content["tasks"].items() if task not in TASKS}
            titles = {task: _read_title(task, entry) for task, entry in unknown.items()}
            return cls(command, config, versions, tasks, titles)
        except (AttributeError, KeyError, TypeError, ValueError) as error:
            raise ValueError(
                f"results must hold all that Results.save writes, got {shorten(error)} in {path}. "
                "Was the file edited? Make it again."
            ) from error


def _read_title(task: str, entry: Mapping[str, Any]) -> TaskTitle:
    """Read what a file says of a task of one's own."""
    title, metric = entry.get("title"), entry.get("metric")
    if ":" not in task or not isinstance(title, str) or str(metric) not in STEP_METRICS:
        raise ValueError(f"unknown tasks {[task]}")
    return TaskTitle(title, str(metric))


def pack_summary(summary: ScoreSummary) -> dict[str, Any]:
    """Return JSON values, which have None for nan."""
    units = {} if summary.units is None else {"units": list(summary.units)}
    return {
        **units,
        "mean": float(summary.home_values.mean()),
        "std": float(summary.home_values.std()),
        "metrics": {name: None if math.isnan(x) else x for name, x in summary.metrics.items()},
        "values": summary.values.round(_DIGITS).tolist(),
    }


def unpack_summary(packed: Mapping[str, Any]) -> ScoreSummary:
    """Return what `pack_summary` was given.

    Raises:
        ValueError: if there is something else.
    """
    values = np.array(packed["values"], dtype=float)
    if values.ndim != 2:
        raise ValueError(f"values must be (homes, steps), got {values.ndim} axes")
    nan = float("nan")
    metrics = {name: nan if x is None else float(x) for name, x in packed["metrics"].items()}
    units = packed.get("units")
    if units is not None and len(units) != len(values):
        raise ValueError(f"units must name {len(values)} homes, got {len(units)} names")
    return ScoreSummary(values, metrics, units=None if units is None else tuple(units))


def list_versions() -> dict[str, str]:
    """Return the versions of Python and of what scores depend on, with the commit if known."""
    versions = {"python": platform.python_version(), _PACKAGE: _find_version(_PACKAGE)}
    commit = find_commit()
    if commit is not None:
        versions["commit"] = commit
    return {**versions, **{name: _find_version(name) for name in _DEPENDENCIES}}


def describe_code() -> str:
    """Return version and commit in one line."""
    commit = find_commit()
    known = f"{_PACKAGE} {_find_version(_PACKAGE)}"
    return known if commit is None else f"{known}, commit {commit}"


@lru_cache(maxsize=1)
def find_commit() -> str | None:
    """Return the commit of the checkout that runs; None where the package was installed.

    A commit whose files were edited since ends with "+changes".
    """
    try:
        # The package may lie in an environment within another repository.
        _run_git("ls-files", "--error-unmatch", str(Path(__file__).relative_to(_CHECKOUT)))
        commit = _run_git("rev-parse", f"--short={_COMMIT_LENGTH}", "HEAD")
        changed = _run_git("status", "--porcelain", "--untracked-files=no", "--", *_CODE)
    except (OSError, subprocess.SubprocessError):  # no git, no repository, or not ours
        return None
    return f"{commit}+changes" if changed else commit


def _run_git(*arguments: str) -> str:
    command = ["git", "-C", str(_CHECKOUT), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=10)
    return done.stdout.strip()


def _find_version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:  # run from a checkout that is not installed
        return "not installed"
