"""YAML of files and options: of plain values, and of no more than it says."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, ClassVar

import yaml

from sgm.files import MOST_LEVELS, make_read_error, read_file
from sgm.messages import shorten_text

MOST_BYTES = 1 << 24  # of a file
MOST_VALUES = 100_000  # with each alias counted as often as it stands there
_MOST_DIGITS = 4_000  # that a number may be written with
_PLAIN = frozenset(
    f"tag:yaml.org,2002:{name}" for name in ("str", "int", "float", "bool", "null", "seq", "map")
)


def read_yaml(path: str | Path) -> Any:
    """Read a YAML file; raises OSError if it cannot be read, ValueError as `parse_yaml` does."""
    return parse_yaml(read_file(path, MOST_BYTES).decode("utf-8-sig"))


def load_yaml(name: str, path: str | Path) -> Any:
    """Read the YAML file of what has a name; raises ValueError, which names both, if it cannot."""
    rule = f"{name} must be a file that can be read"
    try:
        return read_yaml(path)
    except OSError as error:
        raise make_read_error(error, rule, f"for {path}. Check the path.") from error
    except ValueError as error:
        got = shorten_text(str(error))
        raise ValueError(f"{rule} as YAML, got {got} in {path}. Mend it.") from None


def parse_yaml(
    text: str, construct: Callable[[str], Any] = lambda text: yaml.load(text, _Loader)
) -> Any:
    """Parse YAML of texts, numbers, booleans, null, lists and mappings.

    Args:
        text: of a file or an option.
        construct: makes values of a text that was found to be plain.

    Raises:
        ValueError: if it is no YAML (the place is named), is nested too deeply, has other values,
            aliases that stand for too many, or a value that is not what its tag says.
    """
    try:
        _check_events(yaml.parse(text, Loader=_BASE))
        return construct(text)
    except yaml.YAMLError as error:
        raise ValueError(" ".join(str(error).split())) from None
    except (TypeError, AttributeError, LookupError, RecursionError) as error:
        # such as `!!int ''`, a tag on what it does not fit
        raise ValueError(f"a value that cannot be made ({type(error).__name__})") from None


_BASE: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)  # the first is quicker


class _Loader(_BASE):
    """Reads dates as texts."""

    yaml_implicit_resolvers: ClassVar = {
        first: [(tag, pattern) for tag, pattern in found if not tag.endswith(":timestamp")]
        for first, found in _BASE.yaml_implicit_resolvers.items()
    }


def _check_events(events: Iterable[yaml.Event]) -> None:
    """Count levels and values without making any; refuse what is not plain."""
    sizes: dict[str, int] = {}  # of what has an anchor
    open_parts: list[list[Any]] = [[None, 0]]  # anchor, and values so far
    for event in events:
        tag = getattr(event, "tag", None)
        if tag is not None and tag not in _PLAIN and tag != "!":
            raise ValueError(f"a value of the kind {tag[:50]}, which is not plain")
        size = 0
        if isinstance(event, yaml.AliasEvent):
            if event.anchor in {anchor for anchor, _ in open_parts}:
                raise ValueError("an alias within what it stands for")
            size = sizes.get(event.anchor, 1)
        elif isinstance(event, yaml.ScalarEvent):
            size = 1
            if len(event.value) > _MOST_DIGITS and not event.value.strip("+-.:_0123456789"):
                raise ValueError(f"a number of {len(event.value)} digits")
            if event.anchor is not None:
                sizes[event.anchor] = size
        elif isinstance(event, yaml.CollectionStartEvent):
            open_parts.append([event.anchor, 1])
            if len(open_parts) > MOST_LEVELS + 1:
                raise ValueError("lists or mappings that are nested too deeply")
        elif isinstance(event, yaml.CollectionEndEvent):
            anchor, size = open_parts.pop()
            if anchor is not None:
                sizes[anchor] = size
        open_parts[-1][1] += size
        if open_parts[-1][1] > MOST_VALUES:
            raise ValueError(f"more than {MOST_VALUES} values, with its aliases")
