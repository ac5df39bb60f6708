"""What was seen in a look, as callers say it: names, mappings or sightings."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from typing import Any, TypeAlias

from sgm.memory.sighting import Sighting
from sgm.messages import shorten

Seen: TypeAlias = Iterable[str | Mapping[str, Any] | Sighting]
_THING = "thing"  # what `Sighting.description` is called in JSON
_FIELDS = (_THING, *[field.name for field in fields(Sighting) if field.init][1:])


def read_seen(seen: Seen) -> list[Sighting]:
    """Return what was seen as sightings.

    Args:
        seen: of each thing its name, a mapping with `thing` and perhaps other fields of `Sighting`,
            or a sighting.

    Raises:
        ValueError: if it is something else, or a value of a sighting is out of range.
    """
    if isinstance(seen, (str, bytes, Mapping, Sighting)) or not isinstance(seen, Iterable):
        raise ValueError(
            f"seen must be a list of all things that were seen, got {shorten(seen)}. Write "
            '["mug"]; [] if nothing was.'
        )
    return [_read_sighting(f"seen[{number}]", value) for number, value in enumerate(seen)]


def _read_sighting(spot: str, value: Any) -> Sighting:
    if isinstance(value, Sighting):
        return value
    if isinstance(value, str):
        return Sighting(value)
    if not isinstance(value, Mapping) or _THING not in value or not value.keys() <= {*_FIELDS}:
        raise ValueError(
            f"{spot} must be a name, a Sighting, or a mapping of {', '.join(_FIELDS)}, got "
            f'{shorten(value)}. Write {{"thing": "mug"}}.'
        )
    about = {name: said for name, said in value.items() if said is not None}  # None: left out
    if _THING not in about:
        raise ValueError(f"thing of {spot} must be a name, got None. Say what was seen.")
    return Sighting(about.pop(_THING), **about)
