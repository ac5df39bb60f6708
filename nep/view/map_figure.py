"""The floor plan as a figure of plotly: shades, dots, the way of a search, what can be clicked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from matplotlib.colors import to_rgb

from nep.view.texts import escape_label as escape
from sgm.arrays.grouped import mark_rows
from sgm.arrays.relations import NUM_RELATIONS
from sgm.finder.ranking import Ranking
from sgm.finder.search_plan import SearchPlan
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.columns import NEVER
from sgm.memory.scene_graph_memory import SceneGraphMemory
from simulator.drawing.belief import SMALLEST_SHOWN, list_probabilities
from simulator.drawing.colours import BELIEF, MISSING, ROUTE, TRUE_PLACE, compute_shade
from simulator.drawing.floor_plan import FloorPlan
from simulator.drawing.home import get_room_colour, mix

MOST_DOTS = 1500  # more objects in view are drawn as one dot per place, with their number
MOST_NAMES = 120  # more furniture in view goes without names
_NUM_SHADES = 16
_MARGIN = 0.6  # around the home, in squares

View = Sequence[float]  # left, right, bottom, top


@dataclass(frozen=True)
class MapContent:
    """What a map shows.

    Attributes:
        plan: where everything stands.
        memory: what is remembered.
        ranking: the answer to a question; None before there is one.
        search: the plan of a search, drawn as a way; None for none.
        true_places: ids of furniture where the thing asked for truly is.
        looked: furniture that was looked at in this step, by id, and from where the last look at it
            was, None where it is unknown.
        selected: id of furniture that was clicked; None for none.
        view: what is on the screen; None for all.
    """

    plan: FloorPlan
    memory: SceneGraphMemory
    ranking: Ranking | None = None
    search: SearchPlan | None = None
    true_places: Sequence[int] = ()
    looked: Mapping[int, Viewpoint | None] = field(default_factory=dict)
    selected: int | None = None
    view: View | None = None


def make_map(content: MapContent) -> dict[str, Any]:
    """Return a figure with what is in view, as plain data."""
    plan = content.plan
    view = content.view or get_extent(plan)
    shown = _find_visible(plan, view)
    probability = np.zeros(len(plan.furniture))
    if content.ranking is not None:
        probability = list_probabilities(plan, content.ranking)
    index = {number: node for node, number in enumerate(plan.furniture_ids)}
    traces = [
        *_draw_rooms(plan, view),
        *_draw_boxes(plan, shown, probability, content),
        *_draw_objects(content, shown),
        *_draw_marks(plan, shown, probability, content, index),
    ]
    left, right, bottom, top = view
    axis = {"visible": False, "showgrid": False, "zeroline": False}
    return {
        "data": traces,
        "layout": {
            "xaxis": {**axis, "range": [left, right]},
            "yaxis": {**axis, "range": [bottom, top], "scaleanchor": "x"},
            "margin": {"l": 0, "r": 0, "t": 0, "b": 0},
            "showlegend": False,
            "hovermode": "closest",
            "dragmode": "pan",
            "uirevision": "as it was zoomed",
            "plot_bgcolor": "white",
            "paper_bgcolor": "white",
        },
    }


def get_extent(plan: FloorPlan) -> View:
    """Return left, right, bottom and top of a home with a margin."""
    box = plan.room_box
    if not len(box):
        return (0.0, 1.0, 0.0, 1.0)
    margin = _MARGIN * plan.size
    return (
        float(box[:, 0].min() - margin),
        float((box[:, 0] + box[:, 2]).max() + margin),
        float(box[:, 1].min() - margin),
        float((box[:, 1] + box[:, 3]).max() + margin),
    )


def _find_visible(plan: FloorPlan, view: View) -> np.ndarray:
    """Return the furniture whose square is on the screen, in order, (n,)."""
    left, right, bottom, top = view
    low, high = plan.corner, plan.corner + plan.size
    is_in = (high[:, 0] >= left) & (low[:, 0] <= right)
    return np.flatnonzero(is_in & (high[:, 1] >= bottom) & (low[:, 1] <= top))


def _draw_rooms(plan: FloorPlan, view: View) -> list[dict[str, Any]]:
    left, right, bottom, top = view
    traces = []
    names: dict[str, list[Any]] = {"x": [], "y": [], "text": [], "color": []}
    for name, (x, y, width, height) in zip(plan.rooms, plan.room_box.tolist(), strict=True):
        if x > right or x + width < left or y > top or y + height < bottom:
            continue
        pad = 0.1 * plan.size
        colour = get_room_colour(name)
        outline = _outline(np.array([[x - pad, y - pad, width + 2 * pad, height + 2 * pad]]))
        traces.append(
            {
                **outline, "mode": "lines", "fill": "toself", "fillcolor": _fade(colour, 0.13),
                "line": {"width": 0}, "hoverinfo": "skip",
            }
        )  # fmt: skip
        names["x"].append(x)
        names["y"].append(y + height + 0.28 * plan.size)
        names["text"].append(f"<b>{escape(name)}</b>")
        names["color"].append(colour)
    traces.append(
        {
            "x": names["x"], "y": names["y"], "text": names["text"], "mode": "text",
            "textposition": "middle right", "hoverinfo": "skip",
            "textfont": {"color": names["color"], "size": 13 if len(traces) <= 12 else 9},
        }
    )  # fmt: skip
    return traces


def _draw_boxes(
    plan: FloorPlan, shown: np.ndarray, probability: np.ndarray, content: MapContent
) -> list[dict[str, Any]]:
    """Draw furniture, one trace per shade, and its names."""
    shade = np.round(compute_shade(probability) * (_NUM_SHADES - 1)).astype(int)
    fills = (mix("#ffffff", BELIEF, np.linspace(0, 1, _NUM_SHADES)) * 255).round().astype(int)
    was_seen = content.memory.batch.furniture_last_observed[0] != NEVER
    traces = []
    for level, known in sorted({(int(shade[n]), bool(was_seen[n])) for n in shown}):
        own = shown[(shade[shown] == level) & (was_seen[shown] == known)]
        red, green, blue = fills[level]
        line = {"width": 1, "color": "#555555" if known else "#c4c4c4"}
        traces.append(
            {
                **_outline_furniture(plan, own), "mode": "lines", "fill": "toself", "line": line,
                "fillcolor": f"rgb({red},{green},{blue})", "hoverinfo": "skip",
            }
        )  # fmt: skip
    if 0 < len(shown) <= MOST_NAMES:
        traces.append(
            {
                "x": (plan.corner[shown, 0] + 0.5 * plan.size).tolist(),
                "y": (plan.corner[shown, 1] + 0.1 * plan.size).tolist(),
                "text": [escape(plan.furniture[node]) for node in shown],
                "mode": "text", "hoverinfo": "skip",
                "textfont": {"size": 10 if len(shown) <= 40 else 8, "color": "#333333"},
            }
        )  # fmt: skip
    return traces


def _draw_objects(content: MapContent, shown: np.ndarray) -> list[dict[str, Any]]:
    """Draw what is remembered in view: dots by age, or one per place if there are too many."""
    plan, memory = content.plan, content.memory
    edges, time = memory.batch.edges, memory.time
    is_visible = mark_rows(shown, len(plan.furniture))
    rows = np.flatnonzero(is_visible[edges["furniture"]] & (edges["num_true"] > 0))
    is_there = edges["is_true"][rows]
    if len(rows) > MOST_DOTS:
        there = np.bincount(edges["furniture"][rows[is_there]], minlength=len(plan.furniture))
        own = shown[there[shown] > 0]
        spots = plan.corner[own] + np.array([0.5, 0.78]) * plan.size
        return [
            {
                "x": spots[:, 0].tolist(), "y": spots[:, 1].tolist(), "mode": "markers+text",
                "text": [str(count) for count in there[own]], "textfont": {"size": 8},
                "textposition": "middle center", "hoverinfo": "skip",
                "marker": {"size": 13, "color": "#d7e3ef"},
            }
        ]  # fmt: skip
    places = edges["furniture"][rows] * NUM_RELATIONS + edges["relation"][rows]
    spots = plan.list_spots(places)
    names = memory.descriptions
    text, owner = [], []
    for row, there in zip(rows.tolist(), is_there.tolist(), strict=True):
        name = names[edges["object"][row]]
        ago = time - int(edges["last_true"][row])
        when = f"seen {ago} steps ago" if ago else "seen in this step"
        text.append(f"{escape(name)}<br>{when}{'' if there else ', missing at the last look'}")
        owner.append(["object", name])
    age = np.log1p(time - edges["last_true"][rows])
    traces = []
    missing = {"symbol": "circle-open", "color": MISSING, "size": 6, "line": {"width": 1}}
    present = {
        "symbol": "circle", "size": 8, "color": age[is_there].tolist(),
        "colorscale": [[0, "#0b4f9c"], [1, "#b9d3ea"]],  # fresh ones are dark
        "cmin": 0, "cmax": max(float(np.log1p(time)), 1.0),
    }  # fmt: skip
    for own, marker in (
        (np.flatnonzero(~is_there), missing),
        (np.flatnonzero(is_there), present),
    ):
        traces.append(
            {
                "x": spots[own, 0].tolist(), "y": spots[own, 1].tolist(), "mode": "markers",
                "marker": marker, "customdata": [owner[row] for row in own],
                "hovertext": [text[row] for row in own], "hoverinfo": "text",
            }
        )  # fmt: skip
    return traces


def _draw_marks(
    plan: FloorPlan,
    shown: np.ndarray,
    probability: np.ndarray,
    content: MapContent,
    index: dict[int, int],
) -> list[dict[str, Any]]:
    """Draw outlines of looks and the selection, the way, numbers, stars, and what is clicked."""
    box, centre = plan.furniture_box, plan.centre
    traces: list[dict[str, Any]] = []
    for ids, colour, width in (
        (content.looked, "#169654", 3),
        ([] if content.selected is None else [content.selected], "#111111", 2),
    ):
        own = np.array([index[number] for number in ids if number in index], dtype=int)
        traces.append(
            {
                **_outline_furniture(plan, own), "mode": "lines", "hoverinfo": "skip",
                "line": {"color": colour, "width": width},
            }
        )  # fmt: skip
    looked = {index[n]: view for n, view in content.looked.items() if n in index}
    traces += _draw_views(plan, looked)
    if content.ranking is not None:
        own = shown[probability[shown] >= SMALLEST_SHOWN]
        if len(own) <= MOST_NAMES:
            traces.append(
                {
                    "x": centre[own, 0].tolist(), "y": centre[own, 1].tolist(), "mode": "text",
                    "text": [f"<b>{probability[node]:.0%}</b>" for node in own],
                    "textfont": {"size": 11}, "hoverinfo": "skip",
                }
            )  # fmt: skip
    if content.search is not None:
        ids = [look.place.furniture for look in content.search]
        way = np.array([centre[index[number]] for number in ids]).reshape(-1, 2)
        way[:, 1] += 0.42 * plan.size
        traces.append(
            {
                "x": way[:, 0].tolist(), "y": way[:, 1].tolist(), "mode": "lines+markers+text",
                "line": {"color": ROUTE, "width": 1.5, "dash": "dot"},
                "marker": {"color": ROUTE, "size": 15}, "hoverinfo": "skip",
                "text": [str(number) for number in range(1, len(ids) + 1)],
                "textfont": {"color": "white", "size": 9},
            }
        )  # fmt: skip
    traces.append(
        {
            "x": centre[shown, 0].tolist(), "y": centre[shown, 1].tolist(), "mode": "markers",
            "marker": {"size": 22, "opacity": 0, "symbol": "square"}, "hoverinfo": "text",
            "hovertext": [
                f"{escape(plan.furniture[node])}"
                + ("" if content.ranking is None else f"<br>{probability[node]:.1%}")
                for node in shown
            ],
            "customdata": [["furniture", int(plan.furniture_ids[node])] for node in shown],
        }
    )  # fmt: skip
    stars = np.array([box[index[i]] for i in content.true_places if i in index]).reshape(-1, 4)
    traces.append(
        {
            "x": (stars[:, 0] + 0.9 * stars[:, 2]).tolist(),
            "y": (stars[:, 1] + 0.5 * stars[:, 3]).tolist(), "mode": "markers",
            "marker": {"symbol": "star", "size": 14, "color": TRUE_PLACE}, "hoverinfo": "text",
            "hovertext": "it is truly here",
        }
    )  # fmt: skip
    return traces


def _draw_views(plan: FloorPlan, looked: Mapping[int, Viewpoint | None]) -> list[dict[str, Any]]:
    """Draw from where furniture was looked at, and the cone of what the camera saw.

    Where a look does not say it, that is where one stands to look at furniture with a box, and the
    angle that it fills.

    Args:
        plan: where everything stands.
        looked: from where each was looked at, by number in the plan.
    """
    wedges = []
    for node, viewpoint in looked.items():
        corners = None if plan.footprints is None else plan.footprints[node]
        if corners is not None and not np.isfinite(corners).all():
            corners = None
        if viewpoint is not None:
            at = np.array([viewpoint.x, viewpoint.y])
            away = np.inf if corners is None else np.linalg.norm(corners - at, axis=1).max()
            wedges.append(viewpoint.compute_corners(float(away)))
        elif corners is not None and plan.stands is not None:
            stand = plan.stands[node]
            if np.isfinite(stand).all():
                wedges.append(np.array([stand, *find_outer_corners(stand, corners)]))
    if not wedges:
        return []
    apexes = np.array(wedges)[:, 0]
    return [
        {
            **_outline_polygons(np.array(wedges)), "mode": "lines", "fill": "toself",
            "fillcolor": "rgba(22,150,84,0.12)", "line": {"width": 0}, "hoverinfo": "skip",
        },
        {
            "x": apexes[:, 0].tolist(), "y": apexes[:, 1].tolist(),
            "mode": "markers", "marker": {"symbol": "circle", "size": 9, "color": "#169654"},
            "hoverinfo": "text", "hovertext": "the robot stood here",
        },
    ]  # fmt: skip


def find_outer_corners(stand: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return the two corners (2, 2) between which furniture (4, 2) is seen from a position (2,)."""
    ahead = corners.mean(axis=0) - stand
    offset = corners - stand
    side = ahead[0] * offset[:, 1] - ahead[1] * offset[:, 0]
    angle = np.arctan2(side, offset @ ahead)
    return corners[[angle.argmin(), angle.argmax()]]


def _outline_furniture(plan: FloorPlan, nodes: np.ndarray) -> dict[str, Any]:
    """Return furniture (n,) as one line with gaps: its footprint to scale, else its square."""
    x, y, width, height = plan.furniture_box[nodes].T
    corners = [x, y, x + width, y, x + width, y + height, x, y + height]
    polygons = np.stack(corners, axis=1).reshape(-1, 4, 2)
    if plan.footprints is not None:
        own = plan.footprints[nodes]
        polygons = polygons[:, np.minimum(np.arange(own.shape[1]), 3)]
        polygons = np.where(np.isnan(own), polygons, own)
    return _outline_polygons(polygons)


def _outline_polygons(corners: np.ndarray) -> dict[str, Any]:
    """Return polygons (n, k, 2) as one line with gaps."""
    gap = np.full((len(corners), 1, 2), np.nan)
    points = np.concatenate([corners, corners[:, :1], gap], axis=1).reshape(-1, 2)
    across, up = (
        [None if np.isnan(value) else round(value, 3) for value in column]
        for column in points.T.tolist()
    )
    return {"type": "scatter", "x": across, "y": up}


def _outline(box: np.ndarray) -> dict[str, Any]:
    """Return boxes (n, 4) as one line with gaps."""
    x, y, width, height = box.T
    gap = np.full(len(box), np.nan)
    across = np.stack([x, x + width, x + width, x, x, gap], axis=1).ravel()
    up = np.stack([y, y, y + height, y + height, y, gap], axis=1).ravel()
    return {
        "type": "scatter",
        "x": [None if np.isnan(value) else round(value, 3) for value in across.tolist()],
        "y": [None if np.isnan(value) else round(value, 3) for value in up.tolist()],
    }


def _fade(colour: str, share: float) -> str:
    red, green, blue = (round(part * 255) for part in to_rgb(colour))
    return f"rgba({red},{green},{blue},{share})"
