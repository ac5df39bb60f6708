"""Draws the floor plan of a home for the notebooks: rooms, furniture, and a dot per object."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyBboxPatch, Rectangle

from simulator.priors.draw import ROOM_COLOURS

COLUMNS = 4  # furniture nodes side by side in a room
GAP = 0.35  # between rooms
# Of the unit square that a furniture node has: its box, and the rows of dots in it and on top.
BOX = (0.06, 0.2, 0.88, 0.38)
ROWS = {0: (0.51, 0.39, 0.27), 1: (0.64, 0.76, 0.88)}
DOTS_PER_ROW = 7

Dots = Mapping[str, tuple[np.ndarray, dict[str, Any]]]


def draw_home(
    axes: Axes,
    rooms: Sequence[str],
    furniture: Sequence[str],
    furniture_room: np.ndarray,
    dots: Dots,
    *,
    is_known: np.ndarray | None = None,
) -> None:
    """Draw a home from above, rooms two by two; what lies on furniture stands above its box.

    Args:
        axes: where to draw.
        rooms: names, (R,).
        furniture: names, (F,); empty texts for none.
        furniture_room: room index of each furniture node, (F,).
        dots: by name in the legend: the place of each object as in `simulator.Houses`
            (2 * furniture + relation, relation 0 "in", 1 "onTop"), and how to draw the dots.
        is_known: furniture drawn with a full outline, bool (F,); None for all.
    """
    corner = np.zeros((len(furniture), 2))
    depth = max(-(-np.bincount(furniture_room).max() // COLUMNS), 1)
    for room, name in enumerate(rooms):
        x = room % 2 * (COLUMNS + GAP)
        y = -(room // 2) * (depth + GAP + 0.2)
        colour = ROOM_COLOURS.get(name, "#777777")
        axes.add_patch(
            FancyBboxPatch(
                (x, y - depth), COLUMNS, depth, boxstyle="round,pad=0.08",
                facecolor=colour, alpha=0.14, edgecolor="none",
            )
        )  # fmt: skip
        axes.text(x, y + 0.1, name, color=colour, weight="bold", va="bottom")
        for turn, node in enumerate(np.flatnonzero(furniture_room == room)):
            corner[node] = x + turn % COLUMNS, y - 1 - turn // COLUMNS
    for node, (x, y) in enumerate(corner):
        known = is_known is None or is_known[node]
        axes.add_patch(
            Rectangle(
                (x + BOX[0], y + BOX[1]), BOX[2], BOX[3], facecolor="white", linewidth=0.9,
                edgecolor="#555555" if known else "#bbbbbb", linestyle="-" if known else ":",
            )
        )  # fmt: skip
        axes.text(x + 0.5, y + 0.1, furniture[node], ha="center", va="center", fontsize=8)
    _draw_dots(axes, corner, dots)
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")


def _draw_dots(axes: Axes, corner: np.ndarray, dots: Dots) -> None:
    """Give every dot a spot of its own at its place."""
    places = np.concatenate([np.asarray(at, dtype=int) for at, _ in dots.values()])
    spots = np.zeros((len(places), 2))
    for place in np.unique(places):
        here = np.flatnonzero(places == place)
        rows = ROWS[place % 2]
        per_row = max(DOTS_PER_ROW, -(-len(here) // len(rows)))  # crowded places squeeze
        row, column = np.divmod(np.arange(len(here)), per_row)
        x, y = corner[place // 2]
        spots[here, 0] = x + BOX[0] + BOX[2] * (column + 0.5) / per_row
        spots[here, 1] = y + np.array(rows)[row]
    start = 0
    for name, (at, style) in dots.items():
        part = spots[start : start + len(at)]
        axes.scatter(part[:, 0], part[:, 1], label=name, zorder=3, **style)
        start += len(at)
