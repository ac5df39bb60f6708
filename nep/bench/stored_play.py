"""Plays that are kept in files of their own: one player in one game, or another unit of work."""

from __future__ import annotations

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar

from nep.bench.scoring_code import checksum_code
from nep.report.code_version import describe_code
from sgm.files import read_json, write_whole


class StoredPlay(ABC):
    """A play and its file: what is there is not played again, by whichever process.

    Attributes:
        path: the file.
        scored_by: modules whose code decides the scores.
    """

    path: Path
    scored_by: ClassVar[Sequence[str]]

    @abstractmethod
    def describe(self) -> dict[str, Any]:
        """Return everything that the scores depend on but the code, as JSON values."""

    @abstractmethod
    def play(self) -> Any:
        """Return the scores, as JSON values."""

    def is_done(self) -> bool:
        """Tell whether the file holds the scores of these settings, of a network that is there."""
        try:
            return read_unit(self.path, self._tell()) is not None
        except FileNotFoundError:
            return False

    def run(self) -> None:
        """Play and write the file, unless it is there already."""
        keep_unit(self.path, self._tell(), self.play)

    def read(self) -> Any:
        """Read the scores of a finished play.

        Raises:
            ValueError: if the file is missing, or damaged.
        """
        found = read_unit(self.path)
        if found is None:
            raise ValueError(f"scores must be a file of a play, got none at {self.path}. Play it.")
        return found["done"]

    def _tell(self) -> dict[str, Any]:
        return {**self.describe(), "code": checksum_code(self.scored_by)}


def keep_unit(
    path: Path,
    about: Mapping[str, Any],
    work: Callable[[], Any],
    on_done: Callable[[], object] = lambda: None,
) -> Any:
    """Return what a file keeps of a unit of work, or do it and keep it.

    Args:
        path: the file; its folder is made if needed.
        about: everything that the work depends on, as JSON values.
        work: returns what came of it, as JSON values.
        on_done: called when it has been done now.
    """
    found = read_unit(path, about)
    if found is not None:
        return found["done"]
    content = {"about": about, "made": describe_code(), "done": work()}
    path.parent.mkdir(parents=True, exist_ok=True)
    text = json.dumps(content)
    write_whole(path, f"{text}\n".encode())
    on_done()
    return json.loads(text)["done"]


def read_unit(path: Path, about: Mapping[str, Any] | None = None) -> dict[str, Any] | None:
    """Return what a unit has kept; None if it is not there, or of something else than `about`."""
    try:
        found = read_json(path, allow_nan=True)
    except (OSError, ValueError):
        return None
    if not isinstance(found, dict) or not {"about", "made", "done"} <= found.keys():
        return None
    is_same = about is None or found["about"] == json.loads(json.dumps(about))
    return found if is_same else None
