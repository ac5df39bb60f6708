"""What an argument of a call must be: checked when it arrives, and told as JSON Schema."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Any, NoReturn, Protocol

from sgm.files import parse_json
from sgm.memory.identity import MOST_NUMBERS
from sgm.memory.sighting import SPELLINGS, Sighting, read_relation
from sgm.memory.time_steps import MAX_TIME
from sgm.messages import shorten, shorten_text
from sgm.names.words import MAX_LENGTH

MOST_SEEN = 500  # sightings of a look


class Rule(Protocol):
    """A rule for one argument."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""

    def read(self, name: str, value: Any) -> Any:
        """Return the value for Python.

        Args:
            name: of the argument, for the message.
            value: as JSON has it.

        Raises:
            ValueError: if it breaks the rule.
        """


@dataclass(frozen=True, slots=True)
class TextRule:
    """A text of 1 to `most` characters.

    Attributes:
        most: characters.
    """

    most: int = MAX_LENGTH

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "string", "minLength": 1, "maxLength": self.most}

    def read(self, name: str, value: Any) -> str:
        """Return the text."""
        if not isinstance(value, str) or not 1 <= len(value) <= self.most:
            _refuse(name, f"be a text of 1 to {self.most} characters", value)
        return value


@dataclass(frozen=True, slots=True)
class ChoiceRule:
    """One of some texts.

    Attributes:
        names: which.
    """

    names: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "string", "enum": list(self.names)}

    def read(self, name: str, value: Any) -> str:
        """Return the text."""
        if not isinstance(value, str) or value not in self.names:
            _refuse(name, f"be one of {', '.join(self.names)}", value)
        return value


@dataclass(frozen=True, slots=True)
class RelationRule:
    """How a thing lies at a place: "in" or "onTop" it, spelled as `read_relation` reads it."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "string", "enum": list(SPELLINGS)}

    def read(self, name: str, value: Any) -> str:
        """Return "in" or "onTop"."""
        try:
            return read_relation(value if value != "" else None)
        except ValueError:
            _refuse(name, f"be one of {', '.join(SPELLINGS)}", value)


@dataclass(frozen=True, slots=True)
class WholeRule:
    """A whole number.

    Attributes:
        least, most: bounds, which it may be itself.
    """

    least: int
    most: int

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "integer", "minimum": self.least, "maximum": self.most}

    def read(self, name: str, value: Any) -> int:
        """Return the number."""
        if not _is_whole(value) or not self.least <= value <= self.most:
            _refuse(name, f"be a whole number from {self.least} to {self.most}", value)
        return int(value)


@dataclass(frozen=True, slots=True)
class NumberRule:
    """A number above `above`, at most `most`.

    Attributes:
        above: bound that it may not be.
        most: bound that it may be.
    """

    above: float
    most: float

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "number", "exclusiveMinimum": self.above, "maximum": self.most}

    def read(self, name: str, value: Any) -> float:
        """Return the number."""
        if not _is_number(value) or not self.above < value <= self.most:
            _refuse(name, f"be a number above {self.above:g} and at most {self.most:g}", value)
        return float(value)


@dataclass(frozen=True, slots=True)
class TimeRule:
    """A local date and time in ISO 8601 without a zone, or a time step."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        step = {"type": "integer", "minimum": 0, "maximum": MAX_TIME}
        return {"anyOf": [{"type": "string", "minLength": 1, "maxLength": 40}, step]}

    def read(self, name: str, value: Any) -> datetime | int:
        """Return a datetime, or the step."""
        if _is_whole(value) and 0 <= value <= MAX_TIME:
            return int(value)
        time = None
        if isinstance(value, str) and len(value) <= 40:
            try:
                time = datetime.fromisoformat(value)
            except ValueError:
                pass
        if time is None or time.tzinfo is not None:
            rule = "be local time such as 2026-11-16T18:30 without a zone, or a time step"
            _refuse(name, rule, value)
        return time


@dataclass(frozen=True, slots=True)
class PlaceRule:
    """A place by its id, or by a name such as "white fridge in kitchen"."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"anyOf": [TextRule().to_json(), WholeRule(0, MAX_TIME).to_json()]}

    def read(self, name: str, value: Any) -> str | int:
        """Return the name or the id."""
        if _is_whole(value) and 0 <= value <= MAX_TIME:
            return int(value)
        if not isinstance(value, str) or not 1 <= len(value) <= MAX_LENGTH:
            _refuse(name, f"be the id of a place, or a name of 1 to {MAX_LENGTH} characters", value)
        return value


@dataclass(frozen=True, slots=True)
class PositionRule:
    """Two numbers, metres."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}

    def read(self, name: str, value: Any) -> tuple[float, float]:
        """Return two finite numbers."""
        is_pair = isinstance(value, list) and len(value) == 2 and all(map(_is_number, value))
        if not is_pair or not all(abs(number) <= 1e9 for number in value):
            _refuse(name, "be two numbers, metres, such as [1.5, 4]", value)
        x, y = value
        return float(x), float(y)


@dataclass(frozen=True, slots=True)
class StartRule:
    """A position, or a place."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {"anyOf": [*PlaceRule().to_json()["anyOf"], PositionRule().to_json()]}

    def read(self, name: str, value: Any) -> tuple[float, float] | str | int:
        """Return what `PositionRule` or `PlaceRule` does."""
        return (PositionRule() if isinstance(value, list) else PlaceRule()).read(name, value)


@dataclass(frozen=True, slots=True)
class VectorRule:
    """A list of numbers, such as an embedding."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        return {
            "type": "array",
            "items": {"type": "number"},
            "minItems": 1,
            "maxItems": MOST_NUMBERS,
        }

    def read(self, name: str, value: Any) -> tuple[float, ...]:
        """Return the numbers."""
        is_row = isinstance(value, list) and 1 <= len(value) <= MOST_NUMBERS
        if not is_row or not all(_is_number(one) and abs(one) <= 1e9 for one in value):
            _refuse(name, f"be a list of 1 to {MOST_NUMBERS} numbers", value)
        return tuple(map(float, value))


# Of the fields of a sighting.
_SIGHTING: Mapping[str, Rule] = {
    "thing": TextRule(),
    "relation": RelationRule(),
    "confidence": NumberRule(0, 1),
    "owner": TextRule(),
    "id": TextRule(),
    "embedding": VectorRule(),
}


@dataclass(frozen=True, slots=True)
class SeenRule:
    """A list of what was seen: names, or objects with `thing`, and perhaps more about it."""

    def to_json(self) -> dict[str, Any]:
        """Return it as JSON Schema."""
        thing = {
            "type": "object",
            "properties": {name: rule.to_json() for name, rule in _SIGHTING.items()},
            "required": ["thing"],
            "additionalProperties": False,
        }
        return {
            "type": "array",
            "items": {"anyOf": [TextRule().to_json(), thing]},
            "maxItems": MOST_SEEN,
        }

    def read(self, name: str, value: Any) -> list[Sighting]:
        """Return sightings."""
        if not isinstance(value, list) or len(value) > MOST_SEEN:
            _refuse(name, f"be a list of at most {MOST_SEEN} things", value)
        return [self._read_one(f"{name}[{row}]", one) for row, one in enumerate(value)]

    def _read_one(self, name: str, value: Any) -> Sighting:
        if isinstance(value, str):
            return Sighting(TextRule().read(name, value))
        if not isinstance(value, dict) or "thing" not in value or not value.keys() <= {*_SIGHTING}:
            _refuse(name, f"be a name, or an object of {', '.join(_SIGHTING)}", value)
        read = {key: _SIGHTING[key].read(f"{name}.{key}", own) for key, own in value.items()}
        return Sighting(read.pop("thing"), **read)


def read_text(rule: Rule, name: str, text: str) -> Any:
    """Return the value of a text of a query: "3" is a number where a number is meant.

    Raises:
        ValueError: if it breaks the rule.
    """
    if not isinstance(rule, TextRule | ChoiceRule | RelationRule):
        try:
            value = parse_json(text)
        except ValueError:
            value = text
        if not isinstance(value, str):
            return rule.read(name, value)
    return rule.read(name, text)


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    """Tell whether it is a finite number of which there is a float."""
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return is_number and abs(value) <= sys.float_info.max


def _refuse(name: str, rule: str, value: Any) -> NoReturn:
    got = shorten_text(shorten(value).encode("utf-8", "backslashreplace").decode())
    raise ValueError(f"{name} must {rule}, got {got}. See /openapi.json.")
