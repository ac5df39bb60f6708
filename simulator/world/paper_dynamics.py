"""The dynamics of the paper: objects leave, move and come at random."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from simulator.world.dynamics import Dynamics, Life
from simulator.world.paper_dynamics_kernel import choose_below, find_empty_slots, run_race
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
        row, slot = choose_below(uniform, self._select(homes.object_remove_prob), budget)
        homes.empty_slots(self._members[row] * homes.num_slots + slot)

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
        row, slot, turn = run_race(uniform, weight, weight.sum(axis=1), num_moves)
        home = self._members[row]
        objects = home * homes.num_slots + slot
        where_to = homes.streams.rows("move where", self._most_moves).take(self._members)
        rows, before = homes.object_row.ravel()[objects], homes.object_place.ravel()[objects]
        places, can_leave = homes.transitions.sample_moves(rows, home, before, where_to[row, turn])
        homes.place_objects(objects, places, can_leave)
        homes.object_moved.ravel()[objects] = True

    def add_objects(self) -> None:
        """Let each object type appear once with its add probability, up to the upper bound."""
        homes = self._homes
        # Three numbers per type: whether and when it comes, its description, its place.
        stream = homes.streams.rows("add", homes.type_add_prob.shape[1] * 3)
        numbers = stream.claim(self._members)
        budget = self._compute_budget(homes.max_count - homes.num_objects)
        row, types = choose_below(numbers.fill(every=3), self._select(homes.type_add_prob), budget)
        home = self._members[row]
        what, where_to = np.ascontiguousarray(numbers.read(row, types * 3 + 1, 2).T)
        codes = homes.object_descriptions.sample(types, what)
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
