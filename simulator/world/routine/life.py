"""The life of homes with routines: their residents' habits, drawn, and then lived."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from simulator.world.routine.activity_kinds import (
    compute_object_weights,
    compute_spot_weights,
    load_kinds,
)
from simulator.world.routine.carried import add_carried
from simulator.world.routine.life_kernel import (
    DAY,
    DAY_STARTS,
    RULES,
    Habits,
    State,
    draw_habits,
    live,
)
from simulator.world.routine.rules import ROLES, RoutineRules
from simulator.world.sampled_state import SampledState
from simulator.world.timed_life import TimedLife, draw_seed
from simulator.world.usual_places import NUM_OWN_PLACES, USUAL, draw_own_places


class RoutineLife(TimedLife):
    """The residents of some homes of a group; changes `object_place` of these homes alone.

    A home's numbers come from its own streams "routine", "routine places" and "routine outlook",
    and depend on no other home.
    """

    state: State

    def __init__(
        self, homes: SampledState, members: np.ndarray, rules: Sequence[RoutineRules]
    ) -> None:
        """Draw residents, habits and usual places, and live up to the first step."""
        clocks = [rule.clock for rule in rules]
        super().__init__(homes, members, clocks, [rule.outlook_days for rule in rules], "routine")
        rules_of_home = dict(zip(members.tolist(), rules, strict=True))
        habits = _make_habits(homes, rules_of_home)
        self.state = _make_state(homes, rules_of_home, habits)
        for home, rule in rules_of_home.items():
            self.state.own_place[home] = draw_own_places(
                homes, home, float(rule.gathering), rule.second_place_share, "routine places"
            )
        homes.object_place[members] = np.where(
            homes.object_place[members] >= 0, self.state.own_place[members, :, USUAL], -1
        )
        draw_habits(habits, self.state)
        self.habits = add_carried(homes, rules_of_home, habits, self.state.num_residents)
        warm_up = np.array([rule.warm_up_days for rule in rules])
        days = np.floor((self._start - DAY_STARTS) / DAY) - warm_up
        self.state.day_end[members] = days * DAY + DAY_STARTS
        self.live(self.state, members, self._start)
        self.note_start()

    @property
    def num_residents(self) -> np.ndarray:
        """Residents of each home, (n,)."""
        return self.state.num_residents[self._members]

    def live(self, state: State, members: np.ndarray, until: np.ndarray) -> None:
        """Let some of the homes (n,) live until times (n,): the state changes in place."""
        live(self.habits, state, members, until)


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
        activity=np.full((num_homes, num_occasions), -1, dtype=np.int32),
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
            habits.activity[home, n] = kinds.index(occasion.kind)
            habits.after[home, n] = names.index(occasion.after) if occasion.after else -1
            habits.role[home, n] = ROLES.index(occasion.role) if occasion.role else -1
            habits.seconds[home, n] = occasion.minutes * 60
            habits.hour[home, :, n] = occasion.weekday_hour * 3600, occasion.weekend_hour * 3600
            habits.share[home, :, n] = occasion.weekday_share, occasion.weekend_share
        is_present = homes.object_place[home] >= 0
        habits.object_weight[home] = object_weights[:, homes.object_type[home]] * is_present
        is_furniture = homes.furniture_room[home] >= 0
        weights = compute_spot_weights(
            homes.room_labels[home],
            homes.furniture_labels[home, is_furniture],
            homes.furniture_room[home, is_furniture],
        )
        habits.spot_weight[home, :, is_furniture] = weights.T
    np.cumsum(habits.spot_weight, axis=2, out=habits.spot_weight)
    return habits


def _make_state(homes: SampledState, rules: Mapping[int, RoutineRules], habits: Habits) -> State:
    """Return the state before the first day, with the number of residents drawn."""
    num_homes, num_slots = homes.object_place.shape
    _, num_residents, num_occasions, _ = habits.share.shape
    num_occurrences = num_residents * num_occasions
    state = State(
        place=homes.object_place,
        own_place=np.full((num_homes, num_slots, NUM_OWN_PLACES), -1, dtype=np.int32),
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
        state.random[home] = draw_seed(rng)
        state.num_residents[home] = rng.integers(rule.min_residents, rule.max_residents + 1)
    return state
