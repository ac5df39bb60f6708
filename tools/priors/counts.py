"""What every importer returns: counts per room, furniture, object and relation."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field

_SHOWN = 8  # names in a summary
PlaceKey = tuple[str | None, str, str, str]  # room or None, furniture, object, relation


@dataclass(slots=True)
class PlacementCounts:
    """How often a source saw what where; filled by one importer, then only read.

    Attributes:
        source: name of the source, kept with every placement.
        is_counted: False if `placements` holds probabilities rather than counts.
        is_per_room: True if the placements were counted in the rooms of `num_rooms`, so that their
            ratio is a rate per room.
        num_rooms: rooms seen, by room type; empty if the source lists no rooms.
        furniture: rooms that hold at least one, by (room, furniture).
        placements: count or probability by (room or None, furniture, object, relation).
        num_units: homes, models, activities or rows read.
        outside: what fell outside the type tables: "rooms", "furniture" or "objects" -> names.
        problems: bad rows that were skipped, each with its file and row.
        skips_bad: whether they are.
    """

    source: str
    is_counted: bool = True
    is_per_room: bool = False
    num_rooms: Counter[str] = field(default_factory=Counter)
    furniture: Counter[tuple[str, str]] = field(default_factory=Counter)
    placements: dict[PlaceKey, float] = field(default_factory=lambda: defaultdict(float))
    num_units: int = 0
    outside: Mapping[str, Counter[str]] = field(
        default_factory=lambda: {part: Counter() for part in ("rooms", "furniture", "objects")}
    )
    problems: list[str] = field(default_factory=list)
    skips_bad: bool = False

    def report(self, problem: str, remedy: str) -> None:
        """Note a bad row if those are skipped.

        Raises:
            ValueError: if they are not: with the problem, and what to do.
        """
        if not self.skips_bad:
            raise ValueError(f"{problem}. {remedy}, or pass --skip-bad.")
        self.problems.append(problem)

    def compute_share(self, room: str, furniture: str) -> float | None:
        """Share of the rooms of this type that hold the furniture; None if the source is silent."""
        present = self.furniture.get((room, furniture), 0)
        return present / self.num_rooms[room] if present and self.num_rooms[room] else None

    def compute_distributions(self) -> dict[PlaceKey, float]:
        """P(room, furniture, relation | object) in a home with one room of each type."""
        rates = {
            key: value / self.num_rooms[key[0]] if self.is_per_room and key[0] else value
            for key, value in self.placements.items()
            if value > 0
        }
        totals: dict[str, list[float]] = defaultdict(list)
        for key, rate in rates.items():
            totals[key[2]].append(rate)
        return {key: rate / math.fsum(totals[key[2]]) for key, rate in rates.items()}

    def summarise(self) -> str:
        """What was read and what fell outside the type tables, with the most frequent names."""
        lines = [
            f"{self.source}: {self.num_units} read, {sum(self.num_rooms.values())} rooms, "
            f"{len(self.placements)} different placements",
        ]
        for part, names in self.outside.items():
            most = ", ".join(f"{name} {count}" for name, count in names.most_common(_SHOWN))
            total = sum(names.values())
            lines.append(f"  outside the {part} table: {total}{f' ({most})' if total else ''}")
        if self.problems:
            lines.append(f"  bad rows skipped: {len(self.problems)}; first: {self.problems[0]}")
        return "\n".join(lines)
