"""The kinds of events of a memory, each declared here once: its arguments, and what it is about."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple, TypeVar

from sgm.messages import shorten

START = "start"  # the only kind that no file holds: reading begins with it

# What an event is about.
BEGINNING = "beginning"  # a memory begins
LAYOUT = "layout"  # rooms, furniture, the map
LOOK = "look"
STATEMENT = "statement"  # where a thing is, as a person says or the robot did
IDENTITY = "identity"  # what a thing is called, and which things are one
QUESTION = "question"
TIME = "time"
SETTINGS = "settings"


class EventKind(NamedTuple):
    """What is known of all events of a kind.

    Attributes:
        about: one of the above.
        arguments: names of those that it must have.
    """

    about: str
    arguments: tuple[str, ...] = ()


def _row(about: str, arguments: str = "") -> EventKind:
    return EventKind(about=about, arguments=tuple(arguments.split()))


# A new kind is a row here. Each place that distinguishes kinds has a table of all of them, which
# `tests/test_event_kinds.py` compares with this one.
EVENT_KINDS: Mapping[str, EventKind] = {
    START: _row(BEGINNING),
    "room": _row(LAYOUT, "room label"),
    "rename_room": _row(LAYOUT, "room label"),
    "furniture": _row(LAYOUT, "furniture label room description position"),
    "move": _row(LAYOUT, "furniture room position"),
    "name": _row(LAYOUT, "furniture label description"),
    "merge_furniture": _row(LAYOUT, "furniture other"),
    "remove_room": _row(LAYOUT, "room"),
    "remove_furniture": _row(LAYOUT, "furniture"),
    "transform": _row(LAYOUT, "angle shift map_id"),
    "look": _row(LOOK, "furniture coverage seen"),
    "absent": _row(LOOK, "furniture description coverage"),
    "moved": _row(STATEMENT, "description furniture relation by confidence was_at"),
    "picked_up": _row(STATEMENT, "description by confidence was_at"),
    "put_down": _row(STATEMENT, "description furniture relation by confidence"),
    "rename": _row(IDENTITY, "description name by"),
    "merge": _row(IDENTITY, "description other by"),
    "split": _row(IDENTITY, "description by"),
    "split_off": _row(IDENTITY, "description furniture name by"),
    "remove_object": _row(IDENTITY, "description"),
    "query": _row(QUESTION, "description"),
    "step": _row(TIME, "num_steps"),
    "configure": _row(SETTINGS),
}


def list_kinds(*about: str) -> tuple[str, ...]:
    """Return the kinds that are about one of these."""
    return tuple(kind for kind, row in EVENT_KINDS.items() if row.about in about)


STATEMENTS = list_kinds(STATEMENT)
# Of these, the ones that say at which furniture a thing is, and not that the robot has it.
PLACED = tuple(kind for kind in STATEMENTS if "furniture" in EVENT_KINDS[kind].arguments)

Entry = TypeVar("Entry")


def get_by_kind(table: Mapping[str, Entry], kind: str, module: str) -> Entry:
    """Return what a table of a module says of a kind.

    Raises:
        ValueError: if it says nothing.
    """
    if kind not in table:
        raise ValueError(
            f"kind of an event must be one of {', '.join(table)}, got {shorten(kind)} in {module}. "
            "Say there what is done with it."
        )
    return table[kind]
