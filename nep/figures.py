"""Figures of results."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.optimize import isotonic_regression

from nep.statistics import smooth
from simulator.evaluation import Scores

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
    "oracle": {"color": "#7f7f7f", "linestyle": ":"},
    "ceiling": {"color": "#404040", "linestyle": "--"},
}


def draw_accuracy_over_steps(
    scores: Mapping[str, Scores], highlight: str, window: int = 10
) -> Figure:
    """Draw accuracy over steps for every policy, the model in bold with a band.

    Curves are averaged over the last `window` steps; the band is one standard error over homes.
    Names stand at the end of their curves.

    Source: paper figure 4.
    """
    figure = Figure(figsize=(7.5, 4.8), dpi=120, layout="constrained")
    axes = figure.subplots()
    ends: list[tuple[float, str, str]] = []
    for name, score in scores.items():
        style: dict[str, Any] = dict(_STYLES.get(name, {"color": "#d62728"}))
        curves = smooth(score.is_correct, window)  # (H, T)
        mean = curves.mean(axis=0)
        steps = np.arange(1, len(mean) + 1)
        is_own = name == highlight
        axes.plot(steps, mean, linewidth=3 if is_own else 1.4, zorder=3 if is_own else 2, **style)
        if is_own:
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
    axes.set_ylabel(f"accuracy, mean of {window} steps")
    axes.set_title("Predict Object Location on unseen homes")
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)
    return figure


def _label_ends(axes: Axes, ends: list[tuple[float, str, str]], x: float) -> None:
    """Write names at the ends of curves, each as near to its own as the others allow."""
    ends = sorted(ends)
    values = np.array([end for end, _, _ in ends])
    steps = np.arange(len(ends)) * 0.045 * (axes.get_ylim()[1] or 1.0)  # a line of text each
    heights = isotonic_regression(values - steps).x + steps
    for y, (_, name, color) in zip(heights, ends, strict=True):
        axes.text(x, y, name.replace("_", " "), color=color, va="center", fontsize=10)
