"""Snapshot files: one safetensors file per home and one manifest, never half a file."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from sgm.files import MissingFileError, make_read_error, read_file, read_json, write_whole
from sgm.messages import shorten

SCHEMA_VERSION = 2
MANIFEST = "manifest.json"


def get_shard_name(home: int) -> str:
    """Return the file name of a home."""
    return f"home_{home:06d}.safetensors"


def save_shard(path: Path, arrays: Mapping[str, np.ndarray]) -> str:
    """Write the arrays of one home, whole or not at all; return the SHA-256 of the file."""
    content = save(dict(arrays))
    write_whole(path, content)
    return hashlib.sha256(content).hexdigest()


def load_shard(path: Path, checksum: str | None = None) -> dict[str, np.ndarray]:
    """Read the arrays of one home; None to compare no checksum (SHA-256).

    Raises:
        ValueError: if the file is missing, truncated or altered; the file is named.
    """
    try:
        content = read_file(path)
    except FileNotFoundError as error:
        raise MissingFileError(
            f"shard must exist, got none at {path}. Collect again: finished homes are kept."
        ) from error
    except OSError as error:
        rule = "shard must be a file that can be read"
        raise make_read_error(error, rule, f"for {path}. Check the folder.") from error
    found = hashlib.sha256(content).hexdigest()
    if checksum is not None and found != checksum:
        raise ValueError(
            f"shard must have the checksum of its manifest, {checksum[:12]}..., got "
            f"{found[:12]}... for {path}. It was altered or cut short: delete it and collect again."
        )
    try:
        return load(content)
    except SafetensorError as error:
        raise ValueError(
            f"shard must be a whole safetensors file, got {error} for {path}. "
            "Delete it and collect again."
        ) from error


def save_manifest(folder: Path, settings: Mapping[str, Any], shards: Mapping[str, str]) -> None:
    """Write the manifest: schema version, settings and the checksum of every finished shard."""
    content = {"schema_version": SCHEMA_VERSION, "settings": settings, "shards": shards}
    write_whole(folder / MANIFEST, (json.dumps(content, indent=1) + "\n").encode())


def load_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a collection.

    Raises:
        ValueError: if there is none, it is damaged, or of another schema version.
    """
    path = folder / MANIFEST
    try:
        manifest = read_json(path)
        version = manifest["schema_version"]
        if not {"settings", "shards"} <= manifest.keys():
            raise KeyError("settings, shards")
    except FileNotFoundError as error:
        raise MissingFileError(
            f"collection must have a {MANIFEST}, got none in {folder}. "
            "Run `python -m simulator.collect --out` on that folder."
        ) from error
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(
            f"manifest must be whole, got {shorten(error)} in {path}. Delete the folder and "
            "collect again."
        ) from error
    if version != SCHEMA_VERSION:
        raise ValueError(
            f"manifest must have schema version {SCHEMA_VERSION}, got {shorten(version)} in "
            f"{path}. Collect again with this version of the package."
        )
    return manifest
