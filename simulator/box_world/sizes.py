"""How large furniture and things are: two tables, by what they are called."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from sgm.names.words import read_words
from sgm.prior.household import read_table

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
    for row in read_table("simulator.box_world", "furniture_sizes.csv"):
        width, depth, height, bottom = (
            float(row[name]) for name in ("width", "depth", "height", "bottom")
        )
        for label in (row["label"], *filter(None, row["also"].split("|"))):
            sizes[label] = FurnitureSize(width, depth, height, bottom, row["shape"])
    return sizes


@lru_cache(maxsize=1)
def _load_things() -> dict[str, tuple[float, float, float]]:
    """Read `data/thing_sizes.csv`: round figures of usual things, written for this table."""
    return {
        words: (float(row["width"]), float(row["depth"]), float(row["height"]))
        for row in read_table("simulator.box_world", "thing_sizes.csv")
        for words in row["words"].split("|")
    }
