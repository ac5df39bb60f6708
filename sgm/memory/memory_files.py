"""The part of a memory for its file, a database of SQLite: what it holds, and every change."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from threading import Lock
from typing import Any

from sgm.checks import read_optional
from sgm.layout.layout import read_map_id
from sgm.memory.clock import Clock
from sgm.memory.home_rows import write_clock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_state import MemoryState, add_snapshot, write_file
from sgm.memory.score_calibration import ScoreCalibration
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph, find_shipped
from sgm.store.connection import check_folder
from sgm.store.home_file import HomeFile

ReadAgain = Callable[[Path], tuple[MemoryContent, PriorGraph]]


def begin_content(
    prior: PriorGraph | None,
    clock: Clock | None,
    score_calibration: ScoreCalibration | None,
    map_id: str,
) -> tuple[MemoryContent, PriorGraph]:
    """Return what a new memory begins with; arguments as of `SceneGraphMemory`."""
    _check_given(prior, clock, score_calibration)
    prior = prior if prior is not None else PriorGraph.household()
    content = MemoryContent.empty(prior.checksum, clock, read_map_id(map_id))
    return replace(content, score_calibration=score_calibration), prior


def take_given(
    content: MemoryContent,
    path: str | Path,
    prior: PriorGraph | None,
    clock: Clock | None,
    score_calibration: ScoreCalibration | None,
    map_id: str,
) -> tuple[MemoryContent, PriorGraph]:
    """Return what a saved memory goes on with; arguments as of `SceneGraphMemory.load`."""
    prior = prior if prior is not None else find_shipped(content.prior)
    if prior is None:
        raise ValueError(
            f"prior must be the one of the memory, {content.prior[:12]}..., got no shipped one "
            f"of that checksum for {path}. Give its own prior, or PriorGraph.default() to go "
            "on with that one."
        )
    saved_map = content.layout.map_id
    if map_id and saved_map and saved_map != map_id:
        raise ValueError(
            f"memory must be of the map that the robot has, {shorten(map_id)}, got one of "
            f"{shorten(saved_map)} for {path}. Load it without map_id, and say with transform how "
            "the map was moved, or start a new memory."
        )
    content.layout.map_id = read_map_id(map_id) or saved_map
    _check_given(prior, clock, score_calibration)
    if clock is not None:
        clock.get_time(content.time)  # or it is refused
        content = replace(content, clock=clock)
    if score_calibration is not None:
        content = replace(content, score_calibration=score_calibration)
    return content, prior


def _check_given(prior: object, clock: object, score_calibration: object) -> None:
    """Raise TypeError for what is given to a memory and is something else."""
    for name, value, expected in (
        ("prior", prior, PriorGraph),
        ("clock", clock, Clock),
        ("score_calibration", score_calibration, ScoreCalibration),
    ):
        read_optional(name, value, expected, "Leave it out for the default.")


class MemoryFiles:
    """The file of a memory; `SceneGraphMemory` says what each call does and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state
        self.read_again: ReadAgain | None = None  # reads what a file holds
        self._saving = Lock()  # never waited for while the lock of the state is held

    def copy_content(self) -> tuple[MemoryContent, PriorGraph]:
        """Return all that the memory holds, and its prior, for another one."""
        with self._state.lock:
            return self._state.get_content_to_save().copy(), self._state.prior

    def go_on_from(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content, as a file says that one went on."""
        with self._state.lock:
            self._state.begin(content.copy(), prior)

    @property
    def file(self) -> HomeFile | None:
        """The file that is written; None of a memory that lives in the process alone."""
        return self._state.file

    @property
    def path(self) -> Path | None:
        """Of the file, without links; None without one."""
        return None if self._state.file is None else self._state.file.path

    def begin(self, path: str | Path) -> None:
        """Have a new file for a memory that begins."""
        check_folder(Path(path))
        if os.path.lexists(path):
            raise FileExistsError(
                f"memory file must be a new one, got one that is there for {path}. Go on with it: "
                "SceneGraphMemory.open; or choose another one."
            )
        write_file(self._state.get_content_to_save(), Path(path))
        self._state.file = HomeFile(Path(path))

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` goes on; it holds no code.

        To its own file that is a snapshot, to another one a copy with all events.
        """
        # Of two saves the later one lasts; no other call waits for the disk.
        with self._saving:
            file = self._state.file
            if file is None or not file.is_held:
                with self._state.lock:
                    content = self._state.get_content_to_save().copy()
                write_file(content, Path(path))
            elif os.path.realpath(path) == str(file.path):
                self.snapshot()
            else:
                self.snapshot()
                file.copy(Path(path))

    def snapshot(self) -> None:
        """Write what the memory holds into its file, so that the next start is quick."""
        with self._state.lock:
            file = self._state.renew_lost_file()
            if file is None:
                return
            content, number = self._state.get_content_to_save().copy(), file.number
        add_snapshot(content, file, number)

    @contextmanager
    def transaction(self) -> Iterator[None]:
        """Write all changes that are made meanwhile at once; no other thread changes the memory.

        A change that raises an error ends it: those before it stay, in memory and file. If the disk
        does not take them, the memory is again what the file holds.

        Raises:
            OSError: if the disk does not take it; then nothing was changed.
        """
        with self._state.lock:
            file = self._state.file
            if file is None or not file.is_held:
                yield
                return
            caught: Exception | None = None
            number = file.num_written
            try:
                with file.transaction():
                    try:
                        yield
                    except OSError:
                        raise
                    except Exception as error:
                        caught = error
            except OSError:
                if file.num_written > number:  # changes that are not in it
                    assert self.read_again is not None
                    self._state.begin(*self.read_again(file.path))
                raise
            if caught is not None:
                raise caught

    def sync(self) -> None:
        """Have the disk take all changes, to survive a loss of power; raises OSError if not."""
        if self._state.file is not None:
            self._state.file.sync()

    def checkpoint(self) -> None:
        """Move what lies beside the file into it, once that is much; no call waits for it."""
        if self._state.file is not None:
            self._state.file.checkpoint()

    def close(self) -> None:
        """Write a snapshot, and let go of the file; the memory lives on in the process alone."""
        with self._saving, self._state.lock:
            file = self._state.file
            if file is None:
                return
            try:
                # Of a file that was taken away, the events are where it is now.
                if file.is_held and file.num_new and file.is_in_place:
                    self.snapshot()
            finally:
                file.close()
                self._state.file = None

    def start_clock(self, clock: Clock) -> None:
        """Have a clock from now on."""
        _check_given(None, clock, None)
        with self._state.lock:
            content = self._state.get_content_to_save()
            if content.clock is not None or clock is None:
                raise ValueError(
                    f"memory must have no clock to get one, got {shorten(content.clock)}. Replace "
                    "it with SceneGraphMemory.load(path, clock=...)."
                )
            clock.get_time(content.time)  # or it is refused
            _configure(self._state, replace(content, clock=clock), self._state.prior)

    def go_on_in(
        self,
        file: HomeFile,
        clock: Clock | None,
        prior: PriorGraph | None,
        score_calibration: ScoreCalibration | None,
        map_id: str,
    ) -> None:
        """Go on writing a file whose events have made the memory; arguments as of `open`."""
        with self._state.lock:
            self._state.file = file
            content = before = self._state.get_content_to_save().copy()
            content, prior = take_given(content, file.path, prior, None, score_calibration, map_id)
            if clock is not None and content.clock is None:
                content = replace(content, clock=begin_before(clock, content.time))
            _configure(self._state, replace(content, prior=prior.checksum), prior, before)


def begin_before(clock: Clock, time: int) -> Clock:
    """Return the clock of step 0 by one of a later step."""
    return clock.shift(-time * clock.step_seconds)


def _configure(
    state: MemoryState,
    content: MemoryContent,
    prior: PriorGraph,
    before: MemoryContent | None = None,
) -> None:
    """Go on with a content of another clock, prior, map or calibration, and write that."""
    before = state.get_content_to_save() if before is None else before
    changed: dict[str, Any] = {}
    if content.clock != before.clock:
        changed["clock"] = content.clock
    if content.prior != before.prior:
        changed["prior"] = content.prior
    if content.layout.map_id != before.layout.map_id:
        changed["map"] = content.layout.map_id
    if content.score_calibration != before.score_calibration:
        changed["score_calibration"] = content.score_calibration
    if not changed:
        return
    file = state.renew_lost_file()
    if file is not None:
        with file.transaction():
            state.write("configure", **changed)
            columns: dict[str, Any] = {
                name: changed[name] for name in ("prior", "map") if name in changed
            }
            if "clock" in changed:
                columns |= write_clock(content.clock)
            file.configure(columns)
    state.begin(content.copy(), prior)
