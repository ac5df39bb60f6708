"""Calls of a memory about rooms and furniture."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from sgm.arrays.read_numbers import read_numbers
from sgm.layout.box import Box, read_box
from sgm.layout.furniture import Furniture, read_open_cost, read_position
from sgm.layout.layout import Layout, RoomId, read_map_id
from sgm.memory.memory_files import MemoryFiles
from sgm.memory.seen_positions import keep_positions_at, turn_positions
from sgm.memory.sighting import read_point
from sgm.names.name import Name
from sgm.names.words import read_words


class MemoryLayout(MemoryFiles):
    """The part of `SceneGraphMemory` for rooms and furniture, which people or a map name."""

    @property
    def layout(self) -> Layout:
        """Rooms and furniture by id, as they are now; the methods below change the memory's own."""
        with self._lock:
            return self._state.layout.copy()

    @property
    def map_id(self) -> str:
        """Id of the map that positions and boxes are in; empty if none was given."""
        with self._lock:
            return self._state.layout.map_id

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        with self._lock:
            return len(self._state.layout.furniture)

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of `batch`, (F,)."""
        with self._lock:
            return self._state.furniture.ids

    def find_called(self, name: Name) -> list[int]:
        """Return the ids of the furniture that is exactly of a name; see `CalledFurniture`."""
        with self._lock:
            return self._state.called.find(name)

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id.

        Raises:
            ValueError: if the label is no name (`read_words`).
        """
        read_words("room label", label)
        with self._lock:
            layout = self._state.layout
            self._write("room", room=layout.num_rooms_ever, label=label)
            room = layout.add_room(label)
            self._state.note_new(label)
        return room

    def add_furniture(
        self,
        label: str,
        room: int,
        description: str | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
        open_cost: float | None = None,
    ) -> int:
        """Add a furniture node and return its id.

        Args:
            label: what it is, such as "fridge".
            room: id from `add_room`.
            description: for people, such as "white fridge"; the label if left out.
            position: where one stands to look at it, in metres; with positions of all furniture,
                searches and plans need no `distance`. With a box it may be left out: it is then
                found in front of the box.
            box: its extents in the map (`sgm.eyes.Box`), from which a camera's frames become looks.
                A floor is furniture, too: label "floor", `Box.of_floor`.
            open_cost: of opening it, in the unit of distances, for searches; None where there is
                nothing to open.

        Raises:
            KeyError: if `room` is not a room of this memory.
            TypeError: if the box is none.
            ValueError: if the label or the description is no name (`read_words`), the position no
                two numbers, or the cost no number, 0 or more.
        """
        read_words("furniture label", label)
        description = label if description is None else description
        read_words("furniture description", description)
        with self._lock:
            layout, furniture = self._state.layout, self._state.layout.num_furniture_ever
            layout.check_room(room)
            node = Furniture(
                label, RoomId(room), description, position=read_position(position),
                box=read_box(box), open_cost=read_open_cost(open_cost),
            )  # fmt: skip
            self._write(
                "furniture", furniture=furniture, label=label, room=node.room,
                description=description, position=node.position, box=node.box,
                open_cost=node.open_cost,
            )  # fmt: skip
            layout.furniture[furniture] = node
            layout.num_furniture_ever += 1
            self._state.note_new(label)
        return furniture

    def move_furniture(
        self,
        furniture: int,
        room: int | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
    ) -> None:
        """Note that a furniture node was moved; what was seen there moves with it.

        Positions of things that are not at its new place are forgotten.

        Args:
            furniture: id from `add_furniture`.
            room: where it stands now; None for the same room.
            position: as in `add_furniture`; None if it is as it was, or, in another room or box,
                unknown.
            box: where it stands now; None if it is as it was, or, in another room, unknown.

        Raises:
            KeyError: if there is no such furniture node or room.
            TypeError: if the box is none.
            ValueError: if the position is no two numbers.
        """
        with self._lock:
            layout = self._state.layout
            layout.check_furniture(furniture)
            node = layout.furniture[furniture]
            if room is not None:
                layout.check_room(room)
                node = replace(node, room=RoomId(room), position=None, box=None)
            if box is not None:
                node = replace(node, position=None, box=read_box(box))
            if position is not None:
                node = replace(node, position=read_position(position))
            place: dict[str, Any] = {"position": node.position, "box": node.box}
            self._write("move", furniture=furniture, room=node.room, **place)
            has_moved = node.box != layout.furniture[furniture].box
            layout.furniture[furniture] = node
            if has_moved:
                index = list(layout.furniture).index(furniture)
                keep_positions_at(self._state.batch.positions, index, node.box)
            self._state.note_new()

    def name_furniture(self, furniture: int, label: str, description: str | None = None) -> None:
        """Note what a furniture node is, where that was not known, or was known wrongly.

        Args:
            furniture: id from `add_furniture`.
            label: what it is.
            description: for people; the label if left out.

        Raises:
            KeyError: if there is no such furniture node.
            ValueError: if the label or the description is no name (`read_words`).
        """
        read_words("furniture label", label)
        description = label if description is None else description
        read_words("furniture description", description)
        with self._lock:
            layout = self._state.layout
            layout.check_furniture(furniture)
            number = int(furniture)
            self._write("name", furniture=number, label=label, description=description)
            node = layout.furniture[number]
            layout.furniture[number] = replace(node, label=label, description=description)
            self._state.note_new(label)

    def merge_furniture(self, furniture: int, other: int) -> None:
        """Note that two furniture nodes are one: what was seen at the other was seen at the first.

        The other node is removed; what people said about it goes with it.

        Args:
            furniture: id of the node that stays.
            other: id of the one that goes.

        Raises:
            KeyError: if there is no such furniture node.
            ValueError: if they are one.
        """
        with self._lock:
            for number in (furniture, other):
                self._state.layout.check_furniture(number)
            if furniture == other:
                raise ValueError(
                    f"furniture to merge must be two, got {furniture} twice. Give another id."
                )
            self._write("merge_furniture", furniture=int(furniture), other=int(other))
            content = self._state.get_content().merge_furniture(int(furniture), int(other))
            self._state.take(content)

    def transform(
        self,
        angle: float = 0.0,
        shift: tuple[float, float] = (0.0, 0.0),
        map_id: str = "",
    ) -> None:
        """Move all positions and boxes into the frame of another map; nothing else changes.

        Those of things, too.

        Args:
            angle: by which the home is turned around the origin of the old map, counter-clockwise,
                in radians.
            shift: by which it is moved then, x and y in metres.
            map_id: of the new map; empty if it has none.

        Raises:
            ValueError: if an argument is out of range, or a box or a thing would lie where no home
                is.
        """
        turn = float(read_numbers("angle", angle, ()))
        by = read_position(shift)
        if by is None:
            raise ValueError("shift must be two numbers, got None. Give metres, or leave it out.")
        with self._lock:
            layout = self._state.layout.transform(turn, by, read_map_id(map_id))
            positions = self._state.batch.positions
            turned = turn_positions(positions, turn, by)
            self._write("transform", angle=turn, shift=by, map_id=map_id)
            self._state.layout = layout
            for name, values in turned.items():
                positions[name][:] = values
            self._state.note_new()

    def get_position(self, furniture: int) -> tuple[float, float] | None:
        """Return where one stands to look at a furniture node; None if it is unknown.

        As it was given; where it was not, a point before the front of its box, outside all others.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        with self._lock:
            self._state.layout.check_furniture(furniture)
            return self._state.layout.compute_position(furniture)

    def get_pose(
        self, furniture: int, at: tuple[float, float, float] | None = None
    ) -> tuple[float, float, float] | None:
        """Return where one stands to look at a furniture node, x, y in the map, and the yaw.

        Args:
            furniture: id from `add_furniture`.
            at: of what is looked at there, x, y, z in the map, metres, such as `Place.position`;
                None for the middle of the furniture. Where no position of the furniture was given,
                one stands right before that.

        Returns:
            Metres and radians; None where it is not known where the furniture stands.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if `at` is no position.
        """
        point = None if at is None else read_point(at, "what is looked at")
        with self._lock:
            self._state.layout.check_furniture(furniture)
            return self._state.layout.compute_pose(furniture, point)

    @property
    def boxes(self) -> dict[int, Box]:
        """Boxes of the furniture that has one, by id, for `sgm.eyes.LookBuilder`."""
        with self._lock:
            return self._state.layout.boxes

    def list_furniture(self, room: int) -> tuple[int, ...]:
        """Return the ids of the furniture of a room, to leave out a closed one, for example.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        with self._lock:
            self._state.layout.check_room(room)
            furniture = self._state.layout.furniture.items()
            return tuple(number for number, node in furniture if node.room == room)

    def remove_room(self, room: int) -> None:
        """Remove a room with all its furniture and what is remembered of it; objects stay.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        with self._lock:
            self._state.layout.check_room(room)
            self._write("remove_room", room=room)
            self._state.take(self._state.get_content().remove(rooms=[room]))

    def remove_furniture(self, furniture: int) -> None:
        """Remove a furniture node and all its edges; the objects that were seen there stay.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._remove_furniture(furniture)

    def _remove_furniture(self, furniture: int, by: str | None = None) -> None:
        """Log that furniture is gone, and forget it."""
        with self._lock:
            self._state.layout.check_furniture(furniture)
            self._write("remove_furniture", furniture=furniture, by=by)
            self._state.take(self._state.get_content().remove(furniture=[furniture]))

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node, "white fridge in kitchen".

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        with self._lock:
            return self._state.layout.describe(furniture)
