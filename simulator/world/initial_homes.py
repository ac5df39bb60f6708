"""What stands where at t = 0: furniture, drawn or as a layout says, and objects on each piece."""

from __future__ import annotations

import itertools
import logging
from collections import defaultdict
from collections.abc import Sequence

import numpy as np

from sgm.arrays.grouped import compute_rank_in_group
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import PlaceCode
from simulator.world.rules import HomeRules
from simulator.world.sampled_state import SampledState
from simulator.world.streams import sample_categorical

logger = logging.getLogger(__name__)


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
        in_members = np.ix_(np.array(members), np.arange(sum(sizes)))
        nodes = [usable[room] for room in np.repeat(np.array(rooms, dtype=object), sizes)]
        turn = compute_rank_in_group(np.repeat(np.arange(len(rooms)), sizes))
        types[in_members] = _draw_types(homes.prior, nodes, turn, uniform[in_members])
    return types


def _draw_types(
    prior: PriorGraph, nodes: Sequence[np.ndarray], turn: np.ndarray, uniform: np.ndarray
) -> np.ndarray:
    """Draw types of n homes, (n, F'), for the nodes of each room in turn (F',)."""
    labels = sorted({furniture_type.label for furniture_type in prior.furniture})
    label_of_node = np.array(
        [labels.index(furniture_type.label) for furniture_type in prior.furniture]
    )
    prob = np.array([furniture_type.prob for furniture_type in prior.furniture])
    cap = np.array([furniture_type.max_count for furniture_type in prior.furniture])
    count = np.zeros((len(uniform), len(labels)), dtype=np.int64)
    types = np.zeros(uniform.shape, dtype=np.int32)
    for furniture in np.argsort(turn, kind="stable"):  # rooms in turn: none uses up a type
        candidates = nodes[furniture]
        weights = compute_available_weights(
            np.tile(prob[candidates], (len(uniform), 1)),
            count[:, label_of_node[candidates]],
            cap[candidates],
        )
        chosen = candidates[sample_categorical(weights, uniform[:, furniture])]
        types[:, furniture] = chosen
        count[np.arange(len(uniform)), label_of_node[chosen]] += 1
    return types


def _list_usable(homes: SampledState) -> dict[str, np.ndarray]:
    """Return the furniture nodes of each room that may be drawn and can hold an object, by room."""
    prior = homes.prior
    weights = prior.weights * homes.sample_prob[:, None, None]
    can_hold = (weights.sum(axis=(0, 2)) > 0) & [
        furniture_type.prob > 0 for furniture_type in prior.furniture
    ]
    rooms_of_nodes = np.array(
        [furniture_type.room for furniture_type in prior.furniture], dtype=object
    )
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
    nodes = {
        (furniture_type.room, furniture_type.label): i
        for i, furniture_type in enumerate(prior.furniture)
    }
    for place in layout:
        if place not in nodes:
            raise ValueError(
                f"furniture of a layout must be in the prior, got {shorten(place[1])} in "
                f"{shorten(place[0])}. Use furniture that the prior knows in that room."
            )
    return np.array([nodes[place] for place in layout], dtype=np.int32)


def sample_initial_objects(
    homes: SampledState,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Draw `objects_per_furniture` objects per furniture node of every home, n in all.

    Homes, ascending, types, places, and a uniform number to draw a description with, (n,) each.

    Raises:
        ValueError: if a home has no furniture that can hold an object.

    Source: algorithm 1, appendix A; docs/design.md, rulings 3 and 4.
    """
    num_homes, num_furniture = homes.num_homes, homes.num_furniture
    home_num_turns = np.array([config.objects_per_furniture for config in homes.configs])
    turns = int(home_num_turns.max())
    uniform = homes.streams.sample_once("objects", home_num_turns, homes.home_num_furniture, 2)
    weights, options = _list_options(homes)  # (H, F, K)
    can_hold = np.any(weights, axis=2)
    holder = _find_holders(homes, can_hold)
    max_count = np.array([object_type.max_count for object_type in homes.prior.objects])
    count = np.zeros((num_homes, len(max_count)), dtype=np.int64)
    types = np.full((num_homes, turns, num_furniture), -1, dtype=np.int64)
    places = np.empty((num_homes, turns, num_furniture), dtype=np.int64)
    for turn in range(turns):  # furniture in turn, so that none uses up a type
        for furniture in range(num_furniture):
            home = np.flatnonzero((turn < home_num_turns) & homes.is_furniture[:, furniture])
            node = holder[home, furniture]
            option_type = PlaceCode.furniture(options[home, node])  # (n, K): of a type as its place
            available = compute_available_weights(
                weights[home, node], count[home[:, None], option_type], max_count[option_type]
            )
            drawn = sample_categorical(available, uniform[home, turn, furniture, 0])
            found, relation = PlaceCode.split(options[home, node, drawn])
            count[home, found] += 1
            types[home, turn, furniture] = found
            places[home, turn, furniture] = PlaceCode.of(node, relation)
    filled = np.nonzero(types >= 0)
    return filled[0], types[filled], places[filled], uniform[(*filled, 1)]


def compute_available_weights(
    weights: np.ndarray, count: np.ndarray, cap: np.ndarray
) -> np.ndarray:
    """Keep the weights of the types that may still be drawn.

    While some type is below its cap, only those may be drawn; when all are full, caps are
    relaxed evenly: the types that are full the fewest times over (docs/design.md, ruling 3).
    Never a hang. Weights and instances so far are (H, m), `cap`, the `max_count`, (m,) or (H, m).
    """
    times_full = np.where(weights > 0, count // np.maximum(cap, 1), np.iinfo(np.int64).max)
    fewest = times_full.min(axis=1, keepdims=True)
    if logger.isEnabledFor(logging.DEBUG) and (fewest > 0).any():
        logger.debug("max_count relaxed in %d homes", int((fewest > 0).sum()))
    return np.where(times_full == fewest, weights, 0.0)


def _list_options(homes: SampledState) -> tuple[np.ndarray, np.ndarray]:
    """List weights of what nodes may hold, 0 beyond, and codes of type and relation, (H, F, K)."""
    option = np.flatnonzero(homes.place_weights)
    home_type, place = np.divmod(option, homes.num_place_codes)
    home, types = np.divmod(home_type, len(homes.prior.objects))
    weight = homes.place_weights.ravel()[option] * homes.sample_prob[types]
    node = home * homes.num_furniture + PlaceCode.furniture(place)
    order = np.argsort(node, kind="stable")
    order = order[weight[order] > 0]
    node, rank = node[order], compute_rank_in_group(node[order])
    num_nodes = homes.num_homes * homes.num_furniture
    shape = (num_nodes, int(rank.max(initial=0)) + 1)
    weights, options = np.zeros(shape), np.zeros(shape, dtype=np.int64)
    weights[node, rank] = weight[order]
    options[node, rank] = PlaceCode.of(types[order], PlaceCode.relation(place[order]))
    whole = (homes.num_homes, homes.num_furniture, shape[1])
    return weights.reshape(whole), options.reshape(whole)


def _find_holders(homes: SampledState, can_hold: np.ndarray) -> np.ndarray:
    """Return who takes the objects of each node, (H, F): the next of its room if it holds none."""
    if not can_hold.any(axis=1).all():
        streams = homes.streams
        home = streams.homes[int(np.argmin(can_hold.any(axis=1)))]
        raise ValueError(
            f"home must have furniture that holds some object, got none after the noise of "
            f"home {home} ({streams.split}, seed {streams.seed}). Use a prior with "
            "more placements, more furniture per room, or less noise."
        )
    holder = np.tile(np.arange(homes.num_furniture), (homes.num_homes, 1))
    for home, furniture in np.argwhere(homes.is_furniture & ~can_hold):
        ring = np.roll(np.arange(homes.home_num_furniture[home]), -furniture - 1)
        rooms = homes.furniture_room[home]
        same_room = rooms[ring] == rooms[furniture]
        ring = np.concatenate([ring[same_room], ring[~same_room]])
        holder[home, furniture] = ring[np.argmax(can_hold[home, ring])]
    return holder
