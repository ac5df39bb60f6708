"""A memory that another process writes, read along beside it."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path

from sgm.memory.memory_event import MemoryEvent, parse_rows, read_kept
from sgm.memory.replayer import Replayer
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.aliases import Aliases
from sgm.names.sections import ENGLISH
from sgm.store.home_reader import HomeReader
from sgm.store.owner import get_inode


class FollowedMemory:
    """Holds what a memory file holds, also what is written to it later.

    Attributes:
        memory: as after the last `catch_up`; it writes to no file.
    """

    def __init__(
        self, path: str | Path, aliases: Aliases | None = None, language: str = ENGLISH
    ) -> None:
        """Read a file.

        Raises:
            FileNotFoundError: if there is none; it is a `ValueError`, too.
            ValueError: if it is no memory file, or is damaged.
        """
        self.path = Path(path)
        self.memory = SceneGraphMemory(aliases=aliases, language=language)
        self._replayer = Replayer(self.memory)
        self._begin()

    def catch_up(self) -> None:
        """Make all changes that were written since the last call.

        Raises:
            ValueError: if what was written is damaged.
        """
        if self._is_another():
            self._reader.close()
            self._begin()
        elif self._reader.has_changed():
            rows = self._reader.read_events(self._number)
            self._apply(parse_rows(rows, self.path))

    def close(self) -> None:
        """Close the file."""
        self._reader.close()

    def _begin(self) -> None:
        self._reader = HomeReader(self.path)
        self._inode = _find_inode(self.path)
        self.memory.parts.state.reader = self._reader
        self._reader.has_changed()
        events = read_kept(self._reader)
        self._number = events[0].number
        self._apply(events)

    def _apply(self, events: Sequence[MemoryEvent]) -> None:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the process that looked was warned
            for event in events:
                self._replayer.apply(event)
                self._number = max(self._number, event.number)

    def _is_another(self) -> bool:
        """Tell whether another file lies at the path: the one before was moved, and begun anew."""
        inode = _find_inode(self.path)
        return inode is not None and inode != self._inode


def _find_inode(path: Path) -> tuple[int, int] | None:
    try:
        return get_inode(path)
    except OSError:
        return None
