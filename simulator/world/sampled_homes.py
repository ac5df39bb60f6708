"""Sampled homes: many homes, drawn from a prior and evolved by their dynamics."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group, pad_rows
from sgm.memory.clock import make_clock_rows
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import NUM_RELATIONS, PlaceCode
from simulator.world.config import HomeConfig
from simulator.world.descriptions import make_descriptions
from simulator.world.dynamics import Life
from simulator.world.initial_homes import (
    list_rooms,
    sample_initial_furniture,
    sample_initial_objects,
)
from simulator.world.noise import NUMBERS_AT_ONCE, compute_noisy_weights
from simulator.world.sampled_state import SampledState
from simulator.world.streams import Streams


class SampledHomes(SampledState):
    """The true state of H homes, evolved together by their dynamics; see `SampledState`.

    Attributes:
        furniture_code: description code of `furniture_descriptions`, -1 beyond, (H, F).
        lives: what evolves the homes, one for each class of dynamics.

    Source: algorithm 1, section 4.1, appendix A; docs/design.md, rulings 1-6.
    """

    configs: tuple[HomeConfig, ...]

    def __init__(
        self,
        prior: PriorGraph,
        config: HomeConfig | Sequence[HomeConfig],
        streams: Streams,
        layout: Sequence[tuple[str, str]] | None = None,
    ) -> None:
        """Sample the homes at t = 0, by the rules of all homes, or of each of them, (H,).

        A layout that all homes share is (room, furniture label) of every furniture node, room after
        room; None to sample `furniture_per_room` for each room.

        Raises:
            ValueError: if a room has no furniture that can hold an object, or the layout has
                furniture that the prior does not know in that room, or is not room after room, or
                there is not one config per home.
        """
        self.prior = prior
        self.streams = streams
        self.num_homes = len(streams.homes)
        self.configs = (
            (config,) * self.num_homes if isinstance(config, HomeConfig) else tuple(config)
        )
        if len(self.configs) != self.num_homes:
            raise ValueError(
                f"configs must be one, or one for each of the {self.num_homes} homes, got "
                f"{len(self.configs)}. Give as many as the streams have homes."
            )
        self.room_labels = pad_rows([config.rooms for config in self.configs], "", object)
        self.object_labels = [object_type.label for object_type in prior.objects]
        self.furniture_room = pad_rows(
            [list_rooms(config, layout) for config in self.configs], -1, np.int64
        )
        self.num_furniture = self.furniture_room.shape[1]
        self.num_place_codes = PlaceCode.count(self.num_furniture)
        self.place_room = np.repeat(self.furniture_room, NUM_RELATIONS, axis=1)
        self.object_descriptions = make_descriptions(prior.objects)
        self.furniture_descriptions = make_descriptions(prior.furniture)
        self.move_freq = np.array([object_type.move_freq for object_type in prior.objects])
        self.add_remove_prob = np.array(
            [object_type.add_remove_prob for object_type in prior.objects]
        )
        self.sample_prob = np.array([object_type.sample_prob for object_type in prior.objects])

        self.furniture_type = sample_initial_furniture(self, layout)
        is_furniture = self.is_furniture
        labels = np.array(
            [*(furniture_type.label for furniture_type in prior.furniture), ""], dtype=object
        )
        self.furniture_labels = labels[self.furniture_type]  # -1, the last one, beyond a home
        self.furniture_code = np.full(is_furniture.shape, -1, dtype=np.int32)
        self.furniture_code[is_furniture] = self.furniture_descriptions.sample(
            self.furniture_type[is_furniture],
            streams.sample_once("furniture description", self.home_num_furniture)[is_furniture],
        )
        self.place_weights = self._sample_place_weights()
        has_place = np.any(self.place_weights, axis=2)
        self.type_add_prob = np.where(has_place, self.add_remove_prob, 0.0)

        capacity = [config.objects_per_furniture for config in self.configs]
        slack = np.array([config.count_slack for config in self.configs])
        capacity = self.home_num_furniture * np.array(capacity)
        self.home_num_slots = np.floor(capacity * (1 + slack)).astype(np.int64)
        self.num_slots = int(self.home_num_slots.max())
        self._make_slots()
        self._sample_objects()
        floor = np.ceil(self.num_objects * (1 - slack)).astype(np.int64)
        self.min_count = np.maximum(floor, 1)  # something to ask for is always left
        self.max_count = np.floor(self.num_objects * (1 + slack)).astype(np.int64)
        self.clock = make_clock_rows([config.dynamics.clock for config in self.configs])
        classes = [type(config.dynamics) for config in self.configs]
        different = list(dict.fromkeys(classes))
        self._life_of_home = np.array([different.index(each_class) for each_class in classes])
        self.lives: list[Life] = []
        for number, rules_class in enumerate(different):
            members = np.flatnonzero(self._life_of_home == number)
            rules = [self.configs[home].dynamics for home in members]
            self.lives.append(rules_class.start(self, members, rules))

    def get_place_weights(self) -> np.ndarray:
        """Return `place_weights`, (H, O, P)."""
        return self.place_weights

    def evolve(self) -> None:
        """Let one time step pass in every home; see `simulator.world.dynamics`."""
        self.object_moved[:] = False
        for life in self.lives:
            life.step()

    def pass_steps(self, num_steps: int) -> None:
        """Let time steps pass, one at least; lives by the clock take all but the last at once."""
        if num_steps > 1:
            for life in self.lives:
                life.skip(num_steps - 1)
        self.evolve()

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return where objects of descriptions go by the dynamics of each home."""
        if len(self.lives) == 1:
            return self.lives[0].transition_rows(homes, codes)
        rows = np.empty((len(homes), self.num_place_codes), dtype=np.float32)
        for number, life in enumerate(self.lives):
            members = np.flatnonzero(self._life_of_home[homes] == number)
            rows[members] = life.transition_rows(homes[members], codes[members])
        return rows

    def sample_hours(self, num_hours: int) -> np.ndarray:
        """Return how homes of one class of dynamics may live on; see `Life.sample_hours`."""
        (life,) = self.lives
        return life.sample_hours(num_hours)

    def _sample_place_weights(self) -> np.ndarray:
        """Draw class noise and read P^i at the home's own furniture, float32 (H, O, P)."""
        num_objects, num_nodes, _ = self.prior.weights.shape
        node_room = np.array(
            [self.prior.rooms.index(furniture_type.room) for furniture_type in self.prior.furniture]
        )
        prior = self.prior.weights.reshape(num_objects, -1)
        rows, columns = np.nonzero(prior)  # of one home
        noise = self.streams.rows("class noise", 2 * prior.size).claim()
        weights = np.zeros((self.num_homes, num_objects, self.num_place_codes), dtype=np.float32)
        place_room = np.repeat(node_room, NUM_RELATIONS)
        at_once = max(NUMBERS_AT_ONCE // (2 * prior.size), 1)
        for first in range(0, self.num_homes, at_once):
            count = min(at_once, self.num_homes - first)
            part_home = np.repeat(np.arange(count), len(rows))
            object_type, column = np.tile(rows, count), np.tile(columns, count)
            some = slice(first, first + count)
            noisy = np.zeros((count, *prior.shape))
            uniform = noise.read(first + part_home, (object_type * prior.shape[1] + column) * 2, 2)
            noisy[part_home, object_type, column] = compute_noisy_weights(
                prior[object_type, column],
                part_home * num_objects + object_type,
                column,
                uniform,
                np.repeat(np.arange(count), num_objects),
                np.tile(place_room, (count, 1)),
                np.full(count, len(place_room)),
                zero_prob=self.noise_zero_prob[some],
                scale=self.noise_scale[some],
            )
            of_nodes = noisy.reshape(count, num_objects, num_nodes, NUM_RELATIONS)
            for home, home_weights in enumerate(of_nodes, start=first):
                nodes = self.furniture_type[home, self.is_furniture[home]]
                read = home_weights[:, nodes].reshape(num_objects, -1)
                weights[home, :, : read.shape[1]] = read
        return weights

    def _sample_objects(self) -> None:
        """Draw the objects of t = 0."""
        homes, types, places, codes = self.choose_objects()  # (n,)
        objects = homes * self.num_slots + compute_rank_in_group(homes)
        self.fill_slots(objects, types, codes)
        rows = self.object_row.ravel()[objects]
        can_leave = self.transitions.can_leave(rows, homes, places.astype(np.int32))
        self.place_objects(objects, places, can_leave)

    def choose_objects(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Draw homes, ascending, types, places and description codes of the objects, (n,) each."""
        homes, types, places, uniform = sample_initial_objects(self)
        return homes, types, places, self.object_descriptions.sample(types, uniform)
