"""Figures of results."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from nep.report.statistics import smooth

# One colour and line style per policy, the same in every figure; oracles are dashed grey.
_STYLES: Mapping[str, dict[str, Any]] = {
    "random": {"color": "#c7c7c7"},
    "priors": {"color": "#bcbd22"},
    "frequentist": {"color": "#e377c2"},
    "myopic": {"color": "#8c564b"},
    "bayesian": {"color": "#1f77b4"},
    "last_seen": {"color": "#98df8a"},
    "last_seen_prior": {"color": "#2ca02c"},
    "prior_filter": {"color": "#9467bd"},
    "home_filter": {"color": "#c5b0d5"},
    "persistence": {"color": "#5f9ea0"},
    "adaptive": {"color": "#006d5b"},
    "oracle": {"color": "#7f7f7f", "linestyle": ":"},
    "schedule_oracle": {"color": "#404040", "linestyle": "-."},
    "ceiling": {"color": "#404040", "linestyle": "--"},
}


_WINDOW = 10  # steps that a curve is averaged over
_NUM_BINS = 10  # of a calibration diagram

# Networks, in the order in which they are given.
_MODEL_COLORS = ("#d62728", "#ff7f0e", "#17becf", "#e41a8c", "#a65628", "#377eb8")


def draw_over_steps(
    values: Mapping[str, np.ndarray],
    highlight: str | Sequence[str],
    *,
    title: str,
    metric: str,
) -> Figure:
    """Draw a score over steps for every policy, models in bold with a band.

    Curves are averaged over the last ten steps; the band is one standard error over homes.
    Names stand at the end of their curves.

    Args:
        values: score of each home and step, (H, T), by policy.
        highlight: which ones to draw in bold: one name or several.
        title: of the figure.
        metric: what the score is.

    Source: paper figure 4.
    """
    bold = {highlight} if isinstance(highlight, str) else set(highlight)
    figure = Figure(figsize=(7.5, 4.8), dpi=120, layout="constrained")
    axes = figure.subplots()
    ends: list[tuple[float, str, str]] = []
    colors = cycle(_MODEL_COLORS)
    for name, rows in values.items():
        style: dict[str, Any] = dict(_STYLES[name] if name in _STYLES else {"color": next(colors)})
        curves = smooth(rows, _WINDOW)  # (H, T)
        mean = curves.mean(axis=0)
        steps = np.arange(1, len(mean) + 1)
        is_bold = name in bold
        axes.plot(steps, mean, linewidth=3 if is_bold else 1.4, zorder=3 if is_bold else 2, **style)
        if is_bold:
            error = curves.std(axis=0) / np.sqrt(len(curves))
            axes.fill_between(
                steps, mean - error, mean + error, color=style["color"], alpha=0.2, linewidth=0
            )
        ends.append((float(mean[-1]), name, style["color"]))
    axes.set_ylim(bottom=0)
    _label_ends(axes, ends, x=len(mean) * 1.015)
    axes.set_xlim(1, len(mean) * 1.24)  # room for the names
    axes.set_xticks([tick for tick in axes.get_xticks() if 0 < tick <= len(mean)])
    axes.set_xlabel("time step")
    axes.set_ylabel(f"{metric}, mean of {_WINDOW} steps")
    axes.set_title(title, loc="left")
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def draw_by_hour(accuracy: Mapping[str, Mapping[str, Sequence[float]]]) -> Figure:
    """Draw the share of wrong answers in each hour of the day, a panel each for some kinds of play.

    Args:
        accuracy: share of right answers in hours 0 to 23, nan where nothing was asked, by player
            and by title; the best player of a panel stands at its top.
    """
    num_rows = -(-len(accuracy) // 2)
    most = max(len(players) for players in accuracy.values())
    figure = Figure(figsize=(15, (0.6 + 0.26 * most) * num_rows), dpi=90, layout="constrained")
    panels = figure.subplots(num_rows, 2, squeeze=False).ravel()
    for axes, (title, players) in zip(panels, accuracy.items(), strict=False):
        names = sorted(players, key=lambda player: -float(np.nanmean(players[player])))
        wrong = 1 - np.array([players[name] for name in names])  # (players, 24)
        image = axes.imshow(wrong, vmin=0, vmax=1, cmap="magma_r", aspect="auto")
        axes.set_yticks(range(len(names)), [name.replace("_", " ") for name in names], fontsize=8)
        axes.set_xticks(range(0, 24, 3), [f"{hour}:00" for hour in range(0, 24, 3)], fontsize=8)
        axes.set_title(fill(title, 80), loc="left", fontsize=8)
    for axes in panels[len(accuracy) :]:
        axes.set_axis_off()
    figure.colorbar(image, ax=list(panels), label="share of wrong first guesses", shrink=0.5)
    return figure


def draw_calibration(confidence: np.ndarray, is_correct: np.ndarray, title: str) -> Figure:
    """Draw how often answers of each confidence are right; the diagonal is a perfect calibration.

    Args:
        confidence: probability that was given to the choice of each answer, in [0, 1], (n,).
        is_correct: whether it was right, bool (n,).
        title: of the figure.
    """
    figure = Figure(figsize=(4.6, 4.6), dpi=110, layout="constrained")
    axes = figure.subplots()
    at = np.minimum((confidence * _NUM_BINS).astype(int), _NUM_BINS - 1)
    count = np.bincount(at, minlength=_NUM_BINS)
    shown = np.flatnonzero(count)
    said = np.bincount(at, confidence, _NUM_BINS)[shown] / count[shown]
    right = np.bincount(at, is_correct, _NUM_BINS)[shown] / count[shown]
    axes.plot([0, 1], [0, 1], color="#999999", linewidth=1)
    axes.bar((np.arange(_NUM_BINS) + 0.5) / _NUM_BINS, count / max(count.sum(), 1),
             width=0.9 / _NUM_BINS, color="#c3cad3", label="share of the answers")  # fmt: skip
    axes.plot(said, right, "o-", color=_MODEL_COLORS[0], label="share that is right")
    axes.set(xlim=(0, 1), ylim=(0, 1), xlabel="probability of the choice", aspect="equal")
    axes.set_title(title, loc="left", fontsize=10)
    axes.legend(frameon=False, loc="upper left", fontsize=9)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _label_ends(axes: Axes, ends: list[tuple[float, str, str]], x: float) -> None:
    """Write names at the ends of curves, each as near to its own as the others allow."""
    ends = sorted(ends)
    values = np.array([end for end, _, _ in ends])
    bottom, top = axes.get_ylim()
    steps = np.arange(len(ends)) * 0.045 * (top or 1.0)  # a line of text each
    heights = isotonic_regression(values - steps).x + steps
    heights = np.minimum(heights, top + steps - steps[-1])  # as far as they fit, none above
    heights = np.maximum(heights, bottom + steps)  # the axes, and none below
    for y, (_, name, color) in zip(heights, ends, strict=True):
        axes.text(x, y, name.replace("_", " "), color=color, va="center", fontsize=10)
