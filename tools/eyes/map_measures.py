"""What the map of a robot without a map is right about, after it was led around twice."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from sgm.eyes.furniture_labels import FurnitureLabels
from sgm.finder.finder import Finder
from sgm.layout.box import Box
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.words import read_name
from sgm.policies.adaptive import Adaptive
from simulator.box_world.robot_body import BodyRules, RobotBody
from simulator.box_world.world import BoxWorld
from simulator.robot_home.robots import MappingRobot

_ROUNDS = 2
_LEAST_PIXELS = 100  # of furniture in one picture that a camera can see
_LEAST_OVERLAP = 0.1  # of footprints, for what is drawn to be that furniture
_STEPS = (np.arange(40) + 0.5) / 40 - 0.5


def measure_map(world: BoxWorld, body: BodyRules) -> dict[str, Any]:
    """Let a robot draw the map of a home, and compare it with the truth.

    Furniture and what is drawn are assigned to each other by the overlap of their footprints. What
    a camera can see are pieces of furniture of which a picture showed 100 pixels; floors and walls
    are none.

    Returns:
        How many pieces are visible, and how many of them are on the map. The overlap of each of
        these (intersection over union). How many have the right label. How many are drawn, and how
        many of those are nowhere in the home. How far each thing is from where the memory has it
        (`measure_positions`), after the last round.
    """
    robot = _WatchingRobot(
        RobotBody(world, body), SceneGraphMemory(world.homes.prior), Finder(Adaptive()), 1
    )
    away: list[float] = []
    for _ in range(_ROUNDS):
        for furniture in range(world.num_furniture):
            robot.patrol(furniture)
        away = measure_positions(robot.memory, world)
        world.evolve()
        robot.memory.step()
    labels = FurnitureLabels()
    names = world.homes.furniture_labels[0, : world.num_furniture].tolist()
    visible = [n for n in sorted(robot.seen) if labels.find_label(names[n]) is not None]
    drawn = [
        row
        for number, row in robot.memory.layout.furniture.items()
        if robot.mapper.is_found(number) and row.box is not None
    ]
    overlap = np.array(
        [
            [compute_overlap(world.floor.furniture[n], row.box) for row in drawn if row.box]
            for n in visible
        ]
    ).reshape(len(visible), len(drawn))
    pairs = [
        (row, column)
        for row, column in zip(*linear_sum_assignment(-overlap), strict=True)
        if overlap[row, column] > _LEAST_OVERLAP
    ]
    return {
        "num_visible": len(visible),
        "num_on_map": len(pairs),
        "overlaps": [float(overlap[pair]) for pair in pairs],
        "num_labelled": sum(
            labels.are_same(names[visible[row]], drawn[column].label) for row, column in pairs
        ),
        "num_drawn": len(drawn),
        "num_nowhere": len(drawn) - len(pairs),
        "positions": away,
    }


def measure_positions(memory: SceneGraphMemory, world: BoxWorld) -> list[float]:
    """Return how far things are from where a memory has seen them in this time step, metres.

    Those that the last look at their place found, each from the nearest thing of its name; a name
    that no thing of the home has is left out.
    """
    true: dict[tuple[str, ...], list[np.ndarray]] = {}
    for slot in np.flatnonzero(world.things.place >= 0).tolist():
        name = read_name(world.describe_thing(slot))
        true.setdefault(name, []).append(world.things.center[slot])
    return [
        min(float(np.linalg.norm(at - seen.position)) for at in true[read_name(name)])
        for name in memory.descriptions
        for seen in memory.places_of(name)
        if seen.position is not None and seen.steps_ago == 0 and read_name(name) in true
    ]


def compute_overlap(box: Box, other: Box) -> float:
    """Return the intersection of two footprints over their union; 0 where one is above the other.

    By 1,600 points of the first.
    """
    if min(box.top, other.top) <= max(box.bottom, other.bottom):
        return 0.0
    flat = np.stack(np.meshgrid(_STEPS, _STEPS), axis=-1).reshape(-1, 2) * box.size[:2]
    points = box.to_map(np.column_stack([flat, np.zeros(len(flat))]))
    points[:, 2] = other.center[2]
    area, other_area = (one.size[0] * one.size[1] for one in (box, other))
    both = float(other.contains(points).mean()) * area
    return both / (area + other_area - both)


class _WatchingRobot(MappingRobot):
    """Notes which furniture its pictures truly showed."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.seen: set[int] = set()

    def _watch(self, frames: Any) -> None:
        super()._watch(map(self._note, frames))

    def _note(self, frame: Any) -> Any:
        first = self.world.homes.num_slots
        owner = frame.shot.owner[np.isfinite(frame.shot.true_depth)] - first
        own = owner[(owner >= 0) & (owner < self.world.num_furniture)]
        counts = np.bincount(own, minlength=self.world.num_furniture)
        self.seen |= set(np.flatnonzero(counts >= _LEAST_PIXELS).tolist())
        return frame
