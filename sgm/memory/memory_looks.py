"""The part of a memory that takes what was seen, and warns of what cannot be looks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from sgm.checks import check_kind
from sgm.layout.viewpoint import Viewpoint
from sgm.memory.clock import Clock
from sgm.memory.given_names import name_hidden, name_seen
from sgm.memory.look import (
    MOST_LOOKS,
    StepLook,
    read_coverage,
    read_hidden,
    read_share,
    read_sightings,
)
from sgm.memory.look_weights import SURE
from sgm.memory.memory_state import MemoryState
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import Sighting
from sgm.memory.thing import ThingName
from sgm.messages import warn_caller
from sgm.names.name import Name
from sgm.names.words import read_words
from sgm.schema import USUAL_RELATION

_MOST_IN_A_ROW = 100  # looks at one place that show the same, step after step
_LONG_STEP = 30.0  # seconds: a camera that watches one place makes no faster steps
_ALIKE = 0.8  # share of the things of two looks that both show
_WHAT_TO_DO = (
    "Join the frames of a visit to one look, as sgm.eyes.LookBuilder does; let steps last minutes."
)


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
            warn_caller(
                f"{num_doubted} of {len(look.seen)} confidences of a look are below {SURE}, so "
                "that these count as not seen: a confidence is the probability that a sighting is "
                "right. If they are scores of a detector, give SceneGraphMemory(score_calibration="
                "ScoreCalibration.open_vocabulary()), or one that was fitted."
            )

    def _watch_frames(self, place: str, num_in_step: float, clock: Clock | None) -> None:
        is_slow = clock is not None and clock.step_seconds >= _LONG_STEP
        if num_in_step >= MOST_LOOKS:
            message = (
                f"looks must be few in a time step, got more than {MOST_LOOKS} at {place}: further "
                "ones that show the same are left out."
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
        warn_caller(f"{message} {_WHAT_TO_DO}", LookPerFrameWarning)


class MemoryLooks:
    """Looks of a robot; `SceneGraphMemory` says what each call does, takes and raises.

    Attributes:
        watch: warns of what cannot be looks.
    """

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state
        self.watch = LookWatch()

    def observe(
        self,
        furniture: int,
        seen: Sequence[Sighting],
        coverage: float | Mapping[str, float] = 1.0,
        hidden: Sequence[str] = (),
        viewpoint: Viewpoint | None = None,
    ) -> None:
        """Fold one look at a furniture node into the memory."""
        self.take(furniture, seen, coverage, hidden, viewpoint, is_named=False)

    def take(
        self,
        furniture: int,
        seen: Sequence[Sighting],
        coverage: float | Mapping[str, float],
        hidden: Sequence[str] = (),
        viewpoint: Viewpoint | None = None,
        *,
        is_named: bool,
    ) -> None:
        """Fold one look in, as `observe` does.

        `is_named` says that what was seen is called as the memory calls it, not as a detector does,
        and is as sure as its confidence says, which is no score.
        """
        with self._state.lock:
            state = self._state
            place = state.furniture.names[state.find_place(furniture)]
        sightings = read_sightings(seen, place)  # may take its time: others go on meanwhile
        share, names = read_coverage(coverage, place), read_hidden(hidden, place)
        if viewpoint is not None:
            hint = "Take that of a BuiltLook, or leave it out."
            check_kind("viewpoint", viewpoint, Viewpoint, hint)
        look = StepLook(int(furniture), sightings, share, names)  # an id is any kind of number
        with self._state.lock:
            state = self._state
            state.find_place(furniture)
            num_in_step = state.step.num_looks.get(look.furniture, 0.0)
            calibration = state.score_calibration
            self.watch.note(look, place, num_in_step, state.clock, calibration is not None)
            if calibration is not None and not is_named:
                sure = [
                    replace(sighting, confidence=calibration(sighting.confidence))
                    for sighting in sightings
                ]
                look = replace(look, seen=tuple(sure))
            if not is_named:
                look = _name_look(state, look)
            if state.file is not None:
                self._state.write(
                    "look",
                    look=look,
                    furniture=look.furniture,
                    coverage=share,
                    seen=[sighting.to_row() for sighting in sightings],
                    hidden=tuple(name.text for name in names),
                    viewpoint=viewpoint,
                    is_named=is_named or None,
                )
            state.look(look)

    def name_seen(self, furniture: int, seen: Sequence[Sighting]) -> tuple[Sighting, ...]:
        """Return sightings by the names that people have given to what is there."""
        with self._state.lock:
            place = self._state.layout.describe(furniture)
            return _name_seen(self._state, furniture, read_sightings(seen, place))

    def note_found(
        self,
        furniture: int,
        thing: str | ThingName,
        relation: str = USUAL_RELATION,
        coverage: float = 0.01,
    ) -> None:
        """Note that a look for one thing has found it, and say nothing of all others there."""
        with self._state.lock:
            if not isinstance(thing, ThingName):
                read_words("thing", thing)
                rows = self._state.find_rows(thing)
                thing = self._state.things[rows[0]].name if len(rows) == 1 else ThingName(thing)
            sighting = Sighting(thing.description, relation, id=thing.id or None)
            self.take(furniture, [sighting], coverage, is_named=True)

    @property
    def score_calibration(self) -> ScoreCalibration | None:
        """What the confidences of sightings mean; None if they are probabilities."""
        with self._state.lock:
            return self._state.score_calibration

    def note_absent(self, furniture: int, description: str, coverage: float = 1.0) -> None:
        """Note that a look for one thing did not find it, and say nothing of all others there."""
        with self._state.lock:
            state = self._state
            place = state.layout.describe(furniture)
            words = read_words("description", description)
            name = description if state.things.has_id(description) else words
            coverage = read_share("coverage", coverage, place)
            look = StepLook(int(furniture), (), coverage, sought=name)
            state.write("absent", furniture=look.furniture, description=name, coverage=coverage)
            state.look(look)


def _name_look(state: MemoryState, look: StepLook) -> StepLook:
    """Return a look of a detector by the names that people have given to what is there."""
    if not state.renamed:
        return look
    seen = _name_seen(state, look.furniture, look.seen)
    hidden = name_hidden(state.renamed, look.furniture, look.hidden)
    return replace(look, seen=seen, hidden=hidden)


def _name_seen(
    state: MemoryState, furniture: int, seen: Iterable[Sighting]
) -> tuple[Sighting, ...]:
    """Return sightings of a detector by the names that people have given to what is there."""
    place, edges = state.find_place(furniture), state.batch.edges

    def is_there(name: Name) -> bool:
        object_row = state.things.get_row(name)
        is_edge = (edges["object"] == object_row) & (edges["furniture"] == place)
        return object_row >= 0 and bool((is_edge & edges["is_true"]).any())

    return name_seen(state.renamed, furniture, seen, is_there)
