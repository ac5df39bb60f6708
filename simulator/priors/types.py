"""The two type tables of the paper's appendix, and the names other data sets use for the types."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from typing import Any, TypeVar

from sgm.files import read_table
from sgm.prior.prior_graph import Adjectives

Row = TypeVar("Row")
ROOMS = ("kitchen", "living room", "bedroom", "bathroom")


@dataclass(frozen=True, slots=True)
class FurnitureRow:
    """One row of the furniture table.

    Attributes:
        label: the type; the second `chair` row of the paper is "armchair".
        sample_prob: how common the type is in a home.
        max_count: most instances in a home.
        num_edges: outgoing edges in the paper's own prior.
        relation: relation of its objects where the source names none.
        alias_of: the type whose placements it shares, if any.
        adjectives: one group of words per category.
    """

    label: str
    sample_prob: float
    max_count: int
    num_edges: int
    relation: str
    alias_of: str | None
    adjectives: Adjectives


@dataclass(frozen=True, slots=True)
class ObjectRow:
    """One row of the object table; fields as in `FurnitureRow` and `ObjectType`."""

    label: str
    sample_prob: float
    max_count: int
    move_freq: float
    add_remove_prob: float
    num_edges: int
    alias_of: str | None
    adjectives: Adjectives


@dataclass(frozen=True, slots=True)
class TypeTables:
    """All furniture and object types, by label, in the order of the paper."""

    furniture: Mapping[str, FurnitureRow]
    objects: Mapping[str, ObjectRow]


@dataclass(frozen=True, slots=True)
class Names:
    """Turns the names of one data set into ours.

    Attributes:
        rooms: room name -> our room.
        furniture: type name -> our furniture label.
        objects: type name -> our object label.
        outside: type names that are in neither of our tables, but look as if they were.
        assets: words of asset ids -> type name of the data set.
    """

    rooms: Mapping[str, str]
    furniture: Mapping[str, str]
    objects: Mapping[str, str]
    outside: frozenset[str]
    assets: Mapping[str, str]

    def find_room(self, name: str) -> str | None:
        """Our room for a name, or None if it is outside our four rooms."""
        return self.rooms.get(name) or _match(name, ROOMS)

    def find_furniture(self, name: str) -> str | None:
        """Our furniture label for a name, or None if it is outside the furniture table."""
        if name in self.outside:
            return None
        return self.furniture.get(name) or _match(name, load_types().furniture)

    def find_object(self, name: str) -> str | None:
        """Our object label for a name, or None if it is outside the object table."""
        if name in self.outside:
            return None
        return self.objects.get(name) or _match(name, load_types().objects)


@lru_cache(maxsize=1)
def load_types() -> TypeTables:
    """Read `data/furniture.csv` and `data/objects.csv`.

    Source: paper appendix, tables "Furniture types" and "Objects types", all rows. The adjectives
    are ours, as many per type as the tables say.
    """
    return TypeTables(_read(FurnitureRow, "furniture.csv"), _read(ObjectRow, "objects.csv"))


@lru_cache(maxsize=8)
def load_names(source: str) -> Names:
    """Read the rows of `data/names.csv` for one source ("procthor", "behavior" or "igibson").

    Names that differ from ours only in case, spacing or camel case need no row.
    """
    kinds = ("room", "furniture", "object", "outside", "asset")
    parts: dict[str, dict[str, str]] = {category: {} for category in kinds}
    for entry in read_table("simulator.priors", "names.csv"):
        if entry["source"] == source:
            parts[entry["kind"]][entry["name"]] = entry["label"]
    rooms, furniture, objects, outside, assets = (parts[category] for category in kinds)
    return Names(rooms, furniture, objects, frozenset(outside), assets)


def _parse_adjectives(text: str) -> Adjectives:
    """Parse `size=small|large; colour=red` to (("small", "large"), ("red",))."""
    groups = (group.partition("=")[2] for group in text.split(";") if group.strip())
    return tuple(tuple(word.strip() for word in group.split("|")) for group in groups)


# How a column is read; others are texts.
_COLUMNS: Mapping[str, Callable[[str], Any]] = {
    "sample_prob": float,
    "max_count": int,
    "num_edges": int,
    "move_freq": float,
    "add_remove_prob": float,
    "alias_of": lambda text: text or None,
    "adjectives": _parse_adjectives,
}


def _read(row_class: type[Row], file: str) -> dict[str, Row]:
    """Read the rows of a table, by label."""
    return {
        entry["label"]: row_class(
            **{
                each.name: _COLUMNS.get(each.name, str)(entry[each.name])
                for each in fields(row_class)  # type: ignore[arg-type]
            }
        )
        for entry in read_table("simulator.priors", file)
    }


def _match(name: str, labels: Mapping[str, object] | tuple[str, ...]) -> str | None:
    """Match "SideTable", "side_table" and "Side table" to "side table"."""
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name).replace("_", " ").strip().lower()
    return words if words in labels else None
