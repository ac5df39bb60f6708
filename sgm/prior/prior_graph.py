"""The prior graph: which furniture a room holds, and which objects lie where on it."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from importlib import resources
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sgm.files import VERSION, make_read_error, parse_json, read_file, write_whole
from sgm.prior.household import build_household
from sgm.prior.prior_check import PARTS, check_prior
from sgm.schema import RELATIONS

Adjectives = tuple[tuple[str, ...], ...]


@dataclass(frozen=True, slots=True)
class FurnitureType:
    """One furniture type in one room: a furniture node of the prior graph.

    Attributes:
        label: the type, such as "side table".
        room: the room it stands in.
        prob: weight of being sampled for the room; need not sum to one.
        max_count: most instances in a home.
        adjectives: words of its descriptions, one group per category.
    """

    label: str
    room: str
    prob: float
    max_count: int
    adjectives: Adjectives


@dataclass(frozen=True, slots=True)
class ObjectType:
    """One object type.

    Attributes:
        label: the type, such as "mug".
        sample_prob: how common it is, 0 to 1; multiplies its placement weights.
        max_count: most instances in a home.
        move_freq: relative weight of being the object that moves, 0 to 1.
        add_remove_prob: probability per step of one appearing, and of each one leaving.
        adjectives: words of its descriptions, one group per category.
    """

    label: str
    sample_prob: float
    max_count: int
    move_freq: float
    add_remove_prob: float
    adjectives: Adjectives


@dataclass(frozen=True, slots=True)
class Placement:
    """One edge from an object type to a furniture type.

    Attributes:
        room: the room of the furniture; None for every room ("coarse" graph).
        furniture: label of the furniture type.
        object: label of the object type.
        relation: such as "onTop" or "in".
        prob: weight of the place among the places of the object; need not sum to one.
        count: how often the source saw it, where the source counts.
        source: where it comes from.
    """

    room: str | None
    furniture: str
    object: str
    relation: str
    prob: float
    count: float | None = None
    source: str | None = None


@dataclass(frozen=True)
class PriorGraph:
    """P(furniture | room) and P(room, furniture, relation | object), with metadata per type.

    Every construction is checked; a broken rule is a ValueError that names the row.

    Source: paper section 4.1 "Priors graph", appendix A.
    """

    rooms: tuple[str, ...]
    furniture: tuple[FurnitureType, ...]
    objects: tuple[ObjectType, ...]
    placements: tuple[Placement, ...]
    metadata: dict[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        check_prior(self.to_dict())

    def __hash__(self) -> int:
        """Hash the checksum, which is computed once: a prior may have 30,000 rows."""
        return hash(self.checksum)

    @classmethod
    def load(cls, path: str | Path) -> PriorGraph:
        """Read a prior file.

        Raises:
            ValueError: if the file is not JSON, or a row breaks a rule (the row is named).
            OSError: if the file cannot be read.
        """
        return cls.from_dict(parse_prior(read_file(path), where=str(path)), where=str(path))

    @classmethod
    @lru_cache(maxsize=1)
    def default(cls) -> PriorGraph:
        """The paper's prior, of which homes are sampled (docs/priors.md says whence it comes)."""
        text = resources.files("sgm.prior").joinpath("default.json").read_text(encoding="utf-8")
        return cls.from_dict(parse_prior(text, where="default.json"), where="default.json")

    @classmethod
    @lru_cache(maxsize=1)
    def household(cls) -> PriorGraph:
        """The prior for homes that people live in: some 800 things, and where they keep them."""
        prior = cls.from_dict(build_household(), where="household.csv")
        prior.metadata["checksum"] = prior.checksum
        return prior

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], *, where: str = "") -> PriorGraph:
        """Build from the JSON form; `where` names the file in errors.

        Raises:
            ValueError: if a row breaks a rule (the row is named).
        """
        try:
            if data["version"] != VERSION or not data.keys() <= PARTS:
                raise ValueError("not a prior of this version")
            return cls(
                rooms=tuple(data["rooms"]),
                furniture=tuple(FurnitureType(**_freeze(fields)) for fields in data["furniture"]),
                objects=tuple(ObjectType(**_freeze(fields)) for fields in data["objects"]),
                placements=tuple(Placement(**fields) for fields in data["placements"]),
                metadata=dict(data.get("metadata", {})),
            )
        except (AttributeError, KeyError, TypeError, ValueError):
            check_prior(data, where=where)  # names the fault, its row and the file
            raise

    def to_dict(self) -> dict[str, Any]:
        """The JSON form, fields in the order of the file."""
        return {
            "version": VERSION,
            "metadata": self.metadata,
            "rooms": list(self.rooms),
            "furniture": _to_rows(self.furniture),
            "objects": _to_rows(self.objects),
            "placements": _to_rows(self.placements),
        }

    def save(self, path: str | Path) -> None:
        """Write the prior as JSON, one row per line; equal graphs give equal bytes."""
        write_whole(path, _format(self.to_dict()).encode())

    @cached_property
    def checksum(self) -> str:
        """SHA-256 of the canonical JSON of everything but `metadata`."""
        content = {part: rows for part, rows in self.to_dict().items() if part != "metadata"}
        text = json.dumps(content, sort_keys=True, separators=(",", ":"))
        return hashlib.sha256(text.encode()).hexdigest()

    @cached_property
    def weights(self) -> NDArray[np.float64]:
        """Placement weights, (O, K, 2): object type, furniture node, relation.

        A coarse placement fills every room that has its furniture. Read-only.
        """
        weights = np.zeros((len(self.objects), len(self.furniture), len(RELATIONS)))
        object_index = {object_type.label: index for index, object_type in enumerate(self.objects)}
        node_index: dict[tuple[str | None, str], list[int]] = {}
        for index, node in enumerate(self.furniture):
            node_index.setdefault((node.room, node.label), []).append(index)
            node_index.setdefault((None, node.label), []).append(index)
        places = [
            (
                object_index[placement.object],
                node,
                RELATIONS.index(placement.relation),
                placement.prob,
            )
            for placement in self.placements
            for node in node_index[placement.room, placement.furniture]
        ]
        *indices, probs = zip(*places, strict=True)
        weights[tuple(map(list, indices))] = probs
        weights.setflags(write=False)
        return weights


# The priors that ship with the package, by the name that command lines use.
SHIPPED: dict[str, Callable[[], PriorGraph]] = {
    "default": PriorGraph.default,
    "household": PriorGraph.household,
}
PRIOR_HELP = "default or household, which ship, or a prior file; default if left out"


def load_prior(source: str | None) -> PriorGraph:
    """Load a prior that ships with the package, by its name in `SHIPPED`, or a file, by its path.

    None is the default. A file of one's own that is called like a shipped prior is reached as
    "./household".

    Raises:
        ValueError: if the file cannot be read or is malformed.
    """
    if source is None or source in SHIPPED:
        return SHIPPED[source or "default"]()
    try:
        return PriorGraph.load(source)
    except OSError as error:
        rule = f"prior must be {' or '.join(SHIPPED)}, or a file that can be read"
        where = f"for {source}. Check the path, or leave it out for the default."
        raise make_read_error(error, rule, where) from error


def find_shipped(checksum: str) -> PriorGraph | None:
    """Return the shipped prior of a checksum, None if there is none.

    The one that most memories have is made first: the other one need not be.
    """
    shipped = reversed(SHIPPED.values())
    return next((prior for make in shipped if (prior := make()).checksum == checksum), None)


def parse_prior(content: str | bytes, *, where: str) -> Any:
    """Parse the JSON of a prior file.

    Raises:
        ValueError: names the file, line and column of the fault.
    """
    try:
        return parse_json(content)
    except json.JSONDecodeError as error:
        raise ValueError(
            f"prior must be JSON, got {error.msg} in {where}, line {error.lineno}, "
            f"column {error.colno}. Rebuild or mend the file."
        ) from error
    except ValueError as error:
        raise ValueError(
            f"prior must be JSON in UTF-8, got {error} in {where}. Rebuild or mend the file."
        ) from None


def _to_rows(rows: Sequence[FurnitureType | ObjectType | Placement]) -> list[dict[str, Any]]:
    if not rows:
        return []
    names = rows[0].__slots__
    return [dict(zip(names, values, strict=True)) for values in map(attrgetter(*names), rows)]


def _freeze(fields: Mapping[str, Any]) -> dict[str, Any]:
    groups = fields["adjectives"]
    if not isinstance(groups, list) or not all(isinstance(words, list) for words in groups):
        raise TypeError("adjectives must be a list of lists")  # a text would split into letters
    return {**fields, "adjectives": tuple(map(tuple, groups))}


def _format(data: Mapping[str, Any]) -> str:
    """One row per line: readable in a diff, small on disk."""
    parts = []
    for part, rows in data.items():
        if part in ("furniture", "objects", "placements"):
            lines = ",\n".join(f"  {json.dumps(row, ensure_ascii=False)}" for row in rows)
            parts.append(f'"{part}": [\n{lines}\n]')
        else:
            indent = 1 if part == "metadata" else None
            parts.append(f'"{part}": {json.dumps(rows, ensure_ascii=False, indent=indent)}')
    return "{\n" + ",\n".join(parts) + "\n}\n"
