"""What tasks, sensing and oracles read of true homes, sampled or recorded."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Protocol

import numpy as np

from simulator.priors.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.streams import Streams

NUM_RELATIONS = 2  # 0 "in", 1 "onTop"; place p of a home = furniture p // 2, relation p % 2


class Descriptions(Protocol):
    """Numbered descriptions of objects, such as "large red mug".

    Attributes:
        num_descriptions: how many there are.
        type_of_code: object type of each description, (num_descriptions,).
    """

    num_descriptions: int
    type_of_code: np.ndarray

    def text(self, code: int) -> str:
        """Spell out one description."""


class Homes(ABC):
    """The true state of H homes that are stepped together.

    `SampledHomes` samples homes, `simulator.trace.RecordedHomes` replays recorded
    ones; a task cannot tell them apart. A home has F furniture nodes, P = 2 F places and up to C
    objects in slots.

    Attributes:
        prior: what can be known of homes beforehand.
        config: the rules.
        streams: random streams of the homes.
        num_homes, num_furniture, num_slots: H, F and C.
        room_labels: text of every room, the same in every home, (R,).
        furniture_room: room index of every furniture node, the same in every home, (F,).
        object_labels: text of every object type, first those of the prior in its order, (T,).
        object_descriptions: every description that an object of the homes may have.
        move_freq: weight of being asked for, per object type, (T,).
        object_type: (H, C).
        object_code: description code, (H, C).
        object_place: the place it is at, -1 if the slot is empty, (H, C).
        object_moved: whether it moved in the last step, (H, C).
        clock: where in the week step 0 is and how long steps are (`Clock.row`), (H, 2), nan where
            nobody knows; None for sampled homes, in which no time of day means anything.
    """

    prior: PriorGraph
    config: HomeConfig
    streams: Streams
    num_homes: int
    num_furniture: int
    num_slots: int
    room_labels: Sequence[str]
    furniture_room: np.ndarray
    object_labels: Sequence[str]
    object_descriptions: Descriptions
    move_freq: np.ndarray
    object_type: np.ndarray
    object_code: np.ndarray
    object_place: np.ndarray
    object_moved: np.ndarray
    clock: np.ndarray | None = None

    @property
    def is_present(self) -> np.ndarray:
        """Which object slots hold an object, (H, C)."""
        return self.object_place >= 0

    @property
    def object_furniture(self) -> np.ndarray:
        """Furniture index that each object is at, -1 for an empty slot, (H, C)."""
        return self.object_place // NUM_RELATIONS  # -1 // 2 == -1

    @property
    def labels(self) -> list[str]:
        """Every label once: house, floor, rooms, furniture and objects; the prior's first."""
        return list(
            dict.fromkeys(
                ["house", "floor", *self.room_labels]
                + [row.label for row in self.prior.furniture]
                + [*self.object_labels, *self.furniture_labels.ravel()]
            )
        )

    @property
    @abstractmethod
    def furniture_labels(self) -> np.ndarray:
        """Text of every furniture node, (H, F)."""

    @abstractmethod
    def get_place_weights(self) -> np.ndarray:
        """Return how likely each place of a home is for each object type at t = 0, (H, T, P).

        Raises:
            ValueError: if nobody knows: the homes were recorded.
        """

    @abstractmethod
    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the true dynamics of descriptions, (n,), (n,) -> (n, P); zero for unknown ones."""

    @abstractmethod
    def evolve(self) -> None:
        """Let one time step pass in every home."""
