"""A small prior that fits on a page, and homes made from it or from the shipped one."""

from collections.abc import Callable, Sequence

import numpy as np
import pytest

from sgm.layout.layout import LayoutArrays
from sgm.memory.memory_batch import MemoryBatch
from sgm.prior.place_prior import PlacePrior
from sgm.prior.prior_graph import FurnitureType, ObjectType, Placement, PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.routine.rules import Occasion
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

COLORS = ("red", "blue")
SIZES = ("large", "small")

# label, room, prob, max_count, adjectives
FURNITURE = [
    ("fridge", "kitchen", 1.0, 2, ()),
    ("shelf", "kitchen", 2.0, 3, (("oak", "pine"),)),
    ("table", "kitchen", 1.0, 2, ()),
    ("bed", "bedroom", 1.0, 1, ()),
    ("shelf", "bedroom", 1.0, 3, (("oak", "pine"),)),
    ("desk", "bedroom", 2.0, 2, ()),
]
# label, sample_prob, max_count, move_freq, add_remove_prob, adjectives
OBJECTS = [
    ("mug", 0.8, 4, 1.0, 0.1, (COLORS, SIZES)),
    ("milk", 0.5, 2, 0.5, 0.05, ()),
    ("book", 1.0, 6, 0.6, 0.1, (("old", "new"),)),
    ("lamp", 0.3, 1, 0.0, 0.02, ()),
    ("plate", 0.9, 6, 0.8, 0.1, (("round", "square"),)),
    ("apple", 0.6, 5, 0.9, 0.3, (("red", "green"),)),
    ("sock", 0.7, 5, 0.7, 0.1, (COLORS,)),
    ("pen", 0.5, 5, 0.9, 0.05, (COLORS,)),
    ("phone", 0.4, 2, 1.0, 0.05, ()),
    ("pillow", 0.6, 3, 0.2, 0.02, ()),
]
# room, furniture, object, relation, prob
PLACEMENTS = [
    ("kitchen", "shelf", "mug", "in", 0.4),
    ("kitchen", "table", "mug", "onTop", 0.4),
    ("bedroom", "desk", "mug", "onTop", 0.2),
    ("kitchen", "fridge", "milk", "in", 0.8),
    ("kitchen", "table", "milk", "onTop", 0.2),
    ("bedroom", "shelf", "book", "onTop", 0.5),
    ("bedroom", "desk", "book", "onTop", 0.3),
    ("kitchen", "shelf", "book", "onTop", 0.2),
    ("bedroom", "desk", "lamp", "onTop", 0.6),
    ("bedroom", "shelf", "lamp", "onTop", 0.4),
    ("kitchen", "shelf", "plate", "onTop", 0.5),
    ("kitchen", "shelf", "plate", "in", 0.2),
    ("kitchen", "table", "plate", "onTop", 0.3),
    ("kitchen", "fridge", "apple", "in", 0.4),
    ("kitchen", "table", "apple", "onTop", 0.4),
    ("bedroom", "desk", "apple", "onTop", 0.2),
    ("bedroom", "bed", "sock", "onTop", 0.5),
    ("bedroom", "shelf", "sock", "in", 0.5),
    ("bedroom", "desk", "pen", "onTop", 0.5),
    ("bedroom", "desk", "pen", "in", 0.25),
    ("kitchen", "table", "pen", "onTop", 0.25),
    (None, "shelf", "phone", "onTop", 0.2),
    (None, "table", "phone", "onTop", 0.2),
    (None, "desk", "phone", "onTop", 0.2),
    (None, "bed", "phone", "onTop", 0.2),
    ("bedroom", "bed", "pillow", "onTop", 0.7),
    ("bedroom", "shelf", "pillow", "in", 0.3),
]
# Furniture numbers 0-5 of the homes of one layout.
LAYOUT = [(room, label) for label, room, *_ in FURNITURE]
ROOMS = ("kitchen", "bedroom")


@pytest.fixture(scope="session")
def tiny_prior() -> PriorGraph:
    """Two rooms, six furniture nodes, ten object types."""
    return PriorGraph(
        rooms=ROOMS,
        furniture=tuple(FurnitureType(*row) for row in FURNITURE),
        objects=tuple(ObjectType(*row) for row in OBJECTS),
        placements=tuple(Placement(*row) for row in PLACEMENTS),
    )


@pytest.fixture(scope="session")
def default_prior() -> PriorGraph:
    return PriorGraph.default()


@pytest.fixture(scope="session")
def make_tiny_homes(tiny_prior: PriorGraph) -> Callable[..., SampledHomes]:
    """Homes of the small prior, all with the furniture of `LAYOUT` unless told otherwise."""

    def make(
        num_homes: int = 1,
        seed: int = 0,
        layout: Sequence[tuple[str, str]] | None = LAYOUT,
        prior: PriorGraph = tiny_prior,
        homes: Sequence[int] | None = None,
        **rules: object,
    ) -> SampledHomes:
        numbers = range(num_homes) if homes is None else homes
        config = HomeConfig(rooms=ROOMS, **rules)
        return SampledHomes(prior, config, Streams(seed, "train", numbers), layout)

    return make


@pytest.fixture(scope="session")
def make_default_homes(default_prior: PriorGraph) -> Callable[..., SampledHomes]:
    """Homes of the shipped prior."""

    def make(
        num_homes: int = 1, seed: int = 0, homes: Sequence[int] | None = None, **rules: object
    ) -> SampledHomes:
        numbers = range(num_homes) if homes is None else homes
        return SampledHomes(default_prior, HomeConfig(**rules), Streams(seed, "test", numbers))

    return make


@pytest.fixture
def make_tiny_memory(tiny_prior: PriorGraph) -> Callable[..., MemoryBatch]:
    """Empty memories of homes with the furniture of `LAYOUT`."""

    def make(num_homes: int = 1, threshold: float = 0.0) -> MemoryBatch:
        furniture = [label for _, label in LAYOUT]
        rooms = [ROOMS.index(room) for room, _ in LAYOUT]
        objects = [row.label for row in tiny_prior.objects]
        labels = list(dict.fromkeys(["house", "floor", *ROOMS, *furniture, *objects]))
        furniture_room = np.tile(rooms, (num_homes, 1))
        place_prior = PlacePrior(
            tiny_prior, [ROOMS] * num_homes, [furniture] * num_homes, furniture_room
        )
        layout = LayoutArrays(
            np.tile([labels.index(room) for room in ROOMS], (num_homes, 1)),
            np.tile([labels.index(label) for label in furniture], (num_homes, 1)),
            furniture_room,
            place_prior,
        )
        memory = MemoryBatch(labels, layout, threshold)
        memory.count_history()
        return memory

    return make


def make_strict_life(minutes: float) -> RoutineDynamics:
    """Return rules of one resident who has lunch at noon each day, always with the same things.

    All are put back afterwards; lunch takes `minutes`.
    """
    lunch = Occasion("lunch", "eating", 12.0, 12.0, minutes, 1.0, 1.0)
    return RoutineDynamics(
        occasions=(lunch,), max_residents=1, person_spread_hours=0, habit_spread_hours=0,
        omission_spread=0, drift_hours=0, jitter_hours=0, min_use=1, max_use=1, static_share=0,
        elsewhere_share=0, extra_share=0, left_share=0, left_habit=1, second_place_share=0,
        new_share=0,
    )  # fmt: skip
