"""Scores on disk: one file per setting and contestant, played once."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nep.paper.experiments import Setting
from nep.players.contestants import Checkpoint, list_contestants
from simulator.files import compute_checksum, write_whole
from simulator.priors.prior_graph import PriorGraph
from simulator.tasks.evaluation import TaskScores, evaluate_policy
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

SCORES_VERSION = 1  # raise it when the same settings give other scores


@dataclass(frozen=True, slots=True)
class StoredScores:
    """What a table or figure needs of a `TaskScores`.

    Attributes:
        values: the task's own score of each step, (H, T).
        accuracy: share of right answers per home, (H,).
        away_accuracy, calibration_error, nll, candidate_recall: as in `TaskScores`.
    """

    values: np.ndarray
    accuracy: np.ndarray
    away_accuracy: float
    calibration_error: float
    nll: float
    candidate_recall: float

    @property
    def home_values(self) -> np.ndarray:
        """Mean score per home, (H,)."""
        return self.values.mean(axis=1)


@dataclass(frozen=True, slots=True)
class Evaluation:
    """A contestant that plays a setting on test homes, and the file that keeps how it did.

    Attributes:
        setting: what is played.
        contestant: name of a policy, or of the network of `checkpoint`.
        checkpoint: the network; None for a policy.
        homes, steps, seed: of the test homes.
        path: the file.
    """

    setting: Setting
    contestant: str
    checkpoint: Path | None
    num_homes: int
    steps: int
    seed: int
    path: Path

    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on, as JSON values."""
        return {
            "scores_version": SCORES_VERSION,
            "task": self.setting.task,
            "dynamic_nodes": self.setting.dynamic_nodes,
            "contestant": self.contestant,
            "checkpoint": compute_checksum(self.checkpoint) if self.checkpoint else None,
            "prior": PriorGraph.default().checksum,
            "num_homes": self.num_homes,
            "steps": self.steps,
            "seed": self.seed,
            "split": "test",
        }

    def is_done(self) -> bool:
        """Tell whether the file holds the scores of these settings and this checkpoint."""
        if self.checkpoint and not self.checkpoint.is_file():
            return False
        return read_json(self.path).get("settings") == self.describe()

    def run(self) -> None:
        """Play and write the file, unless it is there already."""
        if self.is_done():
            return
        policies = [] if self.checkpoint else [self.contestant]
        networks = [Checkpoint(self.contestant, self.checkpoint)] if self.checkpoint else []
        (make,) = list_contestants(self.setting.task, policies, networks).values()
        scores = evaluate_policy(
            make,
            SampledSource(home=HomeConfig(dynamic_nodes=self.setting.dynamic_nodes)),
            Streams(self.seed, "test", range(self.num_homes)),
            self.steps,
            task=self.setting.task,
        )
        content = {"settings": self.describe(), "scores": _pack(scores)}
        self.path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(self.path, (json.dumps(content) + "\n").encode())

    def load(self) -> StoredScores:
        """Read the scores of a finished evaluation."""
        stored = read_json(self.path)["scores"]
        nan = float("nan")
        return StoredScores(
            values=np.array(stored["values"]),
            accuracy=np.array(stored["accuracy_per_home"]),
            **{name: nan if stored[name] is None else stored[name] for name in _SCALARS},
        )


_SCALARS = ("away_accuracy", "calibration_error", "nll", "candidate_recall")


def read_json(path: Path) -> dict[str, Any]:
    """Read an object that was written whole; empty if there is no such file."""
    return json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}


def _pack(scores: TaskScores) -> dict[str, Any]:
    packed: dict[str, Any] = {
        "mean": float(scores.home_values.mean()),
        "std": float(scores.home_values.std()),
    }
    for name in _SCALARS:
        value = getattr(scores, name)
        packed[name] = None if math.isnan(value) else value
    packed["accuracy_per_home"] = scores.accuracy.tolist()
    packed["values"] = scores.values.round(6).tolist()
    return packed
