"""The part of a memory for rooms and furniture, which people or a map name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from sgm.arrays.read_numbers import read_numbers
from sgm.layout.box import Box, read_box
from sgm.layout.furniture import Furniture, Room, read_open_cost, read_position
from sgm.layout.layout import Layout, RoomId, read_map_id
from sgm.memory.look import StepLook
from sgm.memory.memory_state import MemoryState
from sgm.memory.seen_positions import is_beside, keep_positions_at, turn_positions
from sgm.memory.sighting import Point, read_point
from sgm.memory.thing import SaidOf
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.words import read_words


class MemoryLayout:
    """Rooms and furniture; `SceneGraphMemory` says what each call does, takes and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state

    @property
    def layout(self) -> Layout:
        """Rooms and furniture by id, as they are now; the methods below change the memory's own."""
        with self._state.lock:
            return self._state.layout.copy()

    @property
    def map_id(self) -> str:
        """Id of the map that positions and boxes are in; empty if none was given."""
        with self._state.lock:
            return self._state.layout.map_id

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        with self._state.lock:
            return len(self._state.layout.furniture)

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of `batch`, (F,)."""
        with self._state.lock:
            return self._state.furniture.ids

    def find_called(self, name: Name) -> list[int]:
        """Return the ids of the furniture that is exactly of a name; see `CalledFurniture`."""
        with self._state.lock:
            return self._state.called.find(name)

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id."""
        read_words("room label", label)
        with self._state.lock:
            layout = self._state.layout
            self._state.write("room", room=layout.num_rooms_ever, label=label)
            room = layout.add_room(label)
            self._state.note_new(label)
        return room

    def rename_room(self, room: int, label: str) -> None:
        """Note what a room is, where that was not known, or was known wrongly."""
        read_words("room label", label)
        with self._state.lock:
            layout = self._state.layout
            layout.check_room(room)
            self._state.write("rename_room", room=int(room), label=label)
            layout.rooms[RoomId(room)] = Room(label)
            self._state.note_new(label)

    def add_furniture(
        self,
        label: str,
        room: int,
        description: str | None = None,
        position: tuple[float, float] | None = None,
        box: Box | None = None,
        open_cost: float | None = None,
    ) -> int:
        """Add a furniture node and return its id."""
        read_words("furniture label", label)
        description = label if description is None else description
        read_words("furniture description", description)
        with self._state.lock:
            layout, furniture = self._state.layout, self._state.layout.num_furniture_ever
            layout.check_room(room)
            node = Furniture(
                label,
                RoomId(room),
                description,
                position=read_position(position),
                box=read_box(box),
                open_cost=read_open_cost(open_cost),
            )
            self._state.write(
                "furniture",
                furniture=furniture,
                label=label,
                room=node.room,
                description=description,
                position=node.position,
                box=node.box,
                open_cost=node.open_cost,
            )
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
        open_cost: float | None = None,
    ) -> None:
        """Note that a furniture node was moved; what was seen there moves with it."""
        with self._state.lock:
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
            cost = read_open_cost(open_cost)
            if cost is not None:
                node = replace(node, open_cost=cost)
            place: dict[str, Any] = {"position": node.position, "box": node.box, "open_cost": cost}
            self._state.write("move", furniture=furniture, room=node.room, **place)
            has_moved = node.box != layout.furniture[furniture].box
            number = int(furniture)
            layout.furniture[number] = node
            if has_moved:
                index, new_box = list(layout.furniture).index(number), node.box

                def is_there(point: Point) -> bool:
                    return new_box is not None and bool(is_beside(new_box, point)[0])

                keep_positions_at(self._state.open_looks().positions, index, new_box)
                self._state.close_looks(
                    lambda look: look.keep_at(is_there) if look.furniture == number else look,
                )
            self._state.note_new()

    def name_furniture(self, furniture: int, label: str, description: str | None = None) -> None:
        """Note what a furniture node is, where that was not known, or was known wrongly."""
        read_words("furniture label", label)
        description = label if description is None else description
        read_words("furniture description", description)
        with self._state.lock:
            layout = self._state.layout
            layout.check_furniture(furniture)
            number = int(furniture)
            self._state.write("name", furniture=number, label=label, description=description)
            node = layout.furniture[number]
            layout.furniture[number] = replace(node, label=label, description=description)
            self._state.note_new(label)

    def merge_furniture(self, furniture: int, other: int) -> None:
        """Note that two furniture nodes are one; the other goes."""
        with self._state.lock:
            for number in (furniture, other):
                self._state.layout.check_furniture(number)
            if furniture == other:
                raise ValueError(
                    f"furniture to merge must be two, got {furniture} twice. Give another id."
                )
            self._state.write("merge_furniture", furniture=int(furniture), other=int(other))
            _merge(self._state, int(furniture), int(other))

    def transform(
        self,
        angle: float = 0.0,
        shift: Sequence[float] = (0.0, 0.0),
        map_id: str = "",
    ) -> None:
        """Move all positions and boxes into the frame of another map; nothing else changes."""
        turn = float(read_numbers("angle", angle, ()))
        offset = read_position(shift)
        if offset is None or tuple(shift)[2:] not in ((), (0,)):
            raise ValueError(
                f"shift must be two numbers, got {shorten(shift)}. Give metres, or leave it out: "
                "heights stay as they are."
            )
        with self._state.lock:
            layout = self._state.layout.transform(turn, offset, read_map_id(map_id))
            turn_positions(self._state.batch.positions, turn, offset)  # or it is refused
            self._state.write("transform", angle=turn, shift=offset, map_id=map_id)
            batch = self._state.open_looks()
            for name, values in turn_positions(batch.positions, turn, offset).items():
                batch.positions[name][:] = values
            self._state.layout = layout
            self._state.close_looks(lambda look: look.turn(turn, offset))
            self._state.note_new()

    def get_position(self, furniture: int) -> tuple[float, float] | None:
        """Return where one stands to look at a furniture node; None if it is unknown."""
        with self._state.lock:
            self._state.layout.check_furniture(furniture)
            return self._state.layout.compute_position(furniture)

    def get_pose(
        self, furniture: int, target: tuple[float, float, float] | None = None
    ) -> tuple[float, float, float] | None:
        """Return where one stands to look at a furniture node, x, y in the map, and the yaw."""
        point = None if target is None else read_point(target, "what is looked at")
        with self._state.lock:
            self._state.layout.check_furniture(furniture)
            return self._state.layout.compute_pose(furniture, point)

    @property
    def boxes(self) -> dict[int, Box]:
        """Boxes of the furniture that has one, by id, for `sgm.eyes.LookBuilder`."""
        with self._state.lock:
            return self._state.layout.boxes

    def list_furniture(self, room: int) -> tuple[int, ...]:
        """Return the ids of the furniture of a room, to leave out a closed one, for example."""
        with self._state.lock:
            self._state.layout.check_room(room)
            furniture = self._state.layout.furniture.items()
            return tuple(number for number, node in furniture if node.room == room)

    def remove_room(self, room: int) -> None:
        """Remove a room with all its furniture and what is remembered of it; objects stay."""
        with self._state.lock:
            self._state.layout.check_room(room)
            self._state.write("remove_room", room=room)
            self._state.remove(rooms=[room])

    def forget_furniture(self, furniture: int, by: str) -> None:
        """Remove a furniture node that a person says is gone."""
        read_words("by", by)
        self.remove_furniture(furniture, by)

    def remove_furniture(self, furniture: int, by: str | None = None) -> None:
        """Log that furniture is gone, and forget it."""
        with self._state.lock:
            self._state.layout.check_furniture(furniture)
            self._state.write("remove_furniture", furniture=furniture, by=by)
            self._state.remove(furniture=[int(furniture)])

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node, "white fridge in kitchen"."""
        with self._state.lock:
            return self._state.layout.describe(furniture)


def _merge(state: MemoryState, kept: int, other: int) -> None:
    """Let furniture be one with another, by id, and looks at this be looks at that one.

    A look at either one had not in view what the other one showed.
    """
    shown: dict[int, dict[str, Name]] = {kept: {}, other: {}}
    for look in state.step.looks:
        for seen in look.seen if look.furniture in shown else ():
            name = Name.read(seen.id) if seen.id else seen.name
            shown[look.furniture][name.text] = name
    state.open_looks()

    def change(look: StepLook) -> StepLook:
        if look.furniture not in shown or look.sought:
            return replace(look, furniture=kept) if look.furniture == other else look
        hidden = shown[other if look.furniture == kept else kept]
        names = {**{name.text: name for name in look.hidden}, **hidden}
        return replace(look, furniture=kept, hidden=tuple(names.values()))

    def redirect(said: SaidOf) -> SaidOf:
        if said.statement is None:
            return said
        was_at = kept if said.was_at == other else said.was_at
        return replace(said, statement=said.statement.redirect(other, kept), was_at=was_at)

    state.close_looks(change, lambda content: content.merge_furniture(kept, other), redirect)
