"""The dynamics of the paper: objects leave, move and come at random."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.kernel import kernel
from simulator.world.dynamics import Dynamics, Life
from simulator.world.sampled_state import SampledState


@dataclass(frozen=True)
class PaperDynamics(Dynamics):
    """In every step some objects leave, some move, and some come.

    Its numbers are fields of `HomeConfig`: `move_share`, `count_slack`, `dynamic_nodes` and
    `cross_room_moves`. How often an object type moves, comes and goes is the prior's.

    Source: algorithm 1, appendix A "Evolution of the environment"; docs/design.md, rulings 2, 7
    and 8.
    """

    follows_transitions: ClassVar[bool] = True

    @classmethod
    def start(
        cls, homes: SampledState, members: np.ndarray, rules: Sequence[PaperDynamics]
    ) -> PaperLife:
        """Begin with the objects as they were drawn."""
        return PaperLife(homes, members)


class PaperLife(Life):
    """Homes that change as the paper says, evolved together."""

    def __init__(self, homes: SampledState, members: np.ndarray) -> None:
        """Take charge of some homes of a group, (n,)."""
        self._homes = homes
        self._members = members
        configs = [homes.configs[home] for home in members]
        self._move_share = np.array([config.move_share for config in configs])
        self._is_dynamic = np.array([config.dynamic_nodes for config in configs])
        # Fixed, so that streams keep their widths.
        share = np.zeros(homes.num_homes)
        share[members] = self._move_share
        self._most_moves = np.floor(homes.home_num_slots * share + 0.5).astype(np.int64) + 1

    def step(self) -> None:
        """Let one time step pass: remove, then move, then add."""
        is_dynamic = bool(self._is_dynamic.any())
        if is_dynamic:
            self.remove_objects()
        self.move_objects()
        if is_dynamic:
            self.add_objects()

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the T^i rows of descriptions, (n,), (n,) -> (n, P); zero for unknown ones."""
        return self._homes.read_transitions(homes, codes)

    def remove_objects(self) -> None:
        """Let objects leave with their remove probability, never below the lower count bound."""
        homes = self._homes
        uniform = homes.streams.rows("remove", homes.home_num_slots).take(self._members)
        budget = self._compute_budget(homes.num_objects - homes.min_count)
        member, slot = choose_below(uniform, self._select(homes.object_remove_prob), budget)
        homes.empty_slots(self._members[member] * homes.num_slots + slot)

    def move_objects(self) -> None:
        """Move 5 % of the present objects to another furniture node, following T^i.

        Movers are drawn without replacement with weight `move_freq` (an exponential race: the
        largest log(u) / weight win), among the objects that have somewhere else to go.
        """
        homes = self._homes
        uniform = homes.streams.rows("move who", homes.home_num_slots).take(self._members)
        num_moves = homes.num_objects[self._members] * self._move_share
        num_moves = np.floor(num_moves + 0.5).astype(np.int64)
        weight = self._select(homes.object_move_weight)
        member, slot, turn = run_race(uniform, weight, weight.sum(axis=1), num_moves)
        home = self._members[member]
        objects = home * homes.num_slots + slot
        where_to = homes.streams.rows("move where", self._most_moves).take(self._members)
        rows, before = homes.object_row.ravel()[objects], homes.object_place.ravel()[objects]
        places, can_leave = homes.transitions.sample_moves(
            rows, home, before, where_to[member, turn]
        )
        homes.place_objects(objects, places, can_leave)
        homes.object_moved.ravel()[objects] = True

    def add_objects(self) -> None:
        """Let each object type appear once with its add probability, up to the upper bound."""
        homes = self._homes
        # Three numbers per type: whether and when it comes, its description, its place.
        stream = homes.streams.rows("add", homes.type_add_prob.shape[1] * 3)
        numbers = stream.claim(self._members)
        budget = self._compute_budget(homes.max_count - homes.num_objects)
        member, types = choose_below(
            numbers.fill(every=3), self._select(homes.type_add_prob), budget
        )
        home = self._members[member]
        description_uniform, where_to = np.ascontiguousarray(
            numbers.read(member, types * 3 + 1, 2).T
        )
        codes = homes.object_descriptions.sample(types, description_uniform)
        objects = find_empty_slots(homes.object_place, home)
        homes.fill_slots(objects, types, codes)
        rows = homes.object_row.ravel()[objects]
        places, can_leave = homes.transitions.sample_places(rows, home, where_to)
        homes.place_objects(objects, places, can_leave)

    def _compute_budget(self, room: np.ndarray) -> np.ndarray:
        """Return how many objects may come or go, given the distance to a bound, (H,) -> (n,)."""
        return np.where(self._is_dynamic, np.maximum(room[self._members], 0), 0)

    def _select(self, array: np.ndarray) -> np.ndarray:
        """Return the rows of these homes, (H, ...) -> (n, ...); no copy where it is all of them."""
        return array if len(self._members) == len(array) else array[self._members]


@kernel
def choose_below(
    uniform: np.ndarray, threshold: np.ndarray, budget: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Choose the numbers (H, C) that lie below their thresholds, up to a budget per home, (H,).

    Given that it lies below, uniform / threshold is uniform: where a home has more of them than
    its budget, those with the lowest stay, of equals the earlier.

    Returns:
        Homes and columns of the chosen, (n,) each, home after home, columns ascending.
    """
    homes = np.empty(uniform.size, dtype=np.int64)
    columns = np.empty(uniform.size, dtype=np.int64)
    order = np.empty(uniform.shape[1])
    end = 0
    for home in range(len(uniform)):
        start = end
        for column in range(uniform.shape[1]):
            if uniform[home, column] < threshold[home, column]:
                homes[end] = home
                columns[end] = column
                order[end - start] = uniform[home, column] / threshold[home, column]
                end += 1
        count = end - start
        if count > budget[home]:
            last = -1.0
            if budget[home] > 0:
                last = order[np.argsort(order[:count])[budget[home] - 1]]
            num_equal = budget[home] - (order[:count] < last).sum()
            end = start
            for i in range(count):
                if order[i] < last or (order[i] == last and num_equal > 0):
                    num_equal -= order[i] == last
                    columns[end] = columns[start + i]
                    end += 1
    return homes[:end], columns[:end]


@kernel
def run_race(
    uniform: np.ndarray, weight: np.ndarray, total_weight: np.ndarray, num_winners: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Find the slots with the largest log(uniform) / weight, at most `num_winners` per home.

    Only slots within a reach are looked at where that leaves enough of them, as it nearly always
    does; else all of the home are. A weight is 0 for slots that do not take part, (H, C); no result
    depends on the rounding of its sum per home, (H,).

    Returns:
        Homes of the winners, home after home, their slots, and their ranks in the home.
    """
    total = num_winners.sum()
    homes = np.empty(total, dtype=np.int64)
    slots = np.empty(total, dtype=np.int64)
    ranks = np.empty(total, dtype=np.int64)
    runners = np.empty(uniform.shape[1], dtype=np.int64)
    lags = np.empty(uniform.shape[1])
    end = 0
    for home in range(len(uniform)):
        most = num_winners[home]
        reach = (most + 3 * math.sqrt(most)) / max(total_weight[home], 1e-300)
        count = _list_runners(uniform[home], weight[home], reach, runners, lags)
        if (lags[:count] < reach).sum() < most:
            count = _list_runners(uniform[home], weight[home], np.inf, runners, lags)
        order = np.argsort(lags[:count])
        for rank in range(min(count, most)):
            homes[end], slots[end], ranks[end] = home, runners[order[rank]], rank
            end += 1
    return homes[:end], slots[:end], ranks[:end]


@kernel
def _list_runners(
    uniform: np.ndarray, weight: np.ndarray, reach: float, runners: np.ndarray, lags: np.ndarray
) -> int:
    """List the slots that take part and may be in reach, and how far they lag; count them.

    As log(u) <= u - 1, an object with 1 - u > reach * weight is out of reach.
    """
    count = 0
    for slot in range(len(weight)):
        runners[count] = slot
        is_near = (1 - uniform[slot]) * (1 - 1e-12) <= reach * weight[slot]
        count += is_near & (weight[slot] > 0)
    for i in range(count):
        slot = runners[i]
        lags[i] = -math.log(max(uniform[slot], 1e-300)) / weight[slot]
    return count


@kernel
def find_empty_slots(object_place: np.ndarray, homes: np.ndarray) -> np.ndarray:
    """Return an empty slot for each of n objects, as home * C + slot; a home has enough of them.

    A slot is empty where its place (H, C) is negative; the homes of the objects ascend, (n,).
    """
    num_slots = object_place.shape[1]
    objects = np.empty(len(homes), dtype=np.int64)
    slot = 0
    for i in range(len(homes)):
        if i == 0 or homes[i] != homes[i - 1]:
            slot = 0
        while object_place[homes[i], slot] >= 0:
            slot += 1
        objects[i] = homes[i] * num_slots + slot
        slot += 1
    return objects
