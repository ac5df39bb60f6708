"""What has been played for a table: the JSON file beside it, with which a command goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from simulator.files import read_json, write_whole


def find_scores(table: Path) -> Path:
    """Return the file of scores beside a table.

    Raises:
        ValueError: if the table cannot be written, since it is a folder.
    """
    if table.is_dir():
        raise ValueError(f"out must be a file, got a folder at {table}. Name a table.")
    return table.with_suffix(".json")


def load_scores(path: Path) -> dict[str, Any]:
    """Return what has been played, by home or kind and player; nothing where there is no file.

    Raises:
        ValueError: if the file is damaged.
    """
    try:
        scores = read_json(path, allow_nan=True)
        if not isinstance(scores, dict):
            raise ValueError("no object")
    except FileNotFoundError:
        return {}
    except ValueError as error:
        raise ValueError(
            f"scores must be a JSON object, got {error} in {path}. Remove the file to play again."
        ) from error
    return scores


def save_scores(path: Path, scores: Mapping[str, Any]) -> None:
    """Write what has been played, making the folder if needed."""
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, f"{json.dumps(scores, indent=1)}\n".encode())
