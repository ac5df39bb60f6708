"""From stamps of messages to time steps of a memory; time only goes forward, and never stands."""

from __future__ import annotations

import math
from collections.abc import Callable
from datetime import datetime, timedelta

from sgm.memory.clock import MAX_JUMP, Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory

LocalTime = Callable[[float], datetime | None]
_LEAST_BACK = 60.0  # seconds by which looks of one moment may be out of order


def to_local_time(stamp: float) -> datetime | None:
    """Return the local date and time of seconds since 1970; None beyond what there is."""
    try:
        return datetime.fromtimestamp(stamp)
    except (OverflowError, OSError, ValueError):
        return None


class LiveClock:
    """Lets the time of a memory pass by stamps, which are seconds of the clock of messages.

    A memory without a clock gets one that begins with the first stamp. Stamps that jump, as while a
    robot has not the right time yet, are said, and time goes on evenly from where it was.
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        step_seconds: float,
        local_time: LocalTime,
        warn: Callable[[str], None],
        *,
        accept_jump: bool = False,
    ) -> None:
        """Begin before the first stamp.

        Args:
            memory: whose time passes.
            step_seconds: length of a time step, where the memory has no clock.
            local_time: gives the local date and time of a stamp, None where it is none; then the
                memory gets no clock, and its steps are counted from the first stamp on.
            warn: takes a warning of stamps that jump.
            accept_jump: whether the first stamp is right, however far ahead of the memory.
        """
        self._memory, self._local_time, self._warn = memory, local_time, warn
        self._step_seconds = step_seconds
        self._accept_jump = accept_jump
        self._zero: float | None = None  # stamp of step 0
        self._latest = -math.inf

    def go_to(self, stamp: float) -> None:
        """Let time pass until a stamp: to the last step that has begun by then."""
        memory, is_first = self._memory, self._zero is None
        if self._zero is None:
            self._zero = stamp - self._find_seconds(stamp)
        step_seconds = self._get_step_seconds()
        present = memory.time * step_seconds  # seconds from step 0 on
        back = max(self._latest, self._zero + present) - stamp
        if back > max(step_seconds, _LEAST_BACK):
            self._warn(
                f"stamps must go forward, got one {timedelta(seconds=round(back))} before the "
                "present of the memory. Time goes on from there; check the clock of the robot."
            )
            self._zero -= back
        steps = math.floor((stamp - self._zero) / step_seconds + 1e-9) - memory.time
        is_accepted = is_first and self._accept_jump
        if steps * step_seconds > MAX_JUMP.total_seconds() and not is_accepted:
            self._warn(
                f"time must be at most {MAX_JUMP.days} days after the present step, got "
                f"{steps * step_seconds / 86400:.0f} days. The memory goes on as if no time had "
                "passed; if the clock of the robot is right, say accept_jump."
            )
            self._zero, steps = stamp - present, 0
        self._latest = stamp
        if steps > 0:
            memory.step(steps, accept_jump=True)

    def go_to_wall_time(self, now: float) -> None:
        """Let time pass before any stamp has come, as after a start, where that makes sense.

        The clock of the messages may be another one: nothing else is taken from it.
        """
        clock, date = self._memory.clock, self._local_time(now)
        if self._zero is not None or clock is None or date is None:
            return
        ahead = (date - clock.start).total_seconds() - self._memory.time * clock.step_seconds
        if ahead >= clock.step_seconds and (self._accept_jump or ahead <= MAX_JUMP.total_seconds()):
            steps = math.floor(ahead / clock.step_seconds + 1e-9)
            self._memory.step(steps, accept_jump=True)

    def _get_step_seconds(self) -> float:
        clock = self._memory.clock
        return self._step_seconds if clock is None else clock.step_seconds

    def _find_seconds(self, stamp: float) -> float:
        """Return how many seconds after step 0 the first stamp is; the clock begins with it."""
        memory, date = self._memory, self._local_time(stamp)
        clock, passed = memory.clock, memory.time * self._get_step_seconds()
        if date is None:
            return passed
        if clock is None:
            clock = Clock(date - timedelta(seconds=passed), self._step_seconds)
            memory.start_clock(clock)
        return (date - clock.start).total_seconds()
