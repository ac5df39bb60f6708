"""Measures of recorded and of simulated homes beside each other: a table and a figure."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from textwrap import fill
from typing import TYPE_CHECKING

import numpy as np

from nep.report.tables import join_table
from simulator.caches import keep_home_clean
from simulator.world.source import HomeSource
from simulator.world.streams import Streams
from tools.realism.measures import MEASURES, Behaviour, follow_homes, measure_behaviour
from tools.realism.moves import MOVE_MEASURES, Moves, measure_moves

if TYPE_CHECKING:  # loads matplotlib
    from matplotlib.figure import Figure

_HOUR = 3600.0
_HOMES_AT_ONCE = 10  # that are followed by the minute: their tables are large


@dataclass(frozen=True, slots=True)
class RealismColumn:
    """What was measured of some homes of one kind.

    Attributes:
        name: the heading.
        homes: one `Behaviour` each.
    """

    name: str
    homes: tuple[Behaviour, ...]

    def compute_means(self) -> dict[str, float]:
        """Return the mean of every measure over homes."""
        rows = [asdict(home) for home in self.homes]
        return {name: float(np.mean([values[name] for values in rows])) for name in MEASURES}


def measure_source(source: HomeSource, num_homes: int, days: int, seed: int) -> list[Behaviour]:
    """Follow homes for some days, by steps of an hour, and measure each.

    Raises:
        ValueError: if steps are not an hour long, or there are not so many homes or days.
    """
    source.check_homes(range(num_homes))
    found = []
    for group in source.list_groups(range(num_homes)):
        homes = source.make(Streams(seed, "test", group.homes))
        num_steps = 24 * days if group.num_steps is None else min(24 * days, group.num_steps)
        clock = np.full((homes.num_homes, 2), (0.0, _HOUR)) if homes.clock is None else homes.clock
        if (clock[:, 1] != _HOUR).any():
            raise ValueError(
                f"steps must be an hour, got {clock[:, 1].max():g} s. Set step_seconds to 3600."
            )
        for (whereabouts, _), (start, _) in zip(follow_homes(homes, num_steps), clock, strict=True):
            hour = (start / _HOUR + np.arange(num_steps + 1)) % 24 // 1
            found.append(measure_behaviour(whereabouts, hour))
    return found


def measure_minutes(source: HomeSource, num_homes: int, days: int, seed: int) -> list[Moves]:
    """Follow homes by steps of a minute for some days, or as long as they were recorded.

    Raises:
        ValueError: if there are not so many homes.
    """
    source.check_homes(range(num_homes))
    found = []
    for group in source.list_groups(range(num_homes)):
        for first in range(0, len(group.homes), _HOMES_AT_ONCE):
            homes = source.make(Streams(seed, "test", group.homes[first : first + _HOMES_AT_ONCE]))
            num_steps = min(24 * 60 * days, group.num_steps or 24 * 60 * days)
            found += [measure_moves(*home) for home in follow_homes(homes, num_steps)]
    return found


def make_move_table(recorded: Mapping[str, Moves], simulated: Mapping[str, Sequence[Moves]]) -> str:
    """Return a Markdown table: a row per measure of moves, recorded homes first.

    Simulated homes have their median with the quantiles of 5 and 95 %; a recorded one outside of
    these of the first kind is in italics.
    """
    rows = []
    for name, title in MOVE_MEASURES.items():
        ranges = {column: _compute_quantiles(homes, name) for column, homes in simulated.items()}
        low, _, high = next(iter(ranges.values()))
        cells = []
        for home in recorded.values():
            value = getattr(home, name)
            text = "n/a" if np.isnan(value) else f"{value:.3g}"
            cells.append(f"*{text}*" if value < low or value > high else text)
        cells += [f"{middle:.3g} [{low:.2g}, {high:.2g}]" for low, middle, high in ranges.values()]
        rows.append([title, *cells])
    return join_table(["measure", *recorded, *simulated], rows).rstrip()


def _compute_quantiles(
    homes: Sequence[Moves] | Sequence[Behaviour], name: str
) -> tuple[float, float, float]:
    values = np.array([getattr(home, name) for home in homes], dtype=float)
    values = values[~np.isnan(values)]
    if not len(values):
        return np.nan, np.nan, np.nan
    low, middle, high = np.quantile(values, [0.05, 0.5, 0.95]).tolist()
    return low, middle, high


def list_outside(recorded: Sequence[Behaviour], means: Mapping[str, float]) -> list[str]:
    """List the measures whose mean lies outside the spread of the recorded homes, if any."""
    rows = [asdict(home) for home in recorded]
    return [
        name
        for name in MEASURES
        if rows
        and not min(home_values[name] for home_values in rows)
        <= means[name]
        <= max(home_values[name] for home_values in rows)
    ]


def make_table(recorded: Mapping[str, Behaviour], simulated: Sequence[RealismColumn]) -> str:
    """Return a Markdown table: a row per measure, recorded homes first.

    Simulated homes have their mean with the standard deviation over homes; a mean outside the
    spread of the recorded homes is in italics.
    """
    rows = []
    outside = [list_outside(list(recorded.values()), c.compute_means()) for c in simulated]
    for name, title in MEASURES.items():
        cells = [f"{getattr(home, name):.3g}" for home in recorded.values()]
        for column, outliers in zip(simulated, outside, strict=True):
            values = [getattr(home, name) for home in column.homes]
            text = f"{np.mean(values):.3g} ± {np.std(values).round(12):.2g}"
            cells.append(f"*{text}*" if name in outliers else text)
        rows.append([title, *cells])
    names = [*recorded, *(column.name for column in simulated)]
    return join_table(["measure", *names], rows).rstrip()


def draw_behaviour(
    recorded: Mapping[str, Behaviour], simulated: Sequence[RealismColumn], called: str
) -> Figure:
    """Draw every measure: a dot per recorded home, and quantiles of the simulated ones.

    A square is the median over homes; nine homes of ten lie on its line.

    Args:
        recorded: by name.
        simulated: kinds of homes.
        called: what the recorded homes are.
    """
    keep_home_clean()
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11, 7), dpi=120, layout="constrained")
    axes = figure.subplots(3, 4).ravel()
    for axis, (name, title) in zip(axes, MEASURES.items(), strict=True):
        values = [getattr(home, name) for home in recorded.values()]
        if values:
            axis.axhspan(min(values), max(values), color="#dddddd")
        axis.plot([0] * len(values), values, "o", color="#404040", markersize=4)
        for place, column in enumerate(simulated, start=1):
            low, middle, high = _compute_quantiles(column.homes, name)
            axis.errorbar(place, middle, [[middle - low], [high - middle]], fmt="s", capsize=3)
        labels = [fill(called, 21), *(column.name for column in simulated)]
        axis.set_xticks(range(len(labels)), labels, rotation=35, ha="right", fontsize=6)
        axis.set_title(fill(title, 39), fontsize=7)
        axis.tick_params(axis="y", labelsize=6)
        axis.set_xlim(-0.5, len(simulated) + 0.5)
    return figure
