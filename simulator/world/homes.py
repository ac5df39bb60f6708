"""What tasks, sensing and oracles read of true homes, sampled or recorded."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from functools import cached_property
from typing import Protocol

import numpy as np

from sgm.memory.clock import Clock
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import HOME_LABELS, PlaceCode
from simulator.world.parts import Part
from simulator.world.rules import HomeRules
from simulator.world.streams import Streams

_MONDAY = datetime(2024, 5, 6)  # of clocks that say no more than where in the week they are


def list_labels(prior: PriorGraph, more: Iterable[str] = ()) -> list[str]:
    """List every label once: house, floor, rooms, furniture and objects of a prior, then others."""
    furniture = [furniture_type.label for furniture_type in prior.furniture]
    objects = [object_type.label for object_type in prior.objects]
    return list(dict.fromkeys([*HOME_LABELS, *prior.rooms, *furniture, *objects, *more]))


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
    """The true state of H homes of any sizes that are stepped together.

    `SampledHomes` samples homes, `simulator.trace.RecordedHomes` replays recorded
    ones; a task cannot tell them apart. The largest home has R rooms, F furniture nodes, P places
    (`PlaceCode.count`) and slots for C objects; the rows of smaller ones end with the values that
    are named below, and what happens in a home does not depend on those beside it.

    Attributes:
        prior: what can be known of homes beforehand.
        configs: the rules of every home, (H,).
        streams: random streams of the homes.
        num_homes, num_furniture, num_slots: H, F and C.
        room_labels: text of every room, "" beyond those of a home, (H, R).
        furniture_labels: text of every furniture node, "" beyond those of a home, (H, F).
        furniture_room: room index of every furniture node, -1 beyond those of a home, (H, F).
        home_num_slots: slots of each home, the first ones of its row, (H,).
        object_labels: text of every object type, first those of the prior in its order, (T,).
        object_descriptions: every description that an object of the homes may have.
        move_freq: weight of being asked for, per object type, (T,).
        object_type: (H, C).
        object_code: description code, (H, C).
        object_place: the place it is at, -1 if the slot is empty, (H, C).
        object_moved: whether it moved in the last step, (H, C).
        clock: where in the week step 0 is and how long steps are (`Clock.row`), (H, 2), nan where
            unknown; None where no time of day means anything, as in the paper's homes.
        pauses: how many time steps pass before each question of a task, in turn, and from the first
            on again, (n,); None for one before each.
    """

    prior: PriorGraph
    configs: tuple[HomeRules, ...]
    streams: Streams
    num_homes: int
    num_furniture: int
    num_slots: int
    room_labels: np.ndarray
    furniture_labels: np.ndarray
    furniture_room: np.ndarray
    home_num_slots: np.ndarray
    object_labels: Sequence[str]
    object_descriptions: Descriptions
    move_freq: np.ndarray
    object_type: np.ndarray
    object_code: np.ndarray
    object_place: np.ndarray
    object_moved: np.ndarray
    clock: np.ndarray | None = None
    pauses: np.ndarray | None = None

    @property
    def is_present(self) -> np.ndarray:
        """Which object slots hold an object, (H, C)."""
        return self.object_place >= 0

    @property
    def object_furniture(self) -> np.ndarray:
        """Furniture index that each object is at, -1 for an empty slot, (H, C)."""
        return PlaceCode.furniture(self.object_place)

    @property
    def labels(self) -> list[str]:
        """Every label once: house, floor, rooms, furniture and objects of the prior, then others.

        Labels that the prior knows have the same number whatever homes are there.
        """
        home_labels = [
            *self.object_labels,
            *self.room_labels.ravel(),
            *self.furniture_labels.ravel(),
        ]
        return list_labels(self.prior, filter(None, home_labels))

    @property
    def is_furniture(self) -> np.ndarray:
        """Which columns are furniture of a home, the first ones of its row, bool (H, F)."""
        return self.furniture_room >= 0

    @cached_property
    def home_num_furniture(self) -> np.ndarray:
        """Furniture nodes of each home, (H,)."""
        return np.count_nonzero(self.is_furniture, axis=1)

    @cached_property
    def detection_error(self) -> np.ndarray:
        """Probability that an object looked at is missed, by the rules of each home, (H,)."""
        return np.array([config.detection_error for config in self.configs])

    @cached_property
    def type_labels(self) -> np.ndarray:
        """What each object type is called in each home, object (H, T); each is in `labels`."""
        return np.tile(np.array(self.object_labels, dtype=object), (self.num_homes, 1))

    @cached_property
    def prior_types(self) -> np.ndarray:
        """As which type of the prior an agent takes each type in each home, -1 for none, (H, T)."""
        types = np.arange(len(self.object_labels))
        return np.tile(np.where(types < len(self.prior.objects), types, -1), (self.num_homes, 1))

    def view_prior(self, weights: np.ndarray) -> np.ndarray:
        """Return `PlacePrior.weights` of the layouts as the agents know them."""
        return weights

    def make_clock(self, home: int = 0) -> Clock | None:
        """Return what time it is in a home, in some week; None where no time means anything."""
        if self.clock is None or not np.isfinite(self.clock[home]).all():
            return None
        since_monday, step_seconds = self.clock[home].tolist()
        return Clock(_MONDAY + timedelta(seconds=since_monday), step_seconds)

    @cached_property
    def sensing(self) -> list[tuple[Part, np.ndarray]]:
        """What looks show, and in which homes, bool (H,): each home has one of them."""
        sensing_of_home = [config.sensing for config in self.configs]
        return [
            (part, np.array([part == each for each in sensing_of_home]))
            for part in dict.fromkeys(sensing_of_home)
        ]

    @abstractmethod
    def get_place_weights(self) -> np.ndarray:
        """Return how likely each place of a home is for each object type at t = 0, (H, T, P).

        Raises:
            ValueError: if they are unknown: the homes were recorded.
        """

    @abstractmethod
    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the true dynamics of descriptions, (n,), (n,) -> (n, P); zero for unknown ones."""

    @abstractmethod
    def evolve(self) -> None:
        """Let one time step pass in every home."""

    def pass_steps(self, num_steps: int) -> None:
        """Let time steps pass, one at least; `object_moved` is of the last one."""
        for _ in range(num_steps):
            self.evolve()
