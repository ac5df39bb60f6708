"""Snapshot files: one safetensors file per home and one manifest; written whole, and checked."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError
from safetensors.numpy import load, save

from sgm.files import (
    VERSION,
    MissingFileError,
    VersionError,
    check_version,
    make_read_error,
    read_file,
    read_json,
    write_whole,
)
from sgm.messages import shorten
from sgm.schema import COUNTERS, NOW, NUM_RELATIONS, SNAPSHOT_TABLES, Column

MANIFEST = "manifest.json"
# What the columns of extras are called in a shard: where their own names begin.
EXTRA, QUESTION_EXTRA = "extra_", "question_"


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
    """Write the manifest: version, settings and the checksum of every finished shard."""
    content = {"version": VERSION, "settings": settings, "shards": shards}
    write_whole(folder / MANIFEST, (json.dumps(content, indent=1) + "\n").encode())


def load_manifest(folder: Path) -> dict[str, Any]:
    """Read the manifest of a collection.

    Raises:
        ValueError: if there is none, it is damaged, or of another version.
    """
    path = folder / MANIFEST
    try:
        manifest = read_json(path)
        check_version("manifest", manifest["version"], path)
        if not {"settings", "shards"} <= manifest.keys():
            raise KeyError("settings, shards")
    except FileNotFoundError as error:
        raise MissingFileError(
            f"collection must have a {MANIFEST}, got none in {folder}. "
            "Run `python -m simulator.collect --out` on that folder."
        ) from error
    except VersionError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise ValueError(
            f"manifest must be whole, got {shorten(error)} in {path}. Delete the folder and "
            "collect again."
        ) from error
    return manifest


MAX_HOMES = 1_000_000  # of a collection: six digits in the names of its shards
_MAX_NUMBER = 2**31 - 2  # of time steps, counters and snapshots
_MAX_WIDTH = 10_000  # columns of an extra


@dataclass(frozen=True, slots=True)
class _Rule:
    """What an array must be: its axes by letter, its kinds, and the range of its numbers."""

    axes: str
    kinds: str
    low: float = -np.inf
    high: float | str = np.inf  # a letter: below the length of that axis


# What the names of the arrays of each table begin with, and the letter of its axis.
PREFIXES = {"rooms": "room", "furniture": "furniture", "objects": "object", "edges": "edge"}
_LETTERS = {"labels": "label", "rooms": "R", "furniture": "F", "objects": "N", "edges": "E"}
_OF = {PREFIXES[table]: _LETTERS[table] for table, names in COUNTERS.items() if names}


def _make_rule(column: Column, axes: str) -> _Rule:
    high = _MAX_NUMBER if column.high == NOW else column.high
    kinds = "iu" if column.dtype is np.bool_ else "i" if column.is_whole else "f"
    return _Rule(axes, kinds, column.low, _LETTERS.get(column.refers_to, high))


_RULES = {
    **{
        f"{PREFIXES[table]}_{column.name}": _make_rule(column, _LETTERS[table])
        for table, columns in SNAPSHOT_TABLES.items()
        for column in columns
        if column.is_fixed
    },
    "snapshot_time": _Rule("S", "i", 0, _MAX_NUMBER),
    "snapshot_query": _Rule("S", "i", 0, "N"),
    "snapshot_furniture_prior": _Rule("SFr", "f", 0, _MAX_NUMBER),
    "snapshot_furniture_answers": _Rule("SF", "u", 0, 1),
    **{f"{table}_version_of": _Rule(table, "i", 0, letter) for table, letter in _OF.items()},
    **{f"{table}_version_valid_from": _Rule(table, "i", 0) for table in _OF},
    **{f"{table}_version_valid_to": _Rule(table, "i", 0) for table in _OF},
    **{
        f"{PREFIXES[table]}_version_{column.name}": _make_rule(column, PREFIXES[table])
        for table, columns in SNAPSHOT_TABLES.items()
        for column in columns
        if column.is_counter
    },
}


def check_manifest(manifest: Mapping[str, Any], folder: Path) -> None:
    """Check what a manifest says of a collection; its shards lie in its own folder.

    Raises:
        ValueError: if a part is of another kind, or a shard is none of the collection's homes.
    """
    settings, shards = manifest["settings"], manifest["shards"]
    settings = settings if isinstance(settings, dict) else {}
    num_homes, labels = settings.get("num_homes"), settings.get("labels")
    problem = ""
    if type(num_homes) is not int or not 1 <= num_homes <= MAX_HOMES:
        problem = f"num_homes that is no number in 1 to {MAX_HOMES}"
    elif not isinstance(labels, list) or not all(isinstance(label, str) for label in labels):
        problem = "labels that are no list of texts"
    elif not isinstance(shards, dict):
        problem = "shards that are no JSON object"
    else:
        for name, checksum in shards.items():
            number = re.fullmatch(r"home_(\d{6})\.safetensors", name, re.ASCII)
            if number is None or int(number[1]) >= num_homes:
                problem = (
                    f"the shard {shorten(name)}, which is none from {get_shard_name(0)} to "
                    f"{get_shard_name(num_homes - 1)}"
                )
            elif not isinstance(checksum, str):
                problem = f"no checksum of {name}"
    if problem:
        raise ValueError(
            f"manifest must be one that simulator.collect wrote, got {problem} in "
            f"{folder / MANIFEST}. Delete the folder and collect again."
        )


def check_shard(arrays: Mapping[str, np.ndarray], num_labels: int, path: Path) -> None:
    """Check the arrays of one home: names, shapes, kinds, ranges, and what holds between them.

    Raises:
        ValueError: if they are none that `Recorder` makes with so many labels; names the shard.
    """
    problem = _find_problem(arrays, num_labels)
    if problem:
        raise ValueError(
            f"shard must be one that simulator.collect wrote, got {problem} in {path}. Delete it "
            "and collect again."
        )


def _find_problem(arrays: Mapping[str, np.ndarray], num_labels: int) -> str:
    sizes = {"label": num_labels, "2": 2, "r": NUM_RELATIONS}
    rules = dict(_RULES)
    for name in arrays:
        if name.startswith(f"snapshot_furniture_{EXTRA}"):
            rules[name] = _Rule("SF*", "f")
        elif name.startswith(f"snapshot_{QUESTION_EXTRA}"):
            rules[name] = _Rule("S*", "f")
        elif name == "home_clock":
            rules[name] = _Rule("2", "f", 0, _MAX_NUMBER)
    if unknown := sorted(arrays.keys() - rules):
        return f"an array {shorten(unknown[0])} that has no meaning"
    if missing := [name for name in rules if name not in arrays]:
        return f"no array {missing[0]}"
    for name, rule in rules.items():
        if arrays[name].dtype.kind not in rule.kinds:
            return f"{name} of type {arrays[name].dtype}"
        if not _fits(arrays[name].shape, rule.axes, sizes):
            return f"{name} of shape {arrays[name].shape}"
    for name, rule in rules.items():
        high = sizes[rule.high] - 1 if isinstance(rule.high, str) else rule.high
        array = arrays[name]
        if rule.low > -np.inf and not ((array >= rule.low) & (array <= high)).all():
            return f"{name} outside of {rule.low} to {high}"
    return _find_version_problem(arrays, sizes)


def _fits(shape: tuple[int, ...], axes: str, sizes: dict[str, int]) -> bool:
    """Tell whether axes have the lengths of all others of their letter, the first one's."""
    letters = [axes] if axes in _OF else list(axes)  # versions: an axis of each kind
    if letters[-1] == "*":
        letters.pop()
        if len(shape) == len(letters) + 1 and not 1 <= shape[-1] <= _MAX_WIDTH:
            return False
        shape = shape[: len(letters)] if len(shape) <= len(letters) + 1 else shape
    return len(shape) == len(letters) and all(
        sizes.setdefault(letter, size) == size for letter, size in zip(letters, shape, strict=True)
    )


def _find_version_problem(arrays: Mapping[str, np.ndarray], sizes: Mapping[str, int]) -> str:
    """Versions of one node or edge follow each other from the first one to the last snapshot."""
    first = {}
    for table, letter in _OF.items():
        of, valid_from, valid_to = (
            arrays[f"{table}_version_{name}"] for name in ("of", "valid_from", "valid_to")
        )
        is_last = np.append(of[1:] != of[:-1], True)[: len(of)]
        ends = np.where(is_last, sizes["S"], np.append(valid_from[1:], 0)[: len(of)])
        if (np.diff(of) < 0).any() or (valid_to != ends).any() or (valid_from > valid_to).any():
            return f"versions of {table} that do not follow each other"
        first[table] = np.full(sizes[letter], sizes["S"])
        np.minimum.at(first[table], of, valid_from)
    if (first["object"][arrays["edge_object"]] > first["edge"]).any():
        return "an edge before its object"
    return ""
