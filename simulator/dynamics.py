"""How homes change: one call evolves all houses by one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # homes evolve themselves with this module
    from simulator.houses import Houses


def evolve(houses: Houses) -> None:
    """Evolve every house by one step, in place: remove, then move, then add.

    Source: algorithm 1, appendix A "Evolution of the environment"; rulings 2, 7 and 8.
    """
    houses.object_moved[:] = False
    if houses.config.dynamic_nodes:
        remove_objects(houses)
    move_objects(houses)
    if houses.config.dynamic_nodes:
        add_objects(houses)


def remove_objects(houses: Houses) -> None:
    """Let objects leave with their remove probability, never below the lower count bound."""
    from simulator.compiled.dynamics import choose_below  # loads numba

    uniform = houses.streams.rows("remove", houses.num_slots).next()
    budget = np.maximum(houses.num_objects - houses.min_count, 0)
    house, slot = choose_below(uniform, houses.object_remove_prob, budget)
    houses.empty_slots(house * houses.num_slots + slot)


def move_objects(houses: Houses) -> None:
    """Move 5 % of the present objects to another furniture node, following T^i.

    Movers are drawn without replacement with weight `move_freq` (an exponential race: the
    largest log(u) / weight win), among the objects that have somewhere else to go.
    """
    from simulator.compiled.dynamics import run_race  # loads numba

    uniform = houses.streams.rows("move who", houses.num_slots).next()
    num_moves = np.floor(houses.num_objects * houses.config.move_share + 0.5).astype(np.int64)
    weight = houses.object_move_weight
    house, slot, turn = run_race(uniform, weight, weight.sum(axis=1), num_moves)
    objects = house * houses.num_slots + slot
    where_to = houses.streams.rows("move where", _count_most_moves(houses)).next()
    places, can_leave = houses.transitions.sample_moves(
        houses.object_row.ravel()[objects],
        houses.object_place.ravel()[objects],
        where_to[house, turn],
    )
    houses.place_objects(objects, places, can_leave)
    houses.object_moved.ravel()[objects] = True


def add_objects(houses: Houses) -> None:
    """Let each object type appear once with its add probability, up to the upper count bound."""
    from simulator.compiled.dynamics import choose_below  # loads numba
    from simulator.compiled.houses import find_empty_slots

    # Three numbers per type: whether and when it comes, its description, its place.
    numbers = houses.streams.rows("add", houses.type_add_prob.shape[1] * 3).claim()
    budget = np.maximum(houses.max_count - houses.num_objects, 0)
    house, types = choose_below(numbers.fill(every=3), houses.type_add_prob, budget)
    what, where_to = np.ascontiguousarray(numbers.read(house, types * 3 + 1, 2).T)
    codes = houses.object_descriptions.sample(types, what)
    objects = find_empty_slots(houses.object_place, house)
    houses.fill_slots(objects, types, codes)
    places, can_leave = houses.transitions.sample_places(
        houses.object_row.ravel()[objects], where_to
    )
    houses.place_objects(objects, places, can_leave)


def _count_most_moves(houses: Houses) -> int:
    """Return the most moves a step can have; fixed, so that streams keep their width."""
    return int(np.floor(houses.num_slots * houses.config.move_share + 0.5)) + 1
