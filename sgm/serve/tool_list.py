"""The tools of MCP: the calls with short schemas, as a model reads all of them before it begins."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from sgm.finder.map_calls import MapCalls
from sgm.messages import shorten, shorten_text
from sgm.serve.calls import BY_NAME, CALLS, REQUIRED, Call

_CHANGE: Final = "change"  # argument of the tool of all map calls: which one it is
# What a model has to know of an argument. Bounds are checked, and said by who breaks them.
_KEPT = frozenset(
    ("anyOf", "default", "description", "enum", "items", "properties", "required", "type")
)


@dataclass(frozen=True, slots=True)
class Tool:
    """A tool that a client is shown.

    Attributes:
        name: of the call, or of what several calls do.
        about: one sentence.
        schema: JSON Schema of its arguments.
        is_write: whether it changes the memory.
    """

    name: str
    about: str
    schema: Mapping[str, Any]
    is_write: bool


def shorten_schema(schema: Mapping[str, Any]) -> dict[str, Any]:
    """Return a schema that allows what another one does, and says no bounds."""
    short = {key: value for key, value in schema.items() if key in _KEPT}
    if "properties" in short:
        short["properties"] = {
            name: shorten_schema(part) for name, part in short["properties"].items()
        }
    if "items" in short:
        short["items"] = shorten_schema(short["items"])
    if "anyOf" in short:
        different: list[dict[str, Any]] = []
        for option in map(shorten_schema, short["anyOf"]):
            if option not in different:
                different.append(option)
        short["anyOf"] = different
    return short


def find_call(name: str, arguments: Mapping[str, Any]) -> tuple[Call, Mapping[str, Any]]:
    """Return the call that is meant by the name of a tool or call, and its arguments.

    Raises:
        ValueError: if there is none.
    """
    if name != _MAP_TOOL.name:
        if name not in BY_NAME:
            raise ValueError(
                f"tool must be one of {', '.join(tool.name for tool in TOOLS)}, got "
                f"{shorten_text(name)!r}. List the tools."
            )
        return BY_NAME[name], arguments
    change = arguments.get(_CHANGE)
    names = [call.name for call in _MAP_CALLS]
    if change not in names:
        got = "none" if change is None else shorten(change)
        raise ValueError(
            f"{_CHANGE} must be one of {', '.join(names)}, got {got}. Name the change."
        )
    # A model gives null to what another change needs.
    given = {key: value for key, value in arguments.items() if value is not None}
    del given[_CHANGE]
    return BY_NAME[change], given


def _make_tool(call: Call) -> Tool:
    sentence = call.about.partition(". ")[0].removesuffix(".")
    schema = _shorten_arguments(call)
    return Tool(call.name, f"{sentence}.", schema, call.is_write)


def _shorten_arguments(call: Call) -> dict[str, Any]:
    """Return the short schema of a call; what its key is, the server says once for all."""
    schema = shorten_schema(call.make_input_schema())
    schema["properties"].get("key", {}).pop("description", None)
    return schema


def _make_map_tool() -> Tool:
    properties: dict[str, Any] = {
        _CHANGE: {"type": "string", "enum": [call.name for call in _MAP_CALLS]}
    }
    needed = []
    for call in _MAP_CALLS:
        for name, schema in _shorten_arguments(call)["properties"].items():
            properties.setdefault(name, schema)
            entry = schema.get("items", {}).get("properties", {})
            for said in entry.keys() & properties.keys():  # how, an argument of that name says
                del entry[said]
        names = [argument.name for argument in call.arguments if argument.default is REQUIRED]
        needed.append(f"{call.name}({', '.join(names)})")
    return Tool(
        "change_map",
        f"Change the rooms and places of the home: {', '.join(needed)}.",
        {"type": "object", "properties": properties, "required": [_CHANGE]},
        True,
    )


_MAP_CALLS: Final = tuple(call for call in CALLS if call.name in vars(MapCalls))
_MAP_TOOL: Final = _make_map_tool()
TOOLS: Final = (*(_make_tool(call) for call in CALLS if call not in _MAP_CALLS), _MAP_TOOL)
