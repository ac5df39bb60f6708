"""The time by a machine's clock that may be set: it goes on steadily, and faults are said."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta

from sgm.memory.clock import MAX_JUMP

_NOTHING = timedelta(0)
_MENDED = 0.9  # share of what a clock was wrong by, by which it is set ahead when it is mended


class SteadyClock:
    """Local time that never goes back, whatever the clock of the machine says.

    A machine without a battery begins with a wrong time until it has a network, and people set
    clocks back by an hour in autumn. Where the clock goes back, time goes on from where it was, by
    what has passed since: the clock is `ahead` from then on, until it is set ahead again.

    Attributes:
        ahead: by how much this time is ahead of that of the machine; zero as long as it is right.
        num_faults: how often the clock of the machine went back.
    """

    def __init__(
        self, now: Callable[[], datetime], monotonic: Callable[[], float] | None = None
    ) -> None:
        """Begin with a clock.

        Args:
            now: tells the local time of the machine, which may jump.
            monotonic: seconds that pass, from any start, which do not jump; None where there is no
                such clock: then what `now` passes is true, as long as it goes ahead.
        """
        self._now, self._monotonic = now, monotonic
        self._last: tuple[datetime, float] | None = None
        self.ahead, self.num_faults = _NOTHING, 0

    def read(self, present: datetime, tolerance: timedelta) -> datetime:
        """Return what time it is; one of more than `MAX_JUMP` ahead is not remembered.

        Args:
            present: until which time has passed already.
            tolerance: by which the clock may go back, and be waited for.
        """
        wall = self._now()
        seconds = 0.0 if self._monotonic is None else self._monotonic()
        jump = min(wall - present, _NOTHING)  # by how much the clock was set
        if self._last is not None:
            jump = wall - self._last[0]
            if self._monotonic is not None:
                jump -= timedelta(seconds=seconds - self._last[1])
            elif _NOTHING <= jump <= MAX_JUMP:
                jump = _NOTHING
        ahead = self.ahead
        if jump < -tolerance:
            ahead -= jump
        elif jump >= _MENDED * ahead:
            ahead -= min(jump, ahead)
        if wall + ahead - present <= MAX_JUMP:
            self.num_faults += ahead > self.ahead
            self._last, self.ahead = (wall, seconds), ahead
        return wall + ahead

    def tell(self) -> str:
        """Say what is wrong with the clock of the machine; empty if nothing is."""
        if not self.ahead:
            return ""
        wall = "nothing" if self._last is None else self._last[0].isoformat(timespec="seconds")
        return (
            f"the clock of the machine went back: it says {wall}, {self.ahead} before the time of "
            "the memory, whose steps go on from there. Set the clock right."
        )
