"""What ways cost: by a function of one's own, or the straight line between positions."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from sgm.checks import MOST_COST, is_number
from sgm.layout.furniture import read_position
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.messages import shorten

# (from, to) -> cost of the way; `from` is the start or a furniture id, `to` a furniture id.
Distance = Callable[[Any, int], float]

_MOST_KEPT = 100_000  # costs of ways, 10 MB


class StraightLines:
    """Straight lines in metres between (x, y) or furniture ids; infinite to what has no position.

    Furniture that is added later is looked up when it is asked for.
    """

    def __init__(self, memory: SceneGraphMemory) -> None:
        """Take the positions of the furniture of a memory."""
        self._memory = memory
        self.positions = memory.layout.compute_positions()

    def __call__(self, origin: Any, furniture: int) -> float:
        """Return the length of a way."""
        if furniture not in self.positions:  # added since
            self.positions.update(self._memory.layout.compute_positions())
        is_id = isinstance(origin, (int, np.integer))
        start: Any = self.positions.get(origin) if is_id else read_position(origin)
        end = self.positions.get(furniture)
        return math.inf if start is None or end is None else math.dist(start, end)


class TravelCosts:
    """Costs of ways, each asked for when it is needed, and kept.

    Attributes:
        distance: the function that is asked; None where only looks cost.
    """

    def __init__(self, distance: Distance | None) -> None:
        """Ask a function."""
        self.distance = distance
        self._kept: dict[tuple[Any, int], float] = {}

    def compute(self, start: Any, to: int) -> float:
        """Return the cost of a way; 0 without distances, and for none.

        Raises:
            ValueError: if the distance is no number, 0 or more.
        """
        if self.distance is None or is_at(start, to):
            return 0.0
        if isinstance(self.distance, StraightLines):  # as fast as to look it up
            return self.distance(start, to)
        key = (start, to)
        try:
            cost = self._kept.get(key)
        except TypeError:  # a start may be a list
            return compute_way(self.distance, start, to)
        if cost is None:
            if len(self._kept) >= _MOST_KEPT:
                self._kept.clear()
            cost = self._kept[key] = compute_way(self.distance, start, to)
        return cost

    def compute_row(self, start: Any, to: Sequence[int]) -> np.ndarray:
        """Return the costs of the ways from one place to n places, (n,); errors as of `compute`."""
        if self.distance is None:
            return np.zeros(len(to))
        return np.array([self.compute(start, target) for target in to], dtype=float)


def compute_way(distance: Distance, start: Any, to: int) -> float:
    """Ask for the cost of a way.

    Raises:
        ValueError: if it is no number, 0 to 1e100, or infinite.
    """
    cost = distance(start, to)
    if not is_number(cost) or not (0 <= cost <= MOST_COST or cost == math.inf):
        raise ValueError(
            f"distance from {shorten(start)} to {to} must be a number, 0 to {MOST_COST:g}, got "
            f"{shorten(cost)}. Where there is no way, give math.inf."
        )
    return float(cost)


def is_at(start: Any, furniture: int) -> bool:
    """Tell whether a start, as `Distance` understands it, is that furniture node."""
    return isinstance(start, (int, np.integer)) and int(start) == furniture


def check_start(start: Any, distance: object) -> None:
    """Raise ValueError for a start without distances."""
    if distance is None and start is not None:
        raise ValueError(
            f"start must come with distances, got start={shorten(start)} alone. Give distance=, a "
            "function of (start or furniture id, furniture id)."
        )


def find_distance(
    memory: SceneGraphMemory, start: Any, distance: Distance | None = None
) -> Distance | None:
    """Return a given function of distances, else the straight line in metres.

    The latter is for a start and furniture that all have positions; None for others. The start is
    (x, y) in metres, or a furniture id; None for no start. There is no way to what has no position:
    furniture that was added later without one.

    Raises:
        TypeError: if the distance is no function.
        ValueError: if the start is neither, beside positions of all furniture.
    """
    if callable(distance):
        return distance
    if distance is not None:
        raise TypeError(
            f"distance must be a function of (start or furniture id, furniture id), got "
            f"{shorten(distance)}. Leave it out where all furniture has a position."
        )
    if start is None:
        return None
    lines = StraightLines(memory)
    if None in lines.positions.values():
        return None
    try:
        if not (isinstance(start, (int, np.integer)) and start in lines.positions):
            read_position(start)
    except ValueError:
        raise ValueError(
            f"start must be (x, y) in metres or a furniture id where all furniture has a position, "
            f"got {shorten(start)}. Give distance= to start from a place with a name."
        ) from None
    return lines
