"""The true state of sampled homes that their dynamics read and change."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from sgm.schema import NUM_RELATIONS, PlaceCode
from simulator.world.descriptions import DescriptionTable
from simulator.world.homes import Homes
from simulator.world.noise import NUMBERS_AT_ONCE, compute_noisy_weights, list_positive
from simulator.world.transitions import Transitions


class SampledState(Homes):
    """Furniture, objects in slots and T^i of H sampled homes; see `Homes`. `SampledHomes` fills it.

    The largest home has F furniture nodes, P places (a furniture node with a relation, `PlaceCode`)
    and up to C objects in slots; an empty slot has place -1.

    Attributes:
        num_place_codes: P.
        add_remove_prob, sample_prob: of every object type, as the prior has them, (O,).
        furniture_type: index into `prior.furniture`, -1 beyond the furniture of a home, (H, F).
        place_room: room of every place, likewise, (H, P).
        place_weights: P^i at the home's own furniture, per object type, float32 (H, O, P); not
            normalised over P (a furniture type may stand there twice, or not at all).
        type_add_prob: `add_remove_prob`, or 0 where no furniture of the home takes it, (H, O).
        object_row: its row of `transitions`, (H, C).
        object_move_weight: `move_freq`, or 0 where it has nowhere else to go, (H, C).
        object_remove_prob: `add_remove_prob`, or 0 where there is no object, (H, C).
        transitions: T^i, a row per home and description that it has had; see `read_transitions`.
        num_objects: objects present, (H,).
        min_count, max_count: bounds of `num_objects`, (H,).

    Methods that change objects name them by number: home * C + slot.
    """

    object_descriptions: DescriptionTable
    num_place_codes: int
    add_remove_prob: np.ndarray
    sample_prob: np.ndarray
    furniture_type: np.ndarray
    place_room: np.ndarray
    place_weights: np.ndarray
    type_add_prob: np.ndarray
    object_row: np.ndarray
    object_move_weight: np.ndarray
    object_remove_prob: np.ndarray
    transitions: Transitions
    num_objects: np.ndarray
    min_count: np.ndarray
    max_count: np.ndarray

    @cached_property
    def noise_zero_prob(self) -> np.ndarray:
        """Probability that a placement weight is zeroed, by the rules of each home, (H,)."""
        return np.array([float(config.noise_zero_prob) for config in self.configs])

    @cached_property
    def noise_scale(self) -> np.ndarray:
        """By how much the other weights are scaled at most, by the rules of each home, (H,)."""
        return np.array([float(config.noise_scale) for config in self.configs])

    def list_spots(self) -> np.ndarray:
        """Return the place of every furniture node where people put things, (H, F).

        In it or on it, wherever the prior has more of them; beyond the furniture of a home, any.
        """
        relation_of_type = np.argmax(self.prior.weights.sum(axis=0), axis=1)
        relations = relation_of_type[self.furniture_type]
        return PlaceCode.of(np.arange(self.num_furniture), relations)

    def read_transitions(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the T^i rows of descriptions, (n,), (n,) -> (n, P); zero for unknown ones."""
        return self.transitions.read(self._row_of_code[homes, codes])

    def place_objects(self, objects: np.ndarray, places: np.ndarray, can_leave: np.ndarray) -> None:
        """Put objects at places from which they can leave or not, (n,) each."""
        self.object_place.ravel()[objects] = places
        types = self.object_type.ravel()[objects]
        self.object_move_weight.ravel()[objects] = self.move_freq[types] * can_leave

    def fill_slots(self, objects: np.ndarray, types: np.ndarray, codes: np.ndarray) -> None:
        """Make objects (n,), ascending, of types and descriptions (n,); then place them."""
        homes = objects // self.num_slots
        self.object_type.ravel()[objects] = types
        self.object_code.ravel()[objects] = codes
        self.object_row.ravel()[objects] = self._ensure_rows(homes, codes)
        self.object_remove_prob.ravel()[objects] = self.add_remove_prob[types]
        self.num_objects += np.bincount(homes, minlength=self.num_homes)

    def empty_slots(self, objects: np.ndarray) -> None:
        """Remove objects (n,)."""
        self.object_place.ravel()[objects] = -1
        self.object_move_weight.ravel()[objects] = 0
        self.object_remove_prob.ravel()[objects] = 0
        self.num_objects -= np.bincount(objects // self.num_slots, minlength=self.num_homes)

    def _make_slots(self) -> None:
        """Make the slots of all homes, empty, and T^i without a row."""
        shape = (self.num_homes, self.num_slots)
        self.object_type = np.zeros(shape, dtype=np.int32)
        self.object_code = np.zeros(shape, dtype=np.int32)
        self.object_row = np.zeros(shape, dtype=np.int32)
        self.object_place = np.full(shape, -1, dtype=np.int32)
        self.object_moved = np.zeros(shape, dtype=bool)
        self.object_move_weight = np.zeros(shape)
        self.object_remove_prob = np.zeros(shape)
        self.num_objects = np.zeros(self.num_homes, dtype=np.int64)
        num_codes = self.object_descriptions.num_descriptions
        self._row_of_code = np.full((self.num_homes, num_codes), -1, dtype=np.int32)
        stays = np.array([not config.cross_room_moves for config in self.configs])
        is_room_new = np.diff(self.place_room, axis=1, prepend=self.place_room[:, :1]) != 0
        is_room_new &= stays[:, None] & (self.place_room >= 0)
        self.transitions = Transitions(np.cumsum(is_room_new, axis=1), NUM_RELATIONS)

    def _ensure_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return T^i row numbers, drawing instance noise for descriptions that are new."""
        keys = homes * self._row_of_code.shape[1] + codes
        new = np.unique(keys[self._row_of_code.ravel()[keys] < 0])
        new_homes, new_codes = np.divmod(new, self._row_of_code.shape[1])
        types = self.object_descriptions.type_of_code[new_codes]
        at_once = max(NUMBERS_AT_ONCE // (self.num_place_codes * 2), 1)
        for first in range(0, len(new_codes), at_once):
            some = slice(first, first + at_once)
            rows, places, weights = list_positive(
                self.place_weights.reshape(-1, self.num_place_codes),
                new_homes[some] * len(self.move_freq) + types[some],
            )
            noisy = compute_noisy_weights(
                weights,
                rows,
                places,
                self._draw_instance_noise(new_homes[some], new_codes[some], rows, places),
                new_homes[some],
                self.place_room,
                PlaceCode.count(self.home_num_furniture),
                zero_prob=self.noise_zero_prob,
                scale=self.noise_scale,
            )
            self._row_of_code[new_homes[some], new_codes[some]] = self.transitions.append(
                new_homes[some], rows, places, noisy
            )
        return self._row_of_code[homes, codes]

    def _draw_instance_noise(
        self, homes: np.ndarray, codes: np.ndarray, rows: np.ndarray, places: np.ndarray
    ) -> np.ndarray:
        """Draw what `compute_noisy_weights` takes, (k, 2), for descriptions (n,), one per row."""
        num_numbers = PlaceCode.count(self.home_num_furniture) * 2
        noise = self.streams.rows("instance noise", num_numbers).claim(homes)
        return noise.read(rows, places * 2, 2)
