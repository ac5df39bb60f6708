"""A home of boxes: a simulated home whose rooms, furniture and things have places and sizes."""

from __future__ import annotations

import numpy as np

from sgm.layout.box import ABOVE_TOP, Box
from sgm.schema import IS_BORNE, IS_INSIDE, ON_TOP, RELATIONS, PlaceCode
from simulator.box_world.floor import BoxFloor, sample_floor
from simulator.box_world.ray_kernel import Solids
from simulator.box_world.sizes import find_thing_size, list_levels, list_parts
from simulator.world.homes import Homes

_TRIES = 40  # spots for one thing before it is put on others
_CHOICE = 4  # free spots of which the best is taken
_TALL = 0.12  # metres from which on a thing stands as far back as may be
_SHRINKS = 0.6  # factor of the sides of a thing for which there is no room
_EDGE = 0.02  # metres from the edge of what a thing lies on
_HIGHEST = ABOVE_TOP - 0.05  # metres above a surface that things and piles reach at most


class ThingBoxes:
    """The box of every thing, C slots, as the home moves them from place to place.

    A thing that comes to a place gets a free spot there, small ones rather in front, or lies on
    others. It stays on its spot
    until it leaves the place, also when what it lay on is taken away.

    Attributes:
        center, half: metres, (C, 3).
        yaw: (C,).
        place: `PlaceCode`, -1 where there is none, (C,). A thing that is "in"
            furniture without an inside lies on top.
    """

    def __init__(self, homes: Homes, floor: BoxFloor, rng: np.random.Generator) -> None:
        """Lay out all things of the one home; `rng` draws their spots."""
        self._homes, self._floor, self._rng = homes, floor, rng
        num_slots = homes.num_slots
        self.center, self.half = np.zeros((num_slots, 3)), np.full((num_slots, 3), 0.01)
        self.yaw = np.zeros(num_slots)
        self.place = np.full(num_slots, -1)
        self._code = np.full(num_slots, -1)
        self.update()

    def update(self) -> None:
        """Move what the home has moved since the last call."""
        homes = self._homes
        places = self._read_places()
        is_new = (places != self.place) | (homes.object_code[0] != self._code)
        self.place[is_new] = -1  # what leaves a place gives its spot free
        for slot in np.flatnonzero(is_new & (places >= 0)).tolist():
            self._put(slot, int(places[slot]))
        self._code = homes.object_code[0].copy()

    @property
    def solids(self) -> Solids:
        """The boxes of what is there; the owner is the slot."""
        present = np.flatnonzero(self.place >= 0)
        turn = np.column_stack([np.cos(self.yaw[present]), np.sin(self.yaw[present])])
        return Solids(
            center=self.center[present],
            half=self.half[present],
            turn=turn,
            owner=present.astype(np.int32),
        )

    def get_box(self, slot: int) -> tuple[np.ndarray, np.ndarray, float]:
        """Return the middle (3,), half the sides (3,) and the yaw of a thing, as they are now."""
        return self.center[slot].copy(), self.half[slot].copy(), float(self.yaw[slot])

    def _read_places(self) -> np.ndarray:
        """Return the place of every slot, "onTop" where there is no inside, (C,)."""
        places = self._homes.object_place[0].astype(np.int64)
        has_inside = np.array([box.interior != "none" for box in self._floor.furniture])
        furniture, relation = PlaceCode.split(places)  # furniture -1 where there is none
        is_moved = (places >= 0) & IS_INSIDE[relation] & ~has_inside[furniture]
        return np.where(is_moved, PlaceCode.of(furniture, np.full_like(places, ON_TOP)), places)

    def _put(self, slot: int, place: int) -> None:
        """Give a thing a spot at a place."""
        furniture, relation = PlaceCode.split(place)
        box, shape = self._floor.furniture[furniture], self._floor.shapes[furniture]
        low, high, levels, headroom = _list_surfaces(box, shape, relation)
        object_type = int(self._homes.object_type[0, slot])
        width, depth, height = find_thing_size(self._homes.type_labels[0, object_type])
        others = np.flatnonzero(self.place == place)
        own_center = box.to_own(self.center[others])
        lowest, spot, half = np.inf, np.zeros(3), np.zeros(3)
        num_free = 0
        for attempt in range(3 * _TRIES):
            scale = _SHRINKS ** (attempt // _TRIES)  # what fits nowhere is smaller than usual
            sides = np.array((depth, width) if self._rng.integers(2) else (width, depth)) * scale
            new = np.minimum([*sides, scale * height], [*(0.95 * (high - low)), headroom]) / 2
            level = levels[int(self._rng.integers(len(levels)))]
            middle = self._rng.uniform(low + new[:2], high - new[:2])
            reach = new[:2] + self.half[others, :2]
            is_below = (np.abs(own_center[:, :2] - middle) < reach).all(axis=1)
            is_below &= np.abs(own_center[:, 2] - level - headroom / 2) < headroom / 2
            tops = own_center[is_below, 2] + self.half[others[is_below], 2]
            above = float(tops.max(initial=level)) - level
            if above + 2 * new[2] > headroom:  # no room on the pile: through it, if need be
                above = headroom
            num_free += above == 0
            is_better = above < lowest
            if above == lowest == 0 and shape != "basin":  # small things stand before tall ones
                is_better = (middle[0] > spot[0]) == (2 * new[2] < _TALL)
            if is_better:
                lowest, half = above, new
                base = min(level + above, level + headroom - 2 * new[2])
                spot = np.array([*middle, base + new[2]])
            if num_free == _CHOICE or (lowest < headroom and attempt % _TRIES == _TRIES - 1):
                break
        self.center[slot], self.half[slot] = box.to_map(spot), half
        self.yaw[slot] = box.yaw
        self.place[slot] = place


def _list_surfaces(
    box: Box, shape: str, relation: int
) -> tuple[np.ndarray, np.ndarray, list[float], float]:
    """Return where things lie: low and high x, y, heights from the middle, and room above each.

    On top they lie on the upper side, inside on boards, else on the ground of their volume.
    """
    if not (IS_BORNE[relation] or IS_INSIDE[relation]):
        volume = box.volume(RELATIONS[relation])
        assert volume is not None
        middle, half = box.to_own(np.array(volume.center)), np.array(volume.size) / 2
        low, high = middle - half, middle + half
        return low[:2], high[:2], [float(low[2])], volume.size[2]
    length, width, height = box.size
    high = np.array([length / 2 - _EDGE, width / 2 - _EDGE])
    if IS_BORNE[relation]:
        return -high, high, [height / 2], _HIGHEST
    high -= 0.03  # walls, and the door
    if shape == "basin":
        return -high, high, [-height / 2 + min(0.02, height / 4)], height - 0.05
    levels = list_levels(height)
    return -high, high, levels, (height - 0.04) / len(levels) - 0.04


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
        slots = np.flatnonzero(PlaceCode.furniture(self.things.place) == furniture)
        return [(int(slot), PlaceCode.relation(int(self.things.place[slot]))) for slot in slots]

    def _make_solids(self) -> Solids:
        pieces = zip(self.floor.furniture, self.floor.shapes, strict=True)
        parts = [
            Solids.of_boxes(
                list_parts(box, shape, number in self.open_doors), self.homes.num_slots + number
            )
            for number, (box, shape) in enumerate(pieces)
        ]
        return Solids.join([self.things.solids, *parts, self._still])
