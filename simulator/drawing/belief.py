"""Where something may be: places shaded by probability, and the order of a search."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from sgm.finder.ranking import Ranking
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.drawing.colours import BELIEF, ROUTE, TRUE_PLACE, compute_shade
from simulator.drawing.floor_plan import FloorPlan
from simulator.drawing.home import draw_plan, mix

SMALLEST_SHOWN = 0.005  # probability that is written down


def draw_belief(
    axes: Axes,
    home: FloorPlan | SceneGraphMemory,
    belief: Ranking | np.ndarray,
    *,
    order: Sequence[int] = (),
    true_places: Sequence[int] = (),
) -> Axes:
    """Draw a home with its furniture shaded by probability.

    Example:
        >>> ranking = finder.rank(memory, "red mug")
        >>> draw_belief(plt.subplots()[1], memory, ranking)

    Args:
        axes: where to draw.
        home: a floor plan, or a memory.
        belief: what `Finder.rank` answered; or the probability of each furniture node, (F,).
        order: ids of furniture in the order of a search, drawn as a way with numbers.
        true_places: ids of furniture where it truly is, marked with a star.

    Returns:
        The axes.
    """
    plan = home if isinstance(home, FloorPlan) else FloorPlan.of_memory(home)
    if isinstance(belief, Ranking):
        found = {place.furniture: place.probability for place in belief}
        probability = np.array([found.get(number, 0.0) for number in plan.furniture_ids])
    else:
        probability = belief
    draw_plan(axes, plan, colours=mix("#ffffff", BELIEF, compute_shade(probability)))
    box = plan.furniture_box
    at = {number: node for node, number in enumerate(plan.furniture_ids)}
    for node in np.flatnonzero(probability >= SMALLEST_SHOWN):
        x, y, width, height = box[node]
        axes.text(
            x + 0.5 * width, y + 0.5 * height, f"{probability[node]:.0%}", ha="center",
            va="center", fontsize=8, zorder=5,
        )  # fmt: skip
    way = np.array([plan.centre[at[number]] for number in order]).reshape(-1, 2)
    way[:, 1] += 0.4 * plan.size  # above the boxes, whose numbers can be read
    axes.plot(way[:, 0], way[:, 1], color=ROUTE, linewidth=1, alpha=0.6, zorder=5)
    for number, (x, y) in enumerate(way, start=1):
        axes.text(
            x, y, str(number), color="white", fontsize=7, ha="center", va="center", zorder=6,
            bbox={"boxstyle": "circle,pad=0.2", "facecolor": ROUTE, "edgecolor": "none"},
        )  # fmt: skip
    stars = np.array([box[at[number]] for number in true_places]).reshape(-1, 4)
    axes.scatter(
        stars[:, 0] + 0.88 * stars[:, 2], stars[:, 1] + 0.5 * stars[:, 3], marker="*", s=90,
        color=TRUE_PLACE, zorder=6,
    )  # fmt: skip
    if isinstance(belief, Ranking):
        axes.text(
            0.99, 0.0, f"elsewhere {belief.elsewhere:.0%}", transform=axes.transAxes, ha="right",
            va="top",
        )  # fmt: skip
    return axes
