"""Config files of `nep.fit`: packaged ones by name, and what each builds on."""

from __future__ import annotations

import os
import re
from collections.abc import Sequence
from pathlib import Path

from sgm.files import read_file
from simulator.yaml_text import MOST_BYTES

CONFIG_FOLDER = Path(__file__).parent / "configs"
_BASE = re.compile(r"^base:[ \t]*(\S+)", re.MULTILINE)
_CLASS = re.compile(r"^(model|data)_class:[ \t]*([\w.]+)", re.MULTILINE)


def find_configs(args: Sequence[str]) -> list[str]:
    """Replace configs by the files that they are made of, those they build on first.

    A name that is no file here is a packaged config.

    Args:
        args: command line; the values of `--config` and `-c` are looked at.

    Raises:
        FileNotFoundError: if a YAML file is named that is neither here nor packaged.
        ValueError: if a config builds on what is no packaged config.
    """
    found: list[str] = []
    values = iter(args)
    for arg in values:
        name, has_value, value = arg.partition("=")
        if name == "--base":
            raise ValueError(
                f"--base must stand in a config file, got {arg} on the command line. Give "
                "--config paper.yaml before other configs."
            )
        if name not in ("--config", "-c"):
            found.append(arg)
            continue
        value = _find_config(value if has_value else next(values, ""))
        files = list_files(Path(value)) if os.path.isfile(value) else [value]
        found += [f"--config={path}" for path in files]
    return found


def read_classes(args: Sequence[str]) -> dict[str, str]:
    """Return the import paths that lines `model_class: ...` of configs have, the last of each.

    Args:
        args: command line, with configs as `find_configs` returns them.

    Raises:
        OSError: if a config cannot be read.
    """
    found: dict[str, str] = {}
    for arg in args:
        name, _, value = arg.partition("=")
        if name == "--config" and os.path.isfile(value):
            text = read_file(value, MOST_BYTES).decode("utf-8", errors="replace")
            found |= {f"{kind}_class": path for kind, path in _CLASS.findall(text)}
    return {name: path for name, path in found.items() if path != "null"}


def list_files(path: Path) -> list[Path]:
    """List a config after those that it builds on, as its line `base: paper.yaml` says.

    Raises:
        OSError: if it cannot be read, or is too large for a config.
        ValueError: if one of them is no packaged config.
    """
    match = _BASE.search(read_file(path, MOST_BYTES).decode("utf-8", errors="replace"))
    if match is None:
        return [path]
    base = CONFIG_FOLDER / match[1]
    if not base.is_file() or base == path:
        raise ValueError(
            f"base must be a packaged config, got '{match[1]}' in {path}. Choose from: "
            f"{_list_names()}."
        )
    return [*list_files(base), path]


def _find_config(name: str) -> str:
    if not name.endswith((".yaml", ".yml")) or Path(name).exists():
        return name
    packaged = CONFIG_FOLDER / name
    if not packaged.is_file():
        raise FileNotFoundError(
            f"--config must name a file, got '{name}'. Give a path, or a packaged config: "
            f"{_list_names()}."
        )
    return str(packaged)


def _list_names() -> str:
    return ", ".join(sorted(path.name for path in CONFIG_FOLDER.glob("*.yaml")))
