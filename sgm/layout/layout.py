"""Rooms and furniture of a home, by ids that never change."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from sgm.layout.box import Box
from sgm.layout.furniture import Furniture, Room, compute_pose, compute_position, compute_positions
from sgm.messages import shorten
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import MAX_LENGTH
from sgm.prior.place_prior import PlacePrior
from sgm.prior.prior_graph import PriorGraph


class RoomId(int):
    """Id of a room: a number that is refused where an id of furniture is meant."""

    __slots__ = ()


@dataclass(frozen=True, slots=True)
class LayoutArrays:
    """Layouts of H homes of up to R rooms and F furniture nodes, as a `MemoryBatch` takes them.

    Attributes:
        room_label: -1 beyond the rooms of a home, (H, R).
        furniture_label: -1 beyond the furniture of a home, (H, F).
        furniture_room: room index within the home, -1 beyond its furniture, (H, F).
        place_prior: the prior for these layouts.
    """

    room_label: np.ndarray
    furniture_label: np.ndarray
    furniture_room: np.ndarray
    place_prior: PlacePrior


@dataclass(slots=True)
class Layout:
    """Rooms and furniture; no id is given twice.

    Attributes:
        rooms, furniture: by id.
        num_rooms_ever, num_furniture_ever: ids given so far.
        map_id: of the map that positions and boxes are in; empty if none was given.
    """

    rooms: dict[int, Room] = field(default_factory=dict)
    furniture: dict[int, Furniture] = field(default_factory=dict)
    num_rooms_ever: int = 0
    num_furniture_ever: int = 0
    map_id: str = ""

    def __post_init__(self) -> None:
        """Mark the ids of rooms."""
        rooms = self.rooms.items()
        self.rooms = {
            RoomId(number) if type(number) is int else number: room for number, room in rooms
        }

    @classmethod
    def of(cls, rooms: Iterable[Room], furniture: Iterable[Furniture]) -> Layout:
        """Number rooms and furniture from 0 on."""
        own_rooms, own_furniture = dict(enumerate(rooms)), dict(enumerate(furniture))
        return cls(own_rooms, own_furniture, len(own_rooms), len(own_furniture))

    @property
    def room_labels(self) -> tuple[str, ...]:
        """Label of every room, (R,)."""
        return tuple(room.label for room in self.rooms.values())

    @property
    def furniture_labels(self) -> tuple[str, ...]:
        """Label of every furniture node, (F,)."""
        return tuple(piece.label for piece in self.furniture.values())

    @property
    def room_sizes(self) -> tuple[int, ...]:
        """Furniture nodes of every room, (R,)."""
        counts = Counter(piece.room for piece in self.furniture.values())
        return tuple(counts[room] for room in self.rooms)

    def to_json(self) -> dict[str, Any]:
        """Return JSON values: rows of rooms and of furniture, each with its id first, and the map.

        The map is empty where none was named.
        """
        return {
            "rooms": [[number, room.label] for number, room in self.rooms.items()],
            "furniture": [[number, *piece.to_row()] for number, piece in self.furniture.items()],
            "map": self.map_id,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any], num_rooms: int, num_furniture: int) -> Layout:
        """Read JSON values of `to_json`, among others, and how many ids were given so far.

        Raises:
            ValueError: if a row is of another kind, or furniture stands in no room.
            KeyError, TypeError: if a part is missing, or of another kind.
        """
        rooms = {number: Room(label) for number, label in data["rooms"]}
        furniture = {number: Furniture.from_row(*values) for number, *values in data["furniture"]}
        for piece in furniture.values():
            if piece.room not in rooms:
                raise ValueError(f"there is no room {shorten(piece.room)}")
        return cls(rooms, furniture, num_rooms, num_furniture, read_map_id(data["map"]))

    def transform(self, angle: float, shift: tuple[float, float], map_id: str = "") -> Layout:
        """Return the layout in the frame of another map; see `SceneGraphMemory.transform`."""
        furniture = {
            number: piece.transform(angle, shift) for number, piece in self.furniture.items()
        }
        return replace(self, furniture=furniture, map_id=map_id)

    def leave_out(self, rooms: Collection[int] = (), furniture: Collection[int] = ()) -> Layout:
        """Return the layout without some rooms, what stands in them, and some furniture."""
        return replace(
            self,
            rooms={number: room for number, room in self.rooms.items() if number not in rooms},
            furniture={
                number: piece
                for number, piece in self.furniture.items()
                if number not in furniture and piece.room not in rooms
            },
        )

    def add_room(self, label: str) -> int:
        """Add a room, whose label was checked, and return its id."""
        number = RoomId(self.num_rooms_ever)
        self.rooms[number] = Room(label)
        self.num_rooms_ever += 1
        return number

    def copy(self) -> Layout:
        """Return the same layout, which can be changed alone."""
        return replace(self, rooms=dict(self.rooms), furniture=dict(self.furniture))

    @property
    def boxes(self) -> dict[int, Box]:
        """Boxes of the furniture that has one, by id."""
        pieces = self.furniture.items()
        return {number: piece.box for number, piece in pieces if piece.box is not None}

    def compute_positions(self) -> dict[int, tuple[float, float] | None]:
        """Return where one stands to look at each furniture node, given or found, by id."""
        return compute_positions(self.furniture)

    def compute_position(self, furniture: int) -> tuple[float, float] | None:
        """Return where one stands to look at a furniture node, given or found."""
        return compute_position(self.furniture, furniture)

    def compute_pose(
        self, furniture: int, point: tuple[float, float, float] | None = None
    ) -> tuple[float, float, float] | None:
        """Return where one stands to look at a furniture node, or at a point there, and the yaw."""
        return compute_pose(self.furniture, furniture, point)

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node; raises KeyError for no such id."""
        self.check_furniture(furniture)
        node = self.furniture[furniture]
        return f"{node.description} in {self.rooms[node.room]}"

    def make_arrays(self, vocabulary: Vocabulary, prior: PriorGraph) -> LayoutArrays:
        """Number labels and rooms by position, and look up the prior."""
        position = {room: index for index, room in enumerate(self.rooms)}
        rooms = [vocabulary.get_text(label) for label in self.room_labels]
        labels = [vocabulary.get_text(label) for label in self.furniture_labels]
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
        """Raise KeyError unless there is a room of that id."""
        if not isinstance(room, (int, np.integer)) or room not in self.rooms:
            raise KeyError(
                f"room must be an id from add_room, got {shorten(room)}; there are "
                f"{len(self.rooms)} rooms. Add the room first."
            )

    def check_furniture(self, furniture: int) -> None:
        """Raise KeyError unless there is a furniture node of that id."""
        if isinstance(furniture, RoomId) and furniture in self.rooms:
            raise KeyError(
                f"furniture must be an id from add_furniture, got {int(furniture)}, the id of the "
                f"room {self.rooms[furniture]}. list_furniture({int(furniture)}) tells what "
                "stands there."
            )
        is_id = isinstance(furniture, (int, np.integer)) and not isinstance(furniture, bool)
        if not is_id or furniture not in self.furniture:
            raise KeyError(
                f"furniture must be an id from add_furniture, got {shorten(furniture)}; there are "
                f"{len(self.furniture)} furniture nodes. Add it first, or ask "
                "find_furniture for ids by name."
            )


@dataclass(frozen=True, slots=True)
class FurnitureNames:
    """Furniture of a layout as it is, F nodes.

    Attributes:
        ids: F.
        names: for people, "white fridge in kitchen", F.
        open_costs: of opening each to look into it, None where there is nothing to open, F.
        position: index of each in these, by id.
    """

    ids: tuple[int, ...]
    names: tuple[str, ...]
    open_costs: tuple[float | None, ...]
    position: Mapping[int, int]

    @classmethod
    def of(cls, layout: Layout) -> FurnitureNames:
        """List the furniture of a layout."""
        return cls(
            ids=tuple(layout.furniture),
            names=tuple(map(layout.describe, layout.furniture)),
            open_costs=tuple(
                (piece.open_cost or 0.0) if piece.must_open else None
                for piece in layout.furniture.values()
            ),
            position={number: index for index, number in enumerate(layout.furniture)},
        )


def read_map_id(value: Any) -> str:
    """Return the id of a map; raises ValueError for what is no text of one line, or too long."""
    if not isinstance(value, str) or not value.isprintable() or len(value) > MAX_LENGTH:
        raise ValueError(
            f"map_id must be a text of one line and at most {MAX_LENGTH} characters, got "
            f"{shorten(value)}. Give the name or checksum of the map."
        )
    return value
