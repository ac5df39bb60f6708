"""Turns about the vertical: between the own axes of what stands upright and those of the map."""

from __future__ import annotations

import math
from typing import TypeVar

import numpy as np

Number = TypeVar("Number", float, np.ndarray)


def make_turn(yaw: float | np.ndarray) -> np.ndarray:
    """Return the matrix that turns own x, y into the map, (..., 2, 2), of yaws (...).

    `own @ turn.T` is in the map, and `flat @ turn` in the own axes.
    """
    if isinstance(yaw, np.ndarray):
        cos, sin = np.cos(yaw), np.sin(yaw)
        return np.moveaxis(np.array([[cos, -sin], [sin, cos]]), (0, 1), (-2, -1))
    x, y = math.cos(yaw), math.sin(yaw)
    return np.array([[x, -y], [y, x]])


def make_upright_turn(yaw: float | np.ndarray) -> np.ndarray:
    """Return the same of own x, y, z, (..., 3, 3)."""
    turn = np.zeros((*np.shape(yaw), 3, 3))
    turn[..., :2, :2], turn[..., 2, 2] = make_turn(yaw), 1.0
    return turn


def turn_flat(
    x: Number, y: Number, angle: float, shift: tuple[float, float]
) -> tuple[Number, Number]:
    """Return x, y turned around the origin, counter-clockwise in radians, and moved then."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x - sin * y + shift[0], sin * x + cos * y + shift[1]
