"""How large furniture and things are, by what they are called, and the boxes of furniture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from sgm.files import read_table
from sgm.layout.box import Box
from sgm.names.words import read_words

SHAPES = ("solid", "table", "shelves", "basin", "doors")
USUAL_FURNITURE = "cabinet"  # whose size furniture has that no row names
USUAL_THING = (0.12, 0.10, 0.10)  # of a thing that no row names, metres


@dataclass(frozen=True, slots=True)
class FurnitureSize:
    """What furniture of a kind measures, in metres.

    Attributes:
        width: seen from the front, from left to right.
        depth: from the front to the back.
        height: of the furniture itself.
        bottom: of its lower side above the floor.
        shape: "solid" (a counter), "table" (a board on legs), "shelves" (open in front), "basin"
            (open above) or "doors" (shut in front until it is opened).
    """

    width: float
    depth: float
    height: float
    bottom: float
    shape: str

    @property
    def interior(self) -> str:
        """Which inside it has, as a `Box` says it: "none", "open" or "door"."""
        return {"shelves": "open", "basin": "open", "doors": "door"}.get(self.shape, "none")


def find_furniture_size(label: str) -> FurnitureSize:
    """Return the size of furniture by its label; `USUAL_FURNITURE` stands for unknown ones."""
    sizes = _load_furniture()
    return sizes.get(read_words("furniture label", label), sizes[USUAL_FURNITURE])


def find_thing_size(label: str) -> tuple[float, float, float]:
    """Return width, depth and height of a thing; the last word that a row names decides."""
    sizes = _load_things()
    words = read_words("object label", label)
    if words in sizes:
        return sizes[words]
    for word in reversed(words.split()):
        if word in sizes:
            return sizes[word]
    return USUAL_THING


@lru_cache(maxsize=1)
def _load_furniture() -> dict[str, FurnitureSize]:
    """Read `data/furniture_sizes.csv`: round figures of usual furniture, written for this table."""
    sizes: dict[str, FurnitureSize] = {}
    for furniture in read_table("simulator.box_world", "furniture_sizes.csv"):
        metres = {name: float(furniture[name]) for name in ("width", "depth", "height", "bottom")}
        size = FurnitureSize(**metres, shape=furniture["shape"])
        sizes |= dict.fromkeys(
            (furniture["label"], *filter(None, furniture["also"].split("|"))), size
        )
    return sizes


@lru_cache(maxsize=1)
def _load_things() -> dict[str, tuple[float, float, float]]:
    """Read `data/thing_sizes.csv`: round figures of usual things, written for this table."""
    return {
        words: (float(thing["width"]), float(thing["depth"]), float(thing["height"]))
        for thing in read_table("simulator.box_world", "thing_sizes.csv")
        for words in thing["words"].split("|")
    }


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
    return [-height / 2 + board + level * space for level in range(num)]


def _cut(box: Box, offset: tuple[float, float, float], size: tuple[float, float, float]) -> Box:
    """Return a part of a box, by its middle and sides in the box's own axes."""
    center = box.to_map(np.array(offset, dtype=float))
    return Box(tuple(center.tolist()), size, box.yaw)
