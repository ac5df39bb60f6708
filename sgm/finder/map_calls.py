"""The calls of a service that change its map: rooms, and places where things may be."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sgm.finder.answers import Noted
from sgm.finder.home_map import HomeMap, read_extents, read_stand
from sgm.finder.meanings import ask_room, find_place, find_rooms
from sgm.finder.written import WriteCalls, writes
from sgm.layout.box import Box

# Corners of a footprint, x, y of each, metres in the map.
Corners = Sequence[Sequence[float]]
_FARTHEST_STAND = 3.0  # metres from a place to where one looks at it


class MapCalls(WriteCalls):
    """Every call of `SceneGraphMemory` that changes rooms and furniture, by names and ids.

    A place stands where its extents say: `center` and `size`, or a `polygon` from `bottom` to
    `top`, metres and radians in the map. `position` is where one stands to look at it. A write may
    have a `key`; see `MemoryService`.
    """

    @writes
    def add_room(self, label: str, *, key: str | None = None) -> Noted:
        """Add a room, such as "kitchen".

        Args:
            label: what it is.
            key: of this write.

        Raises:
            ValueError: if the label is no name.
        """
        room = self.memory.add_room(label)
        return self._note("add_room", "", None, self._say("note room", room=label), room)

    @writes
    def rename_room(self, room: int | str, label: str, *, key: str | None = None) -> Noted:
        """Call a room otherwise: "this is no bedroom, it is a study".

        Args:
            room: id or name.
            label: what it is.
            key: of this write.

        Raises:
            KeyError: if there is no room of that id.
            ValueError: if a name is none.
        """
        number = self._find_room(room)
        before = str(self.memory.layout.rooms[number])
        self.memory.rename_room(number, label)
        said = self._say("note room called", room=before, name=label)
        return self._note("rename_room", "", None, said, number)

    @writes
    def remove_room(self, room: int | str, *, key: str | None = None) -> Noted:
        """Remove a room with all its places, and what is remembered of them.

        Args:
            room: id or name.
            key: of this write.

        Raises:
            KeyError: if there is no room of that id.
            ValueError: if the name is none.
        """
        number = self._find_room(room)
        before = str(self.memory.layout.rooms[number])
        self.memory.remove_room(number)
        return self._note("remove_room", "", None, self._say("note no room", room=before), number)

    @writes
    def add_place(
        self,
        label: str,
        room: int | str,
        name: str | None = None,
        position: Sequence[float] | None = None,
        center: Sequence[float] | None = None,
        size: Sequence[float] | None = None,
        yaw: float | None = None,
        interior: str | None = None,
        open_cost: float | None = None,
        polygon: Corners | None = None,
        bottom: float | None = None,
        top: float | None = None,
        *,
        key: str | None = None,
    ) -> Noted:
        """Add a place where things may be, such as a "fridge".

        Args:
            label: what it is.
            room: its room, by id or name.
            name: for people, "white fridge"; None for the label.
            position: where one stands to look at it, x, y, metres; None where that is to be found
                by its extents.
            center: x, y, z of its middle.
            size: depth, width and height.
            yaw: where its front looks to, radians from the x axis; None for 0.
            interior: "none", "open" or "door", as in `Box`; None for "none".
            open_cost: of opening it to look into it, in the unit of distances; None where there is
                nothing to open.
            polygon: corners of its footprint, x, y of each, instead of a center and a size.
            bottom: height of its lower side, with a polygon.
            top: height of its upper side.
            key: of this write.

        Raises:
            KeyError: if there is no room of that id.
            ValueError: if a label or name is none, or numbers are of another kind or out of range.
        """
        number, stand = self._find_room(room), _read_position(position)
        box = read_extents(
            {
                "center": center,
                "size": size,
                "yaw": yaw,
                "interior": interior,
                "polygon": polygon,
                "bottom": bottom,
                "top": top,
            },
            "place",
        )
        _check_stand(stand, box)
        place = self.memory.add_furniture(label, number, name, stand, box, open_cost)
        said = self._say("note place", place=self._tell_place(place))
        return self._note("add_place", "", place, said, number)

    @writes
    def name_place(
        self, place: int | str, label: str, name: str | None = None, *, key: str | None = None
    ) -> Noted:
        """Note what a place is, where that was not known, or was known wrongly.

        Args:
            place: id or name.
            label: what it is.
            name: for people; None for the label.
            key: of this write.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none.
        """
        furniture = find_place(self.memory, place, acts=True)
        before = self._tell_place(furniture)
        self.memory.name_furniture(furniture, label, name)
        said = self._say("note place called", place=before, name=self._tell_place(furniture))
        return self._note("name_place", "", furniture, said)

    @writes
    def move_place(
        self,
        place: int | str,
        room: int | str | None = None,
        position: Sequence[float] | None = None,
        center: Sequence[float] | None = None,
        size: Sequence[float] | None = None,
        yaw: float | None = None,
        interior: str | None = None,
        open_cost: float | None = None,
        polygon: Corners | None = None,
        bottom: float | None = None,
        top: float | None = None,
        *,
        key: str | None = None,
    ) -> Noted:
        """Note that a place was moved; what was seen there moves with it.

        Args:
            place: id or name.
            room: where it stands now, by id or name; None for the same room. In another one its
                extents are unknown where they are not given.
            position: as in `add_place`.
            center: as in `add_place`; None as it was.
            size: as in `add_place`; None as it was.
            yaw: as in `add_place`; None as it was.
            interior: as in `add_place`; None as it was.
            open_cost: as in `add_place`; None as it was.
            polygon: as in `add_place`.
            bottom: as in `add_place`.
            top: as in `add_place`.
            key: of this write.

        Raises:
            KeyError: if there is no place or room of an id.
            ValueError: if a name is none, or numbers are of another kind or out of range.
        """
        furniture = find_place(self.memory, place, acts=True)
        number = None if room is None else self._find_room(room)
        stand, box = _read_position(position), self.memory.boxes.get(furniture)
        extents: dict[str, Any] = {"center": center, "size": size, "yaw": yaw, "interior": interior}
        said = {name: value for name, value in extents.items() if value is not None}
        shape: dict[str, Any] = {"polygon": polygon, "bottom": bottom, "top": top}
        if box is None or any(value is not None for value in shape.values()):
            moved = read_extents(extents | shape, "place")
        else:
            moved = replace(box, **said) if said else None
        _check_stand(stand, moved or (box if number is None else None))
        self.memory.move_furniture(furniture, number, stand, moved, open_cost)
        told = self._say("note place moved", place=self._tell_place(furniture))
        return self._note("move_place", "", furniture, told)

    @writes
    def merge_places(self, place: int | str, other: int | str, *, key: str | None = None) -> Noted:
        """Note that two places are one; what is remembered of the other one is of the first.

        Args:
            place: id or name.
            other: id or name; it goes.
            key: of this write.

        Raises:
            KeyError: if there is no place of an id.
            ValueError: if a name is none, or both are one already.
        """
        first, second = (find_place(self.memory, name, acts=True) for name in (place, other))
        gone = self._tell_place(second)
        self.memory.merge_furniture(first, second)
        said = self._say("note places one", place=self._tell_place(first), other=gone)
        return self._note("merge_places", "", first, said)

    @writes
    def remove_place(self, place: int | str, *, key: str | None = None) -> Noted:
        """Remove a place and what is remembered of it; things stay, without a place.

        Args:
            place: id or name.
            key: of this write.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if the name is none.
        """
        furniture = find_place(self.memory, place, acts=True)
        said = self._say("note no place", place=self._tell_place(furniture))
        self.memory.remove_furniture(furniture)
        return self._note("remove_place", "", furniture, said)

    @writes
    def set_map(
        self,
        rooms: Sequence[Any],
        furniture: Sequence[Any],
        frame: str = "map",
        *,
        key: str | None = None,
    ) -> Noted:
        """Take a whole map over, as its file has it (`HomeMap`); nothing is removed.

        What the home has already, a room of that label or a place of that name in it, is moved to
        where the map has it and not added again. So a robot may send its map at every start.

        Args:
            rooms: names, or mappings with `name` and perhaps `label` and `floor`.
            furniture: mappings with `name` and `room`, and perhaps `label`, `position`, extents and
                `open_cost`, as in `add_place`.
            frame: of the coordinates.
            key: of this write.

        Raises:
            ValueError: if an entry is malformed; then nothing is changed.
        """
        values: Mapping[str, Any] = {
            "frame": frame,
            "rooms": list(rooms),
            "furniture": list(furniture),
        }
        counts = HomeMap.from_values(values, needs_boxes=False).update(self.memory)
        done = [self._asking.count(what, count) for what, count in counts.items() if count]
        said = ", ".join(done) or self._say("note known map")
        return self._note("set_map", "", None, said)

    @writes
    def transform_map(
        self,
        angle: float = 0.0,
        shift: Sequence[float] | None = None,
        map_id: str | None = None,
        *,
        key: str | None = None,
    ) -> Noted:
        """Move all positions and extents into the frame of another map; nothing else changes.

        Args:
            angle: radians by which all turns around the origin, counter-clockwise.
            shift: metres, x, y, by which all moves then; None for not at all.
            map_id: of the new map; None for none.
            key: of this write.

        Raises:
            ValueError: if one is of another kind or not finite.
        """
        self.memory.transform(angle, (0.0, 0.0) if shift is None else shift, map_id or "")
        return self._note("transform_map", "", None, self._say("note new map"))

    def _find_room(self, room: int | str) -> int:
        """Return the id of the room that is meant, exactly; raises `Unclear` for none or several.

        Raises:
            KeyError: if there is no room of that id.
        """
        if not isinstance(room, str):
            self.memory.layout.check_room(room)
            return int(room)
        rooms = find_rooms(self.memory, room, acts=True)
        if len(rooms) != 1:
            raise ask_room(self.memory, room, rooms)
        return rooms[0]


def _read_position(position: Sequence[float] | None) -> tuple[float, float] | None:
    return None if position is None else read_stand(position, "place")


def _check_stand(stand: tuple[float, float] | None, box: Box | None) -> None:
    """Refuse a point too far from a place to look at it: the place was meant to be there."""
    if stand is None or box is None:
        return
    apart = float(box.compute_distance(np.array([[*stand, box.center[2]]]))[0])
    if apart > _FARTHEST_STAND:
        raise ValueError(
            f"position must be where one stands to look at the place, {_FARTHEST_STAND:g} m or "
            f"less from its extents, got {list(stand)}, {apart:.1f} m away. Say center, too, if "
            "the place is there."
        )
