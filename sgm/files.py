"""Files that are written whole or not at all, their checksums, and JSON that can be relied on."""

from __future__ import annotations

import hashlib
import json
import os
import secrets
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NoReturn

from sgm.messages import shorten

LOCK = ".lock"  # name of the file by which a folder is locked


def compute_checksum(path: Path) -> str:
    """Return the SHA-256 of a file."""
    return hashlib.sha256(path.read_bytes()).hexdigest()


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under a temporary name, then rename it.

    Raises:
        OSError: if the disk is full or not writable; the old file, if any, is untouched.
    """
    # No other thread, process or container that writes the same file has this name.
    partial = path.with_name(f"{path.name}.{secrets.token_hex(8)}.part")
    try:
        with partial.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        partial.unlink(missing_ok=True)
        raise OSError(
            error.errno,
            f"disk must take {len(content)} bytes, got {shorten(error.strerror)} for {path}. Free "
            "some space and run the same command again: finished files are kept.",
        ) from error


@contextmanager
def lock_folder(folder: Path) -> Iterator[None]:
    """Have a folder for oneself, on this machine and where the file system tells others of locks.

    Nothing of the lock is left afterwards; what a killed process leaves locks nobody out.

    Args:
        folder: which exists.

    Raises:
        ValueError: if another process has it.
        OSError: if it cannot be written to.
    """
    from filelock import FileLock, Timeout  # here, as only a command that writes needs it

    path = folder / LOCK
    lock = FileLock(path)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise ValueError(
            f"output folder must be in use by one command at a time, got another one at work in "
            f"{folder}. Wait for it to end, or choose another folder."
        ) from None
    try:
        yield
    finally:
        path.unlink(missing_ok=True)
        lock.release()


def read_json(path: str | Path, *, allow_nan: bool = False) -> Any:
    """Read a JSON file.

    Args:
        path: the file.
        allow_nan: whether NaN and infinities, which are no JSON, may stand in it.

    Raises:
        OSError: if it cannot be read.
        ValueError: as `parse_json` does; whoever calls names the file and what to do.
    """
    return parse_json(Path(path).read_bytes(), allow_nan=allow_nan)


def parse_json(content: str | bytes, *, allow_nan: bool = False) -> Any:
    """Parse JSON, in UTF-8 with or without a byte order mark.

    Args:
        content: of a file.
        allow_nan: whether NaN and infinities may stand in it.

    Raises:
        ValueError: if it is no JSON or no UTF-8 (the place is named), is nested too deeply, has a
            key twice in one object, or a number that no computer counts with.
    """
    text = content.decode("utf-8-sig") if isinstance(content, bytes) else content
    try:
        return json.loads(
            text,
            object_pairs_hook=_check_keys,
            parse_constant=None if allow_nan else _refuse_constant,
        )
    except RecursionError:
        raise ValueError("lists or objects that are nested too deeply") from None


def _check_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {shorten(twice[:50])} twice in one object")
    return found


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"{name}, which is no JSON")
