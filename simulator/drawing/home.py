"""A home from above: rooms, furniture, a dot per object, or where one of them may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Rectangle

from sgm.finder.ranking import Ranking
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.schema import NEVER, PlaceCode
from simulator.drawing.floor_plan import FloorPlan
from simulator.priors.draw import ROOM_COLOURS

BELIEF, TRUE_PLACE, ROUTE = "#f07820", "#d6166c", "#2060c8"
SAID = "#7a4fb5"
SEEN, MISSING = "#1f77b4", "#d62728"  # at the last look at its place
OTHER_ROOM = "#777777"
_LARGEST_TEXT, _SMALLEST_TEXT = 8.0, 3.5  # points

# By name in the legend: the place of each object, and how to draw the dots.
Dots = Mapping[str, tuple[np.ndarray, dict[str, Any]]]
SMALLEST_SHOWN = 0.005  # probability that is written down


def compute_shade(probability: np.ndarray | float) -> np.ndarray:
    """Return how strongly probabilities are coloured, (n,); small ones show, too."""
    shade: np.ndarray = np.sqrt(np.clip(probability, 0, 1))
    return shade


def draw_home(
    axes: Axes,
    home: FloorPlan | SceneGraphMemory,
    dots: Dots | None = None,
    *,
    is_known: np.ndarray | None = None,
) -> Axes:
    """Draw a home from above; what lies on furniture stands above its box.

    Example:
        >>> draw_home(plt.subplots()[1], memory)

    Args:
        axes: where to draw.
        home: a floor plan; or a memory, which is drawn with what it holds.
        dots: by name in the legend: the place of each object as in `simulator.Homes`
            (a code of `sgm.schema.PlaceCode`), and how to draw the dots; None
            for what the memory holds.
        is_known: furniture drawn with a full outline, bool (F,); None for all, of a memory for what
            was looked at.

    Returns:
        The axes.
    """
    plan = home if isinstance(home, FloorPlan) else FloorPlan.of_memory(home)
    if isinstance(home, SceneGraphMemory):
        batch = home.batch
        dots = list_dots(home) if dots is None else dots
        is_known = batch.furniture_last_observed[0] != NEVER if is_known is None else is_known
    draw_plan(axes, plan, is_known=is_known)
    if dots:
        places = np.concatenate([np.asarray(nodes, dtype=np.int64) for nodes, _ in dots.values()])
        ends = np.cumsum([len(nodes) for nodes, _ in dots.values()])
        spots = np.split(plan.list_spots(places), ends[:-1])
        for (name, (_, style)), points in zip(dots.items(), spots, strict=True):
            axes.scatter(points[:, 0], points[:, 1], label=name, zorder=3, **style)
    return axes


def draw_plan(
    axes: Axes,
    plan: FloorPlan,
    *,
    is_known: np.ndarray | None = None,
    colours: np.ndarray | None = None,
) -> None:
    """Draw rooms and furniture, of colours RGB (F, 3) or white; `is_known` as in `draw_home`."""
    for name, (x, y, width, height) in zip(plan.rooms, plan.room_box, strict=True):
        colour = get_room_colour(name)
        pad = 0.08 * plan.size
        axes.add_patch(
            FancyBboxPatch(
                (x, y),
                width,
                height,
                boxstyle=f"round,pad={pad}",
                facecolor=colour,
                alpha=0.14,
                edgecolor="none",
                zorder=0,
            )
        )
    for node, (x, y, width, height) in enumerate(plan.furniture_box):
        known = is_known is None or is_known[node]
        axes.add_patch(
            Rectangle(
                (x, y),
                width,
                height,
                linewidth=0.9,
                zorder=1,
                facecolor="white" if colours is None else colours[node],
                edgecolor="#555555" if known else "#bbbbbb",
                linestyle="-" if known else ":",
            )
        )
    axes.set_aspect("equal")
    axes.autoscale_view()
    axes.axis("off")
    _write_names(axes, plan)


def list_dots(memory: SceneGraphMemory) -> Dots:
    """Return what a memory holds: what the last look at its place showed, and what it missed."""
    edges = memory.batch.edges
    was_seen = edges["num_true"] > 0
    place = PlaceCode.of(edges["furniture"], edges["relation"])
    is_true = edges["is_true"]
    missing = {"s": 9, "facecolors": "none", "edgecolors": MISSING, "linewidths": 0.8}
    return {
        "seen at the last look": (place[is_true], {"s": 12, "color": SEEN}),
        "missing at the last look": (place[was_seen & ~is_true], missing),
    }


def get_room_colour(name: str) -> str:
    """Return the colour of a room by its name, "bedroom" or "bedroom 2"."""
    return ROOM_COLOURS.get(name.rstrip("0123456789 "), OTHER_ROOM)


def mix(colour: str, other: str, share: np.ndarray) -> np.ndarray:
    """Return colours on the way from one to another, (n,) -> RGB (n, 3)."""
    first, second = np.array(to_rgb(colour)), np.array(to_rgb(other))
    return first + (second - first) * np.asarray(share)[:, None]


def _write_names(axes: Axes, plan: FloorPlan) -> None:
    """Write names as large as boxes allow; where they could not be read, none of furniture."""
    figure = axes.get_figure(root=True)
    assert figure is not None
    width = abs(np.subtract(*axes.get_xlim())) or 1.0
    height = abs(np.subtract(*axes.get_ylim())) or 1.0
    inches = axes.get_position().size * figure.get_size_inches()
    scale = 72 * min(inches[0] / width, inches[1] / height)  # points per unit
    for name, (x, y, _, height) in zip(plan.rooms, plan.room_box, strict=True):
        size = min(10.0, 0.35 * scale * plan.size)
        if size >= _SMALLEST_TEXT:
            axes.text(
                x,
                y + height + 0.1 * plan.size,
                name,
                color=get_room_colour(name),
                weight="bold",
                va="bottom",
                fontsize=size,
            )
    for name, (x, y) in zip(plan.furniture, plan.corner, strict=True):
        # A letter is about 0.55 of its height wide.
        size = min(_LARGEST_TEXT, scale * plan.size / max(0.55 * len(name), 1.0))
        if size >= _SMALLEST_TEXT:
            axes.text(
                x + 0.5 * plan.size,
                y + 0.1 * plan.size,
                name,
                ha="center",
                va="center",
                fontsize=size,
                zorder=4,
            )


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
    node_of = {number: node for node, number in enumerate(plan.furniture_ids)}
    for node in np.flatnonzero(probability >= SMALLEST_SHOWN):
        x, y, width, height = box[node]
        axes.text(
            x + 0.5 * width,
            y + 0.5 * height,
            f"{probability[node]:.0%}",
            ha="center",
            va="center",
            fontsize=8,
            zorder=5,
        )
    way = np.array([plan.centre[node_of[number]] for number in order]).reshape(-1, 2)
    way[:, 1] += 0.4 * plan.size  # above the boxes, whose numbers can be read
    axes.plot(way[:, 0], way[:, 1], color=ROUTE, linewidth=1, alpha=0.6, zorder=5)
    for number, (x, y) in enumerate(way, start=1):
        axes.text(
            x,
            y,
            str(number),
            color="white",
            fontsize=7,
            ha="center",
            va="center",
            zorder=6,
            bbox={"boxstyle": "circle,pad=0.2", "facecolor": ROUTE, "edgecolor": "none"},
        )
    stars = np.array([box[node_of[number]] for number in true_places]).reshape(-1, 4)
    axes.scatter(
        stars[:, 0] + 0.88 * stars[:, 2], stars[:, 1] + 0.5 * stars[:, 3], marker="*", s=90,
        color=TRUE_PLACE, zorder=6,
    )  # fmt: skip
    if isinstance(belief, Ranking):
        axes.text(
            0.99,
            0.0,
            f"elsewhere {belief.elsewhere:.0%}",
            transform=axes.transAxes,
            ha="right",
            va="top",
        )
    return axes


def draw_pixels(figure: Figure) -> np.ndarray:
    """Return a figure as pixels, uint8 (height, width, 3)."""
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()
