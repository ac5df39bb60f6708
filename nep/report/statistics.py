"""Means over homes and paired bootstrap intervals."""

from __future__ import annotations

import numpy as np


def compute_bootstrap_interval(
    values: np.ndarray, *, level: float = 0.95, num_resamples: int = 10_000, seed: int = 0
) -> tuple[float, float]:
    """Return the percentile bootstrap interval of a mean over homes; nan of a single home.

    Give the differences of two policies, home by home, for a paired comparison.

    Args:
        values: one value per home, (H,).
        level: coverage.
        num_resamples: resamples of the homes.
        seed: of the resampling.

    Source: docs/design.md, ruling 22.
    """
    if len(values) < 2:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    means = values[rng.integers(0, len(values), (num_resamples, len(values)))].mean(axis=1)
    low, high = np.quantile(means, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)


def compute_gap_closed(score: float, floor: float, top: float) -> float:
    """Return the share of the gap between two scores that a score closes; nan without a gap."""
    return (score - floor) / (top - floor) if top != floor else float("nan")


def smooth(values: np.ndarray, window: int = 10) -> np.ndarray:
    """Average over the last `window` entries of the last axis, fewer at the start: (..., T)."""
    total = np.cumsum(values, axis=-1, dtype=float)
    count = np.minimum(np.arange(values.shape[-1]) + 1, window)
    total[..., window:] -= total[..., :-window].copy()
    return total / count
