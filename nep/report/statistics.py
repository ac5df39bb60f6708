"""Means over homes and paired bootstrap intervals."""

from __future__ import annotations

import numpy as np


def compute_bootstrap_interval(
    values: np.ndarray, *, level: float = 0.95, num_resamples: int = 10_000, seed: int = 0
) -> tuple[float, float]:
    """Return the percentile bootstrap interval of a mean over homes; nan of a single home.

    Give the differences of two policies, home by home, for a paired comparison. Of several
    trainings both homes and trainings are resampled, as both were drawn; few trainings make it a
    little too narrow: of three, by a factor of .82 for their part.

    Args:
        values: one value per home, (H,), or per training and home, (S, H).
        level: coverage.
        num_resamples: resamples of the homes.
        seed: of the resampling.

    Source: docs/design.md, ruling 22.
    """
    num_homes = values.shape[-1]
    if num_homes < 2:
        return float("nan"), float("nan")
    rng = np.random.default_rng(seed)
    homes = rng.integers(0, num_homes, (num_resamples, num_homes))
    if values.ndim == 1:
        means = values[homes].mean(axis=1)
    else:
        trainings = rng.integers(0, len(values), (num_resamples, len(values)))
        means = values[trainings[:, :, None], homes[:, None]].mean(axis=(1, 2))
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
