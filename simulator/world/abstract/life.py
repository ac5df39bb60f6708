"""Homes with abstract dynamics, as they live on: arrays over homes, objects and activities."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from sgm.memory.clock import HOUR_SECONDS
from simulator.world.abstract.home_habits import MOST_ACTIVITIES, MOST_STAGES, Ways, draw_ways
from simulator.world.abstract.rules import AbstractRules
from simulator.world.dynamics import Life
from simulator.world.sampled_state import SampledState

_WARM_UP_STEPS = 48  # the same for all, so that no home waits for another
_IDLE = -1


class AbstractLife(Life):
    """n homes of up to C objects, stepped together.

    An object is at a usual place, or in use: on its way through the places of an activity.
    """

    def __init__(
        self, homes: SampledState, members: np.ndarray, rules: Sequence[AbstractRules]
    ) -> None:
        """Draw usual places and activities, and live up to the first step.

        Args:
            homes: the group; its objects are drawn already.
            members: the homes with these dynamics, (n,).
            rules: of each of them, (n,).
        """
        self._homes, self._members = homes, members
        start, seconds = np.array([rule.clock.row for rule in rules]).T
        self._hours = seconds / HOUR_SECONDS  # of a step
        self._now = start / HOUR_SECONDS - _WARM_UP_STEPS * self._hours
        ways = [self._draw_ways(home, rule) for home, rule in zip(members, rules, strict=True)]
        self._keep_ways(ways)
        shape = (len(members), homes.num_slots)
        self._activity = np.full(shape, _IDLE)  # that has each object, (n, C)
        self._stage = np.zeros(shape, dtype=np.int64)
        self._steps_left = np.zeros(shape)
        self._place_of_furniture = homes.list_spots()[members]
        self._is_there = homes.object_place[members] >= 0
        self._furniture = self._usual[:, :, 0].copy()
        for _ in range(_WARM_UP_STEPS):
            self._live()
        self._show()

    def _draw_ways(self, home: int, rule: AbstractRules) -> Ways:
        homes = self._homes
        rng = homes.streams.generator("abstract ways", home)
        moves = math.exp(rng.uniform(math.log(rule.min_moves), math.log(rule.max_moves)))
        types = homes.object_type[home, : homes.home_num_slots[home]]
        num_places = int(homes.home_num_furniture[home])
        hours = rule.step_seconds / HOUR_SECONDS
        return draw_ways(rng, num_places, types, homes.move_freq, hours, moves)

    def _keep_ways(self, ways: Sequence[Ways]) -> None:
        """Keep the ways of all homes, with durations and chances by the step."""
        count, slots = len(ways), self._homes.num_slots
        shape = (count, MOST_ACTIVITIES)
        self._usual = np.zeros((count, slots, 2), dtype=np.int64)
        self._route = np.zeros((*shape, MOST_STAGES), dtype=np.int64)
        self._num_steps = np.ones((*shape, MOST_STAGES))
        self._num_stages = np.ones(shape, dtype=np.int64)
        self._hour, self._spread, self._chance = np.zeros(shape), np.ones(shape), np.zeros(shape)
        self._use = np.zeros((*shape, slots), dtype=np.float32)
        self._presence = np.zeros((count, slots, self._homes.num_furniture), dtype=np.float32)
        self._forgotten = np.array([way.forgotten for way in ways])
        self._settles = np.array([way.settles for way in ways])
        for row, way in enumerate(ways):
            num, own = len(way.route), len(way.usual)
            self._usual[row, :own] = way.usual
            self._route[row, :num], self._num_stages[row, :num] = way.route, way.num_stages
            self._num_steps[row, :num] = np.maximum(way.hours / self._hours[row], 1)
            self._hour[row, :num], self._spread[row, :num] = way.hour, way.spread
            chances = np.maximum(np.round(2 * way.spread / self._hours[row]), 1)  # a day
            self._chance[row, :num] = way.chance / chances
            self._use[row, :num, :own] = way.use
            self._presence[row, :own, : way.presence.shape[1]] = way.presence

    def step(self) -> None:
        """Let one time step pass."""
        homes, members = self._homes, self._members
        before = homes.object_furniture[members]
        self._live()
        self._show()
        homes.object_moved[members] = homes.object_furniture[members] != before

    def transition_rows(self, homes: np.ndarray, codes: np.ndarray) -> np.ndarray:
        """Return what is known beforehand of descriptions, (n,), (n,) -> (n, P); see `Ways`."""
        rows = np.searchsorted(self._members, homes)
        has_code = (self._homes.object_code[homes] == codes[:, None]) & self._is_there[rows]
        presence = np.einsum("nc,ncf->nf", has_code, self._presence[rows])
        known = np.zeros((len(homes), self._homes.num_places), dtype=np.float32)
        np.put_along_axis(known, self._place_of_furniture[rows], presence, axis=1)
        total = known.sum(axis=1, keepdims=True)
        return np.divide(known, total, out=known, where=total > 0)

    def tell_prior(self, weights: np.ndarray) -> None:
        """Say where things of each type are in these homes; of what is not there, nothing."""
        for row, home in enumerate(self._members):
            there = np.flatnonzero(self._is_there[row])
            known = np.zeros((weights.shape[1], self._homes.num_furniture))
            np.add.at(known, self._homes.object_type[home, there], self._presence[row, there])
            weights[home] = 0
            of_places = weights[home].reshape(len(known), -1)
            of_places[:, self._place_of_furniture[row]] = known

    def _show(self) -> None:
        """Put the objects where they are."""
        places = np.take_along_axis(self._place_of_furniture, self._furniture, axis=1)
        self._homes.object_place[self._members] = np.where(self._is_there, places, -1)

    def _live(self) -> None:
        """Let one time step pass."""
        homes, members = self._homes, self._members
        slots = homes.home_num_slots
        starts = homes.streams.rows("abstract starts", MOST_ACTIVITIES).take(members)
        takes = homes.streams.rows("abstract takes", slots).take(members)
        returns = homes.streams.rows("abstract returns", slots).take(members)
        self._now += self._hours
        self._go_on(returns)
        self._begin(starts, takes)
        # Seldom something gets another usual place.
        home, slot = np.nonzero(returns > 1 - self._settles[:, None])
        num_places = homes.home_num_furniture[members[home]]
        self._usual[home, slot, 0] = (takes[home, slot] * num_places).astype(np.int64)

    def _go_on(self, uniform: np.ndarray) -> None:
        """Let things in use go to the next place of their activity, or back, by luck (n, C)."""
        in_use = self._activity != _IDLE
        self._steps_left -= in_use
        home, slot = np.nonzero(in_use & (self._steps_left <= 0))
        self._stage[home, slot] += 1
        activity, stage = self._activity[home, slot], self._stage[home, slot]
        ends = stage >= self._num_stages[home, activity]
        row, thing = home[ends], slot[ends]
        luck, forgotten = uniform[row, thing], self._forgotten[row]
        which = (luck >= (1 + forgotten) / 2).astype(np.int64)
        back = luck >= forgotten
        self._furniture[row[back], thing[back]] = self._usual[row, thing, which][back]
        self._activity[row, thing] = _IDLE
        home, slot, activity, stage = home[~ends], slot[~ends], activity[~ends], stage[~ends]
        self._furniture[home, slot] = self._route[home, activity, stage]
        self._steps_left[home, slot] = np.round(self._num_steps[home, activity, stage])

    def _begin(self, starts: np.ndarray, takes: np.ndarray) -> None:
        """Let activities begin at their hour, by luck (n, A), and take things, by luck (n, C)."""
        hour = (self._now % 24)[:, None]
        apart = np.abs((self._hour - hour + 12) % 24 - 12)
        begins = (apart <= self._spread) & (starts < self._chance)
        for activity in np.flatnonzero(begins.any(axis=0)):
            own = np.flatnonzero(begins[:, activity])
            is_taken = (takes[own] < self._use[own, activity]) & (self._activity[own] == _IDLE)
            row, thing = np.nonzero(is_taken)
            home = own[row]
            self._activity[home, thing], self._stage[home, thing] = activity, 0
            vary = 0.7 + 0.6 * starts[home, activity] / self._chance[home, activity]
            num_steps = np.round(self._num_steps[home, activity, 0] * vary)
            self._steps_left[home, thing] = np.maximum(num_steps, 1)
            self._furniture[home, thing] = self._route[home, activity, 0]
