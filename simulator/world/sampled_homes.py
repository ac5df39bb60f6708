"""Sampled homes: the true state of many homes, as arrays over homes."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from functools import lru_cache

import numpy as np

from simulator.priors.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.descriptions import Adjectives, DescriptionTable
from simulator.world.dynamics import evolve
from simulator.world.homes import NUM_RELATIONS, Homes
from simulator.world.initial_objects import compute_available_weights, sample_initial_objects
from simulator.world.noise import compute_noisy_weights
from simulator.world.streams import Streams, sample_categorical
from simulator.world.transitions import Transitions

_NOISE_NUMBERS = 1 << 20  # random numbers of noise worked on at once: 8 MB


class SampledHomes(Homes):
    """The true state of H homes, evolved together by `simulator.world.dynamics.evolve`.

    A home has R rooms x `furniture_per_room` = F furniture nodes, P = 2 F places (a furniture
    node with a relation) and up to C objects in slots; an empty slot has place -1.

    Attributes:
        furniture_type: index into `prior.furniture`, (H, F).
        furniture_room: index into `config.rooms`, the same in every home, (F,).
        furniture_code: description code of `furniture_descriptions`, (H, F).
        place_weights: P^i at the home's own furniture, per object type, float32 (H, O, P); not
            normalised over P (a furniture type may stand there twice, or not at all).
        type_add_prob: `add_remove_prob`, or 0 where no furniture of the home takes it, (H, O).
        object_type: index into `prior.objects`, (H, C).
        object_code: description code of `object_descriptions`, (H, C).
        object_place: the place it is at, -1 if the slot is empty, (H, C).
        object_moved: whether it moved in the last step, (H, C).
        object_row: its row of `transitions`, (H, C).
        object_move_weight: `move_freq`, or 0 where it has nowhere else to go, (H, C).
        object_remove_prob: `add_remove_prob`, or 0 where there is no object, (H, C).
        transitions: T^i, a row per home and description that it has had; see `transition_rows`.
        num_objects: objects present, (H,).
        initial_count: objects at t = 0, (H,).
        min_count, max_count: bounds of `num_objects`, (H,).

    Methods that change objects name them by number: home * C + slot.

    Source: algorithm 1, section 4.1, appendix A; docs/design.md, rulings 1-6.
    """

    object_descriptions: DescriptionTable

    def __init__(
        self,
        prior: PriorGraph,
        config: HomeConfig,
        streams: Streams,
        layout: Sequence[tuple[str, str]] | None = None,
    ) -> None:
        """Sample the homes at t = 0.

        Args:
            prior: what homes look like.
            config: the rules.
            streams: random streams of the H homes.
            layout: (room, furniture label) of every furniture node, room after room, if all
                homes share a layout; None to sample `furniture_per_room` for each room.

        Raises:
            ValueError: if a room has no furniture that can hold an object, or the layout has
                furniture that the prior does not know in that room, or is not room after room.
        """
        self.prior = prior
        self.config = config
        self.streams = streams
        self.num_homes = len(streams.homes)
        self.room_labels = config.rooms
        self.object_labels = [row.label for row in prior.objects]
        if layout is None:
            layout_rooms = np.repeat(np.arange(len(config.rooms)), config.furniture_per_room)
        else:
            layout_rooms = _find_rooms(config.rooms, [room for room, _ in layout])
        self.furniture_room = layout_rooms
        self.num_furniture = len(layout_rooms)
        self.num_places = self.num_furniture * NUM_RELATIONS
        self.place_room = np.repeat(self.furniture_room, NUM_RELATIONS)
        self.object_descriptions, self.furniture_descriptions = _describe(prior)
        self.move_freq = np.array([row.move_freq for row in prior.objects])
        self.add_remove_prob = np.array([row.add_remove_prob for row in prior.objects])
        self.sample_prob = np.array([row.sample_prob for row in prior.objects])

        weights = prior.weights * self.sample_prob[:, None, None]
        self._node_rooms = _index_nodes(prior, config.rooms, weights)
        if layout is None:
            self.furniture_type = self._sample_furniture()
        else:
            nodes = _find_nodes(prior, layout)
            self.furniture_type = np.tile(nodes, (self.num_homes, 1))
        self.furniture_code = self.furniture_descriptions.sample(
            self.furniture_type.ravel(),
            streams.sample_once("furniture description", self.num_furniture).ravel(),
        ).reshape(self.furniture_type.shape)
        self.place_weights = self._sample_place_weights()
        has_place = np.any(self.place_weights, axis=2)
        self.type_add_prob = np.where(has_place, self.add_remove_prob, 0.0)

        capacity = self.num_furniture * config.objects_per_furniture
        self.num_slots = int(np.floor(capacity * (1 + config.count_slack)))
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
        is_room_new = np.diff(self.place_room, prepend=self.place_room[0]) != 0
        place_block = np.cumsum(is_room_new & (not config.cross_room_moves))
        self.transitions = Transitions(place_block, NUM_RELATIONS)
        self._sample_objects()
        self.initial_count = self.num_objects.copy()
        floor = np.ceil(self.initial_count * (1 - config.count_slack)).astype(np.int64)
        self.min_count = np.maximum(floor, 1)  # something to ask for is always left
        self.max_count = np.floor(self.initial_count * (1 + config.count_slack)).astype(np.int64)

    @property
    def furniture_labels(self) -> np.ndarray:
        """Text of every furniture node, (H, F)."""
        labels = np.array([row.label for row in self.prior.furniture], dtype=object)
        return labels[self.furniture_type]

    def get_place_weights(self) -> np.ndarray:
        """Return `place_weights`, (H, O, P)."""
        return self.place_weights

    def evolve(self) -> None:
        """Let one time step pass in every home; see `simulator.world.dynamics`."""
        evolve(self)

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
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

    def _ensure_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return T^i row numbers, drawing instance noise for descriptions that are new."""
        from simulator.compiled.homes import find_new_codes  # loads numba
        from simulator.compiled.noise import list_positive

        new = np.sort(find_new_codes(self._row_of_code, homes, codes))
        new_homes, new_codes = np.divmod(new, self._row_of_code.shape[1])
        types = self.object_descriptions.type_of_code[new_codes]
        at_once = max(_NOISE_NUMBERS // (self.num_places * 2), 1)
        for first in range(0, len(new_codes), at_once):
            some = slice(first, first + at_once)
            noise = self.streams.rows("instance noise", self.num_places * 2).claim(new_homes[some])
            rows, places, weights = list_positive(
                self.place_weights.reshape(-1, self.num_places),
                new_homes[some] * len(self.move_freq) + types[some],
            )
            noisy = compute_noisy_weights(
                weights,
                rows,
                places,
                noise.read(rows, places * 2, 2),
                self.place_room,
                zero_prob=self.config.noise_zero_prob,
                scale=self.config.noise_scale,
            )
            self._row_of_code[new_homes[some], new_codes[some]] = self.transitions.append(
                len(types[some]), rows, places, noisy
            )
        return self._row_of_code[homes, codes]

    def _sample_furniture(self) -> np.ndarray:
        """Draw furniture types, (H, F)."""
        prior = self.prior
        labels = sorted({row.label for row in prior.furniture})
        label_of_node = np.array([labels.index(row.label) for row in prior.furniture])
        prob = np.array([row.prob for row in prior.furniture])
        cap = np.array([row.max_count for row in prior.furniture])
        uniform = self.streams.sample_once("furniture", self.num_furniture)
        count = np.zeros((self.num_homes, len(labels)), dtype=np.int64)
        types = np.zeros((self.num_homes, self.num_furniture), dtype=np.int32)
        order = np.arange(self.num_furniture).reshape(len(self.config.rooms), -1).T.ravel()
        for furniture in order:  # rooms in turn, so that no room uses up a type's count
            nodes = self._node_rooms[self.furniture_room[furniture]]
            weights = compute_available_weights(
                np.tile(prob[nodes], (self.num_homes, 1)),
                count[:, label_of_node[nodes]],
                cap[nodes],
            )
            chosen = nodes[sample_categorical(weights, uniform[:, furniture])]
            types[:, furniture] = chosen
            count[np.arange(self.num_homes), label_of_node[chosen]] += 1
        return types

    def _sample_place_weights(self) -> np.ndarray:
        """Draw class noise and read P^i at the home's own furniture, float32 (H, O, P)."""
        num_objects, num_nodes, _ = self.prior.weights.shape
        node_room = np.array([self.prior.rooms.index(row.room) for row in self.prior.furniture])
        prior = self.prior.weights.reshape(num_objects, -1)
        rows, columns = np.nonzero(prior)  # of one home
        noise = self.streams.rows("class noise", 2 * prior.size).claim()
        weights = np.empty((self.num_homes, num_objects, self.num_places), dtype=np.float32)
        at_once = max(_NOISE_NUMBERS // (2 * prior.size), 1)
        for first in range(0, self.num_homes, at_once):
            count = min(at_once, self.num_homes - first)
            part_home = np.repeat(np.arange(count), len(rows))
            row, column = np.tile(rows, count), np.tile(columns, count)
            noisy = np.zeros((count, *prior.shape))
            noisy[part_home, row, column] = compute_noisy_weights(
                prior[row, column],
                part_home * num_objects + row,
                column,
                noise.read(first + part_home, (row * prior.shape[1] + column) * 2, 2),
                np.repeat(node_room, NUM_RELATIONS),
                zero_prob=self.config.noise_zero_prob,
                scale=self.config.noise_scale,
            )
            of_nodes = noisy.reshape(count, num_objects, num_nodes, NUM_RELATIONS)
            for home, own in enumerate(of_nodes, start=first):
                weights[home] = own[:, self.furniture_type[home]].reshape(num_objects, -1)
        return weights

    def _sample_objects(self) -> None:
        """Draw the objects of t = 0."""
        types, places, uniform = sample_initial_objects(self)  # (H, n)
        codes = self.object_descriptions.sample(types.ravel(), uniform.ravel())
        slots = np.arange(types.shape[1])
        objects = (np.arange(self.num_homes)[:, None] * self.num_slots + slots).ravel()
        self.fill_slots(objects, types.ravel(), codes)
        rows = self.object_row.ravel()[objects]
        can_leave = self.transitions.can_leave(rows, places.ravel().astype(np.int32))
        self.place_objects(objects, places.ravel(), can_leave)


def _describe(prior: PriorGraph) -> tuple[DescriptionTable, DescriptionTable]:
    """Make the description tables of objects and of furniture."""
    return (
        _make_descriptions(tuple((row.label, row.adjectives) for row in prior.objects)),
        _make_descriptions(tuple((row.label, row.adjectives) for row in prior.furniture)),
    )


@lru_cache(maxsize=8)
def _make_descriptions(rows: tuple[tuple[str, Adjectives], ...]) -> DescriptionTable:
    """Make a description table once for all homes of a prior; it never changes."""
    return DescriptionTable([label for label, _ in rows], [adjectives for _, adjectives in rows])


def _find_rooms(rooms: Sequence[str], layout_rooms: Sequence[str]) -> np.ndarray:
    """Return the room index of every furniture node of a layout, (F,)."""
    for room in layout_rooms:
        if room not in rooms:
            raise ValueError(
                f"room of a layout must be one of {', '.join(rooms)}, got {room!r}. "
                "Name it in the rooms of the config."
            )
    runs = [room for room, _ in itertools.groupby(layout_rooms)]
    if len(runs) > len(set(runs)):
        raise ValueError(
            f"layout must list its furniture room after room, got the rooms {', '.join(runs)}. "
            "Sort the furniture by room."
        )
    return np.array([list(rooms).index(room) for room in layout_rooms])


def _find_nodes(prior: PriorGraph, layout: Sequence[tuple[str, str]]) -> np.ndarray:
    """Return the index into `prior.furniture` of each furniture node of a layout, (F,)."""
    nodes = {(row.room, row.label): i for i, row in enumerate(prior.furniture)}
    for place in layout:
        if place not in nodes:
            raise ValueError(
                f"furniture of a layout must be in the prior, got {place[1]!r} in {place[0]!r}. "
                "Use furniture that the prior knows in that room."
            )
    return np.array([nodes[place] for place in layout], dtype=np.int32)


def _nodes_per_room(prior: PriorGraph, rooms: Sequence[str]) -> list[np.ndarray]:
    """List the furniture nodes of each room."""
    return [
        np.array([i for i, row in enumerate(prior.furniture) if row.room == room], dtype=np.int64)
        for room in rooms
    ]


def _index_nodes(prior: PriorGraph, rooms: Sequence[str], weights: np.ndarray) -> list[np.ndarray]:
    """List the furniture nodes of each room that may be drawn and can hold an object.

    Raises:
        ValueError: if a room has none.
    """
    can_hold = (weights.sum(axis=(0, 2)) > 0) & [row.prob > 0 for row in prior.furniture]
    usable = [nodes[can_hold[nodes]] for nodes in _nodes_per_room(prior, rooms)]
    for room, nodes in zip(rooms, usable, strict=True):
        if len(nodes) == 0:
            raise ValueError(
                f"room must have furniture that can hold an object, got none for {room!r} in the "
                f"prior, whose rooms are {', '.join(prior.rooms)}. Choose other rooms, or add "
                "furniture with placements to the prior."
            )
    return usable
