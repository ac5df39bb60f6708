"""What all command lines share: options from dataclasses, short spellings, errors in one line."""

from __future__ import annotations

import json
import os
import sys
from argparse import ArgumentError
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from functools import partial
from pathlib import Path
from types import UnionType
from typing import TYPE_CHECKING, Any, Literal, Union, get_args, get_origin

from sgm.messages import shorten, shorten_text, shorten_values
from simulator.fan_out import BACKENDS
from simulator.home_options import SOURCES, HomeOptions
from simulator.world.dynamics import DYNAMICS
from simulator.world.sensing import SENSING
from simulator.yaml_text import parse_yaml, read_yaml

if TYPE_CHECKING:  # half a second, which only commands take
    from jsonargparse import ArgumentParser, Namespace

# What a command ends with in one line.
BAD_INPUT = (ValueError, OSError, OverflowError, MemoryError, ModuleNotFoundError)
_YAML = "plain yaml"
# What options take that may be named, by option.
_NAMED: Mapping[str, Mapping[str, str]] = {
    "homes": SOURCES,
    "val_homes": SOURCES,
    "home.dynamics": DYNAMICS,
    "home.sensing": SENSING,
}
_MOST_CHARACTERS = 2000  # of a message; some repeat a whole file


def make_parser(prog: str, description: str) -> ArgumentParser:
    """Make the parser of a command, with --config and --print_config."""
    from jsonargparse import ArgumentParser

    parser = ArgumentParser(
        prog=prog, description=description, exit_on_error=False, parser_mode=use_plain_yaml()
    )
    parser.add_argument("--config", action="config", help="file of options (YAML)")
    return parser


def use_plain_yaml() -> str:
    """Return the `parser_mode` of parsers that read YAML by `parse_yaml`, as ours do."""
    from jsonargparse import get_loader, set_loader

    set_loader(_YAML, partial(parse_yaml, construct=get_loader("yaml")), (ValueError,))
    return _YAML


def add_home_arguments(parser: ArgumentParser) -> None:
    """Add the options of `HomeOptions`, by which a command gets its homes."""
    parser.add_class_arguments(HomeOptions)


def add_worker_arguments(parser: ArgumentParser, workers: int) -> None:
    """Add --workers, of which there are `workers` where it is left out, and --backend."""
    parser.add_argument("--workers", type=int, default=workers, help="processes at a time")
    parser.add_argument(
        "--backend",
        type=str,
        default=BACKENDS[0],
        help="where they work: processes of this machine, or ray, a cluster (docs/scale.md)",
    )


def parse(parser: ArgumentParser, arguments: Sequence[str] | None) -> Namespace:
    """Parse a command line, None for that of the process, and make what its options describe.

    Raises:
        ArgumentError: if an option is unknown or of the wrong kind.
        ValueError: if a value is out of range.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    return parser.instantiate(parser.parse_args(normalise(parser, arguments)))


def pick(options: Namespace, cls: type[Any]) -> dict[str, Any]:
    """Return the options that are fields of a dataclass."""
    return {field.name: options[field.name] for field in fields(cls) if field.name in options}


def normalise(parser: ArgumentParser, arguments: Sequence[str], prefix: str = "") -> list[str]:
    """Write options as jsonargparse reads them.

    `--step-seconds` becomes `--step_seconds`, `--belief` becomes `--belief=true`, `--no_belief`
    becomes `--belief=false`, `--trace a b` becomes `--trace=["a", "b"]`; what is called by a name
    gets its import path: `--home.dynamics paper` becomes
    `--home.dynamics=simulator.world.paper_dynamics.PaperDynamics`.

    Args:
        parser: tells which options there are.
        arguments: as they were typed.
        prefix: of the options of homes, "data." in `nep.fit`.

    Raises:
        ValueError: if an option has an empty value, or a config file is broken.
    """
    kinds = _list_kinds(parser)
    found: list[str] = []
    lists: dict[str, list[str]] = {}
    position = 0
    while position < len(arguments):
        argument = arguments[position]
        position += 1
        if not argument.startswith("--") or argument == "--":
            found.append(argument)
            continue
        name, has_value, value = argument[2:].partition("=")
        name = name.replace("-", "_")
        head, dot, last = name.rpartition(".")
        switched_off = f"{head}{dot}{last.removeprefix('no_')}"
        if last.startswith("no_") and kinds.get(switched_off) == "flag" and not has_value:
            found.append(f"--{switched_off}=false")
            continue
        form = kinds.get(name)
        values = [value] if has_value else []
        if not has_value and form is not None:
            while position < len(arguments) and not arguments[position].startswith("--"):
                if values and form != "list":
                    break
                if form == "flag" and arguments[position].lower() not in ("true", "false"):
                    break
                values.append(arguments[position])
                position += 1
        if form is not None and "" in values:
            raise ValueError(
                f"--{name} must have a value, got an empty one. Leave it out, or name it."
            )
        if name == "config" and values:
            _check_config(values[0])
        if form == "flag" and not values:
            values = ["true"]
        is_list = values and values[0].startswith("[") and values[0].endswith("]")  # of a config
        if form == "list" and values and not is_list:
            lists.setdefault(name, []).extend(values)  # also where the option is repeated
        elif not values:
            found.append(f"--{name}={value}" if has_value else f"--{name}")
        else:
            value = values[0] if form == "word" else _find_class(name, values[0], prefix)
            found.append(f"--{name}={value}")
    return found + [f"--{name}={json.dumps(values)}" for name, values in lists.items()]


def choose(
    prog: str,
    commands: Mapping[str, Callable[[Sequence[str]], int]],
    arguments: Sequence[str] | None,
    status: int = 1,
) -> int:
    """Run the command that the first argument names, with the others.

    Args:
        prog: what the commands belong to.
        commands: what runs each, by name; the first line of its docstring is its help.
        arguments: None for those of the process.
        status: where input is bad.

    Returns:
        The exit status; 2 if there is no such command or option.
    """
    arguments = sys.argv[1:] if arguments is None else arguments
    lines = [f"  {name:12}{_get_summary(run)}" for name, run in commands.items()]
    usage = "\n".join([f"usage: {prog} COMMAND ...", "", *lines, "", f"{prog} COMMAND --help"])
    if arguments and arguments[0] in ("-h", "--help"):
        print(usage)
        return 0
    if not arguments or arguments[0] not in commands:
        found = repr(arguments[0]) if arguments else "none"
        print(f"error: command must be one of {', '.join(commands)}, got {found}.", file=sys.stderr)
        return 2
    try:
        return commands[arguments[0]](arguments[1:])
    except (ArgumentError, *BAD_INPUT) as error:
        return _report(error, status)


@contextmanager
def one_line_errors(status: int = 1) -> Iterator[None]:
    """End with one line instead of a traceback if input is bad; status 2 for unknown options."""
    try:
        yield
    except (ArgumentError, *BAD_INPUT) as error:
        is_plain = status == 1 and not isinstance(error, ArgumentError)
        sys.exit(_make_line(error) if is_plain else _report(error, status))


def _report(error: Exception, status: int) -> int:
    print(_make_line(error), file=sys.stderr)
    return 2 if isinstance(error, ArgumentError) else status


def _make_line(error: Exception) -> str:
    if isinstance(error, BrokenPipeError):
        raise error  # the caller knows whether it matters
    if isinstance(error, MemoryError):
        error = MemoryError(
            "memory must hold what was asked for, got too little of it. Ask for fewer homes, "
            "steps, places or workers."
        )
    line = " ".join(str(error).split())
    return "error: " + shorten_text(shorten_values(line), _MOST_CHARACTERS)


def _get_summary(function: Callable[..., Any]) -> str:
    function = getattr(function, "func", function)  # of a partial
    return (function.__doc__ or "").partition("\n")[0]


def _list_kinds(parser: ArgumentParser) -> dict[str, str]:
    """Tell the kind of each option.

    "list" takes several values, "flag" may have none, "word" is a text that stands for no class.
    """
    kinds = {}
    for action in parser._actions:
        typehint = getattr(action, "_typehint", None)
        is_union = get_origin(typehint) in (Union, UnionType)
        parts = get_args(typehint) if is_union else (typehint,)
        # What may be a number, too, such as Lightning's devices, is written as a list by hand.
        is_list = all(
            get_origin(part) in (list, tuple, Sequence) for part in parts if part is not type(None)
        )
        is_word = typehint is str or get_origin(typehint) is Literal
        kinds[action.dest] = (
            "flag" if typehint is bool else "list" if is_list else "word" if is_word else "value"
        )
    return kinds


def _check_config(text: str) -> None:
    """Check a config file, unless the text is no file but what would stand in one."""
    try:
        if os.path.exists(text):
            read_yaml(text)
    except OSError as error:
        raise ValueError(
            f"--config must be a file that can be read, got {shorten(error.strerror)} for {text}. "
            "Check the path."
        ) from error
    except ValueError as error:
        raise ValueError(
            f"--config must be a YAML file in UTF-8, got {shorten_text(str(error))} in {text}. "
            "Mend it."
        ) from error


def _find_class(name: str, value: str, prefix: str) -> str:
    """Return the import path of what is called so; an import path or a file as it is."""
    names = _NAMED.get(name.removeprefix(prefix)) if name.startswith(prefix) else None
    if names is None:
        return value
    if value in names:
        return names[value]
    is_word = value.isidentifier() and value.islower() and value != "null"
    if is_word and not Path(value).exists():
        raise ValueError(
            f"--{name} must be one of {', '.join(names)}, or the import path of a class, got "
            f"{shorten(value)}. Choose one."
        )
    return value
