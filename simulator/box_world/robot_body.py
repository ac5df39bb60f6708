"""A robot that drives through a home of boxes and takes pictures on its way."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from sgm.camera.pinhole import Pose
from sgm.layout.box import Box
from sgm.layout.turns import make_upright_turn
from simulator.box_world.depth_camera import (
    BoxDetector,
    DepthCamera,
    Detected,
    DetectedFurniture,
    Shot,
)
from simulator.box_world.routes import FloorRoutes
from simulator.box_world.world import BoxWorld

_DRIFT_SECONDS = 10.0  # for how long an error of the localisation lasts
_SIDE_STEP = 0.2  # metres between pictures on the way to the side
_TILT = -0.15  # metres by which the camera looks down for every metre ahead, on the way


@dataclass(frozen=True, slots=True)
class BodyRules:
    """How a robot moves and how well it knows where it is.

    Attributes:
        camera_height: metres above the floor.
        speed: metres a second.
        turn_speed: of the head and the body, radians a second.
        frame_seconds: between pictures where the head stands still.
        frames_per_aim: pictures in each direction of a look.
        sidestep: metres to the left and right from where it looks once more, where it can stand
            there: things hide behind others; 0 for none.
        metres_per_frame: between pictures on the way; 0 for none.
        position_sd: standard deviation of the known position, metres, in x and y.
        angle_sd: standard deviation of the known yaw, radians.
        camera: what it measures.
        detector: what is recognised in the pictures.
        reach: nearest and farthest distance at which what was recognised counts, metres.
        names_furniture: whether furniture is recognised, too, as a robot without a map needs it.
    """

    camera_height: float = 1.4
    speed: float = 0.4
    turn_speed: float = 0.8
    frame_seconds: float = 0.1
    frames_per_aim: int = 3
    sidestep: float = 0.4
    metres_per_frame: float = 0.5
    position_sd: float = 0.0
    angle_sd: float = 0.0
    camera: DepthCamera = field(default_factory=DepthCamera)
    detector: BoxDetector = field(default_factory=BoxDetector)
    reach: tuple[float, float] = (0.2, 4.0)
    names_furniture: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RobotFrame:
    """One picture.

    Attributes:
        time: seconds.
        pose: of the camera, as the robot knows it.
        true_pose: as it is.
        shot: the picture.
        detected: what was recognised in it.
        furniture: which furniture was; none unless the robot names it.
    """

    time: float
    pose: Pose
    true_pose: Pose
    shot: Shot
    detected: list[Detected]
    furniture: list[DetectedFurniture]


class RobotBody:
    """Drives, turns its head, opens doors and takes pictures.

    Its random numbers come from a stream of the home of its own ("box robot"): what it does changes
    nothing in the home but doors.

    Attributes:
        world: where it is.
        routes: its ways.
        rules: what it can do.
        position: x, y.
        time: seconds since the start.
    """

    def __init__(self, world: BoxWorld, rules: BodyRules | None = None) -> None:
        """Stand in the corridor, before the door of the first room."""
        self.world = world
        self.rules = BodyRules() if rules is None else rules
        self.routes = FloorRoutes(world.floor)
        self.position = (world.floor.rooms[0].door[0], 0.0)
        self.time = 0.0
        self._rng = world.homes.streams.generator("box robot", 0)
        self._forward = np.array([1.0, 0.0, 0.0])
        self._error = self._rng.normal(0.0, 1.0, 3)  # of x, y, yaw, in standard deviations
        self._guessed = 0.0  # time of that error

    def go_to(self, furniture: int) -> None:
        """Drive to before furniture and take no pictures."""
        for end in self.routes.find_path(self.position, furniture)[1:]:
            self._move(end)

    def drive(self, goal: int | tuple[float, float]) -> Iterator[RobotFrame]:
        """Drive to before furniture, or to a position; yields the pictures on the way."""
        path = self.routes.find_path(self.position, goal)
        left = self.rules.metres_per_frame
        for end in path[1:]:
            start = np.array(self.position)
            length = float(np.linalg.norm(end - start))
            if length < 1e-9:
                continue
            ahead = (end - start) / length
            done = 0.0
            while self.rules.metres_per_frame and done + left < length:
                done += left
                left = self.rules.metres_per_frame
                self._move(start + done * ahead)
                yield self._take(np.array([*ahead, _TILT]))
            left -= length - done
            self._move(end)

    def look(self, furniture: int) -> Iterator[RobotFrame]:
        """Look at all of the furniture before which the robot stands; yields the pictures.

        A door is open meanwhile.
        """
        yield from self.look_at_box(self.world.floor.furniture[furniture])

    def find_door(self, box: Box) -> int | None:
        """Return the furniture with a door that stands where a box is; None for none.

        That is what a robot finds out that tries to open it.
        """
        best, nearest = None, math.inf
        for number, piece in enumerate(self.world.floor.furniture):
            away = math.dist(piece.center, box.center)
            flat = math.dist(piece.center[:2], box.center[:2])
            if piece.has_door and flat < max(min(piece.size[:2]) / 2, 0.25) and away < nearest:
                best, nearest = number, away
        return best

    def look_at_box(self, box: Box) -> Iterator[RobotFrame]:
        """Look at all that is where a box is; yields the pictures. A door is open meanwhile."""
        door = self.find_door(box)
        if door is not None:
            self.world.open_doors.add(door)
        middle = np.array(box.center)
        for stand in self._list_stands(box):
            start = np.array(self.position)
            num = math.ceil(float(np.linalg.norm(stand - start)) / _SIDE_STEP)
            for part in range(1, num + 1):
                self._move(start + (stand - start) * part / num)
                yield self._take(middle - (*self.position, self.rules.camera_height))
            eye = np.array([*self.position, self.rules.camera_height])
            for target in self._list_aims(box):
                for _ in range(self.rules.frames_per_aim):
                    yield self._take(target - eye)
                    self.time += self.rules.frame_seconds
        if door is not None:
            self.world.open_doors.discard(door)

    def _list_aims(self, box: Box) -> list[np.ndarray]:
        """Return the points at which the robot looks to see all of a piece of furniture."""
        _, width, height = box.size
        sides = [0.0] if width <= 0.7 else [-width / 4, width / 4]
        levels = [height / 2 + 0.1]
        if box.interior != "none":
            num = max(math.ceil(height / 0.8), 1)
            levels += [height / 2 - (board + 0.5) * height / num for board in range(num)]
        return [box.to_map(np.array([0.0, side, level])) for level in levels for side in sides]

    def _list_stands(self, box: Box) -> list[np.ndarray]:
        """Return where the robot looks from: before the front, then left and right of there."""
        aside = box.to_map(np.array([0.0, self.rules.sidestep, 0.0]))[:2] - box.center[:2]
        stand = np.array(self.position)
        ways = [stand + sign * aside for sign in (-1, 1)] if self.rules.sidestep else []
        return [stand, *(to for to in ways if self.routes.is_free_between(stand, to))]

    def _move(self, to: np.ndarray) -> None:
        self.time += float(np.linalg.norm(to - self.position)) / self.rules.speed
        self.position = (float(to[0]), float(to[1]))

    def _take(self, forward: np.ndarray) -> RobotFrame:
        """Turn the head into a direction and take a picture."""
        forward = forward / np.linalg.norm(forward)
        angle = math.acos(min(max(float(forward @ self._forward), -1.0), 1.0))
        self.time += angle / self.rules.turn_speed + 1e-3
        self._forward = forward
        eye = np.array([*self.position, self.rules.camera_height])
        true_pose = Pose.look_at(eye.tolist(), (eye + forward).tolist())
        shot = self.rules.camera.shoot(
            self.world.solids, self.world.homes.num_slots, true_pose, rng=self._rng
        )
        detected = self.rules.detector.detect(self.world, shot, rng=self._rng)
        furniture = []
        if self.rules.names_furniture:
            furniture = self.rules.detector.detect_furniture(self.world, shot, rng=self._rng)
        guessed = self._guess_pose(true_pose)
        return RobotFrame(self.time, guessed, true_pose, shot, detected, furniture)

    def _guess_pose(self, pose: Pose) -> Pose:
        """Return where the robot takes its camera to be; errors last for `_DRIFT_SECONDS`."""
        rules = self.rules
        kept = math.exp(-(self.time - self._guessed) / _DRIFT_SECONDS)
        self._guessed = self.time
        fresh = self._rng.normal(0.0, 1.0, 3)
        self._error = kept * self._error + math.sqrt(1 - kept**2) * fresh
        dx, dy = self._error[:2] * rules.position_sd
        turn = float(self._error[2]) * rules.angle_sd
        about_z = make_upright_turn(turn)
        return Pose(
            about_z @ pose.rotation,
            pose.position + np.array([dx, dy, 0.0]),
            rules.position_sd,
            rules.angle_sd,
        )
