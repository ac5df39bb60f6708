"""The life of homes with sessions: habits, ways and usual places, drawn, and then lived."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from sgm.schema import PlaceCode
from simulator.world.routine.activity_kinds import (
    compute_object_weights,
    compute_spot_weights,
    load_kinds,
)
from simulator.world.routine.carried import load_carried
from simulator.world.sampled_state import SampledState
from simulator.world.sessions.life_kernel import (
    DAY,
    DAY_STARTS,
    HOUR,
    MINUTE,
    MOST_EVENTS,
    MOST_SESSIONS,
    NO_RETURN,
    NUM_LATELY,
    NUM_NEXT,
    RULES,
    SessionHabits,
    SessionState,
    live,
)
from simulator.world.sessions.rules import SessionRules
from simulator.world.timed_life import TimedLife, draw_seed
from simulator.world.usual_places import NUM_OWN_PLACES, USUAL, draw_own_places

_OTHER_USES = 0.4  # how readily a thing is used for what it is not for, beside what it is for
_KEPT = 0.5  # how much ways lead to where things of the group are kept, beside where they are used
_ANYWHERE = 0.05  # and how much to any place
_MAIN_HOURS = (6.0, 23.0)  # between which usual hours are


class SessionLife(TimedLife):
    """Sessions in some homes of a group; changes `object_place` of these homes alone.

    A home's numbers come from its own streams "sessions", "session places" and "sessions outlook",
    and depend on no other home.
    """

    state: SessionState

    def __init__(
        self, homes: SampledState, members: np.ndarray, rules: Sequence[SessionRules]
    ) -> None:
        """Draw habits and usual places, and live up to the first step."""
        clocks = [rule.clock for rule in rules]
        super().__init__(homes, members, clocks, [rule.outlook_days for rule in rules], "sessions")
        rules_of_home = dict(zip(members.tolist(), rules, strict=True))
        self.state = _make_state(homes)
        warm_up = np.array([rule.warm_up_days for rule in rules])
        days = np.floor((self._start - DAY_STARTS) / DAY) - warm_up
        self.state.day_end[members] = days * DAY + DAY_STARTS
        self.habits = _make_habits(homes, rules_of_home, self.state)
        self.live(self.state, members, self._start)
        self.note_start()

    def live(self, state: SessionState, members: np.ndarray, until: np.ndarray) -> None:
        """Let some of the homes (n,) live until times (n,): the state changes in place."""
        live(self.habits, state, members, until)


def _make_state(homes: SampledState) -> SessionState:
    """Return the state before the first day, without usual places."""
    num_homes, num_slots = homes.object_place.shape
    sessions = (num_homes, MOST_SESSIONS)
    return SessionState(
        place=homes.object_place,
        own_place=np.full((num_homes, num_slots, NUM_OWN_PLACES), -1, dtype=np.int32),
        back_at=np.full((num_homes, num_slots), NO_RETURN),
        next_back=np.full(num_homes, NO_RETURN),
        random=np.zeros(num_homes, dtype=np.uint64),
        day_end=np.zeros(num_homes),
        event_time=np.zeros((num_homes, MOST_EVENTS)),
        event=np.zeros((num_homes, MOST_EVENTS), dtype=np.int32),
        num_events=np.zeros(num_homes, dtype=np.int32),
        next_event=np.zeros(num_homes, dtype=np.int32),
        activity=np.zeros(sessions, dtype=np.int32),
        spot=np.full(sessions, -1, dtype=np.int32),
        until=np.zeros(sessions),
        lately=np.zeros((*sessions, NUM_LATELY), dtype=np.int32),
        num_lately=np.zeros(sessions, dtype=np.int32),
    )


def _make_habits(
    homes: SampledState, rules: Mapping[int, SessionRules], state: SessionState
) -> SessionHabits:
    """Draw the habits of homes, and put things at their usual places; fills the state."""
    num_homes, num_slots = homes.object_place.shape
    kinds = list(load_kinds())
    num_kinds, num_furniture = len(kinds), homes.num_furniture
    habits = SessionHabits(
        rules=np.zeros(num_homes, dtype=RULES),
        tidies=np.array(kinds) == "cleaning",
        leads_out=np.array(kinds) == "leaving",
        rate=np.zeros((num_homes, num_kinds)),
        hour=np.full((num_homes, num_kinds), np.nan),
        length=np.zeros((num_homes, num_kinds)),
        weight=np.zeros((num_homes, num_kinds, num_slots)),
        spot=np.zeros((num_homes, num_kinds, num_furniture)),
        spot_place=homes.list_spots().astype(np.int32),
        group=np.zeros((num_homes, num_slots), dtype=np.int32),
        manner=np.zeros((num_homes, num_slots, 4)),
        carried=np.zeros((num_homes, num_slots)),
        way=np.zeros((num_homes, num_kinds, num_furniture, NUM_NEXT), dtype=np.int32),
        way_share=np.zeros((num_homes, NUM_NEXT)),
    )
    object_weights = compute_object_weights(homes.object_labels, homes.move_freq)
    for home, rule in rules.items():
        rng = homes.streams.generator("sessions", home)
        state.random[home] = draw_seed(rng)
        for name in RULES.names or ():
            habits.rules[name][home] = getattr(rule, name, homes.configs[home].dynamic_nodes)
        state.own_place[home] = draw_own_places(
            homes, home, rule.gathering, rule.second_place_share, "session places"
        )
        slots = np.flatnonzero(homes.object_place[home] >= 0)
        homes.object_place[home, slots] = state.own_place[home, slots, USUAL]
        _draw_sessions(habits, home, rule, rng)
        _draw_uses(habits, home, rule, object_weights, homes, slots, rng)
        furniture = PlaceCode.furniture(state.own_place[home, slots, USUAL])
        _draw_ways(habits, home, rule, homes, furniture, slots, rng)
        if homes.configs[home].dynamic_nodes:
            _draw_missing(state, home, rule, slots, rng)
    np.cumsum(habits.weight, axis=2, out=habits.weight)
    np.cumsum(habits.spot, axis=2, out=habits.spot)
    return habits


def _draw_sessions(
    habits: SessionHabits, home: int, rule: SessionRules, rng: np.random.Generator
) -> None:
    """Draw how often each kind of activity is done, when and for how long."""
    num_kinds = len(habits.tidies)
    often = np.exp(rng.normal(size=num_kinds)) * ~habits.leads_out
    is_regular = rng.random(num_kinds) < rule.regular_share
    hours = rng.uniform(*_MAIN_HOURS, num_kinds)
    lengths = rule.session_minutes * MINUTE * np.exp(rng.normal(scale=0.5, size=num_kinds))
    at_home = rule.sessions_per_day * (1 - rule.away_share)
    habits.rate[home] = often / often.sum() * at_home
    habits.rate[home, habits.leads_out] = rule.sessions_per_day * rule.away_share
    habits.hour[home] = np.where(is_regular, hours * HOUR, np.nan)
    habits.length[home] = np.where(habits.leads_out, rule.out_hours * HOUR, lengths)


def _draw_uses(
    habits: SessionHabits,
    home: int,
    rule: SessionRules,
    object_weights: np.ndarray,
    homes: SampledState,
    slots: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Draw what each thing (n,) is for, how often it is used, and what happens to it then."""
    types, of_thing = np.unique(homes.object_type[home, slots], return_inverse=True)
    weights = object_weights[:, types]  # (K, m)
    total = np.maximum(weights.sum(axis=0), 1e-12)
    main = (rng.random(len(types)) * total > np.cumsum(weights, axis=0)).sum(axis=0)
    main = np.minimum(main, len(weights) - 1)
    is_main = np.arange(len(weights))[:, None] == main
    shares = [rule.back_share, rule.stay_share, rule.handed_share, rule.resettled_share]
    mean = np.array(shares) / sum(shares)
    counts = np.maximum(mean * rule.manner_spread, 1e-3)
    manner = rng.standard_gamma(counts, (len(types), 4)) + 1e-12 * mean
    manner = np.cumsum(manner / manner.sum(axis=1, keepdims=True), axis=1)
    often = np.exp(rule.favourites * rng.normal(size=len(slots)))
    often *= rng.random(len(slots)) >= rule.static_share
    use = weights * np.where(is_main, 1, _OTHER_USES)
    habits.weight[home][:, slots] = use[:, of_thing] * often
    habits.group[home, slots] = main[of_thing]
    habits.manner[home, slots] = manner[of_thing]
    table = load_carried()
    labels = [homes.object_labels[number] for number in types]
    carried = np.array([sum(table.get(label, (0.0,))) / 2 for label in labels])[of_thing]
    # As many other things, whatever they are called.
    more = rng.permutation(len(slots))[: np.count_nonzero(carried)]
    carried[more] = np.maximum(carried[more], rng.random(len(more)))
    habits.carried[home, slots] = carried * rule.carried_share


def _draw_ways(
    habits: SessionHabits,
    home: int,
    rule: SessionRules,
    homes: SampledState,
    kept: np.ndarray,
    slots: np.ndarray,
    rng: np.random.Generator,
) -> None:
    """Draw where things of each group go from each place, and spots of activities.

    Things (n,) are kept at furniture, (n,).
    """
    num_kinds, width = habits.spot.shape[1:]
    nodes = np.flatnonzero(homes.furniture_room[home] >= 0)
    spot = compute_spot_weights(
        homes.room_labels[home],
        homes.furniture_labels[home, nodes],
        homes.furniture_room[home, nodes],
    )
    habits.spot[home][:, nodes] = spot
    stored = np.zeros((num_kinds, width))
    np.add.at(stored, (habits.group[home, slots], kept), 1.0)
    stored /= np.maximum(stored.sum(axis=1, keepdims=True), 1)
    leads = (
        spot / spot.sum(axis=1, keepdims=True) + _KEPT * stored[:, nodes] + _ANYWHERE / len(nodes)
    )
    leads *= np.exp(rule.way_spread * rng.normal(size=leads.shape))
    # The greatest of log(w) + Gumbel noise: places without replacement by weights.
    noise = rng.gumbel(size=(num_kinds, len(nodes), len(nodes))) + np.log(leads)[:, None]
    noise[:, np.arange(len(nodes)), np.arange(len(nodes))] = -np.inf  # it goes somewhere else
    best = np.argsort(-noise, axis=2)[:, :, :NUM_NEXT]
    best = np.concatenate([best] + [best[:, :, :1]] * (NUM_NEXT - best.shape[2]), axis=2)
    habits.way[home][:, nodes] = habits.spot_place[home, nodes][best]
    habits.way_share[home] = np.cumsum(rule.way_next ** np.arange(NUM_NEXT))


def _draw_missing(
    state: SessionState, home: int, rule: SessionRules, slots: np.ndarray, rng: np.random.Generator
) -> None:
    """Let some things come into the home later; half of all stay at least."""
    is_missing = rng.random(len(slots)) < rule.missing_share
    is_missing[rng.permutation(len(slots))[: -(-len(slots) // 2)]] = False
    missing = slots[is_missing]
    state.place[home, missing] = -1
    later = state.day_end[home] + rng.exponential(rule.restock_days * DAY, len(missing))
    state.back_at[home, missing] = later
    state.next_back[home] = later.min(initial=NO_RETURN)
