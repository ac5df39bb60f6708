"""Units of work that are kept in files of their own: a tuning, a training, a play."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from nep.report.results import describe_code
from sgm.files import read_json, write_whole


def keep_unit(
    path: Path,
    about: Mapping[str, Any],
    work: Callable[[], Any],
    on_done: Callable[[], object] = lambda: None,
) -> Any:
    """Return what a file keeps of a unit of work, or do it and keep it.

    What came of it, and `about`, everything that it depends on, are JSON values.
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
