"""A memory that outlives its process: a snapshot, and a log of what came since."""

from __future__ import annotations

import json
import os
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from sgm.files import compute_checksum
from sgm.memory.clock import Clock
from sgm.memory.locks import LogLock
from sgm.memory.log_reader import LogLine, read_log
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_files import load_content
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import warn_caller
from sgm.names.aliases import Aliases
from sgm.names.sections import ENGLISH
from sgm.replay.replay import Replayer

LOG_ENDING = ".log"  # of the log beside a snapshot; those before it have a number behind that
MOST_LOG_BYTES = 16 << 20  # from which on a log is begun anew
KEPT_BYTES = 256 << 20  # of logs that were ended; the oldest ones are removed


class KeptHome:
    """Keeps a memory in a file and a log, so that nothing is lost whenever the process ends.

    Beside "home.sgm" lies "home.sgm.log", which has a line for every change, written before the
    change is made. `open` makes these changes again: the memory is what it was, to the bit. One
    process at a time has file and log, by whatever names and links it came to them; in it, no other
    memory is saved to the file.

    Example:
        >>> home = KeptHome.open("home.sgm")
        >>> home.memory.observe(fridge, [Sighting("milk")])  # a kill now loses nothing
        >>> home.snapshot()

    Attributes:
        path: of the snapshot, without links.
        log: the log that is written, beside it.
        memory: what is remembered; it writes the log.
    """

    def __init__(self, path: Path, memory: SceneGraphMemory) -> None:
        """Keep a memory that writes the log of a path; `open` makes one."""
        self.path = path
        self.log = name_log(path)
        self.memory = memory

    @classmethod
    def open(
        cls,
        path: str | Path,
        clock: Clock | None = None,
        aliases: Aliases | None = None,
        language: str = ENGLISH,
        *,
        is_new: bool = False,
    ) -> KeptHome:
        """Go on with a memory as it was when its last process ended, or begin one.

        Args:
            path: such as "home.sgm". A file without a log will do, and a log without a file.
            clock: of the present step, for a memory that has none.
            aliases: as in `SceneGraphMemory`.
            language: as in `SceneGraphMemory`.
            is_new: whether an empty memory begins, where there is neither file nor log.

        Raises:
            FileNotFoundError: if there is neither file nor log, and `is_new` does not say so; or no
                folder.
            ValueError: if a file is damaged; if another process has the log; or if the file is not
                the snapshot that the log goes on from.
            OSError: if a file cannot be read or written.
        """
        path = Path(os.path.realpath(path))  # of a link, the log lies beside what it leads to
        log = name_log(path)
        # First of all, so that no process writes while the files are read; the memory has it later.
        lock = LogLock.of(log)
        lines = _read_latest(log)
        num_names = path.stat().st_nlink if path.exists() else 1
        if num_names > 1:
            warn_caller(
                f"memory file has {num_names} names (hard links): snapshots are written at {path} "
                "alone, and the others stay as they are"
            )
        if lines:
            home = cls(path, replay_latest(lines, aliases, language))
            home._go_on(clock, lines)
        elif path.exists():
            start_clock = _begin_before(clock, load_content(path))
            memory = SceneGraphMemory.load(
                path, clock=start_clock, aliases=aliases, language=language
            )
            home = cls(path, memory)
            home.memory.parts.files.keep(path)
            home.memory.parts.files.start_log(log, goes_on=True)
        elif is_new:
            home = cls(path, SceneGraphMemory(clock=clock, aliases=aliases, language=language))
            home.memory.save(path)  # so that there is a file to have
            home.memory.parts.files.keep(path)
            home.memory.parts.files.start_log(log, goes_on=True)
        else:
            raise FileNotFoundError(
                f"home must be a memory file or its log, got neither at {path}. Check the path, or "
                "begin a new home."
            )
        del lock
        return home

    def _go_on(self, clock: Clock | None, lines: Sequence[LogLine]) -> None:
        """Write where the lines of the log end, and have next starts read what comes from now on.

        On a full disk the log is gone on with, so that what is known can be asked for.
        """
        memory = self.memory
        content = memory.parts.state.get_content_to_save()
        if self.path.exists():
            _check_same(self.path, content, self.log, lines)
        memory.parts.files.keep(self.path)
        start_clock = _begin_before(clock, content)
        if start_clock is not None:
            memory.parts.state.begin(replace(content, clock=start_clock), memory.parts.state.prior)
        if self.log_bytes:
            memory.parts.files.go_on_in(self.log)
        else:  # it ended between the old log and the new one
            memory.parts.files.start_log(self.log, goes_on=True)
        try:
            self.snapshot()
        except OSError as error:
            if start_clock is not None:  # the log does not say so yet
                raise
            warn_caller(f"no snapshot was written at the start: {error.args[-1]}")

    @property
    def log_bytes(self) -> int:
        """Size of the log; 0 where it was moved or removed, until the next change."""
        try:
            return self.log.stat().st_size
        except OSError:
            return 0

    @property
    def is_log_long(self) -> bool:
        """Whether it is time for a snapshot."""
        return self.log_bytes >= MOST_LOG_BYTES

    def snapshot(self) -> None:
        """Write the memory to its file, whole or not at all, and begin the log anew.

        The log so far is kept under a number, `KEPT_BYTES` of them at most.

        Raises:
            OSError: if the disk does not take it; the old file and the log are the memory then.
        """
        numbers = _list_numbers(self.log)
        latest = _number(self.log, max(numbers, default=0) + 1)
        self.memory.save_and_rotate(self.path, latest)
        left = KEPT_BYTES
        for old in (_number(self.log, number) for number in reversed(numbers)):
            left -= old.stat().st_size
            if left < 0:
                old.unlink()


def replay_latest(
    lines: Sequence[LogLine], aliases: Aliases | None = None, language: str = ENGLISH
) -> SceneGraphMemory:
    """Return the memory that wrote a log, as after the last line of `read_log`; it writes no log.

    Raises:
        ValueError: if a line names a room or furniture that there is not.
    """
    first = 0
    for number, line in enumerate(lines):
        if line.kind == "start":
            first = number
    lines = lines[first:]
    clock = lines[0].values["clock"]
    replayer = Replayer(SceneGraphMemory(clock=clock, aliases=aliases, language=language))
    for line in lines:
        replayer.apply(line)
    return replayer.memory


def _begin_before(clock: Clock | None, content: MemoryContent) -> Clock | None:
    """Return the clock of a memory that has none yet, by one of its present step."""
    if clock is None or content.clock is not None:
        return None
    return clock.shift(-content.time * clock.step_seconds)


def name_log(path: Path) -> Path:
    """Return the log beside a memory file."""
    return path.with_name(path.name + LOG_ENDING)


def _number(log: Path, number: int) -> Path:
    return log.with_name(f"{log.name}.{number:06}")


def list_ended_logs(log: Path) -> list[Path]:
    """List the logs before one, the latest last."""
    return [_number(log, number) for number in _list_numbers(log)]


def _list_numbers(log: Path) -> list[int]:
    """List the numbers of the logs that were ended, the latest last."""
    pattern = re.compile(re.escape(log.name) + r"\.(\d{6,})")
    found = (pattern.fullmatch(file.name) for file in log.parent.iterdir())
    return sorted(int(match[1]) for match in found if match)


def _read_latest(log: Path) -> list[LogLine]:
    """Read the log, or the one before it, if the process ended while it was begun anew."""
    lines = read_log(log) if log.exists() else []
    if lines:
        return lines
    numbers = _list_numbers(log)
    return read_log(_number(log, numbers[-1])) if numbers else []


def _check_same(path: Path, latest: MemoryContent, log: Path, lines: Sequence[LogLine]) -> None:
    """Check that a file is a snapshot that the log goes on from, or ends with."""
    # The process may have ended between the new log and the new file, or the disk was full.
    if compute_checksum(path) in [line.values.get("file") for line in lines]:
        return
    saved = _write(load_content(path))
    started = (_write(line.values["memory"]) for line in lines if line.kind == "start")
    if saved == _write(latest) or saved in started:
        return
    raise ValueError(
        f"home must be the memory that its log goes on from, got another one in {path}. Move "
        f"{log.name} and its numbers away to begin from the file, or the file to go on from the "
        "log."
    )


def _write(content: MemoryContent) -> str:
    """Write what a memory holds; a clock may have been given to it since."""
    return json.dumps({**content.to_json(), "clock": None}, sort_keys=True)
