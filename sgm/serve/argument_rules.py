"""What an argument of a call must be: checked when it arrives, and told as JSON Schema."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any

from sgm.checks import is_finite
from sgm.files import parse_json
from sgm.layout.box import INTERIORS
from sgm.layout.outline import MOST_CORNERS
from sgm.memory.sighting import (
    MOST_NUMBERS,
    MOST_PICTURE,
    SPELLINGS,
    Sighting,
    read_picture,
    read_relation,
)
from sgm.messages import shorten, shorten_text
from sgm.names.words import MAX_LENGTH
from sgm.schema import MAX_TIME, MOST_METRES

MOST_SEEN = 500  # sightings of a look
MOST_THINGS = 10  # that are asked for at once
MOST_ENTRIES = 10_000  # rooms, or pieces of furniture, of a map
_LARGEST = 1e9  # number of an embedding, or of a start in metres


@dataclass(frozen=True, slots=True)
class Rule:
    """A rule for one argument.

    Attributes:
        schema: JSON Schema of it.
        must: the same in words, for the message.
        convert: returns a value for Python, given the name of the argument and the value as JSON
            has it; None for one that breaks the rule.
        is_text: whether a text of a query is meant as it is written, as "3" is by a name.
    """

    schema: Mapping[str, Any]
    must: str
    convert: Callable[[str, Any], Any]
    is_text: bool = False

    def read(self, name: str, value: Any) -> Any:
        """Return the value for Python of one in JSON; raises ValueError if it breaks the rule."""
        converted = self.convert(name, value)
        if converted is None:
            got = shorten_text(shorten(value).encode("utf-8", "backslashreplace").decode())
            raise ValueError(f"{name} must {self.must}, got {got}. See the schema of the call.")
        return converted

    def read_text(self, name: str, text: str) -> Any:
        """Return the value of a text of a query: "3" is a number where a number is meant."""
        if not self.is_text:
            try:
                value = parse_json(text)
            except ValueError:
                value = text
            if not isinstance(value, str):
                return self.read(name, value)
        return self.read(name, text)


def make_text_rule(most: int = MAX_LENGTH) -> Rule:
    """Return the rule of a text of 1 to `most` characters."""
    return Rule(
        {"type": "string", "minLength": 1, "maxLength": most},
        f"be a text of 1 to {most} characters",
        lambda _, value: value if isinstance(value, str) and 1 <= len(value) <= most else None,
        is_text=True,
    )


def make_choice_rule(*names: str) -> Rule:
    """Return the rule of one of some texts."""
    return Rule(
        {"type": "string", "enum": list(names)},
        f"be one of {', '.join(names)}",
        lambda _, value: value if isinstance(value, str) and value in names else None,
        is_text=True,
    )


def make_whole_rule(least: int, most: int) -> Rule:
    """Return the rule of a whole number between bounds, which it may be itself."""
    return Rule(
        {"type": "integer", "minimum": least, "maximum": most},
        f"be a whole number from {least} to {most}",
        lambda _, value: int(value) if _is_whole(value) and least <= value <= most else None,
    )


def make_number_rule(above: float, most: float) -> Rule:
    """Return the rule of a number above a bound, and at most another one."""
    return Rule(
        {"type": "number", "exclusiveMinimum": above, "maximum": most},
        f"be a number above {above:g} and at most {most:g}",
        lambda _, value: float(value) if is_finite(value) and above < value <= most else None,
    )


def _read_relation(name: str, value: Any) -> str | None:
    try:
        return read_relation(value if value != "" else None)
    except ValueError:
        return None


def _read_picture(name: str, value: Any) -> str | None:
    try:
        return read_picture(value)
    except ValueError:
        return None


def _read_time(name: str, value: Any) -> datetime | int | None:
    if _is_whole(value) and 0 <= value <= MAX_TIME:
        return int(value)
    if not isinstance(value, str) or len(value) > 40:
        return None
    try:
        time = datetime.fromisoformat(value)
    except ValueError:
        return None
    return time if time.tzinfo is None else None


def _read_place(name: str, value: Any) -> str | int | None:
    if _is_whole(value) and 0 <= value <= MAX_TIME:
        return int(value)
    return value if isinstance(value, str) and 1 <= len(value) <= MAX_LENGTH else None


def _read_names(name: str, value: Any) -> str | list[str] | None:
    if not isinstance(value, list):
        return TEXT.read(name, value) if isinstance(value, str) and value else None
    if not 1 <= len(value) <= MOST_THINGS:
        return None
    return [TEXT.read(f"{name}[{number}]", text) for number, text in enumerate(value)]


def _read_numbers(
    value: Any, least: int, most: int, largest: float = _LARGEST
) -> tuple[float, ...] | None:
    if not isinstance(value, list) or not least <= len(value) <= most:
        return None
    fits = all(is_finite(number) and abs(number) <= largest for number in value)
    return tuple(map(float, value)) if fits else None


def _read_corners(value: Any) -> list[tuple[float, ...]] | None:
    if not isinstance(value, list) or not 3 <= len(value) <= MOST_CORNERS:
        return None
    corners = [_read_numbers(corner, 2, 2) for corner in value]
    return None if None in corners else [corner for corner in corners if corner is not None]


def _read_seen(name: str, value: Any) -> list[Sighting] | None:
    if not isinstance(value, list) or len(value) > MOST_SEEN:
        return None
    return [_THING.read(f"{name}[{number}]", seen) for number, seen in enumerate(value)]


def _read_sighting(name: str, value: Any) -> Sighting | None:
    if isinstance(value, str):
        return Sighting(TEXT.read(name, value))
    if not isinstance(value, dict) or not value.keys() <= {*_SIGHTING}:
        return None
    said = {key: part for key, part in value.items() if part is not None}  # null is left out
    if "thing" not in said:
        return None
    read = {key: _SIGHTING[key].read(f"{name}.{key}", part) for key, part in said.items()}
    return Sighting(read.pop("thing"), **read)


def _is_whole(value: Any) -> bool:
    """Tell whether it is a whole number in the sense of JSON Schema, of which 3.0 is one."""
    if isinstance(value, float):
        return value.is_integer()
    return isinstance(value, int) and not isinstance(value, bool)


_STEP = {"type": "integer", "minimum": 0, "maximum": MAX_TIME}
TEXT = make_text_rule()
# A name, or names, of several things.
THINGS = Rule(
    {
        "anyOf": [
            TEXT.schema,
            {"type": "array", "items": TEXT.schema, "minItems": 1, "maxItems": MOST_THINGS},
        ]
    },
    f"be a text of 1 to {MAX_LENGTH} characters, or a list of 1 to {MOST_THINGS} of them",
    _read_names,
    is_text=True,
)
SHARE = make_number_rule(0, 1)
YES_NO = Rule(
    {"type": "boolean"},
    "be true or false",
    lambda _, value: value if isinstance(value, bool) else None,
)
# How things lie at a place, spelled as `read_relation` reads it.
RELATION = Rule(
    {"type": "string", "enum": list(SPELLINGS)},
    f"be one of {', '.join(SPELLINGS)}",
    _read_relation,
    is_text=True,
)
TIME = Rule(
    {"anyOf": [{"type": "string", "minLength": 1, "maxLength": 40}, _STEP]},
    "be local time such as 2026-11-16T18:30 without a zone, or a time step",
    _read_time,
)
PLACE = Rule(
    {"anyOf": [TEXT.schema, _STEP]},
    f"be the id of a place, or a name of 1 to {MAX_LENGTH} characters",
    _read_place,
)
# Of a room, by its id or a name.
ROOM = Rule(PLACE.schema, PLACE.must.replace("place", "room"), _read_place)
# Where one stands or starts; with a height, as answers have it, which says nothing of that.
POSITION = Rule(
    {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 3},
    "be two numbers, metres, such as [1.5, 4], or three",
    lambda _, value: _read_numbers(value, 2, 3),
)
POINT = Rule(
    {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    "be three numbers, metres, such as [1.5, 4, 0.8]",
    lambda _, value: _read_numbers(value, 3, 3),
)
NUMBER = Rule(
    {"type": "number", "minimum": -_LARGEST, "maximum": _LARGEST},
    f"be a number within {_LARGEST:g}",
    lambda _, value: float(value) if is_finite(value) and abs(value) <= _LARGEST else None,
)
_PAIR = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
CORNERS = Rule(
    {"type": "array", "items": _PAIR, "minItems": 3, "maxItems": MOST_CORNERS},
    f"be 3 to {MOST_CORNERS} corners, x, y of each, metres",
    lambda _, value: _read_corners(value),
)
INTERIOR = make_choice_rule(*INTERIORS)
# Extents of a place, as `read_extents` takes them.
EXTENTS: Mapping[str, Rule] = {
    "center": POINT,
    "size": POINT,
    "yaw": NUMBER,
    "interior": INTERIOR,
    "polygon": CORNERS,
    "bottom": NUMBER,
    "top": NUMBER,
}
COST = Rule(
    {"type": "number", "minimum": 0, "maximum": _LARGEST},
    f"be a number from 0 to {_LARGEST:g}",
    lambda _, value: float(value) if is_finite(value) and 0 <= value <= _LARGEST else None,
)


def _make_entries_rule(needed: Sequence[str], known: Mapping[str, Any]) -> Rule:
    """Return the rule of the rooms, or the furniture, of a map: `HomeMap` reads what is in each."""
    entry = {
        "type": "object",
        "properties": dict(known),
        "required": list(needed),
        "additionalProperties": False,
    }
    return Rule(
        {"type": "array", "items": entry, "minItems": 1, "maxItems": MOST_ENTRIES},
        f"be a list of 1 to {MOST_ENTRIES} entries with {' and '.join(needed)}",
        lambda _, value: (
            value if isinstance(value, list) and 1 <= len(value) <= MOST_ENTRIES else None
        ),
    )


_NAMED = {"name": TEXT.schema, "label": TEXT.schema, "id": _STEP}
ROOMS = _make_entries_rule(
    ("name",),
    {**_NAMED, "floor": {"type": "array", "items": _PAIR, "minItems": 2, "maxItems": MOST_CORNERS}},
)
FURNITURE = _make_entries_rule(
    ("name", "room"),
    {
        **_NAMED,
        "room": TEXT.schema,
        "position": POSITION.schema,
        **{name: rule.schema for name, rule in EXTENTS.items()},
        "open_cost": COST.schema,
        "is_open": YES_NO.schema,
    },
)
# A position, or a place.
START = Rule(
    {"anyOf": [*PLACE.schema["anyOf"], POSITION.schema]},
    PLACE.must,
    lambda name, value: (POSITION if isinstance(value, list) else PLACE).read(name, value),
)
_SIGHTING: Mapping[str, Rule] = {
    "thing": TEXT,
    "relation": RELATION,
    "confidence": SHARE,
    "owner": TEXT,
    "id": TEXT,
    "embedding": Rule(
        {"type": "array", "items": {"type": "number"}, "minItems": 1, "maxItems": MOST_NUMBERS},
        f"be a list of 1 to {MOST_NUMBERS} numbers",
        lambda _, value: _read_numbers(value, 1, MOST_NUMBERS),
    ),
    "position": Rule(
        {
            "type": "array",
            "minItems": 3,
            "maxItems": 3,
            "items": {"type": "number", "minimum": -MOST_METRES, "maximum": MOST_METRES},
        },
        f"be x, y, z in the map, three numbers of metres within {MOST_METRES:g}",
        lambda _, value: _read_numbers(value, 3, 3, MOST_METRES),
    ),
    "position_sd": Rule(
        {"type": "number", "minimum": 0, "maximum": MOST_METRES},
        f"be a number of metres from 0 to {MOST_METRES:g}",
        lambda _, value: float(value) if is_finite(value) and 0 <= value <= MOST_METRES else None,
    ),
    "picture": Rule(
        {"type": "string", "minLength": 1, "maxLength": MOST_PICTURE},
        f"be the path or id of a picture, 1 to {MOST_PICTURE} characters that can be printed",
        _read_picture,
        is_text=True,
    ),
}
# A name, or an object with `thing`, and perhaps more about it.
_THING = Rule(
    {
        "type": "object",
        "properties": {name: rule.schema for name, rule in _SIGHTING.items()},
        "required": ["thing"],
        "additionalProperties": False,
    },
    f"be a name, or an object of {', '.join(_SIGHTING)}",
    _read_sighting,
)
SEEN = Rule(
    {"type": "array", "items": {"anyOf": [TEXT.schema, _THING.schema]}, "maxItems": MOST_SEEN},
    f"be a list of at most {MOST_SEEN} things",
    _read_seen,
)
