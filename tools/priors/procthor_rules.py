"""The numbers that ProcTHOR's house generator draws from, restated for symbolic houses.

Source: ProcTHOR (Deitke et al., 2022), package `procthor` 0.0.1.dev2 (Apache-2.0): constants, house
specifications and spawn biases of its generator. Differs: the code that uses them here is ours and
works on rectangles, not on meshes.
"""

from __future__ import annotations

from typing import Any, Final

ROOM_COLUMNS: Final = {
    "kitchen": ("inKitchens", "kitchens"),
    "living room": ("inLivingRooms", "livingRooms"),
    "bedroom": ("inBedrooms", "bedrooms"),
    "bathroom": ("inBathrooms", "bathrooms"),
}
"""Our room -> column in the placement annotations, room weight of an asset group."""

PRIORITY: Final = {
    "kitchen": ("CounterTop", "Fridge"),
    "living room": ("Television", "DiningTable", "Sofa"),
    "bedroom": ("Bed", "Dresser"),
    "bathroom": ("Toilet", "Sink"),
}
"""Types that a room tries to place first, in random order."""

NUM_ATTEMPTS: Final = ((1, 0.005), (4, 0.01), (5, 0.02), (6, 0.1), (7, 0.865))
"""Attempts to place something on the floor of a room of one house, with probabilities."""

P_LARGEST_RECTANGLE: Final = 0.8
MIN_RECTANGLE_SIDE: Final = 0.5  # metres; for the rectangles that are not the largest
P_EDGE: Final = 0.7
P_GROUP: Final = 0.6
P_SKIP_WEIGHT_ONE: Final = 0.8
P_ALLOW_GROUP: Final = {"floor-house-plant": 0.5, "television": 0.5}

MARGIN_FRONT: Final = 0.5  # metres kept free in front of something at a wall
MARGIN_MIDDLE: Final = 0.35  # metres kept free around something in the middle
PADDING: Final = 0.05  # metres to the wall
DOOR_SIZE: Final = 1.0  # metres of wall and of floor that a door keeps free
NUM_DOORS: Final = {"kitchen": 2, "living room": 2, "bedroom": 2, "bathroom": 1}

PARENT_BIAS: Final = {"Chair": 0.0, "ArmChair": 0.0, "ShelvingUnit": 0.4}
PARENT_BIAS_DEFAULT: Final = 0.2
CHILD_BIAS: Final = {
    "HousePlant": 0.25,
    "SprayBottle": 0.2,
    "Pot": 0.1,
    "Pan": 0.1,
    "Bowl": 0.05,
    "BaseballBat": 0.1,
}
HOUSE_BIAS_LOW: Final = -0.3
HOUSE_BIAS_RANGE: Final = 0.4
HOUSE_BIAS_BETA: Final = (3.5, 1.9)
MAX_COPIES: Final = 3

CELLS_PER_ROOM: Final = 3  # side of a room in cells of the floor plan
MIN_SIDE: Final = 2  # cells
CELL_SIZE: Final = (1.6, 2.2)  # metres
MAX_CUT: Final = 6  # cells that one cut takes from a corner of the floor plan

K, L, R, B = "kitchen", "living room", "bedroom", "bathroom"
_KITCHEN_LIVING: Final = ((3, K), (2, L))
_BED_BATH: Final = ((2, R), (1, B))
_PUBLIC: Final = ((2, ((3, K), (3, L))), (1, ((2, L), (1, B))))

# (weight, sides in cells or None, ((ratio, room or children), ...))
HOUSE_SPECS: Final[tuple[tuple[float, Any, Any], ...]] = (
    (1, ((13, 16), (5, 8)), ((4, _PUBLIC), (1, R), (1, R), (2, ((1, R), (1, B))))),
    (1, None, ((3, _PUBLIC), (2, ((2, R), (2, R), (2, R))))),
    (
        1,
        None,
        (
            (1, ((1, ((3, K), (3, L))), (1, ((1, L), (1, L))))),
            (1, ((1, _BED_BATH), (1, _BED_BATH), (1, _BED_BATH))),
        ),
    ),
    (
        1,
        None,
        (
            (2, ((1, ((3, K), (3, L))), (1, _BED_BATH))),
            (3, ((1, _BED_BATH), (1, _BED_BATH), (1, _BED_BATH))),
        ),
    ),
    (5, None, ((2, _BED_BATH), (2, _KITCHEN_LIVING))),
    (1, None, ((2, ((3, K), (2, B), (3, L))), (1, R), (1, R))),
    (1, None, ((2, _BED_BATH), (2, R), (2, _KITCHEN_LIVING))),
    (1, None, ((2, _BED_BATH), (2, _BED_BATH), (2, _KITCHEN_LIVING))),
    (2, None, _BED_BATH),
    (1, None, ((2, _KITCHEN_LIVING), (1, R))),
    (1, None, ((2, ((1, K), (1, L))), (1, R))),
    (2, None, ((1, K), (1, L))),
    (1, None, ((1, K),)),
    (1, None, ((1, L),)),
    (1, None, ((1, R),)),
    (1, None, ((1, B),)),
)
"""Floor plans: how often, size, and the tree of rooms with the ratio of their areas."""
