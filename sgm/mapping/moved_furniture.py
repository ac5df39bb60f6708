"""Furniture that was drawn by a mapper, and moved by others since: by people, or with the map."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, MutableMapping

import numpy as np

from sgm.layout.box import Box
from sgm.layout.turns import make_upright_turn
from sgm.mapping.landmark import Landmark

_SAME = 1e-6  # metres and radians


def follow_boxes(
    found: Mapping[int, Landmark],
    landmarks: Iterable[Landmark],
    drawn: MutableMapping[int, Box],
    boxes: Mapping[int, Box],
) -> list[int]:
    """Move what was seen of furniture along with it.

    Where all furniture was moved alike, as with the map, what is not believed yet is moved, too.

    Args:
        found: what was seen of each piece of furniture, by id.
        landmarks: that, and what is not believed yet.
        drawn: the box of each as it was drawn last; the new ones are put in.
        boxes: as they are in the memory now.

    Returns:
        The ids of furniture that has another size: it was drawn by others.
    """
    motions = []
    resized = []
    for number, old in list(drawn.items()):
        new = boxes.get(number)
        if new is None or number not in found:
            del drawn[number]
        elif new.size != old.size:
            del drawn[number]
            resized.append(number)
        elif (new.center, new.yaw) != (old.center, old.yaw):
            motions.append(_find_motion(old, new))
            drawn[number] = new
            found[number].move(*motions[-1])
    if motions and len(motions) == len(drawn) and all(map(_are_same, motions, motions[1:])):
        for landmark in landmarks:
            if landmark.furniture is None:
                landmark.move(*motions[0])
    return resized


def _find_motion(box: Box, other: Box) -> tuple[np.ndarray, np.ndarray]:
    """Return the rotation (3, 3) around the origin, and the shift (3,), from a box to another."""
    turn = make_upright_turn(other.yaw - box.yaw)
    return turn, np.array(other.center) - turn @ box.center


def _are_same(motion: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> bool:
    return all(bool(np.abs(a - b).max() < _SAME) for a, b in zip(motion, other, strict=True))
