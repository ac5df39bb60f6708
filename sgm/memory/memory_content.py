"""All that a memory of one home holds, as plain arrays: to keep a part of it, to write it down."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from sgm.layout.home_layout import Furniture, HomeLayout, read_position
from sgm.memory.clock import Clock
from sgm.memory.columns import (
    EDGE_COUNTERS,
    EDGE_HISTORY,
    EDGE_MEASURES,
    FURNITURE_COUNTERS,
    NEVER,
    OBJECT_COUNTERS,
    OBJECT_HISTORY,
)
from sgm.memory.home_history import HomeHistory
from sgm.memory.step_log import StepLook
from sgm.memory.time_steps import MAX_TIME
from sgm.messages import shorten
from sgm.names.words import read_words

OBJECT_COLUMNS = (*OBJECT_COUNTERS, "last_furniture", *OBJECT_HISTORY)
_EDGE_NUMBERS = ("object", "furniture", "relation", *EDGE_COUNTERS, *EDGE_HISTORY)
EDGE_COLUMNS = (*_EDGE_NUMBERS, *EDGE_MEASURES)
HOME_LABELS = ("house", "floor")  # of the two nodes above the rooms

Columns = Mapping[str, np.ndarray]


@dataclass(frozen=True, slots=True)
class MemoryContent:
    """A scene graph memory of one home, O objects and E remembered edges.

    What follows from this and the prior (types of objects, prior weights) is left out.

    Attributes:
        time: time step.
        prior: checksum of the prior.
        labels: text of every label index, in the order in which they came up.
        layout: rooms and furniture, in the order of the columns of `furniture_counters`.
        descriptions: of the objects, (O,).
        furniture_counters: `FURNITURE_COUNTERS`, (F,) each.
        objects: `OBJECT_COLUMNS`, (O,) each; furniture by its position, not by its id.
        edges: `EDGE_COLUMNS`, (E,) each; furniture and objects by position.
        history: of the home as a whole.
        asked: position of the object asked for since the last step, None without one.
        clock: what time it is at every time step; None if nobody knows.
        looks: of the present time step, in order; all else is as it was before them.
        queries: what was asked for after the first of these looks, in order: how many looks came
            before it, and its description.
        sought: by words of a description and furniture id, looks that were about this alone and
            did not find it there: how many, weighed by what was in view, and when the last was.
    """

    time: int
    prior: str
    labels: tuple[str, ...]
    layout: HomeLayout
    descriptions: tuple[str, ...]
    furniture_counters: Columns
    objects: Columns
    edges: Columns
    history: HomeHistory
    asked: int | None
    clock: Clock | None = None
    looks: tuple[StepLook, ...] = ()
    queries: tuple[tuple[int, str], ...] = ()
    sought: Mapping[tuple[str, int], tuple[float, int]] = field(default_factory=dict)

    @classmethod
    def empty(cls, prior: str, clock: Clock | None = None) -> MemoryContent:
        """Return the content of a memory that has seen nothing; `prior` is its checksum."""
        none = np.zeros(0, dtype=np.int64)
        return cls(
            time=0,
            prior=prior,
            labels=HOME_LABELS,
            layout=HomeLayout(),
            descriptions=(),
            furniture_counters=dict.fromkeys(FURNITURE_COUNTERS, none),
            objects=dict.fromkeys(OBJECT_COLUMNS, none),
            edges=dict.fromkeys(EDGE_COLUMNS, none),
            history=HomeHistory(1, 0),
            asked=None,
            clock=clock,
        )

    def remove(
        self,
        rooms: Collection[int] = (),
        furniture: Collection[int] = (),
        objects: Collection[int] = (),
    ) -> MemoryContent:
        """Leave out rooms and furniture by id and objects by position, with all their edges.

        Hypothetical edges of the query asked end, as with every change of the nodes.
        """
        layout = self.layout
        kept = {
            number: node
            for number, node in layout.furniture.items()
            if number not in furniture and node.room not in rooms
        }
        keep_furniture = np.array([number in kept for number in layout.furniture], dtype=bool)
        keep_object = np.ones(len(self.descriptions), dtype=bool)
        keep_object[list(objects)] = False
        new_furniture = _number(keep_furniture)
        new_object = _number(keep_object)
        edges, nodes = self.edges, self.objects
        keep_edge = keep_furniture[edges["furniture"]] & keep_object[edges["object"]]
        edges = {name: column[keep_edge] for name, column in edges.items()}
        nodes = {name: column[keep_object] for name, column in nodes.items()}
        return replace(
            self,
            layout=HomeLayout(
                {number: label for number, label in layout.rooms.items() if number not in rooms},
                kept,
                layout.num_rooms_ever,
                layout.num_furniture_ever,
            ),
            descriptions=tuple(np.array(self.descriptions, dtype=object)[keep_object]),
            furniture_counters={
                name: column[keep_furniture] for name, column in self.furniture_counters.items()
            },
            objects=nodes | {"last_furniture": new_furniture[nodes["last_furniture"]]},
            edges=edges
            | {
                "object": new_object[edges["object"]],
                "furniture": new_furniture[edges["furniture"]],
            },
            history=self.history.take(keep_furniture, keep_edge),
            asked=None,
            looks=(),
            queries=(),
            sought={key: value for key, value in self.sought.items() if key[1] in kept},
        )

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, from which `from_json` makes the same content."""
        return {
            "time": self.time,
            "prior": self.prior,
            "labels": list(self.labels),
            "rooms": [[number, label] for number, label in self.layout.rooms.items()],
            "furniture": [
                [number, node.label, node.room, node.description]
                + ([] if node.position is None else [list(node.position)])
                for number, node in self.layout.furniture.items()
            ],
            "num_rooms_ever": self.layout.num_rooms_ever,
            "num_furniture_ever": self.layout.num_furniture_ever,
            "descriptions": list(self.descriptions),
            **self._list_tables(),
            "edge_measures": {
                name: self.edges[name].astype(float).tolist()
                for name, column in _compute_measures(self.edges).items()
                if (self.edges[name] != column).any()
            },
            "history": self.history.to_json(),
            "asked": self.asked,
            "clock": None if self.clock is None else self.clock.to_json(),
            "looks": [look.to_json() for look in self.looks],
            **({"queries": [list(query) for query in self.queries]} if self.queries else {}),
            "sought": [[*key, *value] for key, value in self.sought.items()],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> MemoryContent:
        """Read JSON values; what was saved before there were clocks or a history has none.

        Raises:
            ValueError: if a part is missing, of the wrong kind, or does not fit the others.
        """
        try:
            clock = data.get("clock")
            objects = _read_table(data["objects"], OBJECT_COLUMNS, _guess_object_history)
            guess = partial(_guess_edge_history, objects=objects)
            edges = _read_table(data["edges"], _EDGE_NUMBERS, guess)
            measures = _compute_measures(edges)
            measures |= _read_measures(data.get("edge_measures", {}))
            num_furniture, history = len(data["furniture"]), HomeHistory(1, len(data["furniture"]))
            if "history" in data:
                history = HomeHistory.from_json(
                    data["history"], num_furniture, len(edges["object"]), data["time"]
                )
            content = cls(
                time=data["time"],
                prior=data["prior"],
                labels=tuple(data["labels"]),
                layout=HomeLayout(
                    dict(data["rooms"]),
                    {
                        number: Furniture(label, room, description, read_position(*position))
                        for number, label, room, description, *position in data["furniture"]
                    },
                    data["num_rooms_ever"],
                    data["num_furniture_ever"],
                ),
                descriptions=tuple(data["descriptions"]),
                furniture_counters=_read_table(data["furniture_counters"], FURNITURE_COUNTERS),
                objects=objects,
                edges={**edges, **measures},
                history=history,
                asked=data["asked"],
                clock=None if clock is None else Clock.from_json(clock),
                looks=tuple(StepLook.from_json(look) for look in data.get("looks", ())),
                queries=tuple((number, words) for number, words in data.get("queries", ())),
                sought={
                    (str(words), furniture): (float(count), time)
                    for words, furniture, count, time in data.get("sought", ())
                },
            )
            content._check()
        except (KeyError, IndexError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error
        return content

    def _list_tables(self) -> dict[str, dict[str, list[int]]]:
        """List the tables by name, but for what is read as it is if it is not there."""
        furniture, objects, edges = (
            {name: columns[name].astype(np.int64) for name in names}
            for columns, names in (
                (self.furniture_counters, FURNITURE_COUNTERS),
                (self.objects, OBJECT_COLUMNS),
                (self.edges, _EDGE_NUMBERS),
            )
        )
        return {
            "furniture_counters": _leave_out(furniture, {}),
            "objects": _leave_out(objects, _guess_object_history(objects)),
            "edges": _leave_out(edges, _guess_edge_history(edges, objects)),
        }

    def _check(self) -> None:
        """Check that the parts fit each other.

        Raises:
            ValueError: if they do not.
        """
        _check_between("time", [self.time], 0, MAX_TIME)
        layout = self.layout
        num_furniture, num_objects = len(layout.furniture), len(self.descriptions)
        for part, columns, rows in (
            ("furniture_counters", self.furniture_counters, num_furniture),
            ("objects", self.objects, num_objects),
            ("edges", self.edges, len(self.edges["object"])),
        ):
            for name, column in columns.items():
                if len(column) != rows:
                    raise ValueError(f"{part} {name}: {len(column)} rows instead of {rows}")
                is_time = name.startswith(("last", "first"))
                low, high = (NEVER, self.time) if is_time else (0, MAX_TIME)
                if name in EDGE_MEASURES:
                    highest = 1 if name == "confidence" else MAX_TIME
                    if not ((column >= 0) & (column <= highest)).all():
                        raise ValueError(f"{part} {name} must lie in 0 to {highest}")
                elif name != "last_furniture":
                    _check_between(f"{part} {name}", column, low, high)
        _check_between("room ids", list(layout.rooms), 0, layout.num_rooms_ever - 1)
        _check_between("furniture ids", list(layout.furniture), 0, layout.num_furniture_ever - 1)
        _check_between("last_furniture", self.objects["last_furniture"], -1, num_furniture - 1)
        _check_between("edge objects", self.edges["object"], 0, num_objects - 1)
        _check_between("edge furniture", self.edges["furniture"], 0, num_furniture - 1)
        _check_between("relations", self.edges["relation"], 0, 1)
        _check_between("is_true", self.edges["is_true"], 0, 1)
        for look in self.looks:
            if look.furniture not in layout.furniture:
                raise ValueError(f"there is no furniture {look.furniture}")
        _check_between("queries", [number for number, _ in self.queries], 1, len(self.looks))
        for _, description in self.queries:
            read_words("description", description)
        for (name, furniture), (count, time) in self.sought.items():
            read_words("description", name)
            _check_between("time of a look", [time], 0, self.time)
            if furniture not in layout.furniture or not 0 < count < MAX_TIME:
                raise ValueError(
                    f"no {shorten(count)} looks for {shorten(name)} at furniture "
                    f"{shorten(furniture)}"
                )
        _check_between("asked", [] if self.asked is None else [self.asked], 0, num_objects - 1)
        texts = [*self.labels, *layout.rooms.values(), *self.descriptions]
        for node in layout.furniture.values():
            if node.room not in layout.rooms:
                raise ValueError(f"there is no room {node.room}")
            texts += [node.label, node.description]
        for text in texts:
            read_words("name", text)
        words = {read_words("description", text) for text in self.descriptions}
        if len(words) < num_objects or len(set(self.labels)) < len(self.labels):
            raise ValueError("two objects of one description, or a label that is there twice")
        if self.labels[:2] != HOME_LABELS or not isinstance(self.prior, str):
            raise ValueError("no labels of house and floor, or no checksum of the prior")


def _number(keep: np.ndarray) -> np.ndarray:
    """Return the new position of everything kept, -1 for the rest and, at the end, for -1."""
    return np.append(np.where(keep, np.cumsum(keep) - 1, -1), -1)


def _leave_out(table: Columns, guess: Columns) -> dict[str, list[int]]:
    """Return the columns of a table that are not as they are guessed."""
    return {
        name: column.tolist()
        for name, column in table.items()
        if name not in guess or not np.array_equal(column, guess[name])
    }


def _guess_object_history(objects: Columns) -> Columns:
    """Guess what is not written, or was not counted yet when a memory was saved.

    The start stands for the first sighting, of everything one was seen at once, and nothing was
    sought where it had been seen.
    """
    num, last = objects["num_observed"], objects["last_observed"]
    return {
        "first_observed": np.where(num < 2, last, 0),
        "num_at_once": np.minimum(num, 1),
        "num_sought": np.zeros_like(num),
        "num_still": np.zeros_like(num),
    }


def _guess_edge_history(edges: Columns, objects: Columns) -> Columns:
    """Guess what is not written, or was not counted yet when a memory was saved.

    An edge is true if the last look found it so, all false looks stand for the last ones, and it
    was true for that share of the time since the object was first seen at which looks found it so.
    """
    num, num_true, last = (edges[name] for name in ("num_observed", "num_true", "last_observed"))
    is_true = ((num_true > 0) & (last == edges["last_true"])).astype(np.int64)
    known = (last - objects["first_observed"][edges["object"]]) * num_true // np.maximum(num, 1)
    return {
        "is_true": is_true,
        "num_absent": np.where(edges.get("is_true", is_true), 0, num - num_true),
        "time_true": np.where(num_true, known, 0),
    }


def _compute_measures(edges: Columns) -> dict[str, np.ndarray]:
    """Return `EDGE_MEASURES` of edges where all looks were whole ones, and all sightings sure."""
    return {
        "missed": edges["num_absent"].astype(float),
        "confidence": (edges["num_true"] > 0).astype(float),
    }


def _read_table(
    data: Mapping[str, list[int]],
    names: tuple[str, ...],
    guess: Callable[[Columns], Columns] = lambda columns: {},
) -> Columns:
    """Read columns; those that are not there are as they are guessed from the others."""
    none = np.zeros(0, dtype=np.int64)
    columns = {name: np.array(data[name] or none) for name in names if name in data}
    for name, column in columns.items():
        if column.ndim != 1 or column.dtype != np.int64:
            raise ValueError(f"{name} must be whole numbers")
    columns = {**guess(columns), **columns}
    return {name: columns[name] for name in names}


def _read_measures(data: Mapping[str, list[float]]) -> Columns:
    columns = {name: np.array(data[name]) for name in EDGE_MEASURES if name in data}
    for name, column in columns.items():
        if column.ndim != 1 or column.dtype != np.float64:
            raise ValueError(f"{name} must be numbers")
    return columns


def _check_between(what: str, values: Any, low: int, high: int) -> None:
    for value in np.asarray(values).tolist():
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise ValueError(f"{what} must lie in {low} to {high}, got {shorten(value)}")
