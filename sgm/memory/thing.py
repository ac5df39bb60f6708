"""What a memory keeps of one object beside numbers: its names, and what was said of it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import Any

from sgm.memory.sighting import read_embedding, read_id
from sgm.memory.statement import MOST_KEPT, Statement


@dataclass(frozen=True, slots=True)
class ThingName:
    """Which node of a memory is meant: by its id, or, where it has none, by its words."""

    description: str
    id: str = ""

    def __str__(self) -> str:
        return f"{self.description} (id {self.id})" if self.id else self.description

    def to_json(self) -> dict[str, Any]:
        """Return JSON values for a log."""
        return {"description": self.description, **({"id": self.id} if self.id else {})}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ThingName:
        """Read JSON values of a log."""
        return cls(str(data["description"]), str(data.get("id", "")))


@dataclass(frozen=True, slots=True)
class Thing:
    """One object node.

    Attributes:
        description: in words, as first written.
        id: of a tracker or of re-identification, by which it is distinguished from others of its
            description; empty where words alone tell things apart.
        statements: what was said of it, and done with it, the latest last.
        embedding: how it looks to the tracker that gave the id, (D,); empty without one.
    """

    description: str
    id: str = ""
    statements: tuple[Statement, ...] = ()
    embedding: tuple[float, ...] = ()

    @property
    def name(self) -> ThingName:
        """By what it is known."""
        return ThingName(self.description, self.id)

    def add(self, statement: Statement) -> Thing:
        """Return it with one statement more; the oldest of too many is left out."""
        return replace(self, statements=(*self.statements, statement)[-MOST_KEPT:])

    def order_places(self) -> dict[tuple[int, int | None], int]:
        """Return the number of the last statement, the oldest is 0, of each time step and place."""
        return {(one.time, one.furniture): at for at, one in enumerate(self.statements)}

    def leave_out(self, furniture: Collection[int]) -> Thing:
        """Return it in a home without some furniture."""
        if not self.statements:
            return self
        left = (statement.leave_out(furniture) for statement in self.statements)
        return replace(self, statements=tuple(one for one in left if one is not None))


def write_things(things: tuple[Thing, ...]) -> dict[str, Any]:
    """Return JSON values of things beside their descriptions, where there are any, by position."""
    written: dict[str, list[Any]] = {"ids": [], "embeddings": [], "statements": []}
    for number, thing in enumerate(things):
        if thing.id:
            written["ids"].append([number, thing.id])
        if thing.embedding:
            written["embeddings"].append([number, list(thing.embedding)])
        if thing.statements:
            said = [statement.to_json() for statement in thing.statements]
            written["statements"].append([number, said])
    return {name: rows for name, rows in written.items() if rows}


def read_things(data: Mapping[str, Any]) -> tuple[Thing, ...]:
    """Read things; parts that do not fit raise ValueError, missing ones KeyError or TypeError."""
    furniture = {number for number, *_ in data["furniture"]}
    ids, embeddings = dict(data.get("ids", ())), dict(data.get("embeddings", ()))
    statements = {
        number: tuple(Statement.from_json(one, furniture, data["time"]) for one in own)
        for number, own in data.get("statements", ())
    }
    if not {*ids, *embeddings, *statements} <= set(range(len(data["descriptions"]))):
        raise ValueError("ids, embeddings or statements of a thing that is not there")
    things = []
    for number, description in enumerate(data["descriptions"]):
        own = read_id(ids[number]) if number in ids else ""
        embedding = read_embedding(embeddings.get(number, ()))
        things.append(Thing(description, own, statements.get(number, ()), embedding))
    return tuple(things)
