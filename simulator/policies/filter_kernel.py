"""What Bayes filters believe, about what and by which rules, and what looks and time do to it."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from simulator.kernel import kernel

# No single look and no number of them rules out a place for good: the densities are approximate.
MOST_CERTAIN = 0.95  # a look is no more certain to find an object than this
LEAST_POSSIBLE = 0.02
MOST_EXPECTED = 3.0  # no more objects than so many are expected at a place

# What is believed about each of Q subjects at each furniture node, float64 (5, Q, F), in this
# order; of a filter that learns nothing of noise, the first two.
LAST = 0  # probability that the instance that was seen last is there
OTHERS = 1  # expected number of other instances
TYPE_POSSIBLE = 2  # probability that class noise has left the place to the object's type
OWN_POSSIBLE = 3  # that instance noise has left it to the description, if it is left to the type
UNSEEN = 4  # expected number of objects of the type that were never seen


class ChainArrays(NamedTuple):
    """The arrays of `simulator.policies.filter_looks.Chains`; n entries are kept.

    Attributes:
        newest: number of each key's newest entry, or -1, (m,).
        first: number of the oldest entry that is kept.
        moment: a round of looks, or a time step of questions, (n,).
        value: what an entry says, (n,).
        share: a number in [0, 1] that it says, (n,).
        previous: number of the entry before it with the same key, or -1, (n,).
    """

    newest: np.ndarray
    first: int
    moment: np.ndarray
    value: np.ndarray
    share: np.ndarray
    previous: np.ndarray


class Subjects(NamedTuple):
    """What beliefs are about: an object, or whatever of a type was neither seen nor asked for.

    Attributes:
        home: (Q,).
        object: row of `MemoryBatch.objects`, -1 for what was neither seen nor asked for, (Q,).
        type: the prior's object type, or -1, (Q,).
        moves: weight of each furniture node when it moves, zeros if they are unknown, (Q, F).
    """

    home: np.ndarray
    object: np.ndarray
    type: np.ndarray
    moves: np.ndarray

    def take(self, rows: np.ndarray) -> Subjects:
        """Return rows (n,)."""
        return Subjects(*(column[rows] for column in self))


class Rules(NamedTuple):
    """What a filter takes for the dynamics of each subject.

    Attributes:
        moves: weight of each furniture node when the object moves, sums to one, (Q, F).
        initial: expected number of such objects at each furniture node at t = 0, (Q, F).
        move_rate: probability that one moves in a step, (Q,).
        asked_move_rate: the same, given that the object is asked for in that step, (Q,).
        remove_rate: probability that one leaves in a step, (Q,).
        add_rate: expected number that appear in a step, (Q,).
        miss_rate: probability that a look misses one, (Q,).
    """

    moves: np.ndarray
    initial: np.ndarray
    move_rate: np.ndarray
    asked_move_rate: np.ndarray
    remove_rate: np.ndarray
    add_rate: np.ndarray
    miss_rate: np.ndarray

    def take(self, rows: np.ndarray) -> Rules:
        """Return rows (n,)."""
        return Rules(*(column[rows] for column in self))


@kernel
def list_entries(chain: ChainArrays, key: int, since: int) -> np.ndarray:
    """Return the rows of a key's entries with `at` >= since, oldest first; none for key -1."""
    first = chain.first
    count = 0
    if key >= 0:
        entry = chain.newest[key]
        while entry >= first and chain.moment[entry - first] >= since:
            count += 1
            entry = chain.previous[entry - first]
    rows = np.empty(count, dtype=np.int64)
    if count > 0:
        entry = chain.newest[key]
        for number in range(count - 1, -1, -1):
            rows[number] = entry - first
            entry = chain.previous[entry - first]
    return rows


@kernel
def make_transition(
    weight: np.ndarray, scale: float, room: np.ndarray, moves: np.ndarray, leave: np.ndarray
) -> None:
    """Compute where one object goes when it moves, by the weight of each furniture node, (F,).

    Fills `moves` with weight * scale, and `leave` with their total in the `room` of each node
    without the node itself, (F,) each.
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

    An object stays in the home with the probability `kept`. It stays where it is with 1 - rate,
    else goes to another node of its room in proportion to `moves` of `make_transition`; so do the
    expected `coming` objects. `scratch` is (2, at least F and the number of rooms).
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
    """Fold one look at a node, which misses things with `miss`, into densities (F,), in place."""
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
def update_class_noise(
    type_possible: np.ndarray,
    unseen: np.ndarray,
    group: np.ndarray,
    node: int,
    is_type_seen: bool,
    miss: float,
) -> None:
    """Learn from one look at a node what class noise has left to the type of a query, in place.

    Nodes of one `group`, room and label, share class noise; all arrays (F,).
    """
    if not is_type_seen:
        possible = type_possible[node]
        expected = unseen[node] / max(possible, LEAST_POSSIBLE)  # if it is possible
        left = possible * math.exp(-min(expected * (1 - miss), MOST_EXPECTED))
        left = max(left / (left + 1 - possible), LEAST_POSSIBLE)
        for other in range(len(group)):
            if group[other] == group[node] and type_possible[other] < 1:
                type_possible[other] = left
    unseen[node] *= miss


@kernel
def update_instance_noise(
    own_possible: np.ndarray,
    type_possible: np.ndarray,
    believed: float,
    node: int,
    is_seen: bool,
    miss: float,
) -> None:
    """Learn from one look at a node what instance noise has left to a description, in place, (F,).

    `believed` is how many such objects were expected at the node.
    """
    possible = own_possible[node]
    if is_seen or possible >= 1:
        own_possible[node] = 1
        return
    found = min(believed, 1.0) * (1 - miss)
    # P(seen | possible); P(seen | impossible) = 0
    found = min(found / max(possible * type_possible[node], 1e-6), MOST_CERTAIN)
    own_possible[node] = max(possible * (1 - found) / (1 - possible * found), LEAST_POSSIBLE)


@kernel
def make_transitions(
    weight: np.ndarray,
    type_possible: np.ndarray,
    own_possible: np.ndarray,
    room: np.ndarray,
    transitions: np.ndarray,
) -> None:
    """Compute where objects of one query go by the prior's weights, (F,), in place.

    Fills `transitions` with `moves` and `leave` of `make_transition`, of the description, then of
    its type, (4, F).
    """
    for_type = weight * type_possible
    _make_shares(for_type * own_possible, room, transitions[0], transitions[1])
    _make_shares(for_type, room, transitions[2], transitions[3])


@kernel
def _make_shares(
    weight: np.ndarray, room: np.ndarray, moves: np.ndarray, leave: np.ndarray
) -> None:
    """Compute where objects go by weights of any sum, in place; see `make_transition`."""
    total = 0.0
    for value in weight:  # in order
        total += value
    make_transition(weight, 1 / total if total > 0 else 1.0, room, moves, leave)


@kernel
def follow(
    belief: np.ndarray,
    since: tuple[np.ndarray, np.ndarray],
    now: int,
    subjects: tuple[np.ndarray, np.ndarray, np.ndarray],
    rules: Rules,
    type_add_rate: np.ndarray,
    layout: tuple[np.ndarray, np.ndarray, np.ndarray],
    rounds: tuple[np.ndarray, int],
    chains: tuple[ChainArrays, ChainArrays, ChainArrays, ChainArrays],
) -> None:
    """Carry the belief about each query from its time to now, in place.

    See `PlaceFilter`, and `HomeFilter` for what is learnt about noise.

    Args:
        belief: (2 or 5, Q, F).
        since: time of each belief, and rounds of looks that it knows, (Q,) each.
        now: time step.
        subjects: home, object row and type key of each query, (Q,).
        rules: of each query.
        type_add_rate: expected number of objects of its type that come in a step, (Q,).
        layout: number of what objects stay in when they move, (Q, F); of each furniture node's room
            and label, (Q, F); and furniture nodes of each query's home, (Q,).
        rounds: time of each round of looks, (R,), and the number of the first of them.
        chains: of `FilterLooks`: looks, sightings, sightings of types, and questions.
    """
    learns = len(belief) > TYPE_POSSIBLE
    since_time, since_round = since
    home, subject, type_key = subjects
    miss_rate = rules.miss_rate
    room, group, num_nodes = layout
    round_time, first_round = rounds
    looks, sightings, type_sightings, questions = chains
    for query in range(belief.shape[1]):
        num = num_nodes[query]
        rooms, groups, weights = room[query, :num], group[query, :num], rules.moves[query, :num]
        own_last, own_others = belief[LAST, query, :num], belief[OTHERS, query, :num]
        for_type = for_own = of_type = own_last
        if learns:
            for_type = belief[TYPE_POSSIBLE, query, :num]
            for_own = belief[OWN_POSSIBLE, query, :num]
            of_type = belief[UNSEEN, query, :num]
        transitions = np.empty((4, num))
        scratch = np.empty((2, max(num, rooms.max() + 1)))
        if learns:
            make_transitions(weights, for_type, for_own, rooms, transitions)
        else:
            make_transition(weights, 1.0, rooms, transitions[0], transitions[1])
        time = since_time[query]
        look = list_entries(looks, home[query], since_round[query])
        seen = list_entries(sightings, subject[query], since_round[query])
        of_key = type_key[query] if learns else -1
        type_seen = list_entries(type_sightings, of_key, since_round[query])
        asked = list_entries(questions, subject[query], time + 1)
        next_look = next_seen = next_type = next_asked = 0
        was_seen = bool(own_last.any())
        while True:
            first_look = next_look
            while next_look < len(look):
                number = looks.moment[look[next_look]]
                if round_time[number - first_round] != time:
                    break
                is_seen = next_seen < len(seen) and sightings.moment[seen[next_seen]] == number
                next_seen += is_seen
                was_seen |= is_seen
                node = looks.value[look[next_look]]
                out_of_view = 1 - looks.share[look[next_look]]
                miss = miss_rate[query] + out_of_view * (1 - miss_rate[query])
                if learns:
                    is_type_seen = (
                        next_type < len(type_seen)
                        and type_sightings.moment[type_seen[next_type]] == number
                    )
                    next_type += is_type_seen
                    update_class_noise(for_type, of_type, groups, node, is_type_seen, miss)
                    believed = own_last[node] + own_others[node]
                    update_instance_noise(for_own, for_type, believed, node, is_seen, miss)
                correct_places(own_last, own_others, node, is_seen, miss)
                next_look += 1
            if time == now:
                break
            if learns and next_look > first_look:
                make_transitions(weights, for_type, for_own, rooms, transitions)
            time += 1
            is_asked = next_asked < len(asked) and questions.moment[asked[next_asked]] == time
            next_asked += is_asked
            densities = own_last, own_others, of_type
            spreads = was_seen, learns  # what was not seen has nowhere to spread from
            _pass_step(
                densities,
                spreads,
                query,
                is_asked,
                rules,
                type_add_rate,
                transitions,
                rooms,
                scratch,
            )


@kernel
def _pass_step(
    densities: tuple[np.ndarray, np.ndarray, np.ndarray],
    spreads: tuple[bool, bool],
    query: int,
    is_asked: bool,
    rules: Rules,
    type_add_rate: np.ndarray,
    transitions: np.ndarray,
    room: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Let a step pass for one query, in place: what was seen last, others, and its type, (F,) each.

    `spreads` says whether the first and the last do; `transitions` are those of
    `make_transitions`.
    """
    last, others, of_type = densities
    type_rate = rules.move_rate[query]
    rate = rules.asked_move_rate[query] if is_asked else type_rate
    kept, coming = 1 - rules.remove_rate[query], rules.add_rate[query]
    moves, leave = transitions[0], transitions[1]
    if spreads[0]:
        spread(last, moves, leave, kept, rate, 0.0, room, scratch)
    spread(others, moves, leave, kept, rate, coming, room, scratch)
    if spreads[1]:
        moves, leave = transitions[2], transitions[3]
        spread(of_type, moves, leave, kept, type_rate, type_add_rate[query], room, scratch)
