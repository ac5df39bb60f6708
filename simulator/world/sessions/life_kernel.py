"""The days of homes with sessions: what is used when, and where it goes.

Times are seconds since the Monday, 00:00, before a home's first step. The events of a day, from
four in the morning to four in the morning, are drawn when it begins; what they do, when they come.

Every home draws from a generator of its own, SplitMix64, which takes as many numbers as it needs.
`_uniform` and `_normal` stand in `simulator.world.routine.life_kernel`, too: a kernel calls
functions of its own file alone (`simulator.kernel`).

Source of the generator: Steele, Lea and Flood, "Fast Splittable Pseudorandom Number Generators"
(OOPSLA 2014), figure 14.
"""

import math
from dataclasses import fields
from typing import NamedTuple

import numpy as np

from sgm.schema import NUM_RELATIONS
from simulator.kernel import kernel
from simulator.world.sessions.rules import SessionRules
from simulator.world.usual_places import FIRST_OTHER, NUM_OTHERS, SECOND, USUAL

DAY = 86_400.0
HOUR = 3600.0
MINUTE = 60.0
DAY_STARTS = 4 * HOUR
NUM_NEXT = 3  # places that a way leads to from each
NUM_LATELY = 16  # things of a session that are likely to be used again
SECOND_SHARE = 0.2  # of the things that are put back, where there is a second place
NUM_TRIES = 4  # to use something that was not used just before
MOST_SESSIONS = 40  # a day
MOST_EVENTS = 4000  # a day
NUM_WORKDAYS = 5  # of a week that begins on Monday
BACK, STAY, HANDED, RESETTLED = range(4)
NO_RETURN = np.inf  # when a thing is put back that stays where it is

_NUMBERS = (rule.name for rule in fields(SessionRules) if isinstance(rule.default, (int, float)))
RULES = np.dtype([(name, np.float64) for name in (*_NUMBERS, "can_leave")])


class SessionHabits(NamedTuple):
    """What is done in H homes, drawn once; K kinds of activity.

    Attributes:
        rules: numbers of `SessionRules`, and whether things may leave the home, `RULES` (H,).
        tidies, leads_out: whether a kind puts things back, or leads out of the home, bool (K,).
        rate: sessions of each kind per day, (H, K).
        hour: when they begin, seconds after midnight, nan for any hour, (H, K).
        length: mean length in seconds, (H, K).
        weight: how readily a kind uses each thing, summed up over things, (H, K, C).
        spot: where a kind may be done, summed up over furniture, (H, K, F).
        spot_place: the place of each furniture node where things are put down, int32 (H, F).
        group: whose way each thing goes, a kind, int32 (H, C).
        manner: shares of `BACK` and so on when a thing is used, summed up, (H, C, 4).
        carried: how often outings take each thing along, (H, C).
        way: the next places of the things of a group from each furniture node, int32
            (H, K, F, NUM_NEXT).
        way_share: how often each of them is the next one, summed up, the same for all, (H,
            NUM_NEXT).
    """

    rules: np.ndarray
    tidies: np.ndarray
    leads_out: np.ndarray
    rate: np.ndarray
    hour: np.ndarray
    length: np.ndarray
    weight: np.ndarray
    spot: np.ndarray
    spot_place: np.ndarray
    group: np.ndarray
    manner: np.ndarray
    carried: np.ndarray
    way: np.ndarray
    way_share: np.ndarray


class SessionState(NamedTuple):
    """What changes in H homes; S sessions of a day, the last one of them what happens between.

    Attributes:
        place: where every thing is, -1 for an empty slot or one that is out, int32 (H, C).
        own_place: of a thing, in the order of `simulator.world.usual_places`, int32 (H, C, 4).
        back_at: when a thing that is in use, or out, is put at its usual place, (H, C).
        next_back: the earliest of them, (H,).
        random: state of each home's generator, uint64 (H,).
        day_end: until when events are drawn, (H,).
        event_time: of a use or the end of a session, (H, E).
        event: session x 2, + 1 for its end, int32 (H, E).
        num_events, next_event: int32 (H,).
        activity, spot: of each session, int32 (H, S).
        until: when it ends, (H, S).
        lately: slots of what was used in it last, int32 (H, S, NUM_LATELY).
        num_lately: how many of them were used, int32 (H, S).
    """

    place: np.ndarray
    own_place: np.ndarray
    back_at: np.ndarray
    next_back: np.ndarray
    random: np.ndarray
    day_end: np.ndarray
    event_time: np.ndarray
    event: np.ndarray
    num_events: np.ndarray
    next_event: np.ndarray
    activity: np.ndarray
    spot: np.ndarray
    until: np.ndarray
    lately: np.ndarray
    num_lately: np.ndarray


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
def _wait(random: np.ndarray, home: int, mean: float) -> float:
    """Draw a number from the exponential distribution of a mean."""
    return -mean * math.log(1 - _uniform(random, home))


@kernel
def _count(random: np.ndarray, home: int, mean: float, most: int) -> int:
    """Draw a number from the Poisson distribution of a mean, at most `most`: by waiting times."""
    count, left = 0, mean - _wait(random, home, 1.0)
    while left > 0 and count < most:
        count += 1
        left -= _wait(random, home, 1.0)
    return count


@kernel
def _draw(random: np.ndarray, home: int, summed: np.ndarray) -> int:
    """Draw an index in proportion to weights that are summed up; -1 if all are zero.

    The weights of sessions are float64; those of routines are float32, and the mark there, too.
    """
    total = summed[-1]
    if total <= 0:
        return -1
    mark = _uniform(random, home) * total
    found: int = np.searchsorted(summed, mark, side="right")
    while found == len(summed) or summed[found] == (summed[found - 1] if found > 0 else 0):
        found -= 1  # rounding has led beyond the last, or onto an index of weight zero
    return found


@kernel
def _begin_session(
    state: SessionState, home: int, session: int, activity: int, until: float
) -> None:
    """Say what a session of the day is and when it ends; nothing has been used in it."""
    state.activity[home, session] = activity
    state.spot[home, session] = -1
    state.until[home, session] = until
    state.num_lately[home, session] = 0


@kernel
def _plan_day(habits: SessionHabits, state: SessionState, home: int) -> None:
    """Draw the sessions of the day that begins at `day_end`, and when things are used."""
    rule, random = habits.rules[home], state.random
    start = state.day_end[home]
    end, midnight = start + DAY, start - DAY_STARTS
    num_sessions, count = 0, 0
    time, event = state.event_time[home], state.event[home]
    last = state.activity.shape[1] - 1  # what happens between sessions
    is_workday = int(midnight // DAY) % 7 < NUM_WORKDAYS
    if is_workday and _uniform(random, home) < rule.work_share:
        begin = midnight + (rule.work_hour + _normal(random, home) * rule.work_spread) * HOUR
        length = (rule.work_hours + _normal(random, home) * rule.work_spread) * HOUR
        begin = min(max(begin, start), end - 2)
        until = min(max(begin + length, begin + 1), end - 1)
        _begin_session(state, home, 0, int(np.argmax(habits.leads_out)), until)
        time[0], event[0] = begin, 0
        time[1], event[1] = until, 1
        num_sessions, count = 1, 2
    for activity in range(len(habits.tidies)):
        wanted = _count(random, home, habits.rate[home, activity], last - num_sessions)
        for _ in range(wanted):
            begin = midnight + (7 + 16 * _uniform(random, home)) * HOUR
            if not math.isnan(habits.hour[home, activity]):
                begin = midnight + habits.hour[home, activity]
                begin += _normal(random, home) * rule.hour_spread * HOUR
            begin = min(max(begin, start), end - 2)
            until = min(begin + _wait(random, home, habits.length[home, activity]), end - 1)
            _begin_session(state, home, num_sessions, activity, until)
            moves = rule.moves_per_hour * (1 - rule.idle_share) * (until - begin) / HOUR
            uses = _count(random, home, moves, len(time) - count - 2 * last)
            if habits.leads_out[activity]:
                uses = 1
            for turn in range(uses):
                use_time = begin if turn == 0 else begin + _uniform(random, home) * (until - begin)
                time[count], event[count] = use_time, 2 * num_sessions
                count += 1
            time[count], event[count] = until, 2 * num_sessions + 1
            count += 1
            num_sessions += 1
    hours = rule.sessions_per_day * rule.session_minutes * MINUTE / HOUR
    idle = rule.moves_per_hour * rule.idle_share * hours
    for _ in range(_count(random, home, idle, len(time) - count)):
        time[count] = start + _uniform(random, home) * DAY
        event[count] = 2 * last
        count += 1
    state.until[home, last] = end
    state.num_lately[home, last] = 0
    order = np.argsort(time[:count])
    time[:count] = time[:count][order]
    event[:count] = event[:count][order]
    state.num_events[home] = count
    state.next_event[home] = 0
    state.day_end[home] = end


@kernel
def _put(state: SessionState, home: int, slot: int, place: int, back_at: float) -> None:
    """Put a thing at a place, -1 for out of the home, until some time."""
    state.place[home, slot] = place
    state.back_at[home, slot] = back_at
    state.next_back[home] = min(state.next_back[home], back_at)


@kernel
def _return(state: SessionState, home: int, slot: int) -> None:
    """Put a thing at its usual place, now and then at its second one."""
    kept_at = state.own_place[home, slot]
    has_second = kept_at[SECOND] != kept_at[USUAL]
    is_second = has_second and _uniform(state.random, home) < SECOND_SHARE
    _put(state, home, slot, kept_at[SECOND] if is_second else kept_at[USUAL], NO_RETURN)


@kernel
def _return_due(state: SessionState, home: int, now: float) -> None:
    """Put back what is due, and find out what is next."""
    next_back = NO_RETURN
    for slot in range(state.place.shape[1]):
        if state.back_at[home, slot] <= now:
            _return(state, home, slot)
        next_back = min(next_back, state.back_at[home, slot])
    state.next_back[home] = next_back


@kernel
def _choose(habits: SessionHabits, state: SessionState, home: int, session: int) -> int:
    """Choose what is used: as a rule what the kind of activity needs, or was used just before."""
    random, activity = state.random, state.activity[home, session]
    count = min(state.num_lately[home, session], NUM_LATELY)
    if count > 0 and _uniform(random, home) < habits.rules[home].again_share:
        return state.lately[home, session, int(_uniform(random, home) * count)]
    if habits.tidies[activity]:
        chosen, seen = -1, 0
        for slot in range(state.place.shape[1]):
            kept_at = state.own_place[home, slot]
            place = state.place[home, slot]
            if place >= 0 and place != kept_at[USUAL] and place != kept_at[SECOND]:
                seen += 1
                if _uniform(random, home) * seen < 1:
                    chosen = slot
        return chosen
    lately = state.lately[home, session, :count]
    for _ in range(NUM_TRIES):
        slot = _draw(random, home, habits.weight[home, activity])
        if slot not in lately:
            break
    else:
        return -1
    if slot >= 0:
        turn = state.num_lately[home, session] % NUM_LATELY
        state.lately[home, session, turn] = slot
        state.num_lately[home, session] += 1
    return slot


@kernel
def _go_on(habits: SessionHabits, state: SessionState, home: int, slot: int) -> int:
    """Draw the next place of a thing on its way."""
    mark = _uniform(state.random, home) * habits.way_share[home, NUM_NEXT - 1]
    turn = 0
    while turn < NUM_NEXT - 1 and mark >= habits.way_share[home, turn]:
        turn += 1
    return habits.way[
        home, habits.group[home, slot], state.place[home, slot] // NUM_RELATIONS, turn
    ]


@kernel
def _leave(
    habits: SessionHabits, state: SessionState, home: int, slot: int, back_at: float
) -> None:
    """Let a thing leave the home until some time, unless it is one of the last two."""
    if habits.rules[home].can_leave > 0 and (state.place[home] >= 0).sum() > 2:
        _put(state, home, slot, -1, back_at)


@kernel
def _use(habits: SessionHabits, state: SessionState, home: int, session: int, now: float) -> None:
    """Use a thing: it goes somewhere, and stays there or not."""
    rule, random = habits.rules[home], state.random
    last = state.activity.shape[1] - 1
    if session == last:
        state.activity[home, last] = int(_uniform(random, home) * len(habits.tidies))
        state.num_lately[home, last] = 0
    activity = state.activity[home, session]
    if session == last or state.spot[home, session] < 0:
        where = _draw(random, home, habits.spot[home, activity])
        state.spot[home, session] = habits.spot_place[home, where]
    if habits.leads_out[activity]:
        for slot in range(state.place.shape[1] if session < last else 0):
            if state.place[home, slot] >= 0 and _uniform(random, home) < habits.carried[home, slot]:
                _leave(habits, state, home, slot, state.until[home, session])
        return
    slot = _choose(habits, state, home, session)
    if slot < 0 or state.place[home, slot] < 0:
        return
    before = state.place[home, slot]
    kept_at = state.own_place[home, slot]
    is_away = before != kept_at[USUAL] and before != kept_at[SECOND]
    if habits.tidies[activity]:
        _return(state, home, slot)
        return
    manner = _draw(random, home, habits.manner[home, slot])
    if manner == HANDED:
        if _uniform(random, home) < rule.consumed_share:
            back = NO_RETURN
            if _uniform(random, home) < rule.restocked_share:
                back = now + _wait(random, home, rule.restock_days * DAY)
            _leave(habits, state, home, slot, back)
            return
        to = _go_on(habits, state, home, slot)
    elif manner == RESETTLED:
        turn = FIRST_OTHER + int(_uniform(random, home) * NUM_OTHERS)
        kept_at[USUAL], kept_at[turn] = kept_at[turn], kept_at[USUAL]
        to = kept_at[USUAL]
    elif is_away and _uniform(random, home) < rule.return_share:
        to = kept_at[USUAL]
    elif _uniform(random, home) < rule.way_share:
        to = _go_on(habits, state, home, slot)
    else:
        to = state.spot[home, session]
    back = NO_RETURN
    if manner == BACK and to != kept_at[USUAL]:
        back = now + _wait(random, home, rule.use_minutes * MINUTE)
    if to // NUM_RELATIONS == before // NUM_RELATIONS:
        to = before
    _put(state, home, slot, to, back)


@kernel
def _end(habits: SessionHabits, state: SessionState, home: int, session: int) -> None:
    """End a session: some of what was used in it is put back."""
    share = habits.rules[home].tidy_share
    for turn in range(min(state.num_lately[home, session], NUM_LATELY)):
        slot = state.lately[home, session, turn]
        if state.place[home, slot] >= 0 and _uniform(state.random, home) < share:
            _return(state, home, slot)


@kernel
def live(habits: SessionHabits, state: SessionState, homes: np.ndarray, until: np.ndarray) -> None:
    """Let some homes (n,) live until times (n,): the state changes in place."""
    for i in range(len(homes)):
        home = homes[i]
        while True:
            next_event = state.next_event[home]
            has_event = next_event < state.num_events[home]
            now = state.event_time[home, next_event] if has_event else state.day_end[home]
            if min(now, state.next_back[home]) > until[i]:
                break
            if state.next_back[home] <= now:
                _return_due(state, home, state.next_back[home])
            elif has_event:
                state.next_event[home] = next_event + 1
                session, is_end = divmod(state.event[home, next_event], 2)
                if is_end:
                    _end(habits, state, home, session)
                else:
                    _use(habits, state, home, session, now)
            else:
                _plan_day(habits, state, home)
