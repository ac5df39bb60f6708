"""What is said of all furniture of a home, in the order of its rows."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from sgm.layout.layout import Layout


@dataclass(frozen=True, slots=True)
class FurnitureNames:
    """Furniture of a layout as it is, F nodes.

    Attributes:
        ids: F.
        names: for people, "white fridge in kitchen", F.
        open_costs: of opening each to look into it, None where there is nothing to open, F.
        position: index of each in these, by id.
    """

    ids: tuple[int, ...]
    names: tuple[str, ...]
    open_costs: tuple[float | None, ...]
    position: Mapping[int, int]

    @classmethod
    def of(cls, layout: Layout) -> FurnitureNames:
        """List the furniture of a layout."""
        return cls(
            ids=tuple(layout.furniture),
            names=tuple(map(layout.describe, layout.furniture)),
            open_costs=tuple(
                (row.open_cost or 0.0) if row.must_open else None
                for row in layout.furniture.values()
            ),
            position={number: index for index, number in enumerate(layout.furniture)},
        )
