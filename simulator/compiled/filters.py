"""What filters do with the densities of each query over furniture nodes."""

from __future__ import annotations

import numpy as np

from simulator.compiled.chains import ChainArrays, list_entries
from simulator.compiled.kernel import kernel


@kernel
def make_transition(
    weight: np.ndarray, scale: float, room: np.ndarray, moves: np.ndarray, leave: np.ndarray
) -> None:
    """Compute where one object goes when it moves, in place.

    Args:
        weight: of each furniture node of the home, (F,).
        scale: what to multiply them with.
        room: of each furniture node, (F,).
        moves: filled with weight * scale, (F,).
        leave: filled with the total of `moves` in the room without the node itself, (F,).
    """
    in_room = np.zeros(room.max() + 1)
    for node in range(len(weight)):
        moves[node] = weight[node] * scale
        in_room[room[node]] += moves[node]
    for node in range(len(weight)):
        elsewhere = in_room[room[node]] - moves[node]
        leave[node] = elsewhere if elsewhere > 1e-9 else 0.0


@kernel
def spread(
    density: np.ndarray,
    moves: np.ndarray,
    leave: np.ndarray,
    kept: float,
    rate: float,
    coming: float,
    room: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Let the objects of one density move, leave and come for one step, in place.

    An object stays with 1 - rate, else goes to another node of its room in proportion to `moves`.

    Args:
        density: expected objects at each furniture node, (F,).
        moves: from `make_transition`, (F,).
        leave: from `make_transition`, (F,).
        kept: probability that an object stays in the home.
        rate: probability that it moves.
        coming: expected number of objects that come, in proportion to `moves`.
        room: of each furniture node, (F,).
        scratch: overwritten, (2, at least F and the number of rooms).
    """
    out, inflow = scratch[0], scratch[1]
    for node in range(len(density)):
        inflow[room[node]] = 0
        out[node] = density[node] * rate / leave[node] if leave[node] > 0 else 0.0
    # The sum of a room is carried in a register while the room stays the same.
    current = room[0]
    total = inflow[current]
    for node in range(len(density)):
        if room[node] != current:
            inflow[current] = total
            current = room[node]
            total = inflow[current]
        total += out[node]
    inflow[current] = total
    for node in range(len(density)):
        movers = density[node] * rate if leave[node] > 0 else 0.0
        arriving = moves[node] * (inflow[room[node]] - out[node])
        density[node] = (density[node] - movers + arriving) * kept + coming * moves[node]


@kernel
def correct_places(
    last: np.ndarray, others: np.ndarray, node: int, is_seen: bool, miss: float
) -> None:
    """Fold one look into the densities of one query, in place.

    Args:
        last: `Belief.last`, (F,).
        others: `Belief.others`, (F,).
        node: furniture looked at.
        is_seen: whether the object was seen there.
        miss: probability that a look misses it.
    """
    if is_seen:
        found = last[node]
        same = found / max(found + others[node], 1e-12)
        others[node] *= miss
        others += (1 - same) * last
        last[:] = 0
        last[node] = 1
    else:
        missed = last[node] * (1 - miss)
        last[node] *= miss
        last /= max(1 - missed, 1e-12)
        others[node] *= miss


@kernel
def follow_places(
    last: np.ndarray,
    others: np.ndarray,
    as_of: tuple[np.ndarray, np.ndarray, int],
    subjects: tuple[np.ndarray, np.ndarray],
    rules: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    room: np.ndarray,
    num_nodes: np.ndarray,
    round_time: np.ndarray,
    first_round: int,
    looks: ChainArrays,
    sightings: ChainArrays,
    questions: ChainArrays,
) -> None:
    """Carry the belief about each query from its time to now, in place; see `PlaceFilter`.

    Args:
        last: `Belief.last`, (Q, F).
        others: `Belief.others`, (Q, F).
        as_of: time of each belief (Q,), rounds of looks that it knows (Q,), and now.
        subjects: home and object row of each query, (Q,).
        rules: moves (Q, F), move_rate, asked_move_rate, remove_rate, add_rate and miss_rate (Q,).
        room: number of what objects stay in when they move, (Q, F).
        num_nodes: furniture nodes of each query's home, (Q,).
        round_time: time of each round of looks, (R,).
        first_round: number of the first of them.
        looks: chains of `LookLog`.
        sightings: likewise.
        questions: likewise.
    """
    since_time, since_round, now = as_of
    home, subject = subjects
    weight, move_rate, asked_move_rate, remove_rate, add_rate, miss_rate = rules
    for query in range(len(last)):
        num = num_nodes[query]
        rooms = room[query, :num]
        own_last, own_others = last[query, :num], others[query, :num]
        moves, leave = np.empty(num), np.empty(num)
        scratch = np.empty((2, max(num, rooms.max() + 1)))
        make_transition(weight[query, :num], 1.0, rooms, moves, leave)
        time = since_time[query]
        look = list_entries(looks, home[query], since_round[query])
        seen = list_entries(sightings, subject[query], since_round[query])
        asked = list_entries(questions, subject[query], time + 1)
        next_look = next_seen = next_asked = 0
        was_seen = own_last.any()
        while True:
            while next_look < len(look):
                number = looks[2][look[next_look]]
                if round_time[number - first_round] != time:
                    break
                is_seen = next_seen < len(seen) and sightings[2][seen[next_seen]] == number
                next_seen += is_seen
                was_seen |= is_seen
                node = looks[3][look[next_look]]
                out_of_view = 1 - looks[4][look[next_look]]
                miss = miss_rate[query] + out_of_view * (1 - miss_rate[query])
                correct_places(own_last, own_others, node, is_seen, miss)
                next_look += 1
            if time == now:
                break
            time += 1
            rate = move_rate[query]
            if next_asked < len(asked) and questions[2][asked[next_asked]] == time:
                rate = asked_move_rate[query]
                next_asked += 1
            kept = 1 - remove_rate[query]
            if was_seen:  # else there is nothing to spread
                spread(own_last, moves, leave, kept, rate, 0.0, rooms, scratch)
            spread(own_others, moves, leave, kept, rate, add_rate[query], rooms, scratch)
