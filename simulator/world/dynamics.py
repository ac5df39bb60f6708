"""How homes change: one call evolves all homes by one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:  # homes evolve themselves with this module
    from simulator.world.sampled_homes import SampledHomes


def evolve(homes: SampledHomes) -> None:
    """Evolve every home by one step, in place: remove, then move, then add.

    Source: algorithm 1, appendix A "Evolution of the environment"; docs/design.md, rulings 2, 7
    and 8.
    """
    homes.object_moved[:] = False
    if homes.is_dynamic.any():
        remove_objects(homes)
    move_objects(homes)
    if homes.is_dynamic.any():
        add_objects(homes)


def remove_objects(homes: SampledHomes) -> None:
    """Let objects leave with their remove probability, never below the lower count bound."""
    from simulator.compiled.dynamics import choose_below  # loads numba

    uniform = homes.streams.rows("remove", homes.home_num_slots).next()
    budget = np.where(homes.is_dynamic, np.maximum(homes.num_objects - homes.min_count, 0), 0)
    home, slot = choose_below(uniform, homes.object_remove_prob, budget)
    homes.empty_slots(home * homes.num_slots + slot)


def move_objects(homes: SampledHomes) -> None:
    """Move 5 % of the present objects to another furniture node, following T^i.

    Movers are drawn without replacement with weight `move_freq` (an exponential race: the
    largest log(u) / weight win), among the objects that have somewhere else to go.
    """
    from simulator.compiled.dynamics import run_race  # loads numba

    uniform = homes.streams.rows("move who", homes.home_num_slots).next()
    num_moves = np.floor(homes.num_objects * homes.move_share + 0.5).astype(np.int64)
    weight = homes.object_move_weight
    home, slot, turn = run_race(uniform, weight, weight.sum(axis=1), num_moves)
    objects = home * homes.num_slots + slot
    where_to = homes.streams.rows("move where", _count_most_moves(homes)).next()
    places, can_leave = homes.transitions.sample_moves(
        homes.object_row.ravel()[objects],
        home,
        homes.object_place.ravel()[objects],
        where_to[home, turn],
    )
    homes.place_objects(objects, places, can_leave)
    homes.object_moved.ravel()[objects] = True


def add_objects(homes: SampledHomes) -> None:
    """Let each object type appear once with its add probability, up to the upper count bound."""
    from simulator.compiled.dynamics import choose_below  # loads numba
    from simulator.compiled.homes import find_empty_slots

    # Three numbers per type: whether and when it comes, its description, its place.
    numbers = homes.streams.rows("add", homes.type_add_prob.shape[1] * 3).claim()
    budget = np.where(homes.is_dynamic, np.maximum(homes.max_count - homes.num_objects, 0), 0)
    home, types = choose_below(numbers.fill(every=3), homes.type_add_prob, budget)
    what, where_to = np.ascontiguousarray(numbers.read(home, types * 3 + 1, 2).T)
    codes = homes.object_descriptions.sample(types, what)
    objects = find_empty_slots(homes.object_place, home)
    homes.fill_slots(objects, types, codes)
    rows = homes.object_row.ravel()[objects]
    places, can_leave = homes.transitions.sample_places(rows, home, where_to)
    homes.place_objects(objects, places, can_leave)


def _count_most_moves(homes: SampledHomes) -> np.ndarray:
    """Return the most moves a step can have, (H,); fixed, so that streams keep their widths."""
    return np.floor(homes.home_num_slots * homes.move_share + 0.5).astype(np.int64) + 1
