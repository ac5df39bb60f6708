"""What filters do with the densities of each query over furniture nodes."""

from __future__ import annotations

import math

import numpy as np

from simulator.compiled.kernel import kernel


@kernel
def make_flow(
    weight: np.ndarray, scale: np.ndarray, room: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return weights times a scale, and the total in the room without the node itself, (Q, F) each.

    Args:
        weight: (Q, F).
        scale: (Q,).
        room: of each furniture node, (Q, F).
    """
    moves = np.empty(weight.shape)
    leave = np.empty(weight.shape)
    in_room = np.empty(room.max() + 1)
    for query in range(len(weight)):
        in_room[:] = 0
        for node in range(weight.shape[1]):
            moves[query, node] = weight[query, node] * scale[query]
            in_room[room[query, node]] += moves[query, node]
        for node in range(weight.shape[1]):
            elsewhere = in_room[room[query, node]] - moves[query, node]
            leave[query, node] = elsewhere if elsewhere > 1e-9 else 0.0
    return moves, leave


@kernel
def spread(
    density: np.ndarray,
    moves: np.ndarray,
    leave: np.ndarray,
    kept: np.ndarray,
    rate: np.ndarray,
    coming: np.ndarray,
    room: np.ndarray,
) -> np.ndarray:
    """Let the objects of a density move, leave and come for one step; see `PlaceFilter.spread`."""
    after = np.empty(density.shape)
    out = np.empty(density.shape[1])
    inflow = np.empty(room.max() + 1)
    for query in range(len(density)):
        inflow[:] = 0
        for node in range(density.shape[1]):
            out[node] = 0
            if leave[query, node] > 0:
                out[node] = density[query, node] * rate[query] / leave[query, node]
            inflow[room[query, node]] += out[node]
        for node in range(density.shape[1]):
            movers = density[query, node] * rate[query] * (leave[query, node] > 0)
            arriving = moves[query, node] * (inflow[room[query, node]] - out[node])
            after[query, node] = (density[query, node] - movers + arriving) * kept[query]
            after[query, node] += coming[query] * moves[query, node]
    return after


@kernel
def correct_places(
    last: np.ndarray, others: np.ndarray, at: np.ndarray, is_seen: np.ndarray, miss: float
) -> None:
    """Fold one look per query into `Belief.last` and `Belief.others`, in place.

    Args:
        last: (Q, F).
        others: (Q, F).
        at: furniture looked at, or -1, (Q,).
        is_seen: whether the object was seen there, bool (Q,).
        miss: probability that a look misses it.
    """
    for query in range(len(at)):
        node = at[query]
        if node < 0:
            continue
        if is_seen[query]:
            found = last[query, node]
            same = found / max(found + others[query, node], 1e-12)
            others[query, node] *= miss
            others[query] += (1 - same) * last[query]
            last[query] = 0
            last[query, node] = 1
        else:
            missed = last[query, node] * (1 - miss)
            last[query, node] *= miss
            last[query] /= max(1 - missed, 1e-12)
            others[query, node] *= miss


@kernel
def doubt_type(
    type_possible: np.ndarray,
    unseen: np.ndarray,
    group: np.ndarray,
    at: np.ndarray,
    is_type_seen: np.ndarray,
    miss: float,
    least: float,
    most: float,
) -> None:
    """Learn about class noise from one look per query, in place; see `HomeFilter.doubt_type`.

    Args:
        type_possible: (Q, F).
        unseen: (Q, F).
        group: (Q, F).
        at: furniture looked at, or -1, (Q,).
        is_type_seen: bool (Q,).
        miss: probability that a look misses an object.
        least: what a place stays possible with.
        most: no more objects than so many are expected at a place.
    """
    for query in range(len(at)):
        node = at[query]
        if node < 0:
            continue
        if not is_type_seen[query]:
            possible = type_possible[query, node]
            expected = unseen[query, node] / max(possible, least)  # if it is possible
            left = possible * math.exp(-min(expected * (1 - miss), most))
            left = max(left / (left + 1 - possible), least)
            for other in range(group.shape[1]):
                is_same = group[query, other] == group[query, node]
                if is_same and type_possible[query, other] < 1:
                    type_possible[query, other] = left
        unseen[query, node] *= miss


@kernel
def doubt_own(
    own_possible: np.ndarray,
    type_possible: np.ndarray,
    believed: np.ndarray,
    at: np.ndarray,
    is_seen: np.ndarray,
    miss: float,
    least: float,
    most: float,
) -> None:
    """Learn about instance noise from one look per query, in place; see `HomeFilter.doubt_own`.

    Args:
        own_possible: (Q, F).
        type_possible: (Q, F).
        believed: how many objects are expected where it looks, (Q,).
        at: furniture looked at, or -1, (Q,).
        is_seen: bool (Q,).
        miss: probability that a look misses an object.
        least: what a place stays possible with.
        most: a look is no more certain to find an object than this.
    """
    for query in range(len(at)):
        node = at[query]
        if node < 0:
            continue
        own = own_possible[query, node]
        if is_seen[query] or own >= 1:
            own_possible[query, node] = 1
            continue
        found = min(believed[query], 1.0) * (1 - miss)
        # P(seen | possible); P(seen | impossible) = 0
        found = min(found / max(own * type_possible[query, node], 1e-6), most)
        own_possible[query, node] = max(own * (1 - found) / (1 - own * found), least)
