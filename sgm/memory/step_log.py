"""The looks of the present time step, and whether they can be looks."""

from __future__ import annotations

import warnings
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from sgm.memory.clock import Clock
from sgm.memory.look_weights import SURE
from sgm.memory.sighting import Coverage, Sighting, parse_coverage, split_coverage
from sgm.messages import shorten
from sgm.names.name import Name

MOST_LOOKS = 10  # at one place in one time step; a search has three to five
_MOST_IN_A_ROW = 100  # looks at one place that show the same, step after step
_LONG_STEP = 30.0  # seconds: a camera that watches one place makes no faster steps
_ALIKE = 0.8  # share of the things of two looks that both show
_WHAT_TO_DO = (
    "Join the frames of a visit to one look, as sgm.eyes.LookBuilder does; let steps last minutes."
)


@dataclass(frozen=True, slots=True)
class StepLook:
    """One look of the present time step.

    Attributes:
        furniture: its id.
        seen: what was detected there.
        coverage: share of it that was in view, or of "in" and "onTop".
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
        return cls(furniture, tuple(Sighting(*one) for one in seen), coverage, names)


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
        looks_by_relation: whether a look had a share of "in" and another of "onTop" in view.
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
            self.num_looks[look.furniture] = num_before + sum(coverage) / 2
        else:
            self.num_looks[look.furniture] = num_before + coverage
            before = self.coverage.get(look.furniture, 0.0)
            self.coverage[look.furniture] = before + coverage
        self.is_plain &= not look.hidden and not self.looks_by_relation
        self.of_place.setdefault(look.furniture, []).append(len(self.looks))
        self.looks.append(look)
        for row, count in seen.items():
            here = self.counts.setdefault(row, Counter())
            here[look.furniture] = max(here.get(look.furniture, 0), count)
            self.num_until_seen.setdefault(row, {})[look.furniture] = len(self.looks)

    def shows_nothing_new(self, look: StepLook) -> bool:
        """Tell whether earlier looks there showed all that a look shows, and as surely."""
        known: Counter[tuple[tuple[str, ...], bool]] = Counter()
        for number in self.of_place.get(look.furniture, ()):
            known |= _count_seen(self.looks[number])
        return _count_seen(look) <= known


def _count_seen(look: StepLook) -> Counter[tuple[tuple[str, ...], bool]]:
    """Count what a look shows by name, sure sightings and others apart."""
    return Counter((sighting.name.key, sighting.confidence >= SURE) for sighting in look.seen)


class LookPerFrameWarning(UserWarning):
    """A memory gets every frame of a camera as if it were a look."""


class LookWatch:
    """Watches the looks of a memory, and warns once of frames of a video, and once of scores.

    Attributes:
        warns_of_scores: whether it has yet to warn of confidences that are no probabilities.
    """

    def __init__(self) -> None:
        self.warns_of_scores = True
        self._warns_of_frames = True
        self._furniture: int | None = None
        self._names: set[tuple[str, ...]] = set()
        self._num_alike = 0

    def note(
        self, look: StepLook, place: str, num_in_step: float, clock: Clock | None, has_scores: bool
    ) -> None:
        """Take note of a look at a place, after looks there in this step, each by its coverage.

        `has_scores` says that its confidences are scores, of which the memory knows what they mean.
        """
        names, num_doubted = set(), 0
        for sighting in look.seen:
            names.add(sighting.name.key)
            num_doubted += 0 < sighting.confidence < SURE
        both, any_of_them = len(names & self._names), len(names | self._names)
        is_alike = look.furniture == self._furniture and both >= _ALIKE * any_of_them
        self._num_alike = self._num_alike + 1 if is_alike else 1
        self._furniture, self._names = look.furniture, names
        if self._warns_of_frames:
            self._watch_frames(place, num_in_step, clock)
        if self.warns_of_scores and not has_scores and 2 * num_doubted > len(look.seen):
            self.warns_of_scores = False
            warnings.warn(
                f"{num_doubted} of {len(look.seen)} confidences of a look are below {SURE}, so "
                "that these count as not seen: a confidence is the probability that a sighting is "
                "right. If they are scores of a detector, give SceneGraphMemory(score_calibration="
                "ScoreCalibration.open_vocabulary()), or one that was fitted.",
                stacklevel=3,
            )

    def _watch_frames(self, place: str, num_in_step: float, clock: Clock | None) -> None:
        is_slow = clock is not None and clock.step_seconds >= _LONG_STEP
        if num_in_step >= MOST_LOOKS:
            message = (
                f"looks must be few in a time step, got more than {MOST_LOOKS} at {place}: further "
                "ones of a step count if they show something new."
            )
        elif self._num_alike > _MOST_IN_A_ROW and not is_slow:
            lasting = "" if clock is None else f" of {clock.step_seconds:g} s"
            message = (
                f"looks must lie some time apart, got more than {_MOST_IN_A_ROW} in a row{lasting} "
                f"at {place} that show the same: if they are frames, each counts as a look."
            )
        else:
            return
        self._warns_of_frames = False
        warnings.warn(f"{message} {_WHAT_TO_DO}", LookPerFrameWarning, stacklevel=4)
