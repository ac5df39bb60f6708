"""The history of one thing as a figure of plotly: a strip of places over hours."""

from __future__ import annotations

from typing import Any

import numpy as np

from nep.view.texts import escape_label as escape
from simulator.drawing.colours import BELIEF, MISSING, SAID, SEEN, TRUE_PLACE
from simulator.drawing.history import History
from simulator.drawing.home import mix


def make_history(history: History, now: float) -> dict[str, Any]:
    """Return a figure, as plain data.

    Args:
        history: what to draw.
        now: hour at which the page stands, marked by a line.
    """
    places = [escape(place) for place in history.places]
    rows = np.arange(len(places))
    traces: list[dict[str, Any]] = []
    if history.belief is not None and len(places):
        belief = history.belief.T
        traces.append(
            {
                "type": "heatmap", "x": history.edges.tolist(), "y": rows.tolist(),
                "z": [[None if np.isnan(p) else round(float(p), 4) for p in row] for row in belief],
                "colorscale": _make_scale(), "zmin": 0, "zmax": 1, "showscale": False,
                "hovertemplate": "%{z:.0%} believed<extra></extra>",
            }
        )  # fmt: skip
    x: list[float | None] = []
    y: list[int | None] = []
    for place, begin, end in history.list_stays():
        x += [begin, end, None]
        y += [place, place, None]
    traces.append(
        {
            "type": "scatter", "x": x, "y": y, "mode": "lines", "name": "truly there",
            "line": {"color": TRUE_PLACE, "width": 4}, "hoverinfo": "name",
        }
    )  # fmt: skip
    found = np.asarray(history.is_found, dtype=bool)
    for name, own, symbol, colour, opacity in (
        ("look that saw it", found, "circle", SEEN, 1.0),
        ("look that did not", ~found, "x-thin", MISSING, 0.45),
    ):
        traces.append(
            {
                "type": "scatter", "x": history.look_hour[own].tolist(),
                "y": (history.look_place[own] + 0.28).tolist(), "mode": "markers", "name": name,
                "marker": {
                    "symbol": symbol, "color": colour, "size": 6, "opacity": opacity,
                    "line": {"color": colour, "width": 1.2},
                },
                "hovertemplate": "%{x:.1f} " + history.unit + f", {name}<extra></extra>",
            }
        )  # fmt: skip
    if history.said_by:
        traces.append(
            {
                "type": "scatter", "x": history.said_hour.tolist(),
                "y": (history.said_place + 0.28).tolist(), "mode": "markers",
                "name": "said to be there", "text": [escape(by) for by in history.said_by],
                "marker": {"symbol": "diamond", "color": SAID, "size": 7},
                "hovertemplate": "%{x:.1f} " + history.unit + ", said by %{text}<extra></extra>",
            }
        )  # fmt: skip
    return {
        "data": traces,
        "layout": {
            "title": {"text": escape(history.description), "x": 0.01, "font": {"size": 14}},
            "xaxis": {"title": {"text": history.unit}, "zeroline": False, "showgrid": False},
            "yaxis": {
                "tickvals": rows.tolist(), "ticktext": places, "automargin": True,
                "range": [max(len(places), 1) - 0.5, -0.5], "showgrid": False, "zeroline": False,
            },
            "height": 130 + 26 * max(len(places), 1),
            "margin": {"l": 10, "r": 10, "t": 34, "b": 36},
            "legend": {
                "orientation": "h", "x": 1, "xanchor": "right", "y": 1.0, "yanchor": "bottom",
            },
            "plot_bgcolor": "white",
            "shapes": [
                {
                    "type": "line", "x0": now, "x1": now, "y0": 0, "y1": 1, "yref": "paper",
                    "line": {"color": "#333333", "width": 1, "dash": "dot"},
                }
            ],
        },
    }  # fmt: skip


def _make_scale() -> list[list[Any]]:
    """Return colours by the square root of the probability, as in the other drawings."""
    shares = np.linspace(0, 1, 9)
    colours = (mix("white", BELIEF, np.sqrt(shares)) * 255).round().astype(int).tolist()
    return [
        [share, f"rgb({red},{green},{blue})"]
        for share, (red, green, blue) in zip(shares.tolist(), colours, strict=True)
    ]
