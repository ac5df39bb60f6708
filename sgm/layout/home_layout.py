"""Rooms and furniture of one home, by ids that never change."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sgm.messages import shorten
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.place_prior import PlacePrior
from sgm.prior.prior_graph import PriorGraph


@dataclass(frozen=True, slots=True)
class Furniture:
    """A furniture node.

    Attributes:
        label: what it is, such as "fridge".
        room: id of its room.
        description: for people, such as "white fridge".
        position: where one stands to look at it, in metres; None if nobody knows.
    """

    label: str
    room: int
    description: str
    position: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class LayoutArrays:
    """A layout as a `MemoryBatch` of one home takes it.

    Attributes:
        room_label: (1, R). furniture_label, furniture_room: (1, F).
        place_prior: the prior for this layout.
    """

    room_label: np.ndarray
    furniture_label: np.ndarray
    furniture_room: np.ndarray
    place_prior: PlacePrior


@dataclass(slots=True)
class HomeLayout:
    """Rooms and furniture; no id is given twice.

    Attributes:
        rooms: label by id.
        furniture: furniture by id.
        num_rooms_ever, num_furniture_ever: ids given so far.
    """

    rooms: dict[int, str] = field(default_factory=dict)
    furniture: dict[int, Furniture] = field(default_factory=dict)
    num_rooms_ever: int = 0
    num_furniture_ever: int = 0

    def add_room(self, label: str) -> int:
        """Add a room, whose label was checked, and return its id."""
        self.rooms[self.num_rooms_ever] = label
        self.num_rooms_ever += 1
        return self.num_rooms_ever - 1

    def add_furniture(self, node: Furniture) -> int:
        """Add what `make_furniture` made, and return its id."""
        self.furniture[self.num_furniture_ever] = node
        self.num_furniture_ever += 1
        return self.num_furniture_ever - 1

    def copy(self) -> HomeLayout:
        """Return the same layout, which can be changed alone."""
        return replace(self, rooms=dict(self.rooms), furniture=dict(self.furniture))

    def make_furniture(
        self,
        label: str,
        room: int,
        description: str | None,
        position: tuple[float, float] | None = None,
    ) -> Furniture:
        """Check what a furniture node is to be, and change nothing.

        Raises:
            KeyError: if there is no such room.
            ValueError: if the label or the description is no name (`read_words`), or the position
                no two numbers.
        """
        read_words("furniture label", label)
        description = label if description is None else description
        read_words("furniture description", description)
        self.check_room(room)
        return Furniture(label, int(room), description, read_position(position))

    def make_moved(
        self, furniture: int, room: int | None, position: tuple[float, float] | None
    ) -> Furniture:
        """Return a furniture node as it is in another room or at another position.

        Raises:
            KeyError: if there is no such furniture node or room.
            ValueError: if the position is no two numbers.
        """
        self.check_furniture(furniture)
        node = self.furniture[furniture]
        if room is not None:
            self.check_room(room)
            node = replace(node, room=int(room), position=None)
        if position is not None:
            node = replace(node, position=read_position(position))
        return node

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node.

        Raises:
            KeyError: if there is no such furniture node.
        """
        self.check_furniture(furniture)
        node = self.furniture[furniture]
        return f"{node.description} in {self.rooms[node.room]}"

    def make_arrays(self, vocabulary: Vocabulary, prior: PriorGraph) -> LayoutArrays:
        """Number labels and rooms by position, and look up the prior."""
        position = {room: index for index, room in enumerate(self.rooms)}
        rooms = [vocabulary.get_text(label) for label in self.rooms.values()]
        labels = [vocabulary.get_text(node.label) for node in self.furniture.values()]
        room_of = np.array(
            [[position[node.room] for node in self.furniture.values()]], dtype=np.int32
        )
        return LayoutArrays(
            np.array([[vocabulary.number(label) for label in rooms]], dtype=np.int32),
            np.array([[vocabulary.number(label) for label in labels]], dtype=np.int32),
            room_of,
            PlacePrior(prior, [rooms], [labels], room_of.astype(np.int64)),
        )

    def check_room(self, room: int) -> None:
        """Check the id of a room.

        Raises:
            KeyError: if there is no such room.
        """
        if not isinstance(room, (int, np.integer)) or room not in self.rooms:
            raise KeyError(
                f"room must be an id from add_room, got {shorten(room)}; there are "
                f"{len(self.rooms)} rooms. Add the room first."
            )

    def check_furniture(self, furniture: int) -> None:
        """Check the id of a furniture node.

        Raises:
            KeyError: if there is no such furniture node.
        """
        is_id = isinstance(furniture, (int, np.integer)) and not isinstance(furniture, bool)
        if not is_id or furniture not in self.furniture:
            raise KeyError(
                f"furniture must be an id from add_furniture, got {shorten(furniture)}; there are "
                f"{len(self.furniture)} furniture nodes. Add it first."
            )


def read_position(position: Any = None) -> tuple[float, float] | None:
    """Return a position as two floats; None stays None.

    Raises:
        ValueError: if it is no two finite numbers.
    """
    if position is None:
        return None
    try:
        x, y = (float(value) for value in position)
    except (TypeError, ValueError, OverflowError):
        x = y = math.nan
    if not (math.isfinite(x) and math.isfinite(y)):
        raise ValueError(
            f"position must be two numbers, got {shorten(position)}. Give metres, such as (1.5, 4)."
        )
    return x, y
