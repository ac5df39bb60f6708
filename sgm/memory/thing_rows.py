"""The things of a memory, and which of them a name or an id means."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sgm.memory.thing import Thing
from sgm.names.words import read_name, read_words


class ThingRows:
    """The objects of a memory by their rows in its table, and by what they are called.

    Things of a known id are distinguished by it, whatever they are called. The others are, by the
    words of their descriptions.
    """

    def __init__(self, things: Iterable[Thing] = ()) -> None:
        """List things, one after the other."""
        self._things: list[Thing] = []
        self._descriptions: tuple[str, ...] = ()
        # By `read_name` of the description, a tuple, or by id, a text.
        self._rows: dict[tuple[str, ...] | str, int] = {}
        self._rows_with_id: dict[tuple[str, ...], list[int]] = {}
        self._names: dict[tuple[str, ...], str] = {}  # each as first written
        self._rows_as_written: dict[str, int] = {}
        for thing in things:
            self._things[self.add(thing.description, thing.id)] = thing

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

    @property
    def names(self) -> tuple[str, ...]:
        """What the things are called, each name once."""
        return tuple(self._names.values())

    def find_written(self, description: str, id: str = "") -> int | None:
        """Return the row of a thing that was called the very same before; None if it is unsure."""
        return self._rows.get(id) if id else self._rows_as_written.get(description)

    def add(self, description: str, id: str = "") -> int:
        """Return the row of a thing, adding it if it is new.

        Args:
            description: by whose words it is known, where it has no id.
            id: by which it is known; empty without one.
        """
        name = read_name(description)
        row = self._rows.setdefault(id or name, len(self))
        if row == len(self):
            self._things.append(Thing(description, id))
            self._names.setdefault(name, description)
            if id:
                self._rows_with_id.setdefault(name, []).append(row)
        if not id:
            self._rows_as_written[description] = row
        return row

    def get_row(self, description: str, id: str = "") -> int:
        """Return the row of a thing by its id or, without one, its name; -1 for none."""
        return self._rows.get(id or read_name(description), -1)

    def has_id(self, name: str) -> bool:
        """Whether a name is the id of a thing."""
        return name in self._rows

    def find_rows(self, name: str) -> list[int]:
        """Return the rows of all things of a name, or of the one of that id."""
        by_id = self._rows.get(name, -1)
        if by_id >= 0:
            return [by_id]
        own = self.get_row(name)
        return ([own] if own >= 0 else []) + self._rows_with_id.get(read_name(name), [])

    def list_words(self, rows: Iterable[int]) -> Iterator[str]:
        """List the words of the descriptions of things, and of their ids."""
        for thing in (self._things[row] for row in rows):
            yield read_words("description", thing.description)
            if thing.id:
                yield read_words("id", thing.id)
