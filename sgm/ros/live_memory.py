"""A memory that looks at a stream of messages, and what a robot asks it; needs no ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from time import time as get_wall_time
from typing import Any, TypeAlias

from sgm.checks import check_at_least
from sgm.eyes.built_look import BuiltLook
from sgm.eyes.look_builder import LookBuilder
from sgm.finder.evidence import tell_point
from sgm.finder.finder import Finder
from sgm.finder.passing_time import pass_time, read_clock
from sgm.finder.ranking import Place, Ranking
from sgm.layout.box import Box
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.mapping.furniture_mapper import FurnitureMapper
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.steady_clock import SteadyClock, read_even_seconds
from sgm.messages import warn_caller
from sgm.names.asking import make_asking
from sgm.names.words import read_name
from sgm.ros.camera_feed import CameraFeed
from sgm.ros.graph_furniture import GraphFurniture

LocalTime: TypeAlias = Callable[[float], datetime | None]
_SAME_CLOCK = 60.0  # seconds by which stamps differ from the present, if their clock tells it
_STALE = 10.0  # seconds without a frame after which nothing is in view: the camera is off
_MOST_SHOWN = 20  # places of a belief that are drawn


def to_local_time(stamp: float) -> datetime | None:
    """Return the local date and time of seconds since 1970; None beyond what there is."""
    try:
        return datetime.fromtimestamp(stamp)
    except (OverflowError, OSError, ValueError):
        return None


@dataclass(frozen=True, slots=True)
class NextPose:
    """Where to go and look.

    Attributes:
        furniture: its id; -1 where the search is over.
        name: for people.
        position: x, y of where to stand, metres in the map.
        yaw: of the robot there, radians.
        probability: that the thing is there.
        outcome: how the search stands, a sentence.
        target: where the thing was seen last there, x, y, z in the map; None where unknown.
    """

    furniture: int
    name: str
    position: tuple[float, float]
    yaw: float
    probability: float
    outcome: str
    target: tuple[float, float, float] | None = None


@dataclass(frozen=True, slots=True)
class BeliefMarker:
    """A place as a box, coloured by how likely the thing is there.

    Attributes:
        furniture: its id.
        box: its extents.
        probability: that the thing is there.
        text: what to write above it.
    """

    furniture: int
    box: Box
    probability: float
    text: str


class LiveMemory:
    """Folds looks into a memory as they are made, and answers; time passes with both.

    Attributes:
        memory: what is remembered.
        feed: takes the messages.
        mapper: draws the map; None where furniture is known.
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        finder: Finder,
        *,
        step_seconds: float = 600.0,
        discover: FurnitureMapper | None = None,
        graph: GraphFurniture | None = None,
        ignore: Iterable[str] = (),
        labels: FurnitureLabels | None = None,
        on_look: Callable[[BuiltLook], None] = lambda look: None,
        local_time: LocalTime = to_local_time,
        accept_jump: bool = False,
        on_warning: Callable[[str], None] = warn_caller,
        now: Callable[[], float] = get_wall_time,
        monotonic: Callable[[], float] | None = None,
        **feed: Any,
    ) -> None:
        """Begin with a memory whose furniture has boxes, or without a map.

        Args:
            memory: with rooms and furniture (`HomeMap.add_to`), new or loaded.
            finder: who is asked.
            step_seconds: length of a time step, where the memory has no clock: it gets one that
                begins with the first look or question.
            discover: draws the map of this memory; None where its furniture is known.
            graph: takes furniture of this memory from scene graphs (`take_graph`); None for none.
            ignore: as in `LookBuilder`.
            labels: as in `LookBuilder`.
            on_look: is given every look after it was folded in.
            local_time: gives the local date and time of a stamp; None of a simulation's.
            accept_jump: whether the first stamp is right, however long the robot was off.
            on_warning: takes a warning of a clock that was set (`SteadyClock`).
            now: tells the present, in seconds since 1970. Stamps of another clock are those of a
                recording, which passes as fast as it is played.
            monotonic: seconds that pass, from any start, by a clock that is never set; None for
                those of this machine, or for `now` where that is given.
            feed: of `CameraFeed`.

        Raises:
            ValueError: if no furniture has a box and none is discovered, or a number is out of
                range.
        """
        check_at_least(1, step_seconds=step_seconds)
        if discover is None and graph is None and not memory.boxes:
            raise ValueError(
                "memory must have furniture with boxes to see it, got none. Add furniture with "
                "box=, give a map, discover=FurnitureMapper(memory), or graph=GraphFurniture("
                "memory)."
            )
        self._graph = graph
        self.memory, self._finder = memory, finder
        self._on_look, self.mapper = on_look, discover
        if monotonic is None:
            monotonic = read_even_seconds if now is get_wall_time else now
        self._now, self._local_time, self._warn = now, local_time, on_warning
        self._step_seconds, self._accept_jump = step_seconds, accept_jump
        self._clock = SteadyClock(monotonic, "messages")
        self._zero: float | None = None  # stamp of step 0
        self._latest: float | None = None  # stamp
        self.builder = LookBuilder(
            memory.layout.furniture,
            discover=discover,
            ignore=ignore,
            labels=labels,
            on_look=self._tell,
        )
        self.feed = CameraFeed(self.builder, now=monotonic, on_stamp=self._take_stamp, **feed)

    def take_graph(self, message: Any) -> None:
        """Take furniture over from a `hydra_msgs/DsgUpdate`.

        Raises:
            ValueError: if it holds no whole graph, or no `graph` takes furniture.
        """
        if self._graph is None:
            raise ValueError(
                "scene graphs must be taken by a GraphFurniture, got none. Write "
                "LiveMemory(..., graph=GraphFurniture(memory))."
            )
        self._graph.take(message, self.builder)

    def finish(self) -> None:
        """End all visits, as when the robot stops."""
        self.feed.finish()
        for _ in self.builder.finish():
            pass

    def rank(self, description: str, k: int | None = None) -> Ranking:
        """Rank the places where a thing may be now; what the camera shows now counts."""
        memory, looks = self._look_now()
        ranking = self._finder.rank(memory, description, k=k)
        return replace(ranking, places=tuple(_mark(place, ranking, looks) for place in ranking))

    def find_next(self, description: str, start: tuple[float, float] | None = None) -> NextPose:
        """Return where to look next for a thing, from a position or from anywhere."""
        memory, looks = self._look_now()
        search = self._finder.search(memory, description, start=start)
        look = search.next()
        if look is None:
            return NextPose(-1, "", (0.0, 0.0), 0.0, 0.0, search.outcome)
        place = _mark(look.place, search.ranking, looks)
        target = place.position
        (x, y), yaw = self.find_stand(place.furniture, target)
        asking, chance = make_asking(memory.language), f"{place.probability:.0%}"
        told = asking.say("look at", place=asking.translate(place.name), percent=chance)
        if place.evidence.is_in_view:
            told = asking.say("look in view", look=told)
        if target is not None:
            told = asking.say("look toward", look=told, point=tell_point(target))
        return NextPose(
            place.furniture,
            place.name,
            (x, y),
            yaw,
            place.probability,
            told,
            target,
        )

    def find_stand(
        self, furniture: int, target: tuple[float, float, float] | None = None
    ) -> tuple[tuple[float, float], float]:
        """Return where to stand before furniture, x, y, and the yaw with which one looks at it.

        With a target, x, y, z in the map, one looks at that. Where it is not known which way to
        look, the yaw is 0; where it is not known where to stand, it is the middle of the furniture.
        """
        pose = self.memory.get_pose(furniture, target)
        if pose is not None:
            return pose[:2], pose[2]
        box = self.memory.boxes.get(furniture)
        middle = (0.0, 0.0) if box is None else box.center[:2]
        return self.memory.get_position(furniture) or middle, 0.0

    def list_markers(self, description: str) -> list[BeliefMarker]:
        """Return the likeliest places of a thing that have a box."""
        boxes = self.memory.boxes
        return [
            BeliefMarker(
                place.furniture,
                boxes[place.furniture],
                place.probability,
                f"{place.name} {place.probability:.0%}",
            )
            for place in self.rank(description, _MOST_SHOWN)
            if place.furniture in boxes
        ]

    def _look_now(self) -> tuple[SceneGraphMemory, list[BuiltLook]]:
        """Let time pass, and return what is known with what is in view, and the looks at that.

        Visits that go on become looks of the memory when they end. Until then a copy has seen them.
        """
        present = self.feed.present
        if present is not None:
            self.builder.end_before(present - _STALE)
            self._take_stamp(present)
            self._go_to(present)
        elif self._latest is None and self.memory.clock is not None:
            now = self._now()  # before any message; that of the messages may be another clock
            seconds = None if self._local_time(now) is None else self._find_seconds(now)
            # One that is not set yet, such as a simulation's before it begins, is not read.
            if seconds is not None and seconds >= self.memory.time * self._get_step_seconds():
                self._zero = now - seconds
                self._read(now)
                self._go_to(now)
        self.builder.place_loose()
        looks = self.builder.list_open()
        if not looks:
            return self.memory, []
        memory = self.memory.copy()
        for look in looks:
            look.tell(memory)
        return memory, looks

    def _tell(self, look: BuiltLook) -> None:
        """Let time pass until a look, and fold it in."""
        for stamp in (look.start, look.end):
            if self._latest is None or stamp > self._latest:  # the builder was shown the frames
                self._take_stamp(stamp)
        self._go_to(look.end)
        look.tell(self.memory)
        self._on_look(look)

    def _take_stamp(self, stamp: float) -> None:
        """Read the clock of the messages; with the first stamp that of a new memory begins."""
        if self._latest is None:
            if abs(stamp - self._now()) > _SAME_CLOCK:  # a recording
                self._clock, self._zero = SteadyClock(None, "messages"), None
            if self._zero is None:
                self._zero = stamp - self._find_seconds(stamp)
        self._latest = stamp
        self._read(stamp)

    def _read(self, stamp: float) -> None:
        """Read the clock, and say if it is wrong."""
        assert self._zero is not None
        is_right = self._accept_jump and self._clock.is_new
        reading, seconds = stamp - self._zero, self._get_step_seconds()
        read_clock(self.memory, self._clock, reading, seconds, self._warn, accept_jump=is_right)

    def _go_to(self, stamp: float) -> None:
        """Let time pass until a stamp: to the last step that has begun by then."""
        assert self._zero is not None
        time = self._clock.translate(stamp - self._zero)
        pass_time(self.memory, time, self._get_step_seconds())

    def _get_step_seconds(self) -> float:
        clock = self.memory.clock
        return self._step_seconds if clock is None else clock.step_seconds

    def _find_seconds(self, stamp: float) -> float:
        """Return how many seconds after step 0 the first stamp is; the clock begins with it."""
        memory, date = self.memory, self._local_time(stamp)
        clock, passed = memory.clock, memory.time * self._get_step_seconds()
        if date is None:
            return passed
        if clock is None:
            clock = Clock(date - timedelta(seconds=passed), self._step_seconds)
            memory.start_clock(clock)
        return (date - clock.start).total_seconds()


def _mark(place: Place, ranking: Ranking, looks: Sequence[BuiltLook]) -> Place:
    """Return a place of a ranking that says whether a look shows there what was asked for."""
    seen = place.evidence.seen
    if seen is None or not seen.is_there:
        return place
    asked = {read_name(name) for name in ranking.resolution.matches}
    if not any(
        look.furniture == place.furniture and read_name(thing.description) in asked
        for look in looks
        for thing in look.seen
    ):
        return place
    return replace(place, evidence=replace(place.evidence, is_in_view=True))
