"""What a ray can hit: many upright boxes as arrays."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sgm.layout.box import Box


class Solids(NamedTuple):
    """B upright boxes of matter, as compiled functions read them.

    Attributes:
        center: x, y, z of the middles, (B, 3).
        half: half of length, width and height, (B, 3).
        turn: cosine and sine of the yaw, (B, 2).
        owner: which thing each belongs to, int32 (B,).
    """

    center: np.ndarray
    half: np.ndarray
    turn: np.ndarray
    owner: np.ndarray

    @classmethod
    def of_boxes(cls, boxes: Sequence[Box], owner: int) -> Solids:
        """Return the boxes of one owner."""
        rows = [[*box.center, *box.size, math.cos(box.yaw), math.sin(box.yaw)] for box in boxes]
        numbers = np.array(rows, dtype=float).reshape(-1, 8)
        return cls(
            np.ascontiguousarray(numbers[:, :3]),
            np.ascontiguousarray(numbers[:, 3:6] / 2),
            np.ascontiguousarray(numbers[:, 6:]),
            np.full(len(rows), owner, dtype=np.int32),
        )

    @classmethod
    def join(cls, parts: Sequence[Solids]) -> Solids:
        """Return all boxes of some."""
        return cls(*map(np.concatenate, zip(*parts, strict=True)))

    def select_between(self, position: np.ndarray, points: np.ndarray) -> Solids:
        """Return the boxes that may lie between a position (3,) and any of the points (n, 3)."""
        middle = (points.min(axis=0) + points.max(axis=0)) / 2
        reach = np.linalg.norm(points - middle, axis=1).max()
        along, offset = middle - position, self.center - position
        share = np.clip(offset @ along / max(float(along @ along), 1e-12), 0, 1)
        away = np.linalg.norm(offset - share[:, None] * along, axis=1)
        rows = np.flatnonzero(away <= reach + np.linalg.norm(self.half, axis=1))
        return Solids(*(column[rows] for column in self))


def list_parts(box: Box, shape: str, is_open: bool = False) -> list[Box]:
    """Return the boxes of matter that furniture consists of.

    Args:
        box: around all of it.
        shape: one of `SHAPES`.
        is_open: whether its door is open; it then stands where no ray goes.
    """
    length, width, height = box.size
    board = min(0.02, height / 4)
    if shape == "solid":
        return [box]
    if shape == "table":
        top = _cut(box, (0, 0, height / 2 - 0.02), (length, width, 0.04))
        at_x, at_y = length / 2 - 0.03, width / 2 - 0.03
        legs = [
            _cut(box, (x, y, -0.02), (0.05, 0.05, height - 0.04))
            for x in (-at_x, at_x)
            for y in (-at_y, at_y)
        ]
        return [top, *legs]
    half = height / 2 - board / 2
    bottom = _cut(box, (0, 0, -half), (length, width, board))
    back = _cut(box, (-length / 2 + board / 2, 0, 0), (board, width, height))
    left = _cut(box, (0, width / 2 - board / 2, 0), (length, board, height))
    right = _cut(box, (0, -width / 2 + board / 2, 0), (length, board, height))
    front = _cut(box, (length / 2 - board / 2, 0, 0), (board, width, height))
    walls = [bottom, back, left, right]
    if shape == "basin":
        return [*walls, front]
    top = _cut(box, (0, 0, half), (length, width, board))
    boards = [
        _cut(box, (-0.02, 0, z - board / 2), (length - 0.06, width - 2 * board, board))
        for z in list_levels(height)[1:]
    ]
    doors = [front] if shape == "doors" and not is_open else []
    return [*walls, top, *boards, *doors]


def list_levels(height: float) -> list[float]:
    """Return where things stand in furniture with boards, from its middle; the lowest first."""
    board = 0.02
    num = max(round((height - 2 * board) / 0.38), 1)
    space = (height - 2 * board) / num
    return [-height / 2 + board + row * space for row in range(num)]


def _cut(box: Box, offset: tuple[float, float, float], size: tuple[float, float, float]) -> Box:
    """Return a part of a box, by its middle and sides in the box's own axes."""
    center = box.to_map(np.array(offset, dtype=float))
    return Box(tuple(center.tolist()), size, box.yaw)
