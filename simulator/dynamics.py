"""How homes change: one call evolves all houses by one step."""

from __future__ import annotations

import numpy as np

from simulator.grouped import compute_rank_in_group
from simulator.houses import Houses
from simulator.streams import sample_categorical


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
    uniform = houses.streams.rows("remove", houses.num_slots).next()  # (H, C)
    present = houses.is_present
    prob = houses.add_remove_prob[houses.object_type]
    house, slot = np.nonzero(present & (uniform < prob))
    floor = np.ceil(houses.initial_count * (1 - houses.config.count_slack)).astype(np.int64)
    floor = np.maximum(floor, 1)  # something to ask for is always left
    budget = np.maximum(present.sum(axis=1) - floor, 0)
    # Given that it is below the probability, uniform / prob is uniform: a random order for free.
    order = np.lexsort((uniform[house, slot] / prob[house, slot], house))
    leaves = order[compute_rank_in_group(house) < budget[house]]
    houses.object_place[house[leaves], slot[leaves]] = -1
    houses.object_move_weight[house[leaves], slot[leaves]] = 0


def move_objects(houses: Houses) -> None:
    """Move 5 % of the present objects to another furniture node, following T^i.

    Movers are drawn without replacement with weight `move_freq` (an exponential race: the
    largest log(u) / weight win), among the objects that have somewhere else to go.
    """
    uniform = houses.streams.rows("move who", houses.num_slots).next()  # (H, C)
    num_moves = np.floor(houses.is_present.sum(axis=1) * houses.config.move_share + 0.5).astype(
        np.int64
    )
    most = min(int(num_moves.max()), houses.num_slots)
    where_to = houses.streams.rows("move where", _count_most_moves(houses)).next()
    if most == 0:
        return
    weight = houses.object_move_weight
    key = np.divide(
        np.log(np.maximum(uniform, 1e-300)),
        weight,
        out=np.full(weight.shape, -np.inf),
        where=weight > 0,
    )
    top = np.argpartition(key, houses.num_slots - most, axis=1)[:, houses.num_slots - most :]
    top = np.take_along_axis(
        top, np.argsort(-np.take_along_axis(key, top, axis=1), axis=1, kind="stable"), axis=1
    )  # (H, most), first mover first
    is_move = np.arange(most) < num_moves[:, None]
    is_move &= np.take_along_axis(weight, top, axis=1) > 0
    house, turn = np.nonzero(is_move)
    slot = top[house, turn]
    options = houses.compute_move_options(
        house, houses.object_row[house, slot], houses.object_place[house, slot]
    )
    houses.place_objects(house, slot, sample_categorical(options, where_to[house, turn]))
    houses.object_moved[house, slot] = True


def add_objects(houses: Houses) -> None:
    """Let each object type appear once with its add probability, up to the upper count bound."""
    num_types = len(houses.add_remove_prob)
    uniform = houses.streams.rows("add", num_types * 3).next()
    uniform = uniform.reshape(-1, num_types, 3)  # whether and when, description, place
    prob = houses.add_remove_prob
    house, types = np.nonzero((uniform[..., 0] < prob) & houses.has_place)
    ceiling = np.floor(houses.initial_count * (1 + houses.config.count_slack)).astype(np.int64)
    budget = np.maximum(ceiling - houses.is_present.sum(axis=1), 0)
    order = np.lexsort((uniform[house, types, 0] / prob[types], house))
    chosen = np.sort(order[compute_rank_in_group(house) < budget[house]])
    if len(chosen) == 0:
        return
    house, types = house[chosen], types[chosen]
    codes = houses.object_descriptions.sample(types, uniform[house, types, 1])
    empty_house, empty_slot = np.nonzero(~houses.is_present)
    first_empty = np.searchsorted(empty_house, house)
    slot = empty_slot[first_empty + compute_rank_in_group(house)]
    houses.fill_slots(house, slot, types, codes)
    rows = houses.transitions[house, houses.object_row[house, slot]]
    houses.place_objects(house, slot, sample_categorical(rows, uniform[house, types, 2]))


def _count_most_moves(houses: Houses) -> int:
    """Return the most moves a step can have; fixed, so that streams keep their width."""
    return int(np.floor(houses.num_slots * houses.config.move_share + 0.5)) + 1
