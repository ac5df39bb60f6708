"""What a detector says of one frame."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from sgm.arrays.read_numbers import read_numbers
from sgm.checks import check_shares
from sgm.messages import shorten
from sgm.names.words import read_words


@dataclass(frozen=True, slots=True)
class Detection:
    """One thing that a detector found in one frame; it has a box in pixels, a center, or both.

    Attributes:
        name: what it is, such as "large red mug".
        score: probability that it is there and called so.
        box: left, top, right, bottom in pixels of the image.
        center: of the thing in the map, metres; None where it is to be found by the depth image.
        size: of the thing in the map, metres along its axes, if known.
        track: the detector's number for this one thing over frames, if it has any.
        embedding: a vector of the detector, for the caller's use.
    """

    name: str
    score: float = 1.0
    box: tuple[float, float, float, float] | None = None
    center: tuple[float, float, float] | None = None
    size: tuple[float, float, float] | None = None
    track: int | str | None = None
    embedding: Sequence[float] | None = None

    def __post_init__(self) -> None:
        """Raise ValueError for a name, score or number that is none, or a thing of no place."""
        read_words("name of a detection", self.name)
        check_shares(**{f"score of {shorten(self.name)}": self.score})
        object.__setattr__(self, "score", float(self.score))
        for field, num in (("box", 4), ("center", 3), ("size", 3)):
            value = getattr(self, field)
            if value is not None:
                what = f"{field} of {shorten(self.name)}"
                object.__setattr__(self, field, tuple(read_numbers(what, value, (num,)).tolist()))
        if self.box is None and self.center is None:
            raise ValueError(
                f"detection must have a box or a center, got neither for {shorten(self.name)}. "
                "Give left, top, right, bottom in pixels, or x, y, z in the map."
            )
        if self.box is not None and (self.box[0] > self.box[2] or self.box[1] > self.box[3]):
            raise ValueError(
                "box of a detection must be left, top, right, bottom, got "
                f"{shorten(self.box)} for {shorten(self.name)}. Put the smaller numbers first."
            )
