"""The time of a memory by a clock that may be set: it goes on steadily, and faults are said."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from datetime import timedelta

from sgm.memory.clock import MAX_JUMP, Clock

_MOST_JUMP = MAX_JUMP.total_seconds()
_SLACK = 10.0  # seconds by which readings may come late, or out of order


def read_even_seconds() -> float:
    """Return seconds that pass, from any start, whatever the clock is set to; asleep, too."""
    if hasattr(time, "CLOCK_BOOTTIME"):
        return time.clock_gettime(time.CLOCK_BOOTTIME)
    return time.monotonic()


class SteadyClock:
    """Seconds since step 0 of a memory, which never go back, whatever a clock says.

    A machine without a battery begins with a wrong time until it has a network, people set clocks
    back by an hour in autumn, and a recording that is played begins anew. Between two readings
    passes what an even clock says. A reading that differs by more than a step is said, and time
    goes on evenly. So it does until the clock is right again; or until one that was set ahead has
    gone on from there for a step, as after a night in which the machine slept: then it is believed.

    The first reading is believed, up to `MAX_JUMP` after the present of the memory: it was off.

    Attributes:
        num_faults: how often the clock was found to be wrong.
    """

    def __init__(self, monotonic: Callable[[], float] | None = None, of: str = "machine") -> None:
        """Begin before the first reading.

        Args:
            monotonic: seconds that pass, from any start, which do not jump; None where there is no
                such clock: then what passes by the readings is true, as long as it goes ahead.
            of: whose clock it is, for messages.
        """
        self._monotonic, self._of = monotonic, of
        self._last: tuple[float, float] | None = None  # a reading, and when it was, evenly
        self._shift = 0.0  # seconds by which time is ahead of the clock; below 0 if that is ahead
        self._since = 0.0  # reading with which the clock was set ahead
        self._said = 0.0  # the shift that was said last
        self._step_seconds = math.inf
        self.num_faults = 0

    def read(
        self, reading: float, present: float, step_seconds: float, *, accept_jump: bool = False
    ) -> float:
        """Return what time it is, seconds since step 0.

        Args:
            reading: what the clock says, in seconds since step 0.
            present: until when time has passed already, likewise.
            step_seconds: length of a step. By less the clock is believed, and waited for.
            accept_jump: whether the reading is right, however far ahead.
        """
        self._step_seconds = step_seconds
        even = 0.0 if self._monotonic is None else self._monotonic()
        if self._last is not None:
            self._follow(reading, even)
        elif reading - present > _MOST_JUMP:
            self._shift, self._since = present - reading, reading
        self._last = reading, even
        behind = present - self.translate(reading)
        if behind > step_seconds:  # the memory was ahead at the start, or was stepped otherwise
            self._shift = present - reading
        is_over = reading - self._since >= step_seconds and -self._shift <= _MOST_JUMP
        if self._shift < 0 and (is_over or accept_jump or -self._shift <= step_seconds):
            self._shift = 0.0
        if not self._is_wrong:
            self._said = 0.0
        elif abs(self._shift - self._said) > step_seconds:
            self._said = self._shift
            self.num_faults += 1
        return self.translate(reading)

    def _follow(self, reading: float, even: float) -> None:
        """Take note of by how much the clock was set since the last reading."""
        assert self._last is not None
        gone, passed = reading - self._last[0], max(even - self._last[1], 0.0)
        if self._monotonic is None:
            passed = gone if 0 <= gone <= _MOST_JUMP else 0.0
        jump = gone - passed
        if -_SLACK <= jump <= 0:  # a clock that is slow, such as that of a recording
            return
        if self._shift >= 0:
            self._since = reading
        self._shift -= jump

    @property
    def is_new(self) -> bool:
        """Whether the clock was not read yet."""
        return self._last is None

    def translate(self, reading: float) -> float:
        """Return the time of a reading, by what is known of the clock now."""
        return reading + (self._shift if self._is_wrong else 0.0)

    @property
    def _is_wrong(self) -> bool:
        return abs(self._shift) > self._step_seconds

    def tell(self, clock: Clock | None) -> str:
        """Say what is wrong, with the clock of the memory; empty if nothing is."""
        if not self._is_wrong or self._last is None:
            return ""
        said = self.tell_reading(clock)
        by = timedelta(seconds=abs(round(self._shift)))
        if self._shift > 0:
            return (
                f"the clock of the {self._of} went back: it says {said}, {by} before the time of "
                "the memory, whose steps go on from there. Set the clock right."
            )
        remedy = f"It is believed once it has gone on from there for {self._step_seconds:g} s."
        if -self._shift > _MOST_JUMP:
            remedy = (
                f"More than {MAX_JUMP.days} days are not believed: set the clock right, or say "
                "accept_jump if it is."
            )
        return (
            f"the clock of the {self._of} was set ahead: it says {said}, {by} after the time of "
            f"the memory, whose steps go on evenly. {remedy}"
        )

    def tell_reading(self, clock: Clock | None) -> str:
        """Say what was read last, a date and time by the clock of the memory, if that has one."""
        reading = math.nan if self._last is None else self._last[0]
        date = None if clock is None else clock.get_date_after(reading)
        return f"{reading:g} s" if date is None else date.isoformat(timespec="seconds")
