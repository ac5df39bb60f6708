"""Homes with sessions: laws of what moves when, and where to."""

from dataclasses import fields, replace

import numpy as np
import pytest

from simulator.testing import check_homes
from simulator.world.config import HomeConfig
from simulator.world.sessions.dynamics import SessionDynamics
from simulator.world.sessions.life_kernel import BACK, HANDED, NUM_NEXT, RESETTLED
from simulator.world.source import SampledSource
from simulator.world.streams import Streams

HOUR = 3600.0
RULES = SessionDynamics(step_seconds=60.0)
HOUSE = HomeConfig(furniture_per_room=3, objects_per_furniture=4)


def make(num_homes=4, seed=0, house=HOUSE, **rules):
    config = replace(house, dynamics=replace(RULES, **rules))
    return SampledSource(home=config).make(Streams(seed, "train", range(num_homes)))


def follow(homes, num_steps):
    """Return the furniture of everything at every step, (T + 1, H, C)."""
    at = [homes.object_furniture.copy()]
    for _ in range(num_steps):
        homes.evolve()
        at.append(homes.object_furniture.copy())
    return np.stack(at)


def test_they_keep_the_contract_of_homes():
    check_homes(SampledSource(home=replace(HOUSE, dynamics=RULES)).make)


def test_a_life_does_not_depend_on_the_length_of_its_steps():
    by_minute, by_hour = make(), make(step_seconds=HOUR)
    for _ in range(24):
        by_minute.pass_steps(60)
        by_hour.evolve()
        assert np.array_equal(by_minute.object_place, by_hour.object_place)


def test_steps_that_pass_at_once_are_those_one_by_one():
    at_once, in_turn = make(), make()
    for num_steps in (1, 7, 200, 1):
        at_once.pass_steps(num_steps)
        for _ in range(num_steps):
            in_turn.evolve()
        assert np.array_equal(at_once.object_place, in_turn.object_place)
        assert np.array_equal(at_once.object_moved, in_turn.object_moved)


def test_uses_per_day_are_those_of_the_rules():
    """E(uses) = sessions x minutes / 60 x moves per hour, and one to begin each session.

    All things are put where they are not, so that each use is a move: handed on along ways.
    """
    rules = {
        "handed_share": 1.0,
        "back_share": 0.0,
        "stay_share": 0.0,
        "resettled_share": 0.0,
        "consumed_share": 0.0,
        "static_share": 0.0,
        "tidy_share": 0.0,
        "away_share": 0.0,
        "missing_share": 0.0,
        "regular_share": 0.0,
        "sessions_per_day": 4.0,
        "session_minutes": 30.0,
        "moves_per_hour": 6.0,
        "idle_share": 0.5,
    }
    homes = make(30, **rules, step_seconds=20.0)
    moved = 0
    for _ in range(2):
        before = homes.object_place
        for _ in range(4320):
            homes.evolve()
            moved += homes.object_moved.sum()
        assert np.array_equal(homes.object_place >= 0, before >= 0)
    # 4 x .5 x 6 = 12 a day, but for the uses of cleaning, which finds nothing to put back at times.
    assert 0.6 * 12 < moved / 60 < 1.2 * 12


def test_moves_come_in_bursts():
    """In minutes with a move there are more in the ten minutes after than a Poisson process has."""
    moved = (np.diff(follow(make(10, idle_share=0.0), 1440), axis=0) != 0).sum(axis=2)  # (T, H)
    rate = moved.mean()
    after = [
        moved[step + 1 : step + 11, home].sum()
        for step, home in np.argwhere(moved > 0)
        if step < 1430
    ]
    assert np.mean(after) > 3 * 10 * rate


def test_what_is_put_back_is_back_within_its_minutes():
    """Absences of things that are used for a mean of two minutes: exponential, so the median is
    2 ln 2 minutes."""
    homes = make(
        20, back_share=1.0, stay_share=0.0, handed_share=0.0, resettled_share=0.0,
        use_minutes=2.0, tidy_share=0.0, again_share=0.0, away_share=0.0, step_seconds=5.0,
        moves_per_hour=60.0, second_place_share=0.0, static_share=0.0, missing_share=0.0,
        way_share=0.0,
    )  # fmt: skip
    usual = homes.lives[0].state.own_place[:, :, 0] // 2
    away = follow(homes, 12 * 60 * 12) != usual
    away[:, ~homes.is_present] = False
    lengths = []
    for home, slot in np.argwhere(away.any(axis=0)):
        edges = np.diff(away[:, home, slot].astype(int), prepend=0, append=0)
        lengths += (np.flatnonzero(edges == -1) - np.flatnonzero(edges == 1)).tolist()
    lengths = np.array(lengths) / 12  # minutes
    assert len(lengths) > 200
    assert abs(np.median(lengths) - 2 * np.log(2)) < 0.35


def test_what_is_handed_on_goes_along_the_ways_of_its_group():
    rules = {
        "handed_share": 1.0,
        "back_share": 0.0,
        "stay_share": 0.0,
        "resettled_share": 0.0,
        "consumed_share": 0.0,
        "tidy_share": 0.0,
        "missing_share": 0.0,
        "away_share": 0.0,
        "moves_per_hour": 30.0,
        "step_seconds": 2.0,
        "second_place_share": 0.0,
        "start_time": "2024-05-06T10:00",
        "sessions_per_day": 30.0,
    }
    homes = make(3, **rules)
    habits, state = homes.lives[0].habits, homes.lives[0].state
    along = total = 0
    for _ in range(2 * 3600):
        before = homes.object_place.copy()
        homes.evolve()
        for home, slot in np.argwhere(homes.object_moved):
            ways = habits.way[home, habits.group[home, slot], before[home, slot] // 2]
            after = homes.object_place[home, slot]
            along += after in ways
            total += after in ways or after != state.own_place[home, slot, 0]  # or tidied away
    assert total > 100
    assert along == total
    share = np.diff(habits.way_share, axis=1, prepend=0)
    assert np.allclose(share, RULES.way_next ** np.arange(NUM_NEXT))


def test_a_new_usual_place_is_for_good():
    homes = make(
        6,
        back_share=0.0,
        stay_share=0.0,
        handed_share=0.0,
        resettled_share=1.0,
        moves_per_hour=60.0,
        away_share=0.0,
    )
    before = homes.lives[0].state.own_place.copy()
    follow(homes, 600)
    after = homes.lives[0].state.own_place
    assert (before[..., 0] != after[..., 0]).any()
    assert np.array_equal(np.sort(before, axis=2), np.sort(after, axis=2))


def test_manners_are_shared_by_the_things_of_a_type_and_have_the_mean_of_the_home():
    shares = {"back_share": 0.5, "stay_share": 0.2, "handed_share": 0.2, "resettled_share": 0.1}
    homes = make(60, **shares, manner_spread=1.0)
    manner = np.diff(homes.lives[0].habits.manner, axis=2, prepend=0)
    assert np.allclose(manner[homes.is_present].sum(axis=1), 1)
    for home in range(5):
        for one in np.unique(homes.object_type[home, homes.is_present[home]]):
            own = homes.is_present[home] & (homes.object_type[home] == one)
            assert np.ptp(manner[home, own], axis=0).max() < 1e-12
    mean = manner[homes.is_present].mean(axis=0)
    for number in (BACK, HANDED, RESETTLED):
        assert abs(mean[number] - list(shares.values())[number]) < 0.06


def test_what_leads_out_takes_things_along_and_brings_them_back():
    rules = {"away_share": 0.9, "out_hours": 1.0, "carried_share": 1.0, "missing_share": 0.0}
    homes = make(6, **rules, moves_per_hour=0.0, consumed_share=0.0, sessions_per_day=10.0)
    is_there = follow(homes, 1440) >= 0
    had = is_there.any(axis=0)
    is_out = ~is_there & had
    assert is_out.any()
    came_back = (is_out[:-1] & is_there[1:]).sum()
    went = (is_there[:-1] & is_out[1:]).sum()
    assert came_back > 0.7 * went > 5
    stays = make(6, **rules, house=replace(HOUSE, dynamic_nodes=False))
    assert (follow(stays, 1440) >= 0).all(axis=0)[stays.is_present].all()


def test_at_work_on_workdays_alone():
    """From 8:30 to 17:30 with all that is carried; 2024-05-06 is a Monday."""
    rules = {
        "work_share": 1.0,
        "work_spread": 0.01,
        "away_share": 0.0,
        "carried_share": 1.0,
        "missing_share": 0.0,
        "consumed_share": 0.0,
        "moves_per_hour": 0.0,
    }
    homes = make(6, **rules, step_seconds=HOUR)
    is_carried = homes.is_present & (np.arange(homes.object_place.shape[1]) % 3 == 0)
    homes.lives[0].habits.carried[:] = is_carried
    is_there = follow(homes, 7 * 24) >= 0  # (T + 1, H, C)
    hour, day = np.arange(7 * 24 + 1) % 24, np.arange(7 * 24 + 1) // 24
    at_work = (day < 5) & (hour >= 9) & (hour <= 17)
    assert not is_there[at_work][:, is_carried].any()
    assert is_there[~at_work][:, is_carried].all()


def test_what_was_used_just_before_is_used_again_as_often_as_the_rules_say():
    """Moves of a thing that moved in the ten minutes before: all that is used stays where it is."""
    rules = {
        "stay_share": 1.0,
        "back_share": 0.0,
        "handed_share": 0.0,
        "resettled_share": 0.0,
        "tidy_share": 0.0,
        "away_share": 0.0,
        "idle_share": 0.0,
        "return_share": 0.0,
        "way_share": 1.0,
        "session_minutes": 30.0,
        "moves_per_hour": 20.0,
        "missing_share": 0.0,
        "sessions_per_day": 3.0,
        "static_share": 0.0,
    }
    shares = []
    for again in (0.0, 0.8):
        moved = np.diff(follow(make(8, **rules, again_share=again), 1440), axis=0) != 0
        step, home, slot = np.nonzero(moved[10:])
        before = [moved[t : t + 10, h, c].any() for t, h, c in zip(step, home, slot, strict=True)]
        assert len(before) > 100
        shares.append(np.mean(before))
    assert shares[0] < 0.2 < 0.4 < shares[1]


def test_what_is_used_up_leaves_for_good_unless_it_is_restocked():
    rules = {
        "handed_share": 1.0,
        "back_share": 0.0,
        "stay_share": 0.0,
        "resettled_share": 0.0,
        "consumed_share": 0.5,
        "moves_per_hour": 60.0,
        "missing_share": 0.0,
        "restock_days": 0.1,
        "carried_share": 0.0,
    }
    counts = []
    for restocked in (0.0, 1.0):
        homes = make(6, **rules, restocked_share=restocked)
        at = follow(homes, 1440)
        counts.append((at[-1] >= 0).sum())
        if restocked == 0:
            is_gone = (at < 0) & (at.max(axis=0) >= 0)
            assert not (is_gone[:-1] & ~is_gone[1:]).any()
        assert ((at >= 0).sum(axis=2) >= 2).all()
    assert counts[0] < counts[1]


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"moves_per_hour": -1.0}, r"moves_per_hour must lie in 0 to 5000, got -1.0"),
        ({"use_minutes": float("nan")}, r"use_minutes must lie in 0.01 to 1440, got nan"),
        ({"way_share": 1.5}, r"way_share must lie in \[0, 1\], got 1.5"),
        (
            dict.fromkeys(("back_share", "stay_share", "handed_share", "resettled_share"), 0.0),
            r"must not all be 0.*Raise one",
        ),
        ({"step_seconds": 0.0}, r"step_seconds must be a number > 0"),
    ],
)
def test_rules_out_of_range_are_named(changed, message):
    with pytest.raises(ValueError, match=message):
        replace(RULES, **changed)


def test_every_number_is_described_and_read_back():
    config = replace(HOUSE, dynamics=replace(RULES, way_share=0.25))
    described = config.describe()
    assert set(described["dynamics"]) == {"name", *(row.name for row in fields(SessionDynamics))}
    assert HomeConfig.from_json(described) == config
