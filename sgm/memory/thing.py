"""What a memory keeps of one object beside numbers: its names, and what was said of it."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from sgm.memory.statement import MOST_KEPT, Statement


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
