"""Which furniture is exactly of a name."""

from __future__ import annotations

from collections.abc import Callable

from sgm.layout.furniture import Furniture
from sgm.layout.layout import Layout
from sgm.names.name import Name
from sgm.names.numbers_by_key import NumbersByKey
from sgm.names.words import MAX_LENGTH

# Ways to call furniture of a room: those before come first.
_WAYS: tuple[Callable[[Furniture, str], str], ...] = (
    lambda row, room: f"{row.description} in {room}",
    lambda row, room: row.description,
    lambda row, room: row.label,
    lambda row, room: f"{room} {row.description}",
    lambda row, room: f"{row.label} in {room}",
    lambda row, room: f"{room} {row.label}",
)


class CalledFurniture:
    """Finds furniture by its names, which are read when they are first needed, and once."""

    def __init__(self, layout: Layout) -> None:
        """Take the furniture of a layout as it is now."""
        rows = layout.furniture.items()
        self._rows = [(number, row, str(layout.rooms[row.room])) for number, row in rows]
        # For each way, ids by `Name.keys`.
        self._tables: list[NumbersByKey] = []

    def find(self, name: Name) -> list[int]:
        """Return the ids of the furniture that is exactly of a name, ascending.

        By all that is said of it ("white fridge in kitchen"), else by its own description, by its
        label, and by these with the room before or after them.
        """
        for way, call in enumerate(_WAYS):
            if way == len(self._tables):
                self._tables.append(self._read(call))
            table = self._tables[way]
            found = {number for key in name.keys for number in table.find(key)}
            if found:
                return [number for number, *_ in self._rows if number in found]
        return []

    def _read(self, call: Callable[[Furniture, str], str]) -> NumbersByKey:
        table = NumbersByKey()
        for number, row, room in self._rows:
            words = call(row, room)
            if len(words) <= MAX_LENGTH:
                for key in Name.read(words).keys:
                    table.add(key, number)
        return table
