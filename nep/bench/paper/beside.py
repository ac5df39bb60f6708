"""Networks that have played the test homes of Table 1 in `nep.temporal`, as rows of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nep.bench.temporal.report import MEMORY, TableRow, read_scores
from nep.report.results import ScoreSummary
from simulator.tasks.metrics import METRICS

# Settings of Table 1, by the name that `nep.temporal` has for their homes.
_SETTINGS = {"predict_location-on": "paper_on", "predict_location-off": "paper_off"}
_CLOSE = 1e-6  # between scores of one rule in the same home; files round them


@dataclass(frozen=True, slots=True)
class Beside:
    """What `temporal.json` says of networks that were trained."""

    content: Mapping[str, Any]
    path: Path

    @classmethod
    def load(cls, path: Path) -> Beside:
        """Read `temporal.json`.

        Raises:
            ValueError: if it is no such file.
        """
        return cls(read_scores(path, "beside"), path)

    def list_rows(
        self, setting: str, known: Mapping[str, ScoreSummary], num_trainings: int
    ) -> dict[str, ScoreSummary]:
        """Return the scores of its networks in a setting, by title; none in one without them.

        Args:
            setting: name of the setting.
            known: scores of rules there; those that have played in both must be the same.
            num_trainings: of the other networks. Of more only the first ones count, and a network
                with fewer is left out.

        Raises:
            ValueError: if no rule shows that the homes are the same.
        """
        rows = self._find_rows(setting)
        if not rows:
            return {}
        rules = {row.name: row for row in rows if not row.num_trainings}
        shared = [name for name in rules if name in known]
        if not shared or not all(_is_same(rules[name], known[name]) for name in shared):
            raise ValueError(
                f"beside must have rules that scored the same in the same homes of {setting}, got "
                f"{', '.join(shared) or 'no shared rule'} in {self.path}. Make it with the same "
                "--num_homes and --steps."
            )
        return {
            f"{row.name} ({row.reads})": _summarise(replace(row, plays=row.plays[:num_trainings]))
            for row in rows
            if _counts(row, num_trainings)
        }

    def describe(self) -> str:
        """Say what the networks learnt from, and which command trained them, a paragraph."""
        sizes = self.content["sizes"]
        return (
            "Networks with what they read in brackets have played in `nep.temporal`. The temporal "
            f"graph networks have learnt from {sizes['train_homes']} homes x "
            f"{sizes['train_steps']} steps, less than the others, so that this compares what was "
            f"trained, and no architectures. `{self.content['command']}`; {self.content['made']}."
            + (f" {self.content['note']}" if self.content.get("note") else "")
        )

    def list_checkpoints(self, setting: str, num_trainings: int) -> dict[str, str]:
        """Return the SHA-256 of its networks, by setting, title and number of the training."""
        return {
            f"{setting}, {row.name} ({row.reads}), seed {seed}": checksum
            for row in self._find_rows(setting)
            if _counts(row, num_trainings)
            for seed, checksum in enumerate(row.checkpoints[:num_trainings])
        }

    def _find_rows(self, setting: str) -> list[TableRow]:
        kind = self.content["kinds"].get(_SETTINGS.get(setting), {})
        return [TableRow(**row) for row in kind.get("rows", [])]


def _is_same(rule: TableRow, known: ScoreSummary) -> bool:
    values, same = np.array(rule.plays[0]["first_guess"]), known.home_values
    return values.shape == same.shape and bool(np.allclose(values, same, rtol=0, atol=_CLOSE))


def _counts(row: TableRow, num_trainings: int) -> bool:
    """Whether a row is a network with so many trainings, or a graph memory that a user named."""
    return row.reads == MEMORY or row.num_trainings >= num_trainings


def _summarise(row: TableRow) -> ScoreSummary:
    """Summarise trainings; of the metrics of other rows it has first guesses and NLL alone."""
    found, metrics = row.summarise(None), dict.fromkeys(METRICS, float("nan"))
    metrics["accuracy"] = float(found.by_training.mean())
    metrics["nll"] = float(np.mean([own["nll"] for own in row.plays]))
    return replace(found, metrics=metrics)
