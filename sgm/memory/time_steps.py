"""Time steps until a time."""

from __future__ import annotations

import math
from datetime import datetime
from typing import Any

import numpy as np

from sgm.memory.clock import Clock
from sgm.messages import shorten

MAX_TIME = 2**31 - 2  # time stamps are 32-bit integers


def count_steps(time: datetime | int, now: int, clock: Clock | None) -> int:
    """Return how many steps it is until a time: to the last step that has begun by then.

    Args:
        time: a date and time by the clock, or a time step.
        now: the present step.
        clock: of the home; None if it has none.

    Raises:
        ValueError: if it is something else, has passed, is too far ahead, or there is no clock.
    """
    if isinstance(time, datetime):
        if clock is None:
            raise ValueError(
                "memory must have a clock for a date and time, got none. Make it with "
                "SceneGraphMemory(clock=Clock(datetime.now(), step_seconds=600))."
            )
        seconds = (time - clock.start).total_seconds()
        num_steps = math.floor(seconds / clock.step_seconds + 1e-9) - now
    elif isinstance(time, (int, np.integer)) and not isinstance(time, bool):
        num_steps = int(time) - now
    else:
        raise ValueError(
            f"time must be a datetime or a time step, got {shorten(time)}. Write for example "
            "datetime(2026, 11, 16, 18, 30)."
        )
    if not 0 <= num_steps <= MAX_TIME - now:
        present: Any = f"time step {now}"
        if clock is not None and isinstance(time, datetime):
            present = clock.shift(now * clock.step_seconds).start
        raise ValueError(
            f"time must not be before the present step, nor after step {MAX_TIME}, got {time} "
            f"at {present}. Time only goes forward."
        )
    return num_steps
