"""Residents' days: who starts and ends what, and the things that go along.

Times are seconds since the Monday, 00:00, before a home's first step. A day goes from four in the
morning to four in the morning, when no resident is busy. Its occurrences (occasion
n of resident r has the number r N + n) are drawn when it begins; what happens to things is drawn
when they begin and end, in the order of time. So a home's life does not depend on how long its
time steps are: they only say when one looks.

Every home draws from a generator of its own, SplitMix64, which takes as many numbers as it needs.
`_uniform` and `_normal` stand in `simulator.world.sessions.life_kernel`, too: a kernel calls
functions of its own file alone (`simulator.kernel`).

Source of the generator: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators"
(OOPSLA 2014), figure 14.
"""

import math
from dataclasses import fields
from typing import Any, NamedTuple

import numpy as np

from simulator.kernel import kernel
from simulator.world.routine.rules import RoutineRules
from simulator.world.usual_places import FIRST_OTHER, NUM_OTHERS, SECOND, USUAL

DAY = 86_400.0
HOUR = 3600.0
DAY_STARTS = 4 * HOUR
TIDY = -1  # the event that is no occurrence: tidying up in the evening

# The numbers of a home that the kernels read: those of its `RoutineRules`, how much of a drift is
# left a day later, whether things may be carried out, and how many of them are taken at most.
_MORE = ("drift_kept", "can_carry_out", "max_things")
_OWN = (rule.name for rule in fields(RoutineRules) if isinstance(rule.default, (int, float)))
RULES = np.dtype([(name, np.float64) for name in (*_OWN, *_MORE)])


class Habits(NamedTuple):
    """What the residents of H homes usually do; drawn once.

    Attributes:
        rules: by which they live, `RULES` (H,).
        leads_out: whether a kind of activity leads the resident and the things out, bool (K,).
        collects: whether a kind collects what another one has left, bool (K, K).
        tidies: whether everything that lies about is put back after a kind, bool (K,).
        num_slots: object slots of each home, the first of its row, (H,).
        activity: of each occasion, -1 beyond those of a home, int32 (H, N).
        after: the occasion that it follows, or -1, int32 (H, N).
        role: the role whose people alone do it, or -1, int32 (H, N).
        seconds: its usual length, (H, N).
        hour: seconds after midnight at which a resident begins, on weekdays and at weekends,
            (H, R, N, 2); at first those of the occasion.
        share: how often, likewise, (H, R, N, 2).
        spot: the place where a resident does a kind of activity, int32 (H, R, K).
        item: objects that a resident takes for an occasion, or -1, int32 (H, R, N, S).
        use: how often each of them is taken, (H, R, N, S).
        left: how often each of them is left where it was used, (H, R, N, S).
        object_weight: how readily a kind takes an object, summed up over objects, (H, K, C).
        spot_weight: how readily a kind is done at furniture, summed up over it, (H, K, F).
        spot_place: the place of each furniture node where things are put down, int32 (H, F).
    """

    rules: np.ndarray
    leads_out: np.ndarray
    collects: np.ndarray
    tidies: np.ndarray
    num_slots: np.ndarray
    activity: np.ndarray
    after: np.ndarray
    role: np.ndarray
    seconds: np.ndarray
    hour: np.ndarray
    share: np.ndarray
    spot: np.ndarray
    item: np.ndarray
    use: np.ndarray
    left: np.ndarray
    object_weight: np.ndarray
    spot_weight: np.ndarray
    spot_place: np.ndarray


class State(NamedTuple):
    """What changes in H homes.

    Attributes:
        place: where every object is, -1 for an empty slot or one that is out, int32 (H, C).
        own_place: of an object, in the order of `simulator.world.usual_places`, int32 (H, C, 4).
        random: state of each home's generator, uint64 (H,).
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

    place: np.ndarray
    own_place: np.ndarray
    random: np.ndarray
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


@kernel
def _uniform(random: np.ndarray, home: int) -> float:
    """Draw a number in [0, 1)."""
    random[home] += np.uint64(0x9E3779B97F4A7C15)
    bits = random[home]
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    bits = bits ^ (bits >> np.uint64(31))
    return np.int64(bits >> np.uint64(11)) * 2.0**-53


@kernel
def _normal(random: np.ndarray, home: int) -> float:
    """Draw a number from the standard normal distribution."""
    radius = math.sqrt(-2 * math.log(1 - _uniform(random, home)))
    return radius * math.cos(2 * math.pi * _uniform(random, home))


@kernel
def _draw(random: np.ndarray, home: int, summed: np.ndarray) -> int:
    """Draw an index in proportion to weights that are summed up; -1 if all are zero.

    The mark is rounded as the weights of routines are, float32; those of sessions are float64.
    """
    total = summed[-1]
    if total <= 0:
        return -1
    mark = np.float32(_uniform(random, home) * total)
    found: int = np.searchsorted(summed, mark, side="right")  # type: ignore[assignment]
    while found == len(summed) or summed[found] == (summed[found - 1] if found > 0 else 0):
        found -= 1  # rounding has led beyond the last, or onto an index of weight zero
    return found


@kernel
def draw_habits(habits: Habits, state: State) -> None:
    """Draw the residents' habits, in place.

    `hour`, `share`, `spot`, `item`, `use` and `left` are filled; weights of objects are summed up
    for those that are used at all.
    """
    random = state.random
    num_kinds = habits.object_weight.shape[1]
    favourite = np.empty(2 * habits.item.shape[3], dtype=np.int64)
    for home in range(len(habits.rules)):
        rule = habits.rules[home]
        set_size = int(rule.max_things)
        _choose_purposes(rule, random, home, habits.num_slots[home], habits.object_weight[home])
        for activity in range(num_kinds):
            habits.spot[home, :, activity] = _draw_spot(habits, random, home, activity)
        for resident in range(state.num_residents[home]):
            mark = _uniform(random, home)
            role = (mark >= rule.away_share) + (mark >= rule.away_share + rule.home_office_share)
            shift = _normal(random, home) * (rule.person_spread_hours * HOUR)
            for activity in range(num_kinds):
                if _uniform(random, home) < rule.own_spot_share:
                    habits.spot[home, resident, activity] = _draw_spot(
                        habits, random, home, activity
                    )
                count = 0  # favourites of this resident and activity
                for _ in range(8 * set_size):
                    found = _draw(random, home, habits.object_weight[home, activity])
                    if found < 0 or count == 2 * set_size or found in favourite[:count]:
                        continue
                    is_apart = count > 0
                    for other in favourite[:count]:
                        is_apart &= (
                            state.own_place[home, found, USUAL]
                            != state.own_place[home, other, USUAL]
                        )
                    if not is_apart or _uniform(random, home) >= rule.together:
                        favourite[count] = found
                        count += 1
                for n in range(habits.activity.shape[1]):
                    if habits.activity[home, n] != activity:
                        continue
                    own_shift = shift + _normal(random, home) * (rule.habit_spread_hours * HOUR)
                    change = (2 * _uniform(random, home) - 1) * rule.omission_spread
                    for w in range(2):
                        habits.hour[home, resident, n, w] += own_shift
                        share = habits.share[home, resident, n, w]
                        if 0 < share < 1:
                            share = min(max(share + change, 0.0), 1.0)
                        is_mine = habits.role[home, n] in (-1, role)
                        habits.share[home, resident, n, w] = share * is_mine
                    wanted = 1 + int(_uniform(random, home) * set_size)
                    for i in range(min(wanted, count)):
                        j = i + int(_uniform(random, home) * (count - i))
                        favourite[i], favourite[j] = favourite[j], favourite[i]
                        habits.item[home, resident, n, i] = favourite[i]
                        use = rule.min_use + _uniform(random, home) * (rule.max_use - rule.min_use)
                        habits.use[home, resident, n, i] = use
                        is_left = _uniform(random, home) < rule.left_share
                        habits.left[home, resident, n, i] = (
                            rule.left_habit if is_left else 1 - rule.left_habit
                        )


@kernel
def _draw_spot(habits: Habits, random: np.ndarray, home: int, activity: int) -> int:
    """Draw a place where a kind of activity may be done."""
    return habits.spot_place[home, _draw(random, home, habits.spot_weight[home, activity])]


@kernel
def _choose_purposes(
    rule: Any, random: np.ndarray, home: int, num_slots: int, weight: np.ndarray
) -> None:
    """Draw what each object of a home is for, and sum up its weights over objects, (K, C)."""
    of_kinds = np.empty(len(weight), dtype=weight.dtype)
    for column in range(weight.shape[1]):
        if column < num_slots:
            of_kinds[:] = weight[:, column]
            for activity in range(1, len(weight)):
                of_kinds[activity] += of_kinds[activity - 1]
            main = _draw(random, home, of_kinds)
            is_static = _uniform(random, home) < rule.static_share
            for activity in range(len(weight)):
                if is_static or activity != main:
                    weight[activity, column] = 0
        if column > 0:
            weight[:, column] += weight[:, column - 1]


@kernel
def _plan_day(habits: Habits, state: State, home: int) -> None:
    """Draw what happens in the day that begins at `day_end`."""
    rule, random = habits.rules[home], state.random
    start = state.day_end[home]
    midnight = start - DAY_STARTS
    end = start + DAY
    is_weekend = np.int64(np.rint(midnight / DAY)) % 7 >= 5
    num_occasions = habits.activity.shape[1]
    starts = np.empty(num_occasions)
    ends = np.empty(num_occasions)
    time, event = state.event_time[home], state.event[home]
    time[0], event[0] = midnight + rule.tidy_hour * HOUR, TIDY
    count = 1
    for resident in range(state.num_residents[home]):
        change = (
            _normal(random, home) * math.sqrt(1 - rule.drift_kept**2) * (rule.drift_hours * HOUR)
        )
        state.drift[home, resident] = state.drift[home, resident] * rule.drift_kept + change
        for n in range(num_occasions):
            starts[n] = -1.0
            share = habits.share[home, resident, n, 1 if is_weekend else 0]
            if share <= 0 or _uniform(random, home) >= share:
                continue
            hour = habits.hour[home, resident, n, 1 if is_weekend else 0]
            begin = (
                midnight
                + hour
                + state.drift[home, resident]
                + (_normal(random, home) * (rule.jitter_hours * HOUR))
            )
            before = habits.after[home, n]
            if before >= 0 and starts[before] >= 0:
                begin = ends[before] + 1
            length = habits.seconds[home, n] * (0.7 + 0.6 * _uniform(random, home))
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
def _put_back(rule: Any, state: State, home: int, slot: int) -> None:
    """Put an object where it belongs: as a rule its usual place, seldom a new one for good."""
    kept_at = state.own_place[home, slot]
    mark = _uniform(state.random, home)
    if mark < rule.new_share:
        new = FIRST_OTHER + int(_uniform(state.random, home) * NUM_OTHERS)
        kept_at[USUAL], kept_at[new] = kept_at[new], kept_at[USUAL]
    is_second = rule.new_share <= mark < rule.new_share + rule.second_share
    state.place[home, slot] = kept_at[SECOND] if is_second else kept_at[USUAL]
    state.left_by[home, slot] = -1


@kernel
def _tidy(rule: Any, share: float, state: State, home: int) -> None:
    """Put back a share of what has been left and is not in use."""
    for slot in range(state.place.shape[1]):
        if state.left_by[home, slot] >= 0 and _uniform(state.random, home) < share:
            _put_back(rule, state, home, slot)


@kernel
def _take(state: State, home: int, occurrence: int, slot: int, to: int, left_share: float) -> None:
    """Take an object to a place (-1: out of the home), unless it is in use, or the only one."""
    if slot < 0 or state.holder[home, slot] >= 0 or state.place[home, slot] < 0:
        return
    if to < 0 and (state.place[home] >= 0).sum() < 2:
        return
    state.holder[home, slot] = occurrence
    state.next_held[home, slot] = state.first_held[home, occurrence]
    state.first_held[home, occurrence] = slot
    state.left_share[home, slot] = left_share
    state.left_by[home, slot] = -1
    state.place[home, slot] = to


@kernel
def _begin(habits: Habits, state: State, home: int, occurrence: int) -> None:
    """Begin an occurrence: its things come along."""
    rule, random = habits.rules[home], state.random
    resident, n = divmod(occurrence, habits.activity.shape[1])
    activity = habits.activity[home, n]
    state.is_on[home, occurrence] = state.errand[home, resident] < 0
    if not state.is_on[home, occurrence]:
        return  # not at home
    spot = habits.spot[home, resident, activity]
    if _uniform(random, home) < rule.elsewhere_share:
        spot = _draw_spot(habits, random, home, activity)
    state.spot[home, occurrence] = spot
    to = spot
    if habits.leads_out[activity]:
        state.errand[home, resident] = occurrence
        to = -1
        if rule.can_carry_out == 0:
            return
    for i in range(habits.item.shape[3]):
        slot = habits.item[home, resident, n, i]
        if slot >= 0 and _uniform(random, home) < habits.use[home, resident, n, i]:
            left_share = habits.left[home, resident, n, i]
            _take(state, home, occurrence, slot, to, left_share)
    if _uniform(random, home) < rule.extra_share:
        extra = _draw(random, home, habits.object_weight[home, activity])
        _take(state, home, occurrence, extra, to, rule.left_share)
    for slot in range(state.place.shape[1] if habits.collects[activity].any() else 0):
        left_by = state.left_by[home, slot]
        if left_by >= 0 and habits.collects[activity, left_by]:
            if _uniform(random, home) < rule.collect_share:
                _take(state, home, occurrence, slot, to, 0.0)


@kernel
def _finish(habits: Habits, state: State, home: int, occurrence: int) -> None:
    """End an occurrence: each of its things is put back, or left where it was done."""
    if not state.is_on[home, occurrence]:
        return
    state.is_on[home, occurrence] = False
    rule = habits.rules[home]
    resident, n = divmod(occurrence, habits.activity.shape[1])
    activity = habits.activity[home, n]
    if state.errand[home, resident] == occurrence:
        state.errand[home, resident] = -1
    slot = state.first_held[home, occurrence]
    state.first_held[home, occurrence] = -1
    while slot >= 0:
        state.holder[home, slot] = -1
        if _uniform(state.random, home) < state.left_share[home, slot]:
            state.place[home, slot] = state.spot[home, occurrence]
            state.left_by[home, slot] = activity
        else:
            _put_back(rule, state, home, slot)
        slot = state.next_held[home, slot]
    if habits.tidies[activity]:
        _tidy(rule, rule.collect_share, state, home)


@kernel
def live(habits: Habits, state: State, homes: np.ndarray, until: np.ndarray) -> None:
    """Let some homes (n,) live until times (n,): the state changes in place."""
    for i in range(len(homes)):
        home = homes[i]
        rule = habits.rules[home]
        while True:
            while state.next_event[home] < state.num_events[home]:
                next_event = state.next_event[home]
                if state.event_time[home, next_event] > until[i]:
                    break
                event = state.event[home, next_event]
                if event == TIDY:
                    _tidy(rule, rule.tidy_share, state, home)
                elif event % 2 == 0:
                    _begin(habits, state, home, event // 2)
                else:
                    _finish(habits, state, home, event // 2)
                state.next_event[home] = next_event + 1
            if state.day_end[home] > until[i]:
                break
            _plan_day(habits, state, home)
