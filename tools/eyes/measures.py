"""What robots' eyes are right about, held against the truth of homes of boxes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from sgm.camera.detection import Detection
from sgm.eyes.built_look import BuiltLook
from sgm.eyes.look_builder import LookBuilder
from sgm.eyes.look_rules import Gate
from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.words import read_name
from sgm.schema import RELATIONS, PlaceCode
from simulator.box_world.robot_body import BodyRules, RobotBody, RobotFrame
from simulator.box_world.robots import make_memory
from simulator.box_world.true_view import TrueView
from simulator.box_world.world import BoxWorld

_WHOLE_SPOT = 0.9  # share of the points of a spot of which all of it was in view


@dataclass(slots=True)
class EyesScores:
    """Sums over the frames and looks of one home.

    Attributes:
        coverage_errors: of every volume of every look, what the look says minus what was true.
        num_detections: that count.
        num_right: of them, those at their furniture and relation.
        num_unassigned: of them, those at no known place.
        num_frames: pictures.
        num_hidden: things that were remembered at a place, are still there, and were truly out of
            view in all frames of a look at it.
        num_false_absences: of them, those that the memory took for absent.
        num_gone: things that were remembered at a place when a look at it was made, and have left.
        num_absences: of them, those that the memory took for absent.
        num_gone_in_view: of them, those whose spot was truly in view: 9 of 10 points of where the
            thing lay when it was seen last, in any of the frames.
        num_absences_in_view: of these, those that the memory took for absent.
        num_visits: to furniture.
        num_looks: looks at it that they made.
    """

    coverage_errors: list[float] = field(default_factory=list)
    num_detections: int = 0
    num_right: int = 0
    num_unassigned: int = 0
    num_frames: int = 0
    num_hidden: int = 0
    num_false_absences: int = 0
    num_gone: int = 0
    num_absences: int = 0
    num_gone_in_view: int = 0
    num_absences_in_view: int = 0
    num_visits: int = 0
    num_looks: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return all values by name."""
        return asdict(self)


class EyesExam:
    """Lets a robot look at all furniture of a home again and again, and compares with the truth.

    Attributes:
        scores: sums so far.
        measures_coverage: whether to compute how much was truly in view of every look.
    """

    def __init__(self, world: BoxWorld, body: BodyRules, *, measures_coverage: bool) -> None:
        """Begin with an empty memory.

        Args:
            world: the home.
            body: of the robot.
            measures_coverage: whether to compute how much was truly in view of every look.
        """
        self.scores = EyesScores()
        self._world = world
        self._body = RobotBody(world, body)
        self._memory: SceneGraphMemory = make_memory(world)
        self._places: dict[int, tuple[int | None, str | None]] = {}  # by id of the detection
        self._builder = LookBuilder(
            dict(enumerate(world.floor.furniture)),
            gate=Gate(nearest=body.reach[0], farthest=body.reach[1]),
            on_detection=self._note_detection,
        )
        camera = body.camera
        self._view = TrueView(world, camera, body.reach)
        self.measures_coverage = measures_coverage
        # Where things lay when they were seen last: middle, half sides, yaw.
        self._spots: dict[tuple[int, str], tuple[np.ndarray, np.ndarray, float]] = {}
        self._shown = np.zeros(world.homes.num_slots, dtype=bool)  # things, since the last look

    def visit_all(self) -> None:
        """Look at all furniture once, in turn."""
        for furniture in range(self._world.num_furniture):
            self._begin()
            for frame in self._body.drive(furniture):
                self._show(frame)
            self._judge(list(self._builder.finish()))
            has_door = self._world.floor.furniture[furniture].has_door
            if has_door:
                self._builder.set_open(furniture)
            self._begin()
            for frame in self._body.look(furniture):
                self._show(frame)
            looks = list(self._builder.finish())
            self._judge(looks)
            self.scores.num_visits += 1
            self.scores.num_looks += sum(look.furniture == furniture for look in looks)
            if has_door:
                self._builder.set_open(furniture, is_open=False)

    def evolve(self) -> None:
        """Let a time step pass in the home."""
        self._world.evolve()
        self._memory.step()

    def _begin(self) -> None:
        self._shown[:] = False
        self._view.clear()

    def _show(self, frame: RobotFrame) -> None:
        self._places.clear()
        is_used = self._builder.frame(
            frame.time,
            frame.pose,
            self._body.rules.camera.intrinsics,
            [found.detection for found in frame.detected],
            frame.shot.depth,
        )
        scores = self.scores
        scores.num_frames += 1
        for found in frame.detected:
            if id(found.detection) not in self._places:
                continue
            furniture, relation = self._places[id(found.detection)]
            place = int(self._world.things.place[found.slot])
            scores.num_detections += 1
            scores.num_unassigned += furniture is None
            scores.num_right += (furniture, relation) == (
                PlaceCode.furniture(place),
                RELATIONS[PlaceCode.relation(place)],
            )
            if furniture == PlaceCode.furniture(place) and found.is_named:
                self._spots[furniture, found.detection.name] = self._world.things.get_box(
                    found.slot
                )
        num_slots = self._world.homes.num_slots
        owner = frame.shot.owner
        self._shown[np.unique(owner[(owner >= 0) & (owner < num_slots)])] = True
        if is_used:
            self._view.add(frame.time, frame.true_pose)

    def _note_detection(
        self, detection: Detection, furniture: int | None, relation: str | None
    ) -> None:
        self._places[id(detection)] = furniture, relation

    def _judge(self, looks: Sequence[BuiltLook]) -> None:
        """Compare looks with what was true, and tell the memory of them."""
        for look in looks:
            for relation in RELATIONS:
                if self.measures_coverage and (look.furniture, relation) in self._view.points:
                    true = self._view.compute_coverage(
                        look.furniture, relation, look.start, look.end
                    )
                    self.scores.coverage_errors.append(look.coverage[relation] - true)
            before = self._list_remembered(look.furniture)
            look.tell(self._memory)
            self._count_absences(look, before)

    def _list_remembered(self, furniture: int) -> set[tuple[str, ...]]:
        """Return the names of what the memory has at a piece of furniture."""
        batch, names = self._memory.batch, self._memory.descriptions
        is_there = (batch.edges["furniture"] == furniture) & batch.edges["is_true"]
        rows = batch.edges["object"][is_there & (batch.edges["num_true"] > 0)]
        rows = rows[batch.objects["same_as"][rows] < 0]  # the others stand under another name
        return {read_name(names[thing]) for thing in rows.tolist()}

    def _count_absences(self, look: BuiltLook, before: set[tuple[str, ...]]) -> None:
        """Count what the memory took for absent, of what was hidden and of what has left."""
        slots_of: dict[tuple[str, ...], list[int]] = {}
        for slot, _ in self._world.list_there(look.furniture):
            slots_of.setdefault(read_name(self._world.describe_thing(slot)), []).append(slot)
        after = self._list_remembered(look.furniture)
        for name in before:
            slots = slots_of.get(name)
            if slots is None:
                self.scores.num_gone += 1
                self.scores.num_absences += name not in after
                if self._was_in_view(look, name):
                    self.scores.num_gone_in_view += 1
                    self.scores.num_absences_in_view += name not in after
            elif not self._shown[slots].any():
                self.scores.num_hidden += 1
                self.scores.num_false_absences += name not in after

    def _was_in_view(self, look: BuiltLook, name: tuple[str, ...]) -> bool:
        """Tell whether frames of a look truly showed all of where a thing lay."""
        for (furniture, description), (center, half, yaw) in self._spots.items():
            if furniture == look.furniture and read_name(description) == name:
                grid = np.stack(np.meshgrid(*[(-0.6, 0.0, 0.6)] * 3), axis=-1).reshape(-1, 3)
                box = Box(tuple(center), tuple(2 * half), yaw)
                counts = self._view.count_frames(box.to_map(grid * half), look.start, look.end)
                return float((counts > 0).mean()) >= _WHOLE_SPOT
        return False  # a name that was wrong
