"""What all calls of a memory share: its state, the lock before it, and the log of its changes."""

from __future__ import annotations

from pathlib import Path
from threading import RLock
from typing import Any

from sgm.memory.look_log import LookLog
from sgm.memory.memory_state import MemoryState


class LoggedState:
    """The state of a memory, which one call at a time reads or changes, and its log.

    A change is written into the log before it is made.
    """

    _lock: RLock  # held by every call while it reads or changes the state
    _state: MemoryState
    _log: LookLog | None

    def _start_log(self, path: str | Path | None, goes_on: bool = False) -> None:
        if path is not None:
            self._log = LookLog(path)
            self._note_start(goes_on)

    def _note_start(self, goes_on: bool) -> None:
        """Write into the log that a new memory begins, or how the one is that goes on."""
        if self._log is not None:
            self._log.start(self._state.get_content_to_save(), is_new=not goes_on)

    def _write(self, kind: str, time: int | None = None, **values: Any) -> None:
        """Append a change (`LogLine`) to the log, if there is one, before it is made."""
        if self._log is not None:
            time = self._state.time if time is None else time
            self._log.write(kind, time, self._state.clock, values)
