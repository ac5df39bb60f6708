"""How homes change: one call evolves all houses by one step."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simulator.grouped import compute_rank_in_group

if TYPE_CHECKING:  # homes evolve themselves with this module
    from simulator.houses import Houses
    from simulator.streams import UniformStream


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
    stream = houses.streams.rows("remove", houses.num_slots)
    objects = np.flatnonzero(stream.next() < houses.object_remove_prob)
    house = objects // houses.num_slots
    uniform = stream.read_last(house, objects - house * houses.num_slots)
    # Given that it is below the probability, uniform / prob is uniform: a random order for free.
    order = uniform / houses.object_remove_prob.ravel()[objects]
    budget = np.maximum(houses.num_objects - houses.min_count, 0)
    houses.empty_slots(objects[_choose_first(house, order, budget)])


def move_objects(houses: Houses) -> None:
    """Move 5 % of the present objects to another furniture node, following T^i.

    Movers are drawn without replacement with weight `move_freq` (an exponential race: the
    largest log(u) / weight win), among the objects that have somewhere else to go.
    """
    stream = houses.streams.rows("move who", houses.num_slots)
    num_moves = np.floor(houses.num_objects * houses.config.move_share + 0.5).astype(np.int64)
    objects, house, turn = run_race(stream, houses.object_move_weight, num_moves)
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
    width = len(houses.add_remove_prob) * 3  # per type: whether and when, description, place
    stream = houses.streams.rows("add", width)
    threshold = np.zeros(width)
    threshold[::3] = houses.add_remove_prob
    numbers = np.flatnonzero(stream.next() < threshold)
    house = numbers // width
    column = numbers - house * width
    fits = houses.has_place[house, column // 3]
    house, column = house[fits], column[fits]
    order = stream.read_last(house, column) / threshold[column]
    budget = np.maximum(houses.max_count - houses.num_objects, 0)
    coming = _choose_first(house, order, budget)
    house, column = house[coming], column[coming]
    types = column // 3
    codes = houses.object_descriptions.sample(types, stream.read_last(house, column + 1))
    empty = np.flatnonzero(houses.object_place < 0)
    first_empty = np.searchsorted(empty, np.arange(houses.num_houses) * houses.num_slots)
    objects = empty[first_empty[house] + compute_rank_in_group(house)]
    houses.fill_slots(objects, types, codes)
    places, can_leave = houses.transitions.sample_places(
        houses.object_row.ravel()[objects], stream.read_last(house, column + 2)
    )
    houses.place_objects(objects, places, can_leave)


def _choose_first(house: np.ndarray, order: np.ndarray, budget: np.ndarray) -> np.ndarray:
    """Return the positions of the first of every house, up to its budget, ascending."""
    if (np.bincount(house, minlength=len(budget)) <= budget).all():
        return np.arange(len(house))
    return np.sort(list_first(house, order, budget)[0])


def list_first(
    house: np.ndarray, order: np.ndarray, budget: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """List the first of every house, up to its budget.

    Args:
        house: ascending, (n,).
        order: finite; the lowest is the first, (n,).
        budget: how many are listed of each house at most, (H,).

    Returns:
        Positions among the n, house after house, each in order; their houses and their ranks.
    """
    count = np.bincount(house, minlength=len(budget))
    first = np.cumsum(count) - count
    width = int(count.max())
    table = np.full((len(budget), width), np.inf)
    table.ravel()[
        np.arange(len(house)) + np.repeat(np.arange(len(budget)) * width - first, count)
    ] = order
    chosen = np.minimum(budget, count)
    most = int(chosen.max())
    by_rank = np.argsort(table, axis=1, kind="stable")[:, :most]
    listed = np.flatnonzero(np.arange(most) < chosen[:, None])
    house = listed // max(most, 1)
    return first[house] + by_rank.ravel()[listed], house, listed - house * most


def run_race(
    stream: UniformStream, weight: np.ndarray, num_winners: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the objects with the largest log(uniform) / weight, at most `num_winners` per house.

    Only objects that come near to winning are looked at: as log(u) <= u - 1, whoever has
    log(u) / weight above -reach has u > 1 - reach * weight. Where that leaves too few, the whole
    house is run.

    Args:
        stream: gives the uniforms, (H, C).
        weight: non-negative, 0 for objects that do not take part, (H, C).
        num_winners: (H,).

    Returns:
        Winners (home * C + slot), their homes, and their ranks within the home.
    """
    most = int(num_winners.max())
    # So many are expected within reach that it is rare that they are fewer than `most`.
    total = np.maximum(weight.sum(axis=1), 1e-300)
    reach = (most + 6 * np.sqrt(most)) / total  # (H,)
    is_near = stream.next() > (1 - 1e-12) - reach[:, None] * weight
    runners, house, lag = _list_runners(stream, is_near, weight)
    num_sure = np.bincount(house[lag < reach[house]], minlength=len(total))
    short = num_sure < num_winners
    if short.any():
        is_near[short] = True
        runners, house, lag = _list_runners(stream, is_near, weight)
    winners, house, turn = list_first(house, lag, num_winners)
    return runners[winners], house, turn


def _list_runners(
    stream: UniformStream, is_near: np.ndarray, weight: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the objects that are near and take part, their homes and -log(uniform) / weight."""
    runners = np.flatnonzero(is_near)
    own_weight = weight.ravel()[runners]
    takes_part = own_weight > 0
    if not takes_part.all():
        runners, own_weight = runners[takes_part], own_weight[takes_part]
    house = runners // weight.shape[1]
    uniform = stream.read_last(house, runners - house * weight.shape[1])
    return runners, house, -np.log(np.maximum(uniform, 1e-300)) / own_weight


def _count_most_moves(houses: Houses) -> int:
    """Return the most moves a step can have; fixed, so that streams keep their width."""
    return int(np.floor(houses.num_slots * houses.config.move_share + 0.5)) + 1
