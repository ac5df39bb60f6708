"""The looks of the present time step: what each showed, and what they sum up to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, TypeAlias

from sgm.memory.look_weights import SURE
from sgm.memory.sighting import Sighting, read_relation
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.schema import NUM_RELATIONS, RELATIONS

MOST_LOOKS = 10  # at one place in one time step; a search has three to five
# One share for all relations, or one of each, in the order of `RELATIONS`.
Coverage: TypeAlias = float | tuple[float, ...]


@dataclass(frozen=True, slots=True)
class StepLook:
    """One look of the present time step.

    Attributes:
        furniture: its id.
        seen: what was detected there.
        coverage: share of it that was in view, or a share by relation.
        hidden: names of what was not seen because its spot was out of view.
    """

    furniture: int
    seen: tuple[Sighting, ...]
    coverage: Coverage = 1.0
    hidden: tuple[Name, ...] = ()

    def to_json(self) -> list[Any]:
        """Return JSON values, from which `from_json` makes the same look."""
        look = [self.furniture, self.coverage, [sighting.to_row() for sighting in self.seen]]
        return [*look, [name.text for name in self.hidden]] if self.hidden else look

    @classmethod
    def from_json(cls, data: Any) -> StepLook:
        """Read JSON values; raises TypeError or ValueError if they are none of a look."""
        furniture, share, seen, *hidden = data
        coverage = parse_coverage(share)
        if not isinstance(furniture, int) or not 0 < max(split_coverage(coverage)) <= 1:
            raise ValueError(f"look at {shorten(furniture)} with coverage {shorten(share)}")
        (texts,) = hidden or [()]
        names = tuple(Name.read(text) for text in texts)
        return cls(furniture, tuple(Sighting(*arguments) for arguments in seen), coverage, names)


@dataclass(slots=True)
class StepLog:
    """What was looked at in this time step.

    Attributes:
        looks: in order.
        of_place: numbers of the looks at each furniture id.
        num_looks: how many these were, each by its coverage, by furniture id.
        coverage: sum of their shares that were in view, by furniture id; of use as long as all
            looks were at whole places, and none had something hidden (`is_plain`).
        counts: things seen, by object row and furniture id.
        num_until_seen: looks up to the latest one that showed it, by object row and furniture id.
        queries: what was asked for since, each with the number of looks before it.
        looks_by_relation: whether a look had other shares of other relations in view.
        is_plain: whether no look had, nor something hidden.
    """

    looks: list[StepLook] = field(default_factory=list)
    of_place: dict[int, list[int]] = field(default_factory=dict)
    num_looks: dict[int, float] = field(default_factory=dict)
    coverage: dict[int, float] = field(default_factory=dict)
    counts: dict[int, dict[int, int]] = field(default_factory=dict)
    num_until_seen: dict[int, dict[int, int]] = field(default_factory=dict)
    queries: list[tuple[int, str]] = field(default_factory=list)
    looks_by_relation: bool = False
    is_plain: bool = True

    def add(self, look: StepLook, seen: Mapping[int, int]) -> None:
        """Note a look; `seen` counts the things seen by object row."""
        coverage, num_before = look.coverage, self.num_looks.get(look.furniture, 0.0)
        if isinstance(coverage, tuple):
            self.looks_by_relation = True
            self.num_looks[look.furniture] = num_before + sum(coverage) / len(coverage)
        else:
            self.num_looks[look.furniture] = num_before + coverage
            before = self.coverage.get(look.furniture, 0.0)
            self.coverage[look.furniture] = before + coverage
        self.is_plain &= not look.hidden and not self.looks_by_relation
        self.of_place.setdefault(look.furniture, []).append(len(self.looks))
        self.looks.append(look)
        for object_row, count in seen.items():
            at_once = self.counts.setdefault(object_row, Counter())
            at_once[look.furniture] = max(at_once.get(look.furniture, 0), count)
            self.num_until_seen.setdefault(object_row, {})[look.furniture] = len(self.looks)

    def shows_nothing_new(self, look: StepLook) -> bool:
        """Tell whether earlier looks there showed all that a look shows, and as surely."""
        known: Counter[tuple[tuple[str, ...], bool]] = Counter()
        for number in self.of_place.get(look.furniture, ()):
            known |= _count_seen(self.looks[number])
        return _count_seen(look) <= known


def _count_seen(look: StepLook) -> Counter[tuple[tuple[str, ...], bool]]:
    """Count what a look shows by name, sure sightings and others apart."""
    return Counter((sighting.name.key, sighting.confidence >= SURE) for sighting in look.seen)


def read_sightings(seen: Iterable[Sighting], place: str) -> tuple[Sighting, ...]:
    """Return what a look showed at a place; anything but sightings raises TypeError."""
    wrong: Any = seen
    if isinstance(seen, Iterable):
        read = tuple(seen)
        for wrong in read:
            if not isinstance(wrong, Sighting):
                break
        else:
            return read
    raise TypeError(
        f"seen must hold Sighting objects, got {shorten(wrong)} at {place}. Write "
        "[Sighting('milk', relation='in')], and [] where nothing was detected."
    )


def read_hidden(hidden: Iterable[str], place: str) -> tuple[Name, ...]:
    """Return the names of what a look at a place had out of view.

    What is no list raises TypeError, what is no name ValueError.
    """
    if isinstance(hidden, str) or not isinstance(hidden, Iterable):
        raise TypeError(
            f"hidden must be a list of descriptions, got {shorten(hidden)} at {place}. Write [] "
            "where nothing was."
        )
    names = []
    for name in hidden:
        names.append(Name.read(name, "description of what is hidden"))
    return tuple(names)


def read_coverage(coverage: Any, place: str) -> Coverage:
    """Return which share of a furniture node was in view, of a number or of numbers by relation.

    A relation that is left out was not in view. What is no share above 0 raises ValueError.
    """
    if not isinstance(coverage, Mapping):
        return read_share("coverage", coverage, place)
    shares = dict.fromkeys(RELATIONS, 0.0)
    for relation, share in coverage.items():
        if not isinstance(share, Real) or not 0 <= float(share) <= 1:
            raise ValueError(
                f"coverage of {shorten(relation)} must lie in [0, 1], got {shorten(share)} at "
                f"{place}. Give the share in view."
            )
        shares[read_relation(relation)] = float(share)
    first, *others = of_each = tuple(shares.values())
    if all(share == first for share in others):
        return read_share("coverage", first, place)
    return of_each


def parse_coverage(data: Any) -> Coverage:
    """Return the coverage of a file, one number or a list; ValueError or TypeError if none."""
    if isinstance(data, list):
        return read_coverage(dict(zip(RELATIONS, data, strict=True)), "a look")
    return float(data)


def split_coverage(coverage: Coverage) -> tuple[float, ...]:
    """Return the share of each relation."""
    return coverage if isinstance(coverage, tuple) else (coverage,) * NUM_RELATIONS


def read_share(name: str, share: Any, place: str) -> float:
    """Return a share above 0; raises ValueError for anything else."""
    if not isinstance(share, Real) or share <= 0 or not share <= 1:
        raise ValueError(
            f"{name} must be above 0 and at most 1, got {shorten(share)} at {place}. Give the "
            "share in view, or leave out the look."
        )
    return float(share)
