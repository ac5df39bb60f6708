"""What moments like the one that is asked about say of a thing."""

import math
from datetime import datetime, timedelta

import numpy as np
import pytest

from sgm.evidence.similar_moments import (
    KINDS,
    PastMoments,
    _KnownMoments,
    _score_groups,
    compare_moments,
)
from sgm.memory.clock import Clock
from sgm.memory.moments import SHOWN
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.schema import NEVER

MONDAY = datetime(2026, 1, 5)
THINGS = ("keys", "wallet", "phone")


def make_home(num_places=3):
    memory = SceneGraphMemory(clock=Clock(MONDAY, 1800))
    room = memory.add_room("kitchen")
    for number in range(num_places):
        memory.add_furniture(f"shelf {number}", room)
    return memory


def compute(memory, *things):
    return compare_moments(compute_past(memory, *things))


def compute_past(memory, *things):
    asked = memory.ask(things)
    return PastMoments.gather(asked.batch, asked.queries)


def test_shares_by_hand():
    """Keys at place 0 at 7:00, at place 1 at 12:00, two days; asked at 12:00 of the third day."""
    memory = make_home()
    for day in range(2):
        for hour, place in ((7, 0), (12, 1)):
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            for each in range(3):
                memory.observe(each, [Sighting("keys")] if each == place else [])
    memory.step_to(MONDAY + timedelta(days=2, hours=12))
    similar = compute(memory, "keys")
    assert compute_past(memory, "keys").lag.tolist() == [24]
    assert compute_past(memory, "keys").last.tolist() == [1]
    # At noon of two days each of the places 0 and 1 had a look, 48 and 24 hours ago; those at 7:00
    # are five hours apart: exp(-12.5) of one. Place 0 was first seen to have them two days ago,
    # place 1 at the first noon. Half-life 21 days.
    noon = 0.5 ** (2 / 21) + 0.5 ** (1 / 21)
    assert similar.amount[0, KINDS.index("hour")] == pytest.approx(2 * noon, rel=1e-4)
    assert similar.amount[0, KINDS.index("day")] == pytest.approx(2 * noon, rel=1e-4)
    # After a sighting at place 1, 24 hours: the noon of the second day alone, at both places; and
    # less so 19 hours: the morning before it.
    morning = 0.5 ** ((1 + 5 / 24) / 21) * math.exp(-0.5 * (math.log(19 / 24) / 0.3) ** 2)
    assert similar.amount[0, KINDS.index("lag")] == pytest.approx(
        2 * (0.5 ** (1 / 21) + morning), rel=1e-4
    )
    hour = similar.shares[0, KINDS.index("hour")]
    assert hour[1] > 0.9
    assert hour[0] < 0.06
    assert np.allclose(similar.shares.sum(axis=2), 1)


def test_looks_that_missed_it_count_against_a_place_for_some_hours():
    memory = make_home()
    for day in range(6):
        memory.step_to(MONDAY + timedelta(days=day, hours=12))
        for place in range(2):
            memory.observe(place, [Sighting("keys")] if place == day % 2 else [])
    said = []
    for hours in (11, 12, 36):
        memory.step_to(MONDAY + timedelta(days=6, hours=hours))
        if hours == 11:
            memory.observe(0, [])
        else:
            said.append(compute(memory, "keys").shares[0, KINDS.index("hour"), 0])
    soon, later = said
    assert soon < later - 0.1


def live(seed, num_days=12):
    memory, rng = make_home(), np.random.default_rng(seed)
    for day in range(num_days):
        for hour in np.sort(rng.choice(48, 6, replace=False) / 2).tolist():
            memory.step_to(MONDAY + timedelta(days=day, hours=hour, minutes=1) + timedelta(hours=1))
            for place in rng.permutation(3)[: rng.integers(1, 4)].tolist():
                seen = [thing for thing in THINGS if rng.random() < 0.4]
                memory.observe(place, [Sighting(thing) for thing in seen])
    memory.step(int(rng.integers(1, 60)))
    return memory


def say_by_hand(memory, thing):
    """Return shares and amounts of one thing, look by look, as the module's text says."""
    asked = memory.ask((thing,))
    batch, row = asked.batch, int(asked.queries.object[0])
    edges, moments = batch.edges, batch.history.moments
    looks = {}  # of each place: hours, and whether it was shown
    for edge in np.flatnonzero((edges["object"] == row) & (edges["num_true"] > 0)).tolist():
        place = int(edges["furniture"][edge])
        states = moments.get_states(np.array([edge]))[0]
        looks[place] = [
            (time / 2, state == SHOWN)
            for time, state in zip(moments.times[0, place].tolist(), states.tolist(), strict=True)
            if state and time != NEVER
        ]
    now, last = batch.time / 2, int(batch.objects["last_furniture"][row])
    seen_last = batch.objects["last_observed"][row] / 2
    lag = max(now - seen_last, 0.25)
    found = {}
    for kind in KINDS:
        for place, of_place in looks.items():
            alike = showed = 0.0
            for hour, is_shown in of_place:
                weight = 0.5 ** ((now - hour) / (21 * 24))
                apart = (now - hour + 12) % 24 - 12
                if "hour" in kind or kind == "day":
                    weight *= math.exp(-0.5 * apart**2)
                if kind == "day" and (hour // 24 % 7 >= 5) != (now // 24 % 7 >= 5):
                    weight *= 0.05
                if "lag" in kind:
                    before = [hour - at for at, was in looks[last] if was and at < hour]
                    logs = [math.log(max(each, 0.05) / lag) for each in before]
                    weight *= max((math.exp(-0.5 * (log / 0.3) ** 2) for log in logs), default=0.0)
                alike, showed = alike + weight, showed + weight * is_shown
            found[kind, place] = alike, showed
    detection = 1 - float(batch.history.compute_miss_rate()[0])
    usual = {
        place: (found["any", place][1] + 0.02) / (found["any", place][0] + 1) for place in looks
    }
    total = max(sum(usual.values()), 1)
    shares, amounts = np.zeros((len(KINDS), 4)), np.zeros(len(KINDS))
    for number, kind in enumerate(KINDS):
        for place in looks:
            alike, showed = found[kind, place]
            share = usual[place] / total
            if kind != "any":
                share = (showed + 0.3 * share * detection) / (detection * (alike + 0.3))
            shares[number, place] = share
            amounts[number] += alike
        total_share = shares[number].sum()
        shares[number, 3] = max(1 - total_share, 0)
        for place, of_place in looks.items():
            shares[number, place] /= max(total_share, 1)
            for hour, is_shown in of_place:
                if not is_shown and hour > seen_last:
                    shares[number, place] *= 1 - 0.8 * math.exp(-(now - hour) / 1.5)
    shares += 0.03 / 4
    return shares / shares.sum(axis=1, keepdims=True), amounts


@pytest.mark.parametrize("seed", range(4))
def test_shares_are_those_of_a_loop_over_looks(seed):
    memory = live(seed)
    together = compute(memory, *THINGS)
    for number, thing in enumerate(THINGS):
        shares, amounts = say_by_hand(memory, thing)
        np.testing.assert_allclose(together.shares[number], shares, atol=1e-9)
        np.testing.assert_allclose(together.amount[number], amounts, atol=1e-9)
        alone = compute(memory, thing)
        assert (alone.shares[0] == together.shares[number]).all()


def test_of_what_was_never_seen_nothing_is_said():
    memory = live(0)
    similar = compute(memory, "passport")
    assert not similar.amount.any()
    assert compute_past(memory, "passport").last.tolist() == [NEVER]
    assert np.isfinite(similar.shares).all()


def live_by(where, num_days=14, hours=(7, 12, 20)):
    memory = make_home()
    for day in range(num_days):
        for hour in hours:
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            there = where(day, hour)
            for place in range(3):
                memory.observe(place, [Sighting("keys")] if place == there else [])
    memory.step_to(MONDAY + timedelta(days=num_days, hours=12))
    return dict(zip(KINDS, compute(memory, "keys").gain[0].tolist(), strict=True))


def test_a_rhythm_is_found_in_the_moments_themselves():
    by_hour = live_by(lambda day, hour: 0 if hour == 12 else 1)
    assert min(by_hour["hour"], by_hour["hour_lag"]) > 0.5
    by_day = live_by(lambda day, hour: 0 if day % 7 >= 5 else 1, num_days=28)
    assert by_day["day"] > 0.4 > 0 > by_day["hour"]
    rng = np.random.default_rng(0)
    by_chance = live_by(lambda day, hour: int(rng.integers(3)), num_days=28)
    assert max(by_chance.values()) < 0.05
    assert live_by(lambda day, hour: 0) == pytest.approx(dict.fromkeys(KINDS, 0.0), abs=0.05)


def test_a_sequence_is_found_whatever_the_hour():
    rng = np.random.default_rng(1)
    memory = make_home()
    for day in range(20):
        begin = MONDAY + timedelta(days=day, hours=int(rng.integers(1, 18)))
        for hours, there in ((0, 0), (1, 1), (2, 2), (4, 0)):
            memory.step_to(begin + timedelta(hours=hours))
            for place in range(3):
                memory.observe(place, [Sighting("cup")] if place == there else [])
    memory.step()
    gain = dict(zip(KINDS, compute(memory, "cup").gain[0].tolist(), strict=True))
    assert gain["lag"] > 0.3 > 0.05 > gain["hour"]


def score_groups(group, shown):
    """Score moments at one place, each of which counts one."""
    nothing = np.zeros(len(shown), dtype=np.int64)
    looks = _KnownMoments(nothing, nothing, nothing.astype(float), np.array(shown))
    return _score_groups(np.array(group), looks, np.ones(len(shown)), 1)


def test_scores_of_groups_by_hand():
    """Four moments, two of either group; the first group showed the thing twice, the other not."""
    score = score_groups([0, 0, 1, 1], [True, True, False, False])
    # The three others foretell each with (1 + 1 / 2) / (3 + 1) = 3 / 8, the other of its group with
    # (1 + 3 / 8) / (1 + 1) = 11 / 16.
    assert score.tolist() == [pytest.approx(4 * math.log(11 / 6))]


def test_a_moment_alone_in_its_group_makes_no_rhythm():
    """Seen once, then missed: nothing is known of its hours."""
    for shown in ([True, False], [True, True, False, False]):
        assert score_groups(range(len(shown)), shown).tolist() == [0.0]
