"""Events of homes as columns: a temporal graph between things and places."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from itertools import chain, pairwise
from typing import Any, TypeVar

import numpy as np

from sgm.messages import shorten

PLACE, THING = 0, 1  # kinds of nodes
KINDS = ("place", "thing")
PARTS = ("train", "val", "test")


@dataclass(frozen=True, slots=True)
class Events:
    """E events: a look at a place showed a thing there, or it did not.

    There is one event for each edge of the memory that a look updates or makes, which is what
    `Policy.observe` gets. A look that updates nothing has no event.

    Attributes:
        home: number of the home, (E,).
        time: time step, from 1 on, (E,).
        look: number of the look in its home, from 0 on; a time step may have several, (E,).
        order: position within the look, from 0 on: what was seen, as the detector listed it, then
            what was not seen, (E,).
        thing: node id, (E,).
        place: node id of the furniture that was looked at, (E,).
        relation: by number in `RELATIONS`, (E,).
        is_seen: whether the look showed the thing there, bool (E,).
        coverage: share of the furniture that was in view, (E,).
        confidence: of the detection, 0 where the thing was not seen, (E,).
    """

    home: np.ndarray
    time: np.ndarray
    look: np.ndarray
    order: np.ndarray
    thing: np.ndarray
    place: np.ndarray
    relation: np.ndarray
    is_seen: np.ndarray
    coverage: np.ndarray
    confidence: np.ndarray


@dataclass(frozen=True, slots=True)
class Nodes:
    """N nodes; the id of a node is its row, and no two homes share one.

    Attributes:
        home: number of the home, (N,).
        kind: 0 place, 1 thing, (N,).
        label: what it is, such as "mug" or "fridge", (N,).
        description: what it is called, such as "large red mug", (N,).
        room: label of the room of a place, "" for things, (N,).
    """

    home: np.ndarray
    kind: np.ndarray
    label: np.ndarray
    description: np.ndarray
    room: np.ndarray


@dataclass(frozen=True, slots=True)
class EventQuestions:
    """Q questions of the task, with their true answers: what a network learns and is scored on.

    Attributes:
        home: number of the home, (Q,).
        time: time step, (Q,).
        look: how many looks of the home came before it: its events are those of smaller `look`,
            (Q,).
        thing: node id of what is asked for, (Q,).
        places: node ids of the places that hold such a thing, one or more each, Q tuples.
    """

    home: np.ndarray
    time: np.ndarray
    look: np.ndarray
    thing: np.ndarray
    places: tuple[tuple[int, ...], ...]


Rows = TypeVar("Rows", Events, Nodes, EventQuestions)
Linked = TypeVar("Linked", Events, EventQuestions)


@dataclass(frozen=True, slots=True)
class EventTable:
    """Events, nodes and questions of some homes.

    Events are in order of time, then of home, look and position in the look. Nodes of a home follow
    each other: its places, then its things in the order in which they became known.

    Attributes:
        events: what looks showed.
        nodes: things and places.
        questions: what was asked.
        step_seconds: length of a time step where homes have a clock, else None.
    """

    events: Events
    nodes: Nodes
    questions: EventQuestions
    step_seconds: float | None = None

    @property
    def num_nodes(self) -> int:
        """Number of nodes, N."""
        return len(self.nodes.kind)

    @property
    def homes(self) -> np.ndarray:
        """Numbers of the homes, ascending."""
        return np.unique(self.nodes.home)

    def list_places(self, home: int) -> np.ndarray:
        """Return the node ids of the places of a home: all candidates of its questions."""
        return np.flatnonzero((self.nodes.home == home) & (self.nodes.kind == PLACE))

    def split_homes(self, val: float = 0.15, test: float = 0.15) -> dict[str, np.ndarray]:
        """Return event masks of "train", "val" and "test" that share no home, bool (E,) each.

        The last homes are for testing. The masks of questions are made alike: compare `home`.

        Raises:
            ValueError: if the shares leave one part without a home.
        """
        part = cut(self.homes, val, test, "homes")
        return {name: np.isin(self.events.home, chosen) for name, chosen in part.items()}

    def split_time(self, val: float = 0.15, test: float = 0.15) -> dict[str, np.ndarray]:
        """Return event masks of "train", "val" and "test", one after the other in every home.

        Raises:
            ValueError: if the shares leave one part without a time step.
        """
        steps = np.arange(
            1, int(max(self.events.time.max(initial=0), self.questions.time.max(initial=0))) + 1
        )
        part = cut(steps, val, test, "time steps")
        return {name: np.isin(self.events.time, chosen) for name, chosen in part.items()}

    def take_homes(self, homes: Sequence[int]) -> EventTable:
        """Return the table of some homes; ids of nodes are counted anew."""
        chosen = np.isin(self.nodes.home, homes)
        new_id = np.cumsum(chosen) - 1
        is_event, is_asked = (np.isin(rows.home, homes) for rows in (self.events, self.questions))
        return EventTable(
            _renumber(take_rows(self.events, np.flatnonzero(is_event)), new_id),
            take_rows(self.nodes, np.flatnonzero(chosen)),
            _renumber(take_rows(self.questions, np.flatnonzero(is_asked)), new_id),
            self.step_seconds,
        )

    @classmethod
    def join(cls, tables: Sequence[EventTable]) -> EventTable:
        """Put tables of different homes together, homes ascending.

        Raises:
            ValueError: if there is no table, two have a home in common, or their steps differ.
        """
        seconds = {table.step_seconds for table in tables}
        homes = [home for table in tables for home in table.homes.tolist()]
        if len(seconds) != 1 or len(set(homes)) < len(homes):
            raise ValueError(
                "tables must be one or more, of different homes and of one length of a step, got "
                f"{len(tables)} of homes {shorten(homes)}. Join others."
            )
        parts = [table.take_homes([home]) for table in tables for home in table.homes]
        parts.sort(key=lambda part: int(part.homes[0]))
        first = np.cumsum([0, *(part.num_nodes for part in parts)])
        new_ids = [np.arange(start, end) for start, end in pairwise(first)]
        of_parts = list(zip(parts, new_ids, strict=True))
        events = _join_rows([_renumber(part.events, new_id) for part, new_id in of_parts])
        questions = _join_rows([_renumber(part.questions, new_id) for part, new_id in of_parts])
        by_time = np.lexsort((events.order, events.look, events.home, events.time))
        asked = np.lexsort((questions.look, questions.home, questions.time))
        return cls(
            take_rows(events, by_time),
            _join_rows([part.nodes for part in parts]),
            take_rows(questions, asked),
            seconds.pop(),
        )


def take_rows(rows: Rows, chosen: np.ndarray) -> Rows:
    """Return some rows of columns, by their numbers (n,)."""
    columns = {column.name: getattr(rows, column.name) for column in fields(rows)}
    taken: dict[str, Any] = {
        name: tuple(column[number] for number in chosen) if name == "places" else column[chosen]
        for name, column in columns.items()
    }
    return type(rows)(**taken)


def _join_rows(parts: Sequence[Rows]) -> Rows:
    """Return rows of several tables, one after the other."""
    columns = {
        column.name: [getattr(part, column.name) for part in parts] for column in fields(parts[0])
    }
    joined: dict[str, Any] = {
        name: tuple(chain(*pieces)) if name == "places" else np.concatenate(pieces)
        for name, pieces in columns.items()
    }
    return type(parts[0])(**joined)


def _renumber(rows: Linked, new_id: np.ndarray) -> Linked:
    """Return rows with other ids of nodes, (N,)."""
    if isinstance(rows, EventQuestions):
        places = tuple(tuple(new_id[list(nodes)].tolist()) for nodes in rows.places)
        return replace(rows, thing=new_id[rows.thing], places=places)
    return replace(rows, thing=new_id[rows.thing], place=new_id[rows.place])


def cut(values: np.ndarray, val: float, test: float, noun: str) -> dict[str, np.ndarray]:
    """Cut values into parts that follow each other; `val` and `test` are shares of the whole.

    Raises:
        ValueError: if one part is empty.
    """
    num_val, num_test = (round(len(values) * share) for share in (val, test))
    first, second = len(values) - num_val - num_test, len(values) - num_test
    parts = values[: max(first, 0)], values[max(first, 0) : second], values[second:]
    if min(len(part) for part in parts) < 1 or min(val, test) < 0:
        raise ValueError(
            f"val and test must leave {noun} for all of {', '.join(PARTS)}, got {val} and {test} "
            f"of {len(values)}. Choose other shares, or collect more."
        )
    return dict(zip(PARTS, parts, strict=True))
