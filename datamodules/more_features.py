"""Features beyond the paper's: what a filter believes, the clock, and what the memory says."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from datamodules.paper_features import Feature
from sgm.arrays.week import DAY_SECONDS, compute_week_seconds
from sgm.evidence.columns import PLACE_COLUMNS, QUESTION_COLUMNS
from sgm.schema import NEVER

if TYPE_CHECKING:
    from simulator.snapshots.snapshots import Selection


def compute_belief_features(belief: np.ndarray) -> np.ndarray:
    """Return the five belief features of query edges, float32 (n, 5).

    Probability that the last seen instance is there, expected number of others (at most 1), the
    logarithm of their sum, scaled to [0, 1] from 1e-4 to 1, and how likely class noise and
    instance noise have left the place possible; of the extra "belief" of `Snapshots`, (n, 4).
    """
    last, others = belief[:, 0], belief[:, 1]
    total = np.clip(last + others, 1e-4, 1)
    columns = [last, np.minimum(others, 1), 1 + np.log10(total) / 4, *belief[:, 2:].T]
    return np.stack(columns, axis=1).astype(np.float32)


def compute_clock_features(
    clock: np.ndarray, time: np.ndarray, last_true: np.ndarray
) -> np.ndarray:
    """Return the eight clock features of edges between objects and furniture, float32 (n, 8).

    Sine and cosine of the hour of the day, then of the day of the week, now; the same four of when
    the object was last seen there. Of an edge that was never seen true these four are zero, which
    no time is.

    The hour runs around the circle once a day from midnight: 06:00 is (1, 0). The day stays where
    it is from midnight to midnight: Monday is (0, 1).

    Args:
        clock: `Snapshots.clock` of the home of each edge, (n, 2).
        time: the present time step, (n,).
        last_true: time step of the last sighting, (n,).
    """
    was_seen = last_true != NEVER
    now = _compute_circles(compute_week_seconds(clock, time))
    seen = _compute_circles(compute_week_seconds(clock, last_true)) * was_seen[:, None]
    return np.concatenate([now, seen], axis=1).astype(np.float32)


def _compute_clock(edges: Selection) -> np.ndarray:
    clock = edges.snapshots.clock
    if clock is None or np.isnan(clock).any():
        raise ValueError(
            "homes must have a clock for features.clock, got one without. Say in layout.json when "
            "a recorded home starts, or make the memory with SceneGraphMemory(clock=Clock(...)); "
            "simulated homes have none."
        )
    last_true = edges["last_true"]
    return compute_clock_features(clock[edges["snapshot"]], edges["time"], last_true)


def _compute_circles(week_seconds: np.ndarray) -> np.ndarray:
    """Return sine and cosine of hour of day and of day of week, (n,) -> (n, 4)."""
    day, second = np.divmod(week_seconds, DAY_SECONDS)
    hour_angle = second * (2 * np.pi / DAY_SECONDS)
    day_angle = day * (2 * np.pi / 7)
    columns = [np.sin(hour_angle), np.cos(hour_angle), np.sin(day_angle), np.cos(day_angle)]
    return np.stack(columns, axis=1)


MORE_FEATURES = (
    Feature(
        "belief of `HomeFilter` (`compute_belief_features`)",
        "belief",
        "query edge",
        lambda edges: compute_belief_features(edges.extra("belief")),
        width=5,
        recorded="belief",
    ),
    Feature(
        "hour and day, now and when last seen there (`compute_clock_features`)",
        "clock",
        "object edge",
        _compute_clock,
        width=8,
    ),
    Feature(
        "what the memory says about it (`sgm.evidence`)",
        "evidence",
        "place",
        lambda places: places.extra("evidence"),
        width=len(PLACE_COLUMNS),
        recorded="evidence",
    ),
    Feature(
        "what the memory says about it (`sgm.evidence`)",
        "evidence",
        "question",
        lambda questions: questions.extra("evidence"),
        width=len(QUESTION_COLUMNS),
        recorded="evidence",
    ),
)
