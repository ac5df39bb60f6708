"""A home of boxes: a simulated home whose rooms, furniture and things have places and sizes."""

from __future__ import annotations

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS
from sgm.layout.box import Box
from simulator.box_world.floor import BoxFloor, sample_floor
from simulator.box_world.solids import Solids, list_parts
from simulator.box_world.things import ThingBoxes
from simulator.world.homes import Homes


class BoxWorld:
    """One home, of any source, with a floor plan, boxes of furniture and boxes of things.

    Where things are is up to the home: they move as its dynamics say. Floor plan and spots come
    from streams of the home of their own ("box floor", "box things"), so that a home of boxes
    lives as the same home without boxes does.

    Attributes:
        homes: the one home.
        floor: where everything stands.
        things: where the things lie; the slots are those of the home.
        room_labels: (R,).
        open_doors: furniture whose doors are open now.
    """

    def __init__(self, homes: Homes) -> None:
        """Lay out a home at t = 0.

        Raises:
            ValueError: if there are several homes.
        """
        if homes.num_homes != 1:
            raise ValueError(
                f"a world of boxes must be one home, got {homes.num_homes}. Make one of them."
            )
        self.homes = homes
        num_furniture = int(homes.home_num_furniture[0])
        rooms = [label for label in homes.room_labels[0].tolist() if label]
        self.floor: BoxFloor = sample_floor(
            homes.furniture_labels[0, :num_furniture].tolist(),
            homes.furniture_room[0, :num_furniture].tolist(),
            len(rooms),
            homes.streams.generator("box floor", 0),
        )
        self.room_labels = tuple(rooms)
        self.things = ThingBoxes(homes, self.floor, homes.streams.generator("box things", 0))
        self.open_doors: set[int] = set()
        self._solids: tuple[frozenset[int], Solids] | None = None
        ground = Box.of_floor(self.floor.low, self.floor.high)
        last_owner = homes.num_slots + self.num_furniture
        self._still = Solids.of_boxes([*self.floor.walls, ground], last_owner)

    @property
    def num_furniture(self) -> int:
        """F."""
        return len(self.floor.furniture)

    @property
    def solids(self) -> Solids:
        """All boxes that a ray can hit, as they are now.

        Their owners are C things, then F pieces of furniture, then all walls and the floor.
        """
        doors = frozenset(self.open_doors)
        if self._solids is None or self._solids[0] != doors:
            self._solids = doors, self._make_solids()
        return self._solids[1]

    def evolve(self) -> None:
        """Let a time step pass; all doors are shut then."""
        self.homes.evolve()
        self._solids = None
        self.things.update()
        self.open_doors.clear()

    def describe_thing(self, slot: int) -> str:
        """Return the description of a thing, such as "large red mug"."""
        return self.homes.object_descriptions.text(int(self.homes.object_code[0, slot]))

    def list_there(self, furniture: int) -> list[tuple[int, int]]:
        """Return slot and relation of everything at a piece of furniture."""
        slots = np.flatnonzero(self.things.place // NUM_RELATIONS == furniture)
        return [(int(slot), int(self.things.place[slot] % NUM_RELATIONS)) for slot in slots]

    def _make_solids(self) -> Solids:
        pieces = zip(self.floor.furniture, self.floor.shapes, strict=True)
        parts = [
            Solids.of_boxes(
                list_parts(box, shape, number in self.open_doors), self.homes.num_slots + number
            )
            for number, (box, shape) in enumerate(pieces)
        ]
        return Solids.join([self.things.solids, *parts, self._still])
