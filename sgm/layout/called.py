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
    lambda piece, room: f"{piece.description} in {room}",
    lambda piece, room: piece.description,
    lambda piece, room: piece.label,
    lambda piece, room: f"{room} {piece.description}",
    lambda piece, room: f"{piece.label} in {room}",
    lambda piece, room: f"{room} {piece.label}",
)


class CalledFurniture:
    """Finds furniture by its names, which are read when they are first needed, and once."""

    def __init__(self, layout: Layout) -> None:
        """Take the furniture of a layout as it is now."""
        furniture = layout.furniture.items()
        self._pieces = [
            (number, piece, str(layout.rooms[piece.room])) for number, piece in furniture
        ]
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
                return [number for number, *_ in self._pieces if number in found]
        return []

    def _read(self, call: Callable[[Furniture, str], str]) -> NumbersByKey:
        table = NumbersByKey()
        for number, piece, room in self._pieces:
            words = call(piece, room)
            if len(words) <= MAX_LENGTH:
                for key in Name.read(words).keys:
                    table.add(key, number)
        return table
