"""Names of the numbers that a semantic segmentation gives: the label space files of Hydra."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sgm.messages import shorten
from simulator.yaml_text import read_yaml


def load_label_names(path: Path) -> dict[int, str]:
    """Read a label space: YAML with `label_names`, a list of entries with `label` and `name`.

    Raises:
        ValueError: if it cannot be read, or an entry is broken or there twice.
    """
    try:
        content: Any = read_yaml(path)
    except (OSError, ValueError) as error:
        raise ValueError(
            f"labels must be a file that can be read as YAML, got {shorten(str(error))} for "
            f"{path}. Name the label space of your Hydra configuration."
        ) from error
    rows = content.get("label_names") if isinstance(content, dict) else None
    if not isinstance(rows, list) or not rows:
        raise ValueError(
            f"labels must have a list label_names, got {shorten(rows, 60)} in {path}. Write "
            "entries like {label: 5, name: chair}."
        )
    names: dict[int, str] = {}
    for index, row in enumerate(rows):
        number, name = (row.get("label"), row.get("name")) if isinstance(row, dict) else (None, row)
        is_named = isinstance(name, str) and name.strip()
        if type(number) is not int or not is_named or number in names:
            raise ValueError(
                f"label_names[{index}] must have a label, a number of its own, and a name, got "
                f"{shorten(row, 60)} in {path}. Write entries like {{label: 5, name: chair}}."
            )
        names[number] = str(name)
    return names
