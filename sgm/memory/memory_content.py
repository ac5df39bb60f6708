"""All that a memory of one home holds, as plain arrays: to keep a part of it, to write it down."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sgm.layout.layout import Layout
from sgm.memory.clock import Clock
from sgm.memory.home_history import HomeHistory
from sgm.memory.lone_looks import SoughtLooks, add_sought
from sgm.memory.look import StepLook
from sgm.memory.moments import Moments
from sgm.memory.same_furniture import merge_places
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.thing import SaidOf, Thing, read_things, write_things
from sgm.memory.week_hours import WeekHours
from sgm.memory.written_tables import (
    Tables,
    check_tables,
    keep_rows,
    list_parts,
    make_empty_tables,
    read_tables,
    write_tables,
)
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.words import read_words
from sgm.schema import HOME_LABELS, MAX_TIME
from sgm.store.snapshot import Snapshot

_MOMENTS = "moments"  # how a file calls what was seen at the latest moments


@dataclass(frozen=True, slots=True)
class MemoryContent:
    """A scene graph memory of one home, O objects and E remembered edges: a view of its state.

    Its arrays are those of the memory (`MemoryState.get_content`); those of a `copy` are not. What
    follows from this and the prior (types of objects, prior weights) is left out.

    Attributes:
        time: time step.
        prior: checksum of the prior.
        labels: text of every label index, in the order in which they came up.
        layout: rooms and furniture, in the order of their rows in the tables.
        things: the objects, what is not in their table, (O,).
        tables: of furniture (F,), objects (O,) and edges (E,); they name each other by position.
        history: of the home as a whole.
        asked: position of the object asked for since the last step, None without one.
        clock: what time it is at every time step; None if it is unknown.
        looks: of the present time step, in order; all else is as it was before them.
        between: what was asked for or said after the first of these looks, in order: how many looks
            came before it, and its description, or what was said.
        sought: by words of a description that no thing has, and furniture id, looks for this alone
            that did not find it there.
        score_calibration: what the scores of further looks mean; None if they are probabilities.
        renamed: by words of what detectors say, and furniture id, what the thing is called there.
    """

    time: int
    prior: str
    labels: tuple[str, ...]
    layout: Layout
    things: tuple[Thing, ...]
    tables: Tables
    history: HomeHistory
    asked: int | None
    clock: Clock | None = None
    looks: tuple[StepLook, ...] = ()
    between: tuple[tuple[int, str | SaidOf], ...] = ()
    sought: Mapping[tuple[str, int], SoughtLooks] = field(default_factory=dict)
    score_calibration: ScoreCalibration | None = None
    renamed: Mapping[tuple[str, int], str] = field(default_factory=dict)

    @classmethod
    def empty(cls, prior: str, clock: Clock | None = None, map_id: str = "") -> MemoryContent:
        """Return the content of a memory that has seen nothing; `prior` is its checksum."""
        layout, history = Layout(map_id=map_id), HomeHistory(1, 0)
        return cls(0, prior, HOME_LABELS, layout, (), make_empty_tables(), history, None, clock)

    def copy(self) -> MemoryContent:
        """Return the same content; nothing that is done to the memory reaches it."""
        return replace(
            self,
            layout=self.layout.copy(),
            tables={
                table: {name: column.copy() for name, column in columns.items()}
                for table, columns in self.tables.items()
            },
            history=self.history.copy(),
            sought=dict(self.sought),
            renamed=dict(self.renamed),
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
        layout = self.layout.leave_out(rooms, furniture)
        kept = layout.furniture
        gone = self.layout.furniture.keys() - kept.keys()
        keep_furniture = np.array([number in kept for number in self.layout.furniture], dtype=bool)
        keep_object = np.ones(len(self.things), dtype=bool)
        keep_object[list(objects)] = False
        rows = {"furniture": keep_furniture, "objects": keep_object}
        tables, keep_edge = keep_rows(self.tables, rows)
        left = zip(self.things, keep_object, strict=True)
        names = {self.things[row].description for row in objects if not self.things[row].id}
        return replace(
            self,
            layout=layout,
            things=tuple(thing.leave_out(gone) for thing, stays in left if stays),
            tables=tables,
            history=self.history.take(keep_furniture, keep_edge, keep_object),
            asked=None,
            looks=(),
            between=(),
            sought={key: value for key, value in self.sought.items() if key[1] in kept},
            renamed={
                key: name
                for key, name in self.renamed.items()
                if key[1] in kept and name not in names
            },
        )

    def merge_furniture(self, kept: int, other: int) -> MemoryContent:
        """Return the content with one furniture node instead of two, by id; `kept` stays."""
        ids = list(self.layout.furniture)
        kept_place, gone_place = ids.index(kept), ids.index(other)
        tables, edges = merge_places(self.tables, kept_place, gone_place)
        history = self.history.copy()
        num_looks = int(tables["furniture"]["num_observed"][kept_place])
        place = self.tables["edges"]["furniture"]
        history.merge_furniture(kept_place, gone_place, num_looks, place, edges)
        sought = {key: looks for key, looks in self.sought.items() if key[1] != other}
        for (words, furniture), looks in self.sought.items():
            if furniture == other:
                both = sorted((*sought.pop((words, kept), ()), *looks))
                for time, count in both:
                    sought[words, kept] = add_sought(sought.get((words, kept), ()), time, count)
        things = tuple(thing.redirect(other, kept) for thing in self.things)
        of_other = {
            (words, kept): name for (words, at), name in self.renamed.items() if at == other
        }
        renamed = {**of_other, **self.renamed}
        content = replace(
            self, tables=tables, history=history, sought=sought, things=things, renamed=renamed
        )
        return content.remove(furniture=[other])

    def to_snapshot(self, event: int) -> Snapshot:
        """Return what a file holds of it after an event, from which the same content is made."""
        columns = {
            f"{part}.{name}": column
            for part, columns in self._write_columns().items()
            for name, column in columns.items()
        }
        return Snapshot(event, self.time, self._write_values(), columns)

    @classmethod
    def from_snapshot(cls, snapshot: Snapshot) -> MemoryContent:
        """Read what a file holds.

        Raises:
            ValueError: if a part is missing, of the wrong kind, or does not fit the others.
        """
        if not isinstance(snapshot.values, dict):
            raise ValueError("no values by name")
        parts = (*list_parts(), _MOMENTS)
        tables: dict[str, dict[str, np.ndarray]] = {part: {} for part in parts}
        for name, column in snapshot.arrays.items():
            part, _, column_name = name.partition(".")
            tables.setdefault(part, {})[column_name] = column
        content = cls.from_json({**tables, **snapshot.values})
        if content.time != snapshot.time:
            raise ValueError(f"time {shorten(snapshot.time)}")
        return content

    def to_json(self) -> dict[str, Any]:
        """Return JSON values, from which `from_json` makes the same content."""
        tables = {
            part: {name: column.tolist() for name, column in columns.items()}
            for part, columns in self._write_columns().items()
        }
        return {**self._write_values(), **tables}

    def _write_columns(self) -> dict[str, dict[str, np.ndarray]]:
        """Return the columns of the tables and of the moments, by part and name."""
        place = self.tables["edges"]["furniture"]
        return {**write_tables(self.tables), _MOMENTS: self.history.moments.to_columns(place)}

    def _write_values(self) -> dict[str, Any]:
        """Return JSON values of all but the columns."""
        scores = self.score_calibration
        return {
            "time": self.time,
            "prior": self.prior,
            "labels": list(self.labels),
            **self.layout.to_json(),
            "num_rooms_ever": self.layout.num_rooms_ever,
            "num_furniture_ever": self.layout.num_furniture_ever,
            "descriptions": [thing.description for thing in self.things],
            **write_things(self.things),
            "history": self.history.to_json(),
            "week": self.history.week.to_json(),
            "asked": self.asked,
            "clock": None if self.clock is None else self.clock.to_json(),
            "looks": [look.to_json() for look in self.looks],
            "between": [
                [number, event if isinstance(event, str) else event.to_json()]
                for number, event in self.between
            ],
            "score_calibration": None if scores is None else scores.to_json(),
            "sought": [[*key, list(looks)] for key, looks in self.sought.items()],
            "renamed": [[*key, name] for key, name in self.renamed.items()],
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> MemoryContent:
        """Read what `to_json` returned.

        Raises:
            ValueError: if a part is missing, of the wrong kind, or does not fit the others.
        """
        try:
            clock, scores = data["clock"], data["score_calibration"]
            num_furniture = len(data["furniture"])
            tables, num_objects = read_tables(data), len(data["descriptions"])
            num_edges = len(tables["edges"]["object"])
            history = HomeHistory.from_json(data["history"], num_furniture, num_edges, data["time"])
            history.week = WeekHours.from_json(data["week"], num_furniture, num_objects)
            history.moments = Moments.from_columns(
                data[_MOMENTS], num_furniture, num_edges, data["time"]
            )
            layout = Layout.from_json(data, data["num_rooms_ever"], data["num_furniture_ever"])
            content = cls(
                time=data["time"],
                prior=data["prior"],
                labels=tuple(data["labels"]),
                layout=layout,
                things=read_things(data),
                tables=tables,
                history=history,
                asked=data["asked"],
                clock=None if clock is None else Clock.from_json(clock),
                score_calibration=None if scores is None else ScoreCalibration.from_json(scores),
                looks=tuple(StepLook.from_json(look) for look in data["looks"]),
                between=tuple(
                    (number, _read_event(event, layout.furniture, data["time"]))
                    for number, event in data["between"]
                ),
                sought={
                    (str(words), furniture): tuple((time, float(count)) for time, count in looks)
                    for words, furniture, looks in data["sought"]
                },
                renamed={(words, furniture): name for words, furniture, name in data["renamed"]},
            )
            content._check()
        except (KeyError, IndexError, TypeError, AttributeError, OverflowError) as error:
            raise ValueError(f"{type(error).__name__}: {error}") from error
        return content

    def _check(self) -> None:
        """Check that the parts fit each other; `ValueError` if not."""
        _check_between("time", [self.time], 0, MAX_TIME)
        layout = self.layout
        num_furniture, num_objects = len(layout.furniture), len(self.things)
        num_rows = {
            "furniture": num_furniture,
            "objects": num_objects,
            "edges": len(self.tables["edges"]["object"]),
            "positions": len(self.tables["positions"]["object"]),
            "lone_looks": len(self.tables["lone_looks"]["object"]),
        }
        check_tables(self.tables, num_rows, self.time)
        _check_between("room ids", list(layout.rooms), 0, layout.num_rooms_ever - 1)
        _check_between("furniture ids", list(layout.furniture), 0, layout.num_furniture_ever - 1)
        for look in self.looks:
            if look.furniture not in layout.furniture:
                raise ValueError(f"there is no furniture {look.furniture}")
        _check_between("between", [number for number, _ in self.between], 1, len(self.looks))
        for (name, furniture), looks in self.sought.items():
            read_words("description", name)
            _check_between("time of a look", [time for time, _ in looks], 0, self.time)
            counts = [count for _, count in looks]
            if furniture not in layout.furniture or not all(0 < n < MAX_TIME for n in counts):
                place = shorten(furniture)
                raise ValueError(f"no {shorten(counts)} looks for {shorten(name)} at {place}")
        for (words, furniture), name in self.renamed.items():
            read_words("description", words)
            read_words("name", name)
            if furniture not in layout.furniture:
                raise ValueError(f"there is no furniture {shorten(furniture)}")
        _check_between("asked", [] if self.asked is None else [self.asked], 0, num_objects - 1)
        texts = [*self.labels, *layout.room_labels, *layout.furniture_labels]
        texts += [node.description for node in layout.furniture.values()]
        for text in texts:
            read_words("name", text)
        names = [Name.read(thing.description, "name") for thing in self.things]
        pairs = zip(self.things, names, strict=True)
        if len({thing.id or name.key for thing, name in pairs}) < num_objects or len(
            set(self.labels)
        ) < len(self.labels):
            raise ValueError("two objects of one description, or a label that is there twice")
        if self.labels[: len(HOME_LABELS)] != HOME_LABELS or not isinstance(self.prior, str):
            raise ValueError("no labels of house and floor, or no checksum of the prior")


def _read_event(event: Any, furniture: Collection[int], time: int) -> str | SaidOf:
    """Read what was asked for, or said; raises TypeError, KeyError or ValueError."""
    if isinstance(event, str):
        read_words("description", event)
        return event
    return SaidOf.from_json(event, furniture, time)


def _check_between(field: str, values: Any, low: int, high: int) -> None:
    for value in np.asarray(values).tolist():
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            raise ValueError(f"{field} must lie in {low} to {high}, got {shorten(value)}")
