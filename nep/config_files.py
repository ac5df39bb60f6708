"""Config files of `nep.fit`: packaged ones by name, what each builds on, and groups of settings.

Settings of model and data are kept in groups, frozen dataclasses. A command line or a config may
leave out the group, as those of version 0.1 do, which had none: `--data.num_homes` stands for
`--data.collection.num_homes`.
"""

from __future__ import annotations

import inspect
import json
import os
import re
from collections.abc import Mapping, Sequence
from copy import deepcopy
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, get_type_hints

from sgm.files import read_file
from sgm.messages import shorten
from simulator.yaml_text import MOST_BYTES, read_yaml

CONFIG_FOLDER = Path(__file__).parent / "configs"
_BASE = re.compile(r"^base:[ \t]*(\S+)", re.MULTILINE)


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


_UNGROUPED = ("features",)  # it was a group before there were any
_OF_HOMES = ("dynamics", "sensing", "rooms", "dynamic_nodes", "looks", "looks_per_step")


def list_groups(cls: type[Any]) -> dict[str, str]:
    """Return the group of each setting in the groups of a constructor, by name.

    Where a subclass passes on its other arguments, those of the class above are read, too.
    """
    groups: dict[str, str] = {}
    for make in (vars(base)["__init__"] for base in cls.__mro__ if "__init__" in vars(base)):
        parameters, hints = inspect.signature(make).parameters, get_type_hints(make)
        for name in parameters:
            hint = hints.get(name)
            if name not in _UNGROUPED and is_dataclass(hint):
                groups |= {field.name: name for field in fields(hint)}
        if all(row.kind is not row.VAR_KEYWORD for row in parameters.values()):
            break
    if "home" in groups:  # what command lines may name without it
        groups |= dict.fromkeys(_OF_HOMES, groups["home"])
    return groups


def name_groups(arguments: Sequence[str], groups: Mapping[str, Mapping[str, str]]) -> list[str]:
    """Write options of a command line, and its configs, with the groups of settings.

    Raises:
        ValueError: if a config has a setting twice, with and without its group.
    """
    found = []
    for argument in arguments:
        name, has_value, value = argument.partition("=")
        part, _, rest = name.removeprefix("--").partition(".")
        head, dot, tail = rest.replace("-", "_").partition(".")
        if name == "--config" and has_value:
            found.append(f"--config={_name_in_config(value, groups)}")
            continue
        own = groups.get(part, {}) if name.startswith("--") else {}
        group = own.get(head, own.get(head.removeprefix("no_")))
        found.append(f"--{part}.{group}.{head}{dot}{tail}{has_value}{value}" if group else argument)
    return found


def _name_in_config(text: str, groups: Mapping[str, Mapping[str, str]]) -> str:
    """Return a config, a file or what would stand in one, with the groups of settings."""
    try:
        config = read_yaml(text) if Path(text).is_file() else json.loads(text)
    except (OSError, ValueError):  # its parser says what is wrong
        return text
    if not isinstance(config, dict):
        return text
    changed = deepcopy(config)
    for part, own in groups.items():
        if isinstance(changed.get(part), dict):
            changed[part] = _group(changed[part], own, text)
    return text if changed == config else json.dumps(changed)


def _group(settings: Mapping[str, Any], groups: Mapping[str, str], where: str) -> dict[str, Any]:
    grouped = {name: value for name, value in settings.items() if name not in groups}
    for name in settings.keys() & groups.keys():
        group = groups[name]
        values = grouped.setdefault(group, {})
        if name in values:
            raise ValueError(
                f"{name} must be set once, got it with and without its group {group} in "
                f"{shorten(where)}. Leave one out."
            )
        grouped[group] = {**values, name: settings[name]}
    return grouped
