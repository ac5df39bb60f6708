"""Memory files: JSON with a version and a checksum, written whole or not at all."""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

from sgm.files import make_read_error, read_json, write_whole
from sgm.memory.memory_content import MemoryContent
from sgm.messages import shorten

FORMAT = "scene graph memory"
FORMAT_VERSION = 5
# Without a clock; 2 without a history and partial looks; 3 without time at places; 4 without
# statements and ids of things.
_FIRST_VERSION = 1


def save_content(path: str | Path, data: dict[str, Any]) -> None:
    """Write `MemoryContent.to_json` to a file; an older file is replaced only by a whole new one.

    Raises:
        OSError: if the folder does not exist or the disk does not take it.
    """
    path = Path(path)
    if not path.name:
        raise FileNotFoundError(f"memory file must have a name, got {path}. Name it home.sgm.")
    if not path.parent.is_dir():
        raise FileNotFoundError(
            f"folder of a memory file must exist, got {shorten(str(path.parent))} for {path}. Make "
            "it."
        )
    checksum = _compute_checksum(FORMAT_VERSION, data)
    head = {"format": FORMAT, "version": FORMAT_VERSION, "checksum": checksum}
    text = json.dumps({**head, "content": data}, ensure_ascii=False, separators=(",", ":"))
    write_whole(path, f"{text}\n".encode())


def load_content(path: str | Path) -> MemoryContent:
    """Read a memory from a file.

    Raises:
        FileNotFoundError: if there is no such file; it is a `ValueError`, too.
        ValueError: if it is none of ours, comes from a newer version of the
            package, or was altered or cut short.
    """
    try:
        file = read_json(path, allow_nan=True)
    except OSError as error:
        raise make_read_error(
            error,
            f"memory file must be one that can be read, got {shorten(error.strerror)} for {path}. "
            "Check the path.",
        ) from error
    except ValueError as error:
        raise ValueError(
            f"memory file must be whole JSON, got {error} for {path}. It was altered, cut short, "
            "or is another file: use a copy, or start a new memory."
        ) from error
    if not isinstance(file, dict) or file.get("format") != FORMAT:
        raise ValueError(
            f"memory file must be one that SceneGraphMemory.save wrote, got another file at {path}."
            " Check the path."
        )
    if file.get("version") not in range(_FIRST_VERSION, FORMAT_VERSION + 1):
        raise ValueError(
            f"memory file must have version {_FIRST_VERSION} to {FORMAT_VERSION}, got "
            f"{shorten(file.get('version'))} for {path}. Install the version of the package that "
            "wrote it."
        )
    try:
        if file.get("checksum") != _compute_checksum(file["version"], file.get("content")):
            raise ValueError("another checksum than the one it states")
        return MemoryContent.from_json(file["content"])
    except ValueError as error:
        raise ValueError(
            f"memory file must be as it was saved, got {error} for {path}. It was altered: use a "
            "copy, or start a new memory."
        ) from error


def _compute_checksum(version: int, data: Any) -> str:
    """Return the checksum of a content; since version 3 it covers the version, too."""
    covered = data if version < 3 else [version, data]
    return hashlib.sha256(json.dumps(covered, sort_keys=True).encode()).hexdigest()
