"""Networks that have played the test homes of Table 1 in `nep.bench temporal`, as rows of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from nep.report.results import ScoreSummary
from sgm.files import VersionError, check_version, read_json
from sgm.messages import shorten
from simulator.tasks.metrics import METRICS

# Settings of Table 1, by the name that `nep.bench temporal` has for their homes.
_SETTINGS = {"predict_location-on": "paper_on", "predict_location-off": "paper_off"}
MEMORY = "graph memory"  # what such a network reads
_CLOSE = 1e-6  # between scores of one rule in the same home; files round them


@dataclass(frozen=True, slots=True)
class TableRow:
    """How a player did in one kind of homes.

    Attributes:
        name: in the table.
        reads: what it reads.
        plays: what each of its trainings scored (`play_kind`); one for a rule.
        num_trainings: 0 for a rule.
        seconds: processor time of a training, nan for a rule.
        checkpoints: SHA-256 of the network of each training.
    """

    name: str
    reads: str
    plays: Sequence[Mapping[str, Any]]
    num_trainings: int = 0
    seconds: float = float("nan")
    checkpoints: Sequence[str] = ()

    def mean(self, column: str) -> float:
        """Return the mean of a column over homes and trainings."""
        return float(np.mean([np.mean(play[column]) for play in self.plays]))

    def summarise(self, units: tuple[str, ...] | None) -> ScoreSummary:
        """Return the first guesses, to be paired with those of another player."""
        values = np.array([play["first_guess"] for play in self.plays])  # (S, H)
        several = values if len(values) > 1 else None
        return ScoreSummary(values.mean(axis=0)[:, None], {}, several, units)


def read_temporal(path: Path, option: str) -> dict[str, Any]:
    """Read the scores of `nep.bench temporal`; `option` names the file.

    Raises:
        ValueError: if it is no such file.
    """
    try:
        content = dict(read_json(path, allow_nan=True))
        check_version("scores", content["version"], path)
        for table in content["kinds"].values():
            [TableRow(**row) for row in table["rows"]]
        content["sizes"]["train_homes"], content["command"], content["made"]
    except VersionError:
        raise
    except (OSError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise make_temporal_error(option, error, path) from error
    return content


def make_temporal_error(option: str, error: Exception, path: Path) -> ValueError:
    """Return the error of a file that holds no such scores."""
    return ValueError(
        f"{option} must be a temporal.json of nep.bench temporal, got {type(error).__name__}: "
        f"{shorten(str(error))} in {path}. Make it with the command."
    )


@dataclass(frozen=True, slots=True)
class TemporalScores:
    """What `temporal.json` says of networks that were trained."""

    content: Mapping[str, Any]
    path: Path

    @classmethod
    def load(cls, path: Path) -> TemporalScores:
        """Read `temporal.json`.

        Raises:
            ValueError: if it is no such file.
        """
        return cls(read_temporal(path, "beside"), path)

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
            "Networks with what they read in brackets have played in `nep.bench temporal`. The "
            f"temporal graph networks have learnt from {sizes['train_homes']} homes x "
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
        table = self.content["kinds"].get(_SETTINGS.get(setting), {})
        return [TableRow(**row) for row in table.get("rows", [])]


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
    metrics["nll"] = float(np.mean([play["nll"] for play in row.plays]))
    return replace(found, metrics=metrics)
