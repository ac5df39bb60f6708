"""Numbers of what is called something, by what names are the same by (`Name.keys`)."""

from __future__ import annotations

from bisect import insort
from collections.abc import Sequence


class NumbersByKey(dict[object, "int | list[int]"]):
    """Numbers by key; of most keys that is one number, which is kept without a list.

    A building has a hundred thousand such keys: lists would take memory, and the collector of
    circles would walk through all of them.
    """

    def copy(self) -> NumbersByKey:
        """Return the same numbers, which can be changed alone."""
        pairs = self.items()
        return NumbersByKey((key, n if isinstance(n, int) else list(n)) for key, n in pairs)

    def find(self, key: object) -> Sequence[int]:
        """Return the numbers of a key, ascending."""
        found = self.get(key, ())
        return (found,) if isinstance(found, int) else found

    def add(self, key: object, number: int) -> None:
        """Add a number to a key that may have it."""
        found = self.setdefault(key, number)
        if isinstance(found, int):
            if found != number:
                self[key] = sorted((found, number))
        elif found[-1] < number:  # they mostly come in order
            found.append(number)
        elif number not in found:
            insort(found, number)

    def discard(self, key: object, number: int) -> None:
        """Take a number from a key that may have it."""
        left = [other for other in self.find(key) if other != number]
        self.pop(key, None)
        for other in left:
            self.add(key, other)
