"""The looks of the present time step: what each showed, and what they sum up to."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from numbers import Real
from typing import Any, TypeAlias

from sgm.layout.turns import turn_flat
from sgm.memory.look_weights import SURE
from sgm.memory.sighting import Point, Sighting, read_relation
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.words import read_words
from sgm.schema import NUM_RELATIONS, RELATIONS

MOST_LOOKS = 10  # at one place in one time step that show the same; a search has three to five
MOST_KEPT = 10 * MOST_LOOKS  # looks at one place that are held apart from what was known before
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
        sought: name or id of the one thing that was looked for, and not found; empty for a look for
            all.
    """

    furniture: int
    seen: tuple[Sighting, ...]
    coverage: Coverage = 1.0
    hidden: tuple[Name, ...] = ()
    sought: str = ""

    def turn(self, angle: float, shift: tuple[float, float]) -> StepLook:
        """Return the look in a map that was turned around its origin, and moved then."""
        seen = []
        for sighting in self.seen:
            if sighting.position is not None:
                x, y, z = sighting.position
                x, y = (float(value) for value in turn_flat(x, y, angle, shift))
                sighting = replace(sighting, position=(x, y, z))
            seen.append(sighting)
        return replace(self, seen=tuple(seen))

    def keep_at(self, is_there: Callable[[Point], bool]) -> StepLook:
        """Return the look at furniture that was moved: what lies elsewhere has no position."""
        seen = [
            sighting
            if sighting.position is None or is_there(sighting.position)
            else replace(sighting, position=None, position_sd=None)
            for sighting in self.seen
        ]
        return replace(self, seen=tuple(seen))

    def to_json(self) -> list[Any]:
        """Return JSON values, from which `from_json` makes the same look."""
        look = [self.furniture, self.coverage, [sighting.to_row() for sighting in self.seen]]
        hidden = [name.text for name in self.hidden]
        if self.sought:
            return [*look, hidden, self.sought]
        return [*look, hidden] if hidden else look

    @classmethod
    def from_json(cls, data: Any) -> StepLook:
        """Read JSON values; raises TypeError or ValueError if they are none of a look."""
        furniture, share, seen, *others = data
        coverage = parse_coverage(share)
        if not isinstance(furniture, int) or not 0 < max(split_coverage(coverage)) <= 1:
            raise ValueError(f"look at {shorten(furniture)} with coverage {shorten(share)}")
        hidden: Any = others[0] if others else ()
        sought = str(others[1]) if len(others) > 1 else ""
        names = tuple(Name.read(text) for text in hidden)
        if sought:
            read_words("description", sought)
        sightings = tuple(Sighting(*arguments) for arguments in seen)
        return cls(furniture, sightings, coverage, names, sought)


@dataclass(slots=True)
class StepLog:
    """What was looked at in this time step.

    Attributes:
        looks: in order.
        of_place: numbers of the looks at each furniture id, but for those for one thing alone.
        of_thing: numbers of the looks for one thing alone, by its words and furniture id.
        num_looks: how many looks there were at each furniture id, each by its coverage.
        coverage: sum of their shares that were in view, by furniture id; of use as long as all
            looks were at whole places, and none had something hidden (`is_plain`).
        shown: things of each object that the latest look at each furniture id showed, by object
            row; what it had not in view is as before.
        at_once: most things of each object that are known at once, by object row, whatever this
            step shows at several places.
        views: of each furniture id, which relations looks since the last statement had in view.
        num_until_seen: looks up to the latest one that showed it, by object row and furniture id.
        last_shown: number of the look that showed it last, and where, by object row.
        left: where each object is no more by what was said since it was seen there, by object row.
        between: what was asked for or said since, each with the number of looks before it.
        num_before_said: looks before the last statement.
        looks_by_relation: whether a look had other shares of other relations in view.
        is_plain: whether no look had, nor something hidden.
    """

    looks: list[StepLook] = field(default_factory=list)
    of_place: dict[int, list[int]] = field(default_factory=dict)
    of_thing: dict[str, dict[int, list[int]]] = field(default_factory=dict)
    num_looks: dict[int, float] = field(default_factory=dict)
    coverage: dict[int, float] = field(default_factory=dict)
    shown: dict[int, dict[int, int]] = field(default_factory=dict)
    at_once: dict[int, int] = field(default_factory=dict)
    views: dict[int, list[tuple[bool, ...]]] = field(default_factory=dict)
    num_until_seen: dict[int, dict[int, int]] = field(default_factory=dict)
    last_shown: dict[int, tuple[int, int]] = field(default_factory=dict)
    left: dict[int, set[int]] = field(default_factory=dict)
    between: list[tuple[int, Any]] = field(default_factory=list)  # a text, or a `SaidOf`
    num_before_said: int = 0
    looks_by_relation: bool = False
    is_plain: bool = True

    def copy(self) -> StepLog:
        """Return the same log, which can be added to alone."""
        return replace(
            self, **{each.name: _copy(getattr(self, each.name)) for each in fields(self)}
        )

    def add(self, look: StepLook, seen: Mapping[int, int]) -> None:
        """Note a look; `seen` counts the things seen by object row."""
        coverage, furniture, number = look.coverage, look.furniture, len(self.looks)
        share = average_coverage(coverage)
        self.looks.append(look)
        if look.sought:
            words = read_words("description", look.sought)
            of_place = self.of_thing.setdefault(words, {})
            of_place.setdefault(furniture, []).append(number)
            return
        self.num_looks[furniture] = self.num_looks.get(furniture, 0.0) + share
        if isinstance(coverage, tuple):
            self.looks_by_relation = True
        else:
            self.coverage[furniture] = self.coverage.get(furniture, 0.0) + coverage
        self.is_plain &= not look.hidden and not self.looks_by_relation
        self.of_place.setdefault(furniture, []).append(number)
        is_whole = share >= SURE and not look.hidden
        before = {} if is_whole else self.shown.get(furniture, {})
        self.shown[furniture] = {**before, **seen}
        self.views.setdefault(furniture, []).append(_list_in_view(coverage))
        for object_row, count in seen.items():
            self.at_once[object_row] = max(self.at_once.get(object_row, 0), count)
            self.num_until_seen.setdefault(object_row, {})[furniture] = number + 1
            self.last_shown[object_row] = number, furniture
            self.left.get(object_row, set()).discard(furniture)

    def say(self, object_row: int, furniture: int | None, left: Iterable[int]) -> None:
        """Note that an object was said to be at furniture, or held, and no more where it has left.

        It counts as a look that showed the object there; looks that follow say something new.
        """
        self.num_before_said = len(self.looks)
        self.views.clear()
        self.left.setdefault(object_row, set()).update(left)
        for place in left:
            self.shown.get(place, {}).pop(object_row, None)
        if furniture is not None:
            self.num_until_seen.setdefault(object_row, {})[furniture] = len(self.looks)
            self.last_shown[object_row] = len(self.looks), furniture
            self.left[object_row].discard(furniture)

    def is_repeated(self, look: StepLook, since: int = 0) -> bool:
        """Tell whether the last looks there showed the same, and had as much in view ten times.

        Of looks for one thing alone, those from the number `since` on count.
        """
        numbers = self.of_place.get(look.furniture, [])
        if look.sought:
            words = read_words("description", look.sought)
            numbers = self.of_thing.get(words, {}).get(look.furniture, [])
        since = max(since, self.num_before_said)
        if len(numbers) < MOST_LOOKS:
            return False
        shown, hidden = _count_seen(look), {name.key for name in look.hidden}
        least = [MOST_LOOKS * float(share > 0) for share in split_coverage(look.coverage)]
        for number in reversed(numbers):
            before = self.looks[number]
            is_same = _count_seen(before) == shown and number >= since
            if not is_same or not hidden.issuperset(name.key for name in before.hidden):
                return False
            least = [
                left - share
                for left, share in zip(least, split_coverage(before.coverage), strict=True)
            ]
            if max(least) <= 1e-9:
                return True
        return False

    def is_again(self, look: StepLook) -> bool:
        """Tell whether a look before had in view what this one has."""
        if look.sought:
            words = read_words("description", look.sought)
            return look.furniture in self.of_thing.get(words, {})
        in_view = _list_in_view(look.coverage)
        return any(
            all(was or not now for was, now in zip(before, in_view, strict=True))
            for before in self.views.get(look.furniture, ())
        )

    def count_shown(self, object_row: int) -> int:
        """Return how many things of an object the latest looks at all places showed."""
        return sum(seen.get(object_row, 0) for seen in self.shown.values())

    def is_full(self, furniture: int) -> bool:
        """Tell whether there are as many looks at furniture as are held apart."""
        return len(self.of_place.get(furniture, ())) >= MOST_KEPT


def _copy(value: Any) -> Any:
    """Copy lists and sets, and mappings with what they hold."""
    if isinstance(value, dict):
        return {key: _copy(held) for key, held in value.items()}
    return value.copy() if isinstance(value, (list, set)) else value


def _list_in_view(coverage: Coverage) -> tuple[bool, ...]:
    """Tell of each relation whether a look had most of it in view."""
    return tuple(share >= SURE for share in split_coverage(coverage))


def _count_seen(look: StepLook) -> Counter[tuple[tuple[str, ...], str, bool]]:
    """Count what a look shows by name and id, sure sightings and others apart."""
    return Counter(
        (sighting.name.key, sighting.id or "", sighting.confidence >= SURE)
        for sighting in look.seen
    )


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


def average_coverage(coverage: Coverage) -> float:
    """Return which share of furniture was in view, all relations taken alike."""
    return sum(coverage) / len(coverage) if isinstance(coverage, tuple) else coverage


def read_share(name: str, share: Any, place: str) -> float:
    """Return a share above 0; raises ValueError for anything else."""
    if not isinstance(share, Real) or share <= 0 or not share <= 1:
        raise ValueError(
            f"{name} must be above 0 and at most 1, got {shorten(share)} at {place}. Give the "
            "share in view, or leave out the look."
        )
    return float(share)
