"""Where in the week time steps lie: seconds since Monday 00:00, and hours of days alike."""

from __future__ import annotations

import numpy as np

HOUR_SECONDS = 3600.0
DAY_SECONDS = 24 * HOUR_SECONDS
WEEK_SECONDS = 7 * DAY_SECONDS
NUM_WEEK_HOURS = 48  # the hours of a working day, then those of a day of the weekend


def compute_week_seconds(clock: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return the seconds since Monday 00:00 at time steps (n,), by the clock of each (n, 2)."""
    return np.mod(clock[:, 0] + time * clock[:, 1], WEEK_SECONDS)


def compute_week_hours(clock: np.ndarray, time: int | np.ndarray) -> np.ndarray:
    """Return which of `NUM_WEEK_HOURS` time steps begin in, int64 (n,), -1 where it is unknown.

    The clock is that of the home of each, nan where it has none, (n, 2); time (n,) or one for all.
    """
    seconds = compute_week_seconds(clock, np.broadcast_to(time, len(clock)))
    is_known = ~np.isnan(seconds)
    seconds = np.where(is_known, seconds, 0.0)
    is_weekend = seconds >= 5 * DAY_SECONDS
    hour = (seconds % DAY_SECONDS // HOUR_SECONDS).astype(np.int64) + 24 * is_weekend
    return np.where(is_known, hour, -1)
