"""Names of what is no thing: people, walls and whatever else a detector names besides."""

from __future__ import annotations

from collections.abc import Iterable

from sgm.messages import shorten
from sgm.names.words import read_name


class IgnoredNames:
    """Names that are left out; case, articles and the order of properties make no difference."""

    def __init__(self, names: Iterable[str] = ()) -> None:
        """Take the names.

        Raises:
            TypeError: if they are one text.
            ValueError: if one is no name.
        """
        if isinstance(names, str):
            raise TypeError(
                f"ignore must be a list, got {shorten(names)}. Write ['person', 'wall']."
            )
        self._names = frozenset(map(read_name, names))

    def __contains__(self, name: str) -> bool:
        """Tell whether a name is one of them."""
        return read_name(name) in self._names
