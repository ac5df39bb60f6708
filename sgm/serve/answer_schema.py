"""JSON Schema of what a call answers, from the dataclass that it returns."""

from __future__ import annotations

import re
import types
from dataclasses import fields, is_dataclass
from textwrap import dedent
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

_PLAIN = {str: "string", int: "integer", float: "number", bool: "boolean", type(None): "null"}
_FIELD = re.compile(r"^([\w, ]+): (.*(?:\n {4}.*)*)", re.MULTILINE)


def make_schema(answer_type: Any) -> dict[str, Any]:
    """Return the JSON Schema of a type: dataclasses, tuples, unions, literals and plain values.

    All fields of a dataclass are always there, but for those that are `LEFT_OUT`; their
    descriptions are those of its docstring.
    """
    if is_dataclass(answer_type):
        hints, told = get_type_hints(answer_type), read_attributes(answer_type)
        return {
            "type": "object",
            "title": answer_type.__name__,  # type: ignore[union-attr]
            "properties": {
                field.name: {**make_schema(hints[field.name]), "description": told[field.name]}
                for field in fields(answer_type)
            },
            "required": [field.name for field in fields(answer_type) if not field.metadata],
        }
    if answer_type in _PLAIN:
        return {"type": _PLAIN[answer_type]}
    origin, arguments = get_origin(answer_type), get_args(answer_type)
    if origin is Literal:
        return {"type": "string", "enum": list(arguments)}
    if origin in (Union, types.UnionType):
        return {"anyOf": [make_schema(argument) for argument in arguments]}
    assert origin is tuple, answer_type
    if arguments[-1] is ...:
        return {"type": "array", "items": make_schema(arguments[0])}
    items = make_schema(arguments[0])
    return {"type": "array", "items": items, "minItems": len(arguments), "maxItems": len(arguments)}


def read_attributes(answer_type: Any) -> dict[str, str]:
    """Return what the docstrings of a dataclass and of what it extends say of each field."""
    told: dict[str, str] = {}
    for cls in reversed(answer_type.__mro__):
        _, _, attributes = (cls.__doc__ or "").partition("Attributes:\n")
        for names, text in _FIELD.findall(dedent(attributes)):  # as Python 3.13 does by itself
            about = " ".join(text.split()).rstrip(".")
            told |= {name.strip(): about for name in names.split(",")}
    return told
