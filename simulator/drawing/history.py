"""Where one thing was, and was believed to be, over time: a strip of places over hours."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes

from simulator.drawing.home import BELIEF, MISSING, SAID, SEEN, TRUE_PLACE, compute_shade, mix


@dataclass(frozen=True)
class History:
    """One thing over time steps, at the P places that it has to do with.

    Attributes:
        description: what it is called.
        places: names, (P,).
        hours: time of each step, (T,), ascending.
        belief: probability of each place at each step, (T, P), nan where none was asked; None if
            none was asked at all.
        truth: whether it was there, bool (T, P); None if it is unknown.
        look_hour, look_place, is_found: looks at these places, and whether they saw it, (n,) each.
        unit: of the hours, for the axis.
        said_hour, said_place, said_by: when it was said to be at these places, and by whom, "robot"
            of what it put there itself, (m,) each.
    """

    description: str
    places: tuple[str, ...]
    hours: np.ndarray
    belief: np.ndarray | None
    truth: np.ndarray | None
    look_hour: np.ndarray
    look_place: np.ndarray
    is_found: np.ndarray
    unit: str = "h"
    said_hour: np.ndarray = field(default_factory=lambda: np.zeros(0))
    said_place: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    said_by: tuple[str, ...] = ()

    @property
    def edges(self) -> np.ndarray:
        """Where the strip of each step begins, and the end of the last, (T + 1,)."""
        last = self.hours[-1:]
        width = np.diff(self.hours)[-1:] if len(self.hours) > 1 else np.ones(1)
        return np.concatenate([self.hours, last + width])

    def list_stays(self) -> list[tuple[int, float, float]]:
        """List where it truly was: place, from and until which hour."""
        if self.truth is None:
            return []
        change = np.diff(self.truth.T.astype(int), axis=1, prepend=0, append=0)  # (P, T + 1)
        (place, begin), (_, end) = np.nonzero(change > 0), np.nonzero(change < 0)
        hours = self.edges[begin].tolist(), self.edges[end].tolist()
        return list(zip(place.tolist(), *hours, strict=True))


def draw_history(axes: Axes, history: History) -> Axes:
    """Draw places over hours: belief as shades, the truth as bars, looks and statements as marks.

    Example:
        >>> draw_history(plt.subplots()[1], replay.trace_object("red mug", finder))

    Returns:
        The axes.
    """
    num_places = len(history.places)
    if history.belief is not None and num_places:
        shade = compute_shade(np.nan_to_num(history.belief.T))
        image = mix("#ffffff", BELIEF, shade.ravel()).reshape(*shade.shape, 3)
        image[np.isnan(history.belief.T)] = 0.95
        axes.pcolormesh(history.edges, np.arange(num_places + 1) - 0.5, image, zorder=0)
    for number, (place, begin, end) in enumerate(history.list_stays()):
        axes.plot(
            [begin, end],
            [place, place],
            color=TRUE_PLACE,
            linewidth=3,
            solid_capstyle="butt",
            label="truly there" if number == 0 else None,
            zorder=2,
        )
    found = np.asarray(history.is_found, dtype=bool)
    look_hours, where = history.look_hour, history.look_place
    for name, hours, places, marker, colour in (
        ("look that saw it", look_hours[found], where[found], "o", SEEN),
        ("look that did not", look_hours[~found], where[~found], "x", MISSING),
        ("said to be there", history.said_hour, history.said_place, "D", SAID),
    ):
        if len(hours):
            axes.scatter(
                hours,
                places + 0.25,
                label=name,
                s=22,
                marker=marker,
                color=colour,
                linewidths=1.2,
                zorder=3,
            )
    axes.set_yticks(np.arange(num_places), history.places)
    axes.set_ylim(max(num_places, 1) - 0.5, -0.5)
    axes.set_xlabel(history.unit)
    axes.set_title(history.description, loc="left")
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
    return axes
