"""A memory that looks at a stream of messages, and what a robot asks it; needs no ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from sgm.checks import check_at_least
from sgm.eyes.built_look import BuiltLook
from sgm.eyes.furniture_labels import FurnitureLabels
from sgm.eyes.furniture_mapper import FurnitureMapper
from sgm.eyes.look_builder import LookBuilder
from sgm.finder.finder import Finder
from sgm.finder.ranking import Ranking, tell_point
from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.ros.camera_feed import CameraFeed
from sgm.ros.graph_furniture import GraphFurniture

_MOST_SHOWN = 20  # places of a belief that are drawn


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
    """Folds looks into a memory as they are made, lets time pass with them, and answers.

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
        **feed: Any,
    ) -> None:
        """Begin with a memory whose furniture has boxes, or without a map.

        Args:
            memory: with rooms and furniture (`HomeMap.add_to`), new or loaded.
            finder: who is asked.
            step_seconds: length of a time step of the memory.
            discover: draws the map of this memory; None where its furniture is known.
            graph: takes furniture of this memory from scene graphs (`take_graph`); None for none.
            ignore: as in `LookBuilder`.
            labels: as in `LookBuilder`.
            on_look: is given every look after it was folded in.
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
        self._step_seconds = step_seconds
        self._began: float | None = None  # seconds of the messages at time step `_first`
        self._first = memory.time
        self.builder = LookBuilder(
            memory.layout.furniture,
            discover=discover,
            ignore=ignore,
            labels=labels,
            on_look=self._tell,
        )
        self.feed = CameraFeed(self.builder, **feed)

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
        """Rank the places where a thing may be."""
        return self._finder.rank(self.memory, description, k=k)

    def find_next(self, description: str, start: tuple[float, float] | None = None) -> NextPose:
        """Return where to look next for a thing, from a position or from anywhere."""
        search = self._finder.search(self.memory, description, start=start)
        look = search.next()
        if look is None:
            return NextPose(-1, "", (0.0, 0.0), 0.0, 0.0, search.outcome)
        furniture = look.place.furniture
        target = look.place.position
        where = "" if target is None else f", at {tell_point(target)}"
        (x, y), yaw = self.find_stand(furniture, target)
        return NextPose(
            furniture,
            look.place.name,
            (x, y),
            yaw,
            look.place.probability,
            f"look at {look.place.name}, {look.place.probability:.0%}{where}",
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

    def _tell(self, look: BuiltLook) -> None:
        """Let time pass until a look, and fold it in."""
        if self._began is None:
            self._began = look.end
        step = self._first + int(max(look.end - self._began, 0.0) // self._step_seconds)
        if step > self.memory.time:
            self.memory.step(step - self.memory.time)
        look.tell(self.memory)
        self._on_look(look)
