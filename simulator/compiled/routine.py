"""Residents' days: who starts and ends what, and the things that go along.

Times are seconds since the Monday, 00:00, before a home's first step. A day goes from four in the
morning to four in the morning, when nobody is in the middle of anything. Its occurrences (occasion
n of resident r has the number r N + n) are drawn when it begins; what happens to things is drawn
when they begin and end, in the order of time. So a home's life does not depend on how long its
time steps are: they only say when one looks.

Every home draws from a generator of its own (`simulator.compiled.split_mix`); what residents
usually do is drawn before (`simulator.compiled.habits`).
"""

import math
from typing import Any, NamedTuple

import numpy as np

from simulator.compiled.habits import Habits, draw_spot
from simulator.compiled.kernel import kernel
from simulator.compiled.split_mix import draw_index, draw_normal, draw_uniform

DAY = 86_400.0
DAY_STARTS = 4 * 3600.0
TIDY = -1  # the event that is no occurrence: somebody tidies up in the evening


class State(NamedTuple):
    """The state of H homes beyond where things are.

    Attributes:
        random: state of each home's generator, uint64 (H,).
        now: (H,).
        day_end: until when events are drawn, (H,).
        num_residents: int32 (H,).
        drift: how much later than usual a resident lives these days, (H, R).
        event_time, event: 2 x occurrence for its start, + 1 for its end, or `TIDY`, (H, 2 R N + 1).
        num_events: of this day, int32 (H,).
        next_event: int32 (H,).
        errand: the occurrence for which a resident is out, or -1, int32 (H, R).
        is_on: whether an occurrence takes place, bool (H, R N).
        spot: the place of an occurrence, int32 (H, R N).
        first_held: the object that it took last, or -1, int32 (H, R N).
        next_held: the object that was taken before an object, or -1, int32 (H, C).
        holder: the occurrence that an object is used in, or -1, int32 (H, C).
        left_share: how probably an object that is used will be left where it is, (H, C).
        left_by: the kind of activity that has left an object where it is, or -1, int32 (H, C).
    """

    random: np.ndarray
    now: np.ndarray
    day_end: np.ndarray
    num_residents: np.ndarray
    drift: np.ndarray
    event_time: np.ndarray
    event: np.ndarray
    num_events: np.ndarray
    next_event: np.ndarray
    errand: np.ndarray
    is_on: np.ndarray
    spot: np.ndarray
    first_held: np.ndarray
    next_held: np.ndarray
    holder: np.ndarray
    left_share: np.ndarray
    left_by: np.ndarray


class Roles(NamedTuple):
    """What is special about kinds of activity.

    Attributes:
        leads_out: whether the resident and the things leave the home, bool (K,).
        collects: whether a kind collects what another one has left, bool (K, K).
        tidies: whether everything that lies about is put back after it, bool (K,).
    """

    leads_out: np.ndarray
    collects: np.ndarray
    tidies: np.ndarray


@kernel
def _plan_day(rule: Any, habits: Habits, state: State, home: int) -> None:
    """Draw what happens in the day that begins at `day_end`."""
    random = state.random
    start = state.day_end[home]
    midnight = start - DAY_STARTS
    end = start + DAY
    is_weekend = np.int64(np.rint(midnight / DAY)) % 7 >= 5
    num_occasions = habits.kind.shape[1]
    starts = np.empty(num_occasions)
    ends = np.empty(num_occasions)
    time, event = state.event_time[home], state.event[home]
    time[0], event[0] = midnight + rule.tidy_time, TIDY
    count = 1
    for resident in range(state.num_residents[home]):
        change = draw_normal(random, home) * math.sqrt(1 - rule.drift_kept**2) * rule.drift_spread
        state.drift[home, resident] = state.drift[home, resident] * rule.drift_kept + change
        for n in range(num_occasions):
            starts[n] = -1.0
            share = habits.share[home, resident, n, 1 if is_weekend else 0]
            if share <= 0 or draw_uniform(random, home) >= share:
                continue
            hour = habits.hour[home, resident, n, 1 if is_weekend else 0]
            begin = midnight + hour + state.drift[home, resident] + (
                draw_normal(random, home) * rule.jitter
            )  # fmt: skip
            before = habits.after[home, n]
            if before >= 0 and starts[before] >= 0:
                begin = ends[before] + 1
            length = habits.seconds[home, n] * (0.7 + 0.6 * draw_uniform(random, home))
            starts[n] = begin = min(max(begin, start), end - 2)
            ends[n] = min(begin + length, end - 1)
            occurrence = resident * num_occasions + n
            time[count], event[count] = starts[n], 2 * occurrence
            time[count + 1], event[count + 1] = ends[n], 2 * occurrence + 1
            count += 2
    order = np.argsort(time[:count])
    time[:count] = time[:count][order]
    event[:count] = event[:count][order]
    state.num_events[home] = count
    state.next_event[home] = 0
    state.day_end[home] = end


@kernel
def _put_back(
    rule: Any, habits: Habits, state: State, place: np.ndarray, home: int, slot: int
) -> None:
    """Put an object where it belongs: as a rule its usual place, seldom a new one for good."""
    own = habits.own_place[home, slot]
    mark = draw_uniform(state.random, home)
    if mark < rule.new_share:
        new = 2 + int(draw_uniform(state.random, home) * 2)
        own[0], own[new] = own[new], own[0]
    is_second = rule.new_share <= mark < rule.new_share + rule.second_share
    place[home, slot] = own[1] if is_second else own[0]
    state.left_by[home, slot] = -1


@kernel
def _tidy(
    rule: Any, share: float, habits: Habits, state: State, place: np.ndarray, home: int
) -> None:
    """Put back a share of what has been left and is not in use."""
    for slot in range(place.shape[1]):
        if state.left_by[home, slot] >= 0 and draw_uniform(state.random, home) < share:
            _put_back(rule, habits, state, place, home, slot)


@kernel
def _take(
    state: State,
    place: np.ndarray,
    home: int,
    occurrence: int,
    slot: int,
    to: int,
    left_share: float,
) -> None:
    """Take an object to a place (-1: out of the home), unless it is in use, or the only one."""
    if slot < 0 or state.holder[home, slot] >= 0 or place[home, slot] < 0:
        return
    if to < 0 and (place[home] >= 0).sum() < 2:
        return
    state.holder[home, slot] = occurrence
    state.next_held[home, slot] = state.first_held[home, occurrence]
    state.first_held[home, occurrence] = slot
    state.left_share[home, slot] = left_share
    state.left_by[home, slot] = -1
    place[home, slot] = to


@kernel
def _begin(
    rule: Any,
    roles: Roles,
    habits: Habits,
    state: State,
    place: np.ndarray,
    home: int,
    occurrence: int,
) -> None:
    """Begin an occurrence: its things come along."""
    random = state.random
    resident, n = divmod(occurrence, habits.kind.shape[1])
    kind = habits.kind[home, n]
    state.is_on[home, occurrence] = state.errand[home, resident] < 0
    if not state.is_on[home, occurrence]:
        return  # not at home
    spot = habits.spot[home, resident, kind]
    if draw_uniform(random, home) < rule.elsewhere_share:
        spot = draw_spot(habits, random, home, kind)
    state.spot[home, occurrence] = spot
    to = spot
    if roles.leads_out[kind]:
        state.errand[home, resident] = occurrence
        to = -1
        if rule.can_carry_out == 0:
            return
    for i in range(habits.item.shape[3]):
        slot = habits.item[home, resident, n, i]
        if slot >= 0 and draw_uniform(random, home) < habits.use[home, resident, n, i]:
            left_share = habits.left[home, resident, n, i]
            _take(state, place, home, occurrence, slot, to, left_share)
    if draw_uniform(random, home) < rule.extra_share:
        extra = draw_index(random, home, habits.object_weight[home, kind])
        _take(state, place, home, occurrence, extra, to, rule.left_share)
    for slot in range(place.shape[1] if roles.collects[kind].any() else 0):
        left_by = state.left_by[home, slot]
        if left_by >= 0 and roles.collects[kind, left_by]:
            if draw_uniform(random, home) < rule.collect_share:
                _take(state, place, home, occurrence, slot, to, 0.0)


@kernel
def _finish(
    rule: Any,
    roles: Roles,
    habits: Habits,
    state: State,
    place: np.ndarray,
    home: int,
    occurrence: int,
) -> None:
    """End an occurrence: each of its things is put back, or left where it was done."""
    if not state.is_on[home, occurrence]:
        return
    state.is_on[home, occurrence] = False
    resident, n = divmod(occurrence, habits.kind.shape[1])
    kind = habits.kind[home, n]
    if state.errand[home, resident] == occurrence:
        state.errand[home, resident] = -1
    slot = state.first_held[home, occurrence]
    state.first_held[home, occurrence] = -1
    while slot >= 0:
        state.holder[home, slot] = -1
        if draw_uniform(state.random, home) < state.left_share[home, slot]:
            place[home, slot] = state.spot[home, occurrence]
            state.left_by[home, slot] = kind
        else:
            _put_back(rule, habits, state, place, home, slot)
        slot = state.next_held[home, slot]
    if roles.tidies[kind]:
        _tidy(rule, rule.collect_share, habits, state, place, home)


@kernel
def live(
    rules: np.ndarray,
    roles: Roles,
    habits: Habits,
    state: State,
    place: np.ndarray,
    homes: np.ndarray,
    until: np.ndarray,
) -> None:
    """Let homes live until a time, in place.

    Args:
        rules: `RULES`, (H,).
        roles: of the kinds.
        habits: of the residents; usual places change, seldom.
        state: what goes on.
        place: where every object is, -1 for an empty slot or one that is out, int32 (H, C).
        homes: which of them live on, (n,).
        until: times, (n,).
    """
    for i in range(len(homes)):
        home = homes[i]
        rule = rules[home]
        while True:
            while state.next_event[home] < state.num_events[home]:
                at = state.next_event[home]
                if state.event_time[home, at] > until[i]:
                    break
                event = state.event[home, at]
                if event == TIDY:
                    _tidy(rule, rule.tidy_share, habits, state, place, home)
                elif event % 2 == 0:
                    _begin(rule, roles, habits, state, place, home, event // 2)
                else:
                    _finish(rule, roles, habits, state, place, home, event // 2)
                state.next_event[home] = at + 1
            if state.day_end[home] > until[i]:
                break
            _plan_day(rule, habits, state, home)
        state.now[home] = until[i]


@kernel
def count_places(place: np.ndarray, homes: np.ndarray, counts: np.ndarray) -> None:
    """Count where the objects of homes (n,) are, (H, C) -> added to (H, C, P)."""
    for home in homes:
        for slot in range(place.shape[1]):
            if place[home, slot] >= 0:
                counts[home, slot, place[home, slot]] += 1
