"""Values as clients of MCP send them, made what the schema declares: "3", 3.0, lists as text."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from sgm.files import parse_json

_TIMES = 3  # that a value may be written as JSON text within JSON text
_TYPES: Mapping[str, tuple[type, ...]] = {
    "string": (str,),
    "integer": (int,),
    "number": (int, float),
    "boolean": (bool,),
    "array": (list,),
    "object": (dict,),
}


def coerce(value: Any, schema: Mapping[str, Any]) -> Any:
    """Return a value as a JSON Schema declares it, where it can be read so; else as it is.

    A text is read as JSON where it may be another type than text: "3" is a number where a number
    may be, '["mug"]' a list where a list may be. A text that may be a text and is no JSON of
    another type stays. 3.0 is a whole number, and a whole number is a text where no number may be.
    """
    options = schema.get("anyOf", (schema,))
    for candidate in _list_candidates(value):
        for option in options:
            if option["type"] != "string" and _fits(candidate, option["type"]):
                return _coerce_parts(candidate, option)
    types = {option["type"] for option in options}
    if "string" in types and types.isdisjoint(("integer", "number")) and _is_whole(value):
        return str(int(value))
    may_be_text = "string" in types
    return None if None in _list_candidates(value) and not may_be_text else value


def _list_candidates(value: Any) -> list[Any]:
    """List what a value may mean: itself, and what its text is as JSON."""
    found = [value]
    for _ in range(_TIMES):
        if not isinstance(found[-1], str):
            break
        try:
            found.append(parse_json(found[-1]))
        except ValueError:
            break
    whole = [int(number) for number in found if isinstance(number, float) and number.is_integer()]
    return whole + found


def _is_whole(value: Any) -> bool:
    return _fits(value, "integer") or (isinstance(value, float) and value.is_integer())


def _fits(value: Any, name: str) -> bool:
    return isinstance(value, _TYPES[name]) and isinstance(value, bool) == (name == "boolean")


def _coerce_parts(value: Any, schema: Mapping[str, Any]) -> Any:
    if isinstance(value, list) and "items" in schema:
        return [coerce(part, schema["items"]) for part in value]
    if isinstance(value, dict):
        known = schema.get("properties", {})
        return {
            name: coerce(part, known[name]) if name in known else part
            for name, part in value.items()
        }
    return value
