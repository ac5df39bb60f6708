"""What a memory keeps of objects beside numbers: their names, and what was said of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from sgm.arrays.table import clone
from sgm.memory.sighting import read_embedding, read_id, read_picture
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.words import read_words
from sgm.prior.copies import get_copies
from sgm.schema import RELATIONS
from sgm.store.event_kinds import PLACED, STATEMENTS

ROBOT = "robot"  # who says what the robot itself did
# How far a statement is believed where its confidence is not given: people err and mix things up,
# and a hand slips. Assumptions, until a home's own statements are compared with its looks.
PERSON_CONFIDENCE, ROBOT_CONFIDENCE = 0.9, 0.97
LEAST_CONFIDENCE = 0.5  # of less, the opposite would be likelier
MOST_KEPT = 8  # statements of each thing; what older ones said has been overtaken
MOST_PICTURES = 8  # of each thing, one for each of the places where it was seen last


@dataclass(frozen=True, slots=True)
class Statement:
    """That a thing is somewhere since a time: a person put it there, or the robot has it.

    Attributes:
        time: time step.
        kind: "moved" as a person said, or what the robot did: "picked_up", "put_down".
        furniture: id of the place; None for with the robot.
        relation: such as "in" or "onTop" it; None with the robot.
        by: who says so; "robot" of its own actions.
        confidence: probability that it is right.
        was_at: ids of furniture where it was held to be before.
        num_observed: of the thing, once this counted as a sighting; nothing was seen of it since as
            long as it is the same.
    """

    time: int
    kind: str
    furniture: int | None
    relation: str | None
    by: str
    confidence: float
    was_at: tuple[int, ...] = ()
    num_observed: int = 0

    def redirect(self, furniture: int, other: int) -> Statement:
        """Return the statement in a home in which furniture turned out to be another piece."""
        place = other if self.furniture == furniture else self.furniture
        was_at = dict.fromkeys(other if place == furniture else place for place in self.was_at)
        return replace(self, furniture=place, was_at=tuple(was_at))

    def leave_out(self, furniture: Collection[int]) -> Statement | None:
        """Return the statement in a home without some furniture; None if it was about that."""
        if self.furniture is not None and self.furniture in furniture:
            return None
        return replace(self, was_at=tuple(place for place in self.was_at if place not in furniture))

    def to_json(self) -> list[Any]:
        """Return JSON values, from which `from_json` makes the same statement."""
        return list(astuple(self))

    @classmethod
    def from_json(cls, data: Any, furniture: Collection[int], time: int) -> Statement:
        """Read JSON values of a memory with this furniture; raises TypeError or ValueError."""
        said, kind, place, relation, speaker, confidence, was_at, num_observed = data
        is_held = kind not in PLACED
        if (
            not isinstance(said, int)
            or not 0 <= said <= time
            or kind not in STATEMENTS
            or (place is not None or relation is not None if is_held else place not in furniture)
            or (not is_held and relation not in RELATIONS)
            or not set(was_at) <= set(furniture)
            or not isinstance(num_observed, int)
        ):
            raise ValueError(f"no statement like {shorten(data)}")
        read_words("by", speaker)
        sure = read_confidence(confidence, speaker)
        return cls(said, kind, place, relation, speaker, sure, tuple(was_at), num_observed)


def read_confidence(confidence: float | None, speaker: str) -> float:
    """Return how far a statement is believed; None for the default of people or the robot.

    What is no probability, or says that the opposite is likelier, raises ValueError.
    """
    if confidence is None:
        return ROBOT_CONFIDENCE if speaker == ROBOT else PERSON_CONFIDENCE
    if not isinstance(confidence, Real) or not LEAST_CONFIDENCE <= confidence <= 1:
        raise ValueError(
            f"confidence of a statement must lie in [0.5, 1], got {shorten(confidence)} by "
            f"{shorten(speaker)}. Leave out a statement that is rather wrong than right."
        )
    return float(confidence)


@dataclass(frozen=True, slots=True)
class ThingName:
    """Which node of a memory is meant: by its id, or, where it has none, by its words."""

    description: str
    id: str = ""

    def is_same(self, other: ThingName) -> bool:
        """Whether another name is of the same node."""
        if self.id or other.id:
            return self.id == other.id
        return Name.read(self.description).key == Name.read(other.description).key

    def __str__(self) -> str:
        return f"{self.description} (id {self.id})" if self.id else self.description

    def to_json(self) -> dict[str, Any]:
        """Return JSON values for a file."""
        return {"description": self.description, **({"id": self.id} if self.id else {})}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ThingName:
        """Read JSON values of a file."""
        return cls(str(data["description"]), str(data.get("id", "")))


@dataclass(frozen=True, slots=True)
class SaidOf:
    """What was said of a thing, done with it, or became of its place, between looks of a time step.

    Attributes:
        name: of the node.
        statement: what was said; None where it came to furniture that was removed since.
        was_at: id of furniture from which one of several was taken; None for all its places.
    """

    name: ThingName
    statement: Statement | None
    was_at: int | None = None

    def to_json(self) -> list[Any]:
        """Return JSON values, from which `from_json` makes the same."""
        said = None if self.statement is None else self.statement.to_json()
        return [self.name.to_json(), said, self.was_at]

    @classmethod
    def from_json(cls, data: Any, furniture: Collection[int], time: int) -> SaidOf:
        """Read JSON values of a memory with this furniture; raises TypeError or ValueError."""
        name, statement, was_at = data
        if was_at is not None and was_at not in furniture:
            raise ValueError(f"there is no furniture {shorten(was_at)}")
        read_words("description", name["description"])
        said = None if statement is None else Statement.from_json(statement, furniture, time)
        return cls(ThingName.from_json(name), said, was_at)


@dataclass(frozen=True, slots=True)
class Pictured:
    """That a picture shows a thing at a place.

    Attributes:
        time: time step of the sighting.
        furniture: id of the place.
        relation: such as "in" or "onTop" it.
        picture: path or id of the picture.
    """

    time: int
    furniture: int
    relation: str
    picture: str

    @property
    def place(self) -> tuple[int, str]:
        """Furniture and relation."""
        return self.furniture, self.relation

    @classmethod
    def from_json(cls, data: Any, furniture: Collection[int], time: int) -> Pictured:
        """Read the values of a memory with this furniture; raises TypeError or ValueError."""
        seen, place, relation, picture = data
        is_known = place in furniture and relation in RELATIONS and picture is not None
        if not isinstance(seen, int) or not 0 <= seen <= time or not is_known:
            raise ValueError(f"no picture like {shorten(data)}")
        return cls(seen, place, relation, read_picture(picture) or "")


def keep_pictures(pictures: Iterable[Pictured]) -> tuple[Pictured, ...]:
    """Return the latest picture of each place, the latest last, of `MOST_PICTURES` places."""
    latest = {
        pictured.place: pictured
        for pictured in sorted(pictures, key=lambda pictured: pictured.time)
    }
    return tuple(sorted(latest.values(), key=lambda pictured: pictured.time))[-MOST_PICTURES:]


@dataclass(frozen=True, slots=True)
class Thing:
    """One object node.

    Attributes:
        description: in words, as first written.
        id: of a tracker or of re-identification, by which it is distinguished from others of its
            description; empty where words alone tell things apart.
        statements: what was said of it, and done with it, the latest last.
        embedding: how it looks to the tracker that gave the id, (D,); empty without one.
        pictures: the latest of each place where one was given, the latest last.
    """

    description: str
    id: str = ""
    statements: tuple[Statement, ...] = ()
    embedding: tuple[float, ...] = ()
    pictures: tuple[Pictured, ...] = ()

    @property
    def name(self) -> ThingName:
        """By what it is known."""
        return ThingName(self.description, self.id)

    def add(self, statement: Statement) -> Thing:
        """Return it with one statement more; the oldest of too many is left out."""
        return replace(self, statements=(*self.statements, statement)[-MOST_KEPT:])

    def note_picture(self, pictured: Pictured) -> Thing:
        """Return it with a picture more, instead of that of the same place."""
        return replace(self, pictures=keep_pictures([*self.pictures, pictured]))

    def find_picture(self, furniture: int | None, relation: str | None) -> str | None:
        """Return the picture of a place; None without one."""
        for pictured in self.pictures:
            if pictured.place == (furniture, relation):
                return pictured.picture
        return None

    def order_places(self) -> dict[tuple[int, int | None], int]:
        """Return the number of the last statement, the oldest is 0, of each time step and place."""
        return {
            (statement.time, statement.furniture): number
            for number, statement in enumerate(self.statements)
        }

    def redirect(self, furniture: int, other: int) -> Thing:
        """Return it in a home in which furniture turned out to be another piece."""
        if not self.statements and not self.pictures:
            return self
        said = (statement.redirect(furniture, other) for statement in self.statements)
        pictures = (
            replace(pictured, furniture=other) if pictured.furniture == furniture else pictured
            for pictured in self.pictures
        )
        return replace(self, statements=tuple(said), pictures=keep_pictures(pictures))

    def leave_out(self, furniture: Collection[int]) -> Thing:
        """Return it in a home without some furniture."""
        if not self.statements and not self.pictures:
            return self
        left = (statement.leave_out(furniture) for statement in self.statements)
        return replace(
            self,
            statements=tuple(statement for statement in left if statement is not None),
            pictures=tuple(
                pictured for pictured in self.pictures if pictured.furniture not in furniture
            ),
        )


@dataclass(frozen=True, slots=True)
class Said:
    """What was said of a thing, and of what was merged with it.

    Attributes:
        thing: with all these statements, the oldest first.
        members: rows of all nodes that were merged as it, its own first.
        last: the last of them; None if there is none, or a look has shown the thing since.
    """

    thing: Thing
    members: Sequence[int]
    last: Statement | None = None


class ThingRows:
    """The objects of a memory by their rows in its table, and by what they are called.

    Things of a known id are distinguished by it, whatever they are called. The others are, by the
    words of their descriptions.
    """

    def __init__(self, things: Iterable[Thing] = ()) -> None:
        """List things, one after the other."""
        self._take(things)

    def _take(self, things: Iterable[Thing]) -> None:
        self._things: list[Thing] = []
        self._descriptions: tuple[str, ...] = ()
        self._numbers = np.zeros(0, dtype=np.int64)
        self._first_numbers: dict[str, int] = {}
        # By `Name.key` of the description, a tuple, or by id, a text.
        self._rows: dict[tuple[str, ...] | str, int] = {}
        self._rows_with_id: dict[tuple[str, ...], list[int]] = {}
        self._texts: dict[tuple[str, ...], str] = {}  # of each name, as first written
        self._read: dict[str, Name] = {}  # what was read of these
        for thing in things:
            self._add(Name.read(thing.description), thing)

    def copy(self) -> ThingRows:
        """Return the same things, which can be changed alone; no name is read again."""
        copied = clone(self)
        copied._things, copied._first_numbers = list(self._things), dict(self._first_numbers)
        copied._rows, copied._texts = dict(self._rows), dict(self._texts)
        copied._rows_with_id = {key: list(rows) for key, rows in self._rows_with_id.items()}
        copied._read = dict(self._read)
        return copied

    def __len__(self) -> int:
        return len(self._things)

    def __iter__(self) -> Iterator[Thing]:
        return iter(self._things)

    def __getitem__(self, row: int) -> Thing:
        return self._things[row]

    def __setitem__(self, row: int, thing: Thing) -> None:
        """Say something else of a thing, which is called as before."""
        self._things[row] = thing

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of the things, (O,)."""
        new = self._things[len(self._descriptions) :]
        if new:
            self._descriptions += tuple(thing.description for thing in new)
        return self._descriptions

    def number_descriptions(self) -> np.ndarray:
        """Number what the things are called: the same number for the same description, (O,)."""
        known, first = len(self._numbers), self._first_numbers
        if known < len(self._things):
            new = [first.setdefault(text, len(first)) for text in self.descriptions[known:]]
            self._numbers = np.append(self._numbers, new)
        return self._numbers

    @property
    def names(self) -> tuple[str, ...]:
        """What the things are called, each name once."""
        return tuple(self._texts.values())

    def add(self, name: Name, id: str = "") -> int:
        """Return the row of a thing by its id or, without one, its name, adding it if it is new."""
        row = self._rows.get(id or name.key, -1)
        return row if row >= 0 else self._add(name, Thing(name.text, id))

    def _add(self, name: Name, thing: Thing) -> int:
        """Add a thing that is new, and return its row."""
        row = self._rows[thing.id or name.key] = len(self._things)
        self._things.append(thing)
        if self._texts.setdefault(name.key, name.text) is name.text:
            self._read[name.text] = name
        if thing.id:
            self._rows_with_id.setdefault(name.key, []).append(row)
        return row

    def rename(self, row: int, description: str) -> None:
        """Call a thing otherwise, as if it had always been called so."""
        before, descriptions = self._things[row], list(self.descriptions)
        self._things[row] = replace(before, description=description)
        if self._rows_with_id:  # others may be called as it was, or as it is now
            self._take(self._things)
            return
        old, new = Name.read(before.description), Name.read(description)
        del self._rows[old.key], self._read[old.text]
        self._rows[new.key], self._read[new.text] = row, new
        texts = self._texts.items()
        self._texts = dict(
            (new.key, new.text) if key == old.key else (key, text) for key, text in texts
        )
        descriptions[row] = description
        self._descriptions = tuple(descriptions)
        self._numbers, self._first_numbers = np.zeros(0, dtype=np.int64), {}

    def get_row(self, name: Name, id: str = "") -> int:
        """Return the row of a thing by its id or, without one, its name; -1 for none."""
        return self._rows.get(id or name.key, -1)

    def has_id(self, name: str) -> bool:
        """Whether a name is the id of a thing; what is no text is none."""
        return isinstance(name, str) and name in self._rows

    def read(self, text: str) -> Name:
        """Return a name; what things are called was read when they were added."""
        return self._read.get(text) or Name.read(text)

    def find_rows(self, name: str | Name) -> list[int]:
        """Return the rows of all things of a name, or of the one of that id."""
        text = name if isinstance(name, str) else name.text
        by_id = self._rows.get(text, -1)
        if by_id >= 0:
            return [by_id]
        if isinstance(name, str):
            name = self._read.get(name) or Name.read(name)
        key = name.key
        row = self._rows.get(key, -1)
        return ([row] if row >= 0 else []) + self._rows_with_id.get(key, [])

    def is_single(self, row: int, label: str) -> bool:
        """Tell whether a thing is one alone: it has an id or a number, or homes have one such."""
        thing = self._things[row]
        return bool(thing.id or self.read(thing.description).instance) or get_copies(label)[0] == 1

    def join(self, members: Sequence[int]) -> Thing:
        """Return the first of some things with what was said of any of them."""
        thing = self._things[members[0]]
        if len(members) == 1:
            return thing
        # What was said since a merge is of the first, and so the last of a time step.
        said = (
            statement for row in reversed(members) for statement in self._things[row].statements
        )
        pictures = [pictured for row in members for pictured in self._things[row].pictures]
        return replace(
            thing,
            statements=tuple(sorted(said, key=lambda statement: statement.time)),
            pictures=keep_pictures(pictures),
        )

    def list_words(self, rows: Iterable[int]) -> Iterator[str]:
        """List the words of the descriptions of things, and of their ids."""
        for thing in (self._things[row] for row in rows):
            yield read_words("description", thing.description)
            if thing.id:
                yield read_words("id", thing.id)


def write_things(things: tuple[Thing, ...]) -> dict[str, Any]:
    """Return JSON values of things beside their descriptions, each by position."""
    columns: dict[str, list[Any]] = {
        "ids": [thing.id for thing in things],
        "embeddings": [list(thing.embedding) for thing in things],
        "statements": [[said.to_json() for said in thing.statements] for thing in things],
        "pictures": [[list(astuple(row)) for row in thing.pictures] for thing in things],
    }
    return {
        name: [[number, value] for number, value in enumerate(column) if value]
        for name, column in columns.items()
    }


def read_things(data: Mapping[str, Any]) -> tuple[Thing, ...]:
    """Read things; parts that do not fit raise ValueError, missing ones KeyError or TypeError."""
    furniture = {number for number, *_ in data["furniture"]}
    ids, embeddings = dict(data["ids"]), dict(data["embeddings"])
    statements = {
        number: tuple(
            Statement.from_json(statement, furniture, data["time"]) for statement in listed
        )
        for number, listed in data["statements"]
    }
    pictures = {
        number: keep_pictures(Pictured.from_json(row, furniture, data["time"]) for row in listed)
        for number, listed in data["pictures"]
    }
    if not {*ids, *embeddings, *statements, *pictures} <= set(range(len(data["descriptions"]))):
        raise ValueError("ids, embeddings, statements or pictures of a thing that is not there")
    things = []
    for number, description in enumerate(data["descriptions"]):
        id = read_id(ids[number]) if number in ids else ""
        embedding = read_embedding(embeddings[number]) if number in embeddings else ()
        said, shown = statements.get(number, ()), pictures.get(number, ())
        things.append(Thing(description, id, said, embedding, shown))
    return tuple(things)
