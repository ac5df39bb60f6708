"""Means over what was drawn independently: intervals, tests, what could have been detected.

The unit of all of them is a home or a household. Steps and replays of one are averaged first, so
that they never count as further units. Values are one per unit, (U,), or, of several trainings, one
per training and unit, (S, U).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

LEVEL = 0.95  # of intervals; 1 - LEVEL is the level of tests
POWER = 0.8  # with which a detectable difference would be found
FEWEST_RESAMPLED = 10  # units that are resampled; of fewer, a t interval


def average_units(values: np.ndarray, units: Sequence[str] | None) -> np.ndarray:
    """Average what belongs to one unit: (..., H) -> (..., U), units in order of appearance.

    Args:
        values: one value per play, (..., H).
        units: which home or household each play is of, H names; None if each is one of its own.

    Raises:
        ValueError: if there are not as many names as values.
    """
    if units is None:
        return values
    if len(units) != values.shape[-1]:
        raise ValueError(
            f"units must name the home of each of {values.shape[-1]} values, got {len(units)} "
            "names. Give one each."
        )
    index = {name: number for number, name in enumerate(dict.fromkeys(units))}
    of = np.array([index[name] for name in units], dtype=np.int64)
    member = of[:, None] == np.arange(len(index))  # (H, U)
    means: np.ndarray = values @ member / member.sum(axis=0)
    return means


def compute_interval(values: np.ndarray, *, num_resamples: int = 10_000) -> tuple[float, float]:
    """Return the interval of a mean over units, at `LEVEL`; nan of a single unit.

    From `FEWEST_RESAMPLED` units on it is the percentile bootstrap, at the quantiles that make up
    for its narrowness in small samples; of fewer units, or of several trainings, a t interval.

    Args:
        values: one value per unit, (U,), or per training and unit, (S, U).
        num_resamples: resamples of the units.

    Source: docs/design.md, ruling 22; Hesterberg 2015, "What Teachers Should Know About the
    Bootstrap", section 5.3 (expanded percentile interval).
    """
    num_units = values.shape[-1]
    if num_units < 2:
        return float("nan"), float("nan")
    if values.ndim > 1 and len(values) == 1:
        values = values[0]
    if values.ndim > 1 or num_units < FEWEST_RESAMPLED:
        error, freedom = compute_error(values)
        half = float(stats.t.ppf((1 + LEVEL) / 2, freedom)) * error
        return float(values.mean()) - half, float(values.mean()) + half
    picked = np.random.default_rng(0).integers(0, num_units, (num_resamples, num_units))
    wide = np.sqrt(num_units / (num_units - 1)) * stats.t.ppf((1 + LEVEL) / 2, num_units - 1)
    tail = float(stats.norm.sf(wide))
    low, high = np.quantile(values[picked].mean(axis=1), [tail, 1 - tail])
    return float(low), float(high)


def compute_error(values: np.ndarray) -> tuple[float, float]:
    """Return the standard error of a mean over units, and its degrees of freedom.

    Of several trainings, trainings and units were both drawn. Their effects and the residual have
    the mean squares A, B and E, and the variance of the mean is (A + B - E) / SU,
    but at least that of any of the three alone.

    Source: Satterthwaite 1946, two crossed random factors.
    """
    if values.ndim == 1 or len(values) == 1:
        values = values.reshape(-1)
        return float(values.std(ddof=1) / np.sqrt(len(values))), len(values) - 1.0
    num_trainings, num_units = values.shape
    by_training, by_unit = values.mean(axis=1), values.mean(axis=0)
    residual = values - by_training[:, None] - by_unit + values.mean()
    free = np.array([num_trainings - 1, num_units - 1, (num_trainings - 1) * (num_units - 1)])
    squares = np.array(
        [
            num_units * by_training.var(ddof=1),
            num_trainings * by_unit.var(ddof=1),
            (residual**2).sum() / free[2],
        ]
    )
    both = squares[0] + squares[1] - squares[2]
    alone = int(squares.argmax())
    if both <= squares[alone]:
        return float(np.sqrt(squares[alone] / values.size)), float(free[alone])
    return float(np.sqrt(both / values.size)), float(both**2 / (squares**2 / free).sum())


def compute_p_value(values: np.ndarray) -> float:
    """Return the two-sided p of the t test that a mean over units is zero; nan of a single unit."""
    if values.shape[-1] < 2:
        return float("nan")
    error, freedom = compute_error(values)
    mean = abs(float(values.mean()))
    if error == 0:
        return 1.0 if mean == 0 else 0.0
    return float(2 * stats.t.sf(mean / error, freedom))


def compute_detectable(values: np.ndarray) -> float:
    """Return the smallest true mean that the t test would find with `POWER`; nan of a single unit.

    It is (t of (1 + LEVEL) / 2 + t of POWER) x standard error.
    """
    if values.shape[-1] < 2:
        return float("nan")
    error, freedom = compute_error(values)
    return float(stats.t.ppf([(1 + LEVEL) / 2, POWER], freedom).sum()) * error


def correct_holm(p_values: Sequence[float]) -> list[float]:
    """Return p values that hold for all comparisons of a table together, in the same order.

    A comparison without one (nan) counts for nothing, and stays nan.

    Source: Holm 1979.
    """
    known = [number for number, p in enumerate(p_values) if not np.isnan(p)]
    order = sorted(known, key=lambda number: p_values[number])
    corrected, most = [float("nan")] * len(p_values), 0.0
    for rank, number in enumerate(order):
        most = max(most, min(1.0, (len(order) - rank) * p_values[number]))
        corrected[number] = most
    return corrected


def compute_gap_closed(score: float, floor: float, top: float) -> float:
    """Return the share of the gap between two scores that a score closes; nan without a gap."""
    return (score - floor) / (top - floor) if top != floor else float("nan")


def smooth(values: np.ndarray, window: int = 10) -> np.ndarray:
    """Average over the last `window` entries of the last axis, fewer at the start: (..., T)."""
    total = np.cumsum(values, axis=-1, dtype=float)
    count = np.minimum(np.arange(values.shape[-1]) + 1, window)
    total[..., window:] -= total[..., :-window].copy()
    return total / count
