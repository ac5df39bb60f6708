"""The life of homes with routines: their residents' habits, drawn, and then lived."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from sgm.arrays.relations import NUM_RELATIONS
from simulator.kernel import kernel
from simulator.world.dynamics import Life
from simulator.world.routine.activity_kinds import (
    compute_object_weights,
    compute_spot_weights,
    load_kinds,
)
from simulator.world.routine.carried import add_carried
from simulator.world.routine.life_kernel import RULES, Habits, State, draw_habits, live
from simulator.world.routine.rules import ROLES, RoutineRules
from simulator.world.sampled_state import SampledState

_LATER_PLACES = 4  # of an object: its usual place, a second one, two that may become usual


class RoutineLife(Life):
    """The residents of some homes of a group; changes `object_place` of these homes alone.

    A home's numbers come from its own streams "routine", "routine places" and "routine outlook",
    and depend on no other home.
    """

    def __init__(
        self, homes: SampledState, members: np.ndarray, rules: Sequence[RoutineRules]
    ) -> None:
        """Draw residents, habits and usual places, and live up to the first step."""
        self._homes = homes
        self._members = members
        self._outlook: np.ndarray | None = None
        self._outlook_hours = np.array([24 * rule.outlook_days for rule in rules])
        self._step = np.array([rule.step_seconds for rule in rules])
        self._start = np.array([rule.clock.row[0] for rule in rules])
        self._num_steps = 0
        own = dict(zip(members.tolist(), rules, strict=True))
        habits = _make_habits(homes, own)
        self.state = _make_state(homes, own, habits)
        _draw_own_places(homes, own, self.state.own_place)
        homes.object_place[members] = np.where(
            homes.object_place[members] >= 0, self.state.own_place[members, :, 0], -1
        )
        draw_habits(habits, self.state)
        self.habits = add_carried(homes, own, habits, self.state.num_residents)
        warm_up = np.array([rule.warm_up_days for rule in rules])
        day = 86_400.0
        four = 4 * 3600.0
        self.state.day_end[members] = (np.floor((self._start - four) / day) - warm_up) * day + four
        live(self.habits, self.state, members, self._start)
        self._at_start = _copy(self.state)

    @property
    def num_residents(self) -> np.ndarray:
        """Residents of each home, (n,)."""
        return self.state.num_residents[self._members]

    def step(self) -> None:
        """Let one time step pass."""
        homes = self._homes
        before = homes.object_place[self._members]
        self._num_steps += 1
        until = self._start + self._num_steps * self._step
        live(self.habits, self.state, self._members, until)
        after = homes.object_place[self._members]
        has_moved = before // NUM_RELATIONS != after // NUM_RELATIONS
        homes.object_moved[self._members] = has_moved & (after >= 0)
        homes.num_objects[self._members] = (after >= 0).sum(axis=1)

    def count_hours(self) -> np.ndarray:
        """Count at how many hours of `outlook_days` objects are at each place, float32 (H, C, P).

        They are lived in a copy of the homes as at step 0. Time out of the home does not count.
        """
        if self._outlook is None:
            state = self._start_copy("routine outlook")
            num_places = self._homes.num_furniture * NUM_RELATIONS
            counts = np.zeros((*state.place.shape, num_places), dtype=np.float32)
            for hour in range(1, self._outlook_hours.max() + 1):
                is_on = hour <= self._outlook_hours
                own = self._members[is_on]
                live(self.habits, state, own, self._start[is_on] + 3600.0 * hour)
                row, slot = np.nonzero(state.place[own] >= 0)
                counts[own[row], slot, state.place[own[row], slot]] += 1
            self._outlook = counts
        return self._outlook

    def sample_hours(self, num_hours: int) -> np.ndarray:
        """Live on from step 0 with the same habits and other random numbers; see `Life`."""
        state = self._start_copy("routine copy")
        num_homes, num_slots = state.place.shape
        lived = np.empty((num_homes, num_hours, num_slots), dtype=np.int16)
        for hour in range(num_hours):
            live(self.habits, state, self._members, self._start + 3600.0 * hour)
            lived[:, hour] = state.place // NUM_RELATIONS  # -1 // 2 == -1
        return lived

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return the share of time that objects are at each place; see `count_hours`."""
        counts = self.count_hours()
        rows, slots = np.nonzero(self._homes.object_code[homes] == codes[:, None])
        found = np.zeros((len(homes), counts.shape[2]), dtype=np.float32)
        np.add.at(found, rows, counts[homes[rows], slots])
        total = found.sum(axis=1, keepdims=True)
        return np.divide(found, total, out=found, where=total > 0)

    def _start_copy(self, purpose: str) -> State:
        """Return the state at step 0, with the random numbers of a purpose."""
        state = _copy(self._at_start)
        for home in self._members:
            state.random[home] = _draw_seed(self._homes.streams.generator(purpose, home))
        return state


def _copy(state: State) -> State:
    return State(*(array.copy() for array in state))


def _make_habits(homes: SampledState, rules: Mapping[int, RoutineRules]) -> Habits:
    """Return habits of which only the usual hours, and what leads to the others, are known yet."""
    num_homes, num_slots = homes.object_place.shape
    kinds = list(load_kinds())
    num_kinds = len(kinds)
    num_residents = max(rule.max_residents for rule in rules.values())
    num_occasions = max(len(rule.occasions) for rule in rules.values())
    numbers = np.zeros(num_homes, dtype=RULES)
    for home, rule in rules.items():
        for name in RULES.names or ():
            numbers[name][home] = getattr(rule, name, 0)
        most = max(round(rule.max_things_share * int(homes.num_objects[home])), 1)
        numbers["drift_kept"][home] = math.exp(-1 / rule.drift_days)
        numbers["can_carry_out"][home] = homes.configs[home].dynamic_nodes
        numbers["max_things"][home] = most
    num_items = int(numbers["max_things"].max())
    is_washing_up, is_left = np.array(kinds) == "washing up", np.isin(kinds, ("cooking", "eating"))
    size = (num_homes, num_residents, num_occasions)
    habits = Habits(
        rules=numbers,
        leads_out=np.array(kinds) == "leaving",
        collects=is_washing_up[:, None] & is_left,
        tidies=np.array(kinds) == "cleaning",
        num_slots=homes.home_num_slots,
        kind=np.full((num_homes, num_occasions), -1, dtype=np.int32),
        after=np.full((num_homes, num_occasions), -1, dtype=np.int32),
        role=np.full((num_homes, num_occasions), -1, dtype=np.int32),
        seconds=np.zeros((num_homes, num_occasions)),
        hour=np.zeros((*size, 2)),
        share=np.zeros((*size, 2)),
        spot=np.zeros((num_homes, num_residents, num_kinds), dtype=np.int32),
        item=np.full((*size, num_items), -1, dtype=np.int32),
        use=np.zeros((*size, num_items)),
        left=np.zeros((*size, num_items)),
        object_weight=np.zeros((num_homes, num_kinds, num_slots), dtype=np.float32),
        spot_weight=np.zeros((num_homes, num_kinds, homes.num_furniture), dtype=np.float32),
        spot_place=homes.list_spots().astype(np.int32),
    )
    object_weights = compute_object_weights(homes.object_labels, homes.move_freq)
    for home, rule in rules.items():
        names = [occasion.name for occasion in rule.occasions]
        for n, occasion in enumerate(rule.occasions):
            habits.kind[home, n] = kinds.index(occasion.kind)
            habits.after[home, n] = names.index(occasion.after) if occasion.after else -1
            habits.role[home, n] = ROLES.index(occasion.role) if occasion.role else -1
            habits.seconds[home, n] = occasion.minutes * 60
            habits.hour[home, :, n] = occasion.weekday_hour * 3600, occasion.weekend_hour * 3600
            habits.share[home, :, n] = occasion.weekday_share, occasion.weekend_share
        is_present = homes.object_place[home] >= 0
        habits.object_weight[home] = object_weights[:, homes.object_type[home]] * is_present
        own = homes.furniture_room[home] >= 0
        weights = compute_spot_weights(
            homes.room_labels[home], homes.furniture_labels[home, own],
            homes.furniture_room[home, own],
        )  # fmt: skip
        habits.spot_weight[home, :, own] = weights.T
    np.cumsum(habits.spot_weight, axis=2, out=habits.spot_weight)
    return habits


def _make_state(homes: SampledState, rules: Mapping[int, RoutineRules], habits: Habits) -> State:
    """Return the state before the first day, with the number of residents drawn."""
    num_homes, num_slots = homes.object_place.shape
    _, num_residents, num_occasions, _ = habits.share.shape
    num_occurrences = num_residents * num_occasions
    state = State(
        place=homes.object_place,
        own_place=np.full((num_homes, num_slots, _LATER_PLACES), -1, dtype=np.int32),
        random=np.zeros(num_homes, dtype=np.uint64),
        day_end=np.zeros(num_homes),
        num_residents=np.zeros(num_homes, dtype=np.int32),
        drift=np.zeros((num_homes, num_residents)),
        event_time=np.zeros((num_homes, 2 * num_occurrences + 1)),
        event=np.zeros((num_homes, 2 * num_occurrences + 1), dtype=np.int32),
        num_events=np.zeros(num_homes, dtype=np.int32),
        next_event=np.zeros(num_homes, dtype=np.int32),
        errand=np.full((num_homes, num_residents), -1, dtype=np.int32),
        is_on=np.zeros((num_homes, num_occurrences), dtype=bool),
        spot=np.zeros((num_homes, num_occurrences), dtype=np.int32),
        first_held=np.full((num_homes, num_occurrences), -1, dtype=np.int32),
        next_held=np.full((num_homes, num_slots), -1, dtype=np.int32),
        holder=np.full((num_homes, num_slots), -1, dtype=np.int32),
        left_share=np.zeros((num_homes, num_slots)),
        left_by=np.full((num_homes, num_slots), -1, dtype=np.int32),
    )
    for home, rule in rules.items():
        rng = homes.streams.generator("routine", home)
        state.random[home] = _draw_seed(rng)
        state.num_residents[home] = rng.integers(rule.min_residents, rule.max_residents + 1)
    return state


def _draw_seed(rng: np.random.Generator) -> np.uint64:
    return rng.integers(0, 2**64, dtype=np.uint64)


def _draw_own_places(
    homes: SampledState, rules: Mapping[int, RoutineRules], own_place: np.ndarray
) -> None:
    """Draw the places of objects from T^i, (H, C, 4), in place; without a row they stay."""
    for home, rule in rules.items():
        num_slots = int(homes.home_num_slots[home])
        uniform = homes.streams.generator("routine places", home).random((num_slots, 5))
        slots = np.flatnonzero(homes.object_place[home, :num_slots] >= 0)
        weights = homes.transitions.read(homes.object_row[home, slots])
        none = ~weights.any(axis=1)
        weights[none, homes.object_place[home, slots[none]]] = 1
        own_place[home, slots] = _draw_places(
            weights, uniform[slots], float(rule.gathering), rule.second_place_share
        )


@kernel
def _draw_places(
    weights: np.ndarray, uniform: np.ndarray, gathering: float, second_place_share: float
) -> np.ndarray:
    """Draw the places of a home's objects by weights (n, P), one after the other, int32 (n, 4).

    The usual place, a second one, or again the usual one, and two others, by numbers (n, 5); see
    `RoutineRules`.
    """
    num_places = weights.shape[1]
    num_kept = np.zeros(num_places)
    own = np.empty((len(weights), 4), dtype=np.int32)
    for i in range(len(weights)):
        for turn in range(4):
            total = 0.0
            for place in range(num_places):
                if turn == 0 or place != own[i, 0]:
                    total += weights[i, place] * (1 + gathering * num_kept[place])
            own[i, turn] = own[i, 0]
            mark = uniform[i, turn] * total
            for place in range(num_places if total > 0 else 0):
                if weights[i, place] > 0 and (turn == 0 or place != own[i, 0]):
                    own[i, turn] = place
                    mark -= weights[i, place] * (1 + gathering * num_kept[place])
                    if mark < 0:
                        break
        if uniform[i, 4] >= second_place_share:
            own[i, 1] = own[i, 0]
        num_kept[own[i, 0]] += 1
    return own
