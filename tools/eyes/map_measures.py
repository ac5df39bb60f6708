"""What the map of a robot without a map is right about, after it was led around twice."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.layout.footprints import compute_shared_area, get_area
from sgm.mapping.furniture_labels import FurnitureLabels
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.seen_places import SeenRows
from sgm.names.words import read_name
from sgm.policies.adaptive import Adaptive
from simulator.box_world.robot_body import BodyRules, RobotBody
from simulator.box_world.robots import MappingRobot
from simulator.box_world.world import BoxWorld

_ROUNDS = 2
_LEAST_PIXELS = 100  # of furniture in one picture that a camera can see
_LEAST_OVERLAP = 0.1  # of footprints, for what is drawn to be that furniture


def measure_map(world: BoxWorld, body: BodyRules) -> dict[str, Any]:
    """Let a robot draw the map of a home, and compare it with the truth.

    Furniture and what is drawn are assigned to each other by the overlap of their footprints. What
    a camera can see are pieces of furniture of which a picture showed 100 pixels; floors and walls
    are none.

    Returns:
        How many pieces are visible, and how many of them are on the map. The overlap of each of
        these (intersection over union). How many have the right label. How many are drawn, and how
        many of those are nowhere in the home. How far each thing is from where the memory has it,
        and how many have the name of another one (`measure_positions`), after the last round.
    """
    robot = _WatchingRobot(
        RobotBody(world, body), SceneGraphMemory(world.homes.prior), Finder(Adaptive()), 1
    )
    errors, num_misnamed = list[float](), 0
    for _ in range(_ROUNDS):
        robot.called.clear()
        for furniture in range(world.num_furniture):
            robot.patrol(furniture)
        errors, num_misnamed = measure_positions(robot.memory, world, robot.called)
        world.evolve()
        robot.memory.step()
    labels = FurnitureLabels()
    names = world.homes.furniture_labels[0, : world.num_furniture].tolist()
    visible = [n for n in sorted(robot.seen) if labels.find_label(names[n]) is not None]
    drawn = [
        piece
        for number, piece in robot.memory.layout.furniture.items()
        if robot.mapper.is_found(number) and piece.box is not None
    ]
    overlap = np.array(
        [
            [compute_overlap(world.floor.furniture[n], piece.box) for piece in drawn if piece.box]
            for n in visible
        ]
    ).reshape(len(visible), len(drawn))
    pairs = [
        (real, sketched)
        for real, sketched in zip(*linear_sum_assignment(-overlap), strict=True)
        if overlap[real, sketched] > _LEAST_OVERLAP
    ]
    return {
        "num_visible": len(visible),
        "num_on_map": len(pairs),
        "overlaps": [float(overlap[pair]) for pair in pairs],
        "num_labelled": sum(
            labels.are_same(names[visible[real]], drawn[sketched].label) for real, sketched in pairs
        ),
        "num_drawn": len(drawn),
        "num_nowhere": len(drawn) - len(pairs),
        "positions": errors,
        "num_misnamed": num_misnamed,
    }


def measure_positions(
    memory: SceneGraphMemory, world: BoxWorld, called: Mapping[tuple[str, ...], set[int]]
) -> tuple[list[float], int]:
    """Return how far things are from where a memory has seen them in this time step, metres.

    A position of a name is that of the nearest thing that the detector called so in this step.

    Args:
        memory: that has all looks.
        world: the truth.
        called: the things, by slot, that the detector has called by each name in this step, rightly
            or not.

    Returns:
        The errors of those that the last look at their place found. How many more there are whose
        name is that of another thing.
    """
    centers, names = world.things.center, memory.descriptions
    rows = SeenRows.of_things(memory.batch)
    errors, num_misnamed = list[float](), 0
    for thing, seen in zip(
        rows.thing.tolist(), rows.tell(memory.batch, memory.furniture_ids), strict=True
    ):
        if seen.position is None or seen.steps_ago > 0:
            continue
        name = read_name(names[thing])
        slots = sorted(called[name])
        away = np.linalg.norm(centers[slots] - seen.position, axis=1)
        nearest = int(away.argmin())
        if read_name(world.describe_thing(slots[nearest])) == name:
            errors.append(float(away[nearest]))
        else:
            num_misnamed += 1
    return errors, num_misnamed


def compute_overlap(box: Box, other: Box) -> float:
    """Return the intersection of two footprints over their union; 0 where one is above the other.

    By 1,600 points of the first.
    """
    if min(box.top, other.top) <= max(box.bottom, other.bottom):
        return 0.0
    both = compute_shared_area(box, other, num_points=40)
    return both / (get_area(box) + get_area(other) - both)


class _WatchingRobot(MappingRobot):
    """Notes which furniture its pictures truly showed, and which things were called what."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.seen: set[int] = set()
        self.called: dict[tuple[str, ...], set[int]] = {}  # slots of things, by name

    def _watch(self, frames: Any) -> None:
        super()._watch(map(self._note, frames))

    def _note(self, frame: Any) -> Any:
        first = self.world.homes.num_slots
        owner = frame.shot.owner[np.isfinite(frame.shot.true_depth)] - first
        pieces = owner[(owner >= 0) & (owner < self.world.num_furniture)]
        counts = np.bincount(pieces, minlength=self.world.num_furniture)
        self.seen |= set(np.flatnonzero(counts >= _LEAST_PIXELS).tolist())
        for found in frame.detected:
            self.called.setdefault(read_name(found.detection.name), set()).add(found.slot)
        return frame
