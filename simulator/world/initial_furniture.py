"""Which furniture stands where: drawn from the prior room by room, or as a layout says."""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from simulator.world.initial_objects import compute_available_weights
from simulator.world.rules import HomeRules
from simulator.world.sampled_state import SampledState
from simulator.world.streams import sample_categorical


def list_rooms(config: HomeRules, layout: Sequence[tuple[str, str]] | None) -> np.ndarray:
    """Return the room index of every furniture node of a home, (F',), by its rules or a layout.

    Raises:
        ValueError: if the layout has other rooms than the rules, or is not room after room.
    """
    rooms = config.rooms
    if layout is None:
        return np.repeat(np.arange(len(rooms)), config.room_sizes)
    if len(set(rooms)) < len(rooms):
        raise ValueError(
            f"rooms must differ where a layout is given, got {', '.join(rooms)}. Leave the layout "
            "out, or name each room once."
        )
    for room, _ in layout:
        if room not in rooms:
            raise ValueError(
                f"room of a layout must be one of {', '.join(rooms)}, got {shorten(room)}. Name it "
                "in the rooms of the config."
            )
    runs = [room for room, _ in itertools.groupby(room for room, _ in layout)]
    if len(runs) > len(set(runs)):
        raise ValueError(
            f"layout must list its furniture room after room, got the rooms {', '.join(runs)}. "
            "Sort the furniture by room."
        )
    return np.array([rooms.index(room) for room, _ in layout])


def sample_initial_furniture(
    homes: SampledState, layout: Sequence[tuple[str, str]] | None
) -> np.ndarray:
    """Return indices into `prior.furniture`, -1 beyond the furniture of a home, (H, F).

    They are those of a layout, or drawn; rooms and numbers of furniture are known already.

    Raises:
        ValueError: if a room has no furniture that can hold an object, or the layout has some that
            the prior does not know there.

    Source: algorithm 1, appendix A; docs/design.md, rulings 3 and 4.
    """
    usable = _list_usable(homes)
    if layout is not None:
        return np.tile(_find_nodes(homes.prior, layout), (homes.num_homes, 1))
    uniform = homes.streams.sample_once("furniture", homes.home_num_furniture)
    types = np.full(uniform.shape, -1, dtype=np.int32)
    alike: dict[tuple[tuple[str, ...], tuple[int, ...]], list[int]] = defaultdict(list)
    for home, config in enumerate(homes.configs):
        alike[config.rooms, config.room_sizes].append(home)
    for (rooms, sizes), members in alike.items():
        own = np.ix_(np.array(members), np.arange(sum(sizes)))
        nodes = [usable[room] for room in np.repeat(np.array(rooms, dtype=object), sizes)]
        turn = compute_rank_in_group(np.repeat(np.arange(len(rooms)), sizes))
        types[own] = _draw_types(homes.prior, nodes, turn, uniform[own])
    return types


def _draw_types(
    prior: PriorGraph, nodes: Sequence[np.ndarray], turn: np.ndarray, uniform: np.ndarray
) -> np.ndarray:
    """Draw types of n homes, (n, F'), for the nodes of each room in turn (F',)."""
    labels = sorted({row.label for row in prior.furniture})
    label_of_node = np.array([labels.index(row.label) for row in prior.furniture])
    prob = np.array([row.prob for row in prior.furniture])
    cap = np.array([row.max_count for row in prior.furniture])
    count = np.zeros((len(uniform), len(labels)), dtype=np.int64)
    types = np.zeros(uniform.shape, dtype=np.int32)
    for furniture in np.argsort(turn, kind="stable"):  # rooms in turn: none uses up a type
        own = nodes[furniture]
        weights = compute_available_weights(
            np.tile(prob[own], (len(uniform), 1)), count[:, label_of_node[own]], cap[own]
        )
        chosen = own[sample_categorical(weights, uniform[:, furniture])]
        types[:, furniture] = chosen
        count[np.arange(len(uniform)), label_of_node[chosen]] += 1
    return types


def _list_usable(homes: SampledState) -> dict[str, np.ndarray]:
    """Return the furniture nodes of each room that may be drawn and can hold an object, by room."""
    prior = homes.prior
    weights = prior.weights * homes.sample_prob[:, None, None]
    can_hold = (weights.sum(axis=(0, 2)) > 0) & [row.prob > 0 for row in prior.furniture]
    rooms_of_nodes = np.array([row.room for row in prior.furniture], dtype=object)
    rooms = dict.fromkeys(homes.room_labels[homes.room_labels != ""])
    usable = {room: np.flatnonzero(can_hold & (rooms_of_nodes == room)) for room in rooms}
    for room, nodes in usable.items():
        if len(nodes) == 0:
            raise ValueError(
                f"room must have furniture that can hold an object, got none for {shorten(room)} "
                f"in the prior, whose rooms are {', '.join(prior.rooms)}. Choose other rooms, or "
                "add furniture with placements to the prior."
            )
    return usable


def _find_nodes(prior: PriorGraph, layout: Sequence[tuple[str, str]]) -> np.ndarray:
    """Return the index into `prior.furniture` of each furniture node of a layout, (F,)."""
    nodes = {(row.room, row.label): i for i, row in enumerate(prior.furniture)}
    for place in layout:
        if place not in nodes:
            raise ValueError(
                f"furniture of a layout must be in the prior, got {shorten(place[1])} in "
                f"{shorten(place[0])}. Use furniture that the prior knows in that room."
            )
    return np.array([nodes[place] for place in layout], dtype=np.int32)
