"""Pictures of a prior graph: three layers of nodes, and heat maps of the rooms."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from sgm.messages import needed_to
from sgm.prior.prior_graph import Placement, PriorGraph
from simulator.caches import keep_home_clean

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

ROOM_COLOURS = {
    "kitchen": "#d98c3f",
    "living room": "#4f8f5b",
    "bedroom": "#5b78b8",
    "bathroom": "#a0568f",
}
OBJECT_WIDTH = 0.2  # inches per object node
NODE_SIZE = 40.0


def draw_graph(
    prior: PriorGraph, placements: Sequence[Placement], path: Path, *, room: str | None = None
) -> None:
    """Draw rooms, furniture and objects as three layers, one band per room.

    Edge darkness is the weight, relative to the darkest edge of the layer and room. A node with the
    same label is drawn once per room; a coarse prior is drawn in one band.

    Args:
        prior: the graph.
        placements: its rows to draw.
        path: picture to write; the ending chooses the format.
        room: only this room.

    Raises:
        ModuleNotFoundError: if `matplotlib` is not installed.

    Source: paper figures 7 and 8.
    """
    bands = _split_bands(prior, placements, room)
    widest = max(len({placement.object for placement in rows}) for rows in bands.values())
    figure = _make_figure(
        max(10.0, OBJECT_WIDTH * widest + 1),
        sum(4.2 if name in prior.rooms else 8.0 for name in bands) + 0.4,
    )
    axes = figure.subplots(len(bands), 1, squeeze=False)[:, 0]
    for axis, (name, rows) in zip(axes, bands.items(), strict=True):
        _draw_band(axis, prior, name, rows, widest)
    figure.suptitle("darker edge = more probable", fontsize=9, x=0.01, ha="left")
    figure.savefig(path, dpi=120)


def draw_heat_map(
    prior: PriorGraph, placements: Sequence[Placement], path: Path, *, room: str | None = None
) -> None:
    """Draw P(furniture | object, room), one panel per room: furniture down, objects across.

    Args and errors as `draw_graph`.
    """
    bands = _split_bands(prior, placements, room)
    widest = max(len({placement.object for placement in rows}) for rows in bands.values())
    heights = [
        len({placement.furniture for placement in rows}) * 0.2 + 1.6 for rows in bands.values()
    ]
    figure = _make_figure(max(10.0, OBJECT_WIDTH * widest + 2.2), sum(heights))
    axes = figure.subplots(len(bands), 1, squeeze=False, height_ratios=heights)[:, 0]
    image: Any = None
    for axis, (name, rows) in zip(axes, bands.items(), strict=True):
        furniture, objects = _order_nodes(prior, name, rows)
        values = np.zeros((len(furniture), len(objects)))
        for placement in rows:
            values[furniture.index(placement.furniture), objects.index(placement.object)] += (
                placement.prob
            )
        totals = values.sum(axis=0, keepdims=True)
        shares = np.divide(values, totals, out=np.zeros_like(values), where=totals > 0)
        image = axis.pcolormesh(
            shares, cmap="Greys", vmin=0, vmax=1, edgecolors="#dddddd", linewidth=0.4
        )
        axis.set_yticks(np.arange(len(furniture)) + 0.5, furniture, fontsize=8)
        axis.set_xticks(np.arange(len(objects)) + 0.5, objects, rotation=90, fontsize=7)
        axis.set_xlim(0, widest)
        axis.invert_yaxis()
        axis.tick_params(length=0, which="both")
        axis.set_frame_on(False)
        axis.set_title(name, loc="left", fontsize=11, color=ROOM_COLOURS.get(name, "black"))
    given = "object, room" if name in prior.rooms else "object"
    figure.colorbar(image, ax=list(axes), shrink=0.3, aspect=30, label=f"P(furniture | {given})")
    figure.savefig(path, dpi=120)


def _make_figure(width: float, height: float) -> Figure:
    """A figure that needs no display and leaves no global state behind."""
    keep_home_clean()
    with needed_to("draw a prior (--no_picture leaves it out)", install="matplotlib"):
        from matplotlib.figure import Figure
    return Figure(figsize=(width, height), layout="constrained")


def _split_bands(
    prior: PriorGraph, placements: Sequence[Placement], room: str | None
) -> dict[str, list[Placement]]:
    """Placements by room; coarse ones go to one band of all rooms."""
    bands: dict[str, list[Placement]] = defaultdict(list)
    for placement in placements:
        bands[placement.room or room or "all rooms"].append(placement)
    order = [*prior.rooms, "all rooms"]
    return dict(sorted(bands.items(), key=lambda band: order.index(band[0])))


def _order_nodes(
    prior: PriorGraph, name: str, rows: Sequence[Placement]
) -> tuple[list[str], list[str]]:
    """Furniture by room and probability; objects by the mean position of their furniture.

    Nodes stand near those they belong to, so that few edges cross.
    """
    rooms = [name] if name in prior.rooms else list(prior.rooms)
    used = {placement.furniture for placement in rows}
    probs: dict[str, list[float]] = defaultdict(lambda: [0.0] * len(rooms))
    for node in prior.furniture:
        if node.room in rooms and node.label in used:
            probs[node.label][rooms.index(node.room)] += node.prob
    centres = {
        label: float(np.dot(values, range(len(rooms)))) / (sum(values) or 1.0)
        for label, values in probs.items()
    }
    furniture = sorted(probs, key=lambda label: (centres[label], -sum(probs[label])))
    sums: dict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
    for placement in rows:
        sums[placement.object][0] += placement.prob * furniture.index(placement.furniture)
        sums[placement.object][1] += placement.prob
    objects = sorted(sums, key=lambda label: sums[label][0] / (sums[label][1] or 1.0))
    return furniture, objects


def _draw_band(
    axis: Axes, prior: PriorGraph, name: str, rows: Sequence[Placement], widest: int
) -> None:
    """Draw one room: itself on top, its furniture below, their objects at the bottom."""
    from matplotlib import colormaps

    rooms = [name] if name in prior.rooms else list(prior.rooms)
    furniture, objects = _order_nodes(prior, name, rows)
    width = max(float(len(objects)), len(furniture) * 5.0)
    x_room, x_furniture, x_object = (
        _spread(labels, width) for labels in (rooms, furniture, objects)
    )
    upper = {
        (x_room[node.room], 2.0, x_furniture[node.label], 1.0): node.prob
        for node in prior.furniture
        if node.room in x_room and node.label in x_furniture
    }
    _draw_edges(axis, upper)
    lower: dict[tuple[float, float, float, float], float] = defaultdict(float)
    for placement in rows:
        lower[x_furniture[placement.furniture], 1.0, x_object[placement.object], 0.0] += (
            placement.prob
        )
    _draw_edges(axis, lower)
    palette = colormaps["tab20"](np.arange(len(objects)) % 20)  # so that an eye can follow each
    axis.scatter(
        list(x_object.values()),
        np.zeros(len(objects)),
        s=NODE_SIZE,
        c=palette,
        edgecolors="#444444",
        linewidths=0.4,
        zorder=3,
    )
    for label in objects:
        axis.text(x_object[label], -0.09, label, rotation=90, ha="center", va="top", fontsize=7.5)
    middle: dict[str, Any] = {"ha": "center", "va": "center", "zorder": 4}
    box = {"boxstyle": "round,pad=0.25", "fc": "#f2ede0", "ec": "#777777", "lw": 0.6}
    for label in furniture:
        axis.text(x_furniture[label], 1.0, label, fontsize=8, bbox=box, **middle)
    for place in rooms:
        box = {"boxstyle": "round,pad=0.35", "fc": ROOM_COLOURS.get(place, "#555555"), "ec": "none"}
        axis.text(x_room[place], 2.0, place, fontsize=11, color="white", bbox=box, **middle)
    axis.set_xlim(-1.5, max(widest, len(furniture) * 5, 20) + 0.5)
    axis.set_ylim(-1.15, 2.2)
    axis.axis("off")


def _spread(labels: Sequence[str], width: float) -> dict[str, float]:
    """Spread labels evenly over the width of a band."""
    step = width / len(labels)
    return {label: step * (index + 0.5) for index, label in enumerate(labels)}


def _draw_edges(axis: Axes, edges: Mapping[tuple[float, float, float, float], float]) -> None:
    """Draw edges (x0, y0, x1, y1) -> weight, the light ones first; darkness is the weight."""
    from matplotlib.collections import LineCollection

    darkest = max(edges.values(), default=1.0) or 1.0
    ordered = sorted(edges.items(), key=lambda edge: edge[1])
    strength = np.array([(weight / darkest) ** 0.7 for _, weight in ordered])
    colours = [(0.92 * (1 - value),) * 3 for value in strength]
    lines = [((x0, y0), (x1, y1)) for (x0, y0, x1, y1), _ in ordered]
    axis.add_collection(LineCollection(lines, colors=colours, linewidths=0.5 + 1.0 * strength))
