"""Residents' days against the law that they are drawn from."""

from dataclasses import replace

import numpy as np
import pytest

from sgm.prior.prior_graph import PriorGraph
from simulator.world.config import HomeConfig
from simulator.world.paper_dynamics import PaperDynamics
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.routine.rules import Occasion
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams
from tests.homes import make_strict_life

STRICT = make_strict_life(minutes=60)
(LUNCH,) = STRICT.occasions
SMALL = HomeConfig(furniture_per_room=4, objects_per_furniture=3)


def make(rules, num_homes=4, config=SMALL, first=0):
    configs = [replace(config, dynamics=rules)] * num_homes
    homes = range(first, first + num_homes)
    return SampledHomes(PriorGraph.default(), configs, Streams(0, "test", homes))


def follow(homes, num_steps):
    """Return places at every step, (H, C, T + 1)."""
    places = [homes.object_place.copy()]
    for _ in range(num_steps):
        homes.evolve()
        places.append(homes.object_place.copy())
    return np.stack(places, axis=2)


def find_away(places):
    """Mark objects that are not where they are at midnight, the first step, bool (H, C, T + 1)."""
    return places != places[:, :, :1]


@pytest.mark.slow
def test_a_life_does_not_depend_on_the_length_of_steps():
    by_hour = follow(make(RoutineDynamics()), 24 * 9)
    by_minutes = follow(make(RoutineDynamics(step_seconds=600)), 24 * 9 * 6)
    by_day = follow(make(RoutineDynamics(step_seconds=86_400)), 9)
    np.testing.assert_array_equal(by_minutes[:, :, ::6], by_hour)
    np.testing.assert_array_equal(by_hour[:, :, ::24], by_day)
    assert (by_hour[:, :, 1:] != by_hour[:, :, :-1]).any()


def test_a_life_does_not_depend_on_other_homes():
    rules = RoutineDynamics()
    alone = make(rules, num_homes=1, first=3)
    configs = [
        replace(SMALL, dynamics=RoutineDynamics(max_things_share=0.4, step_seconds=60)),
        HomeConfig(dynamics=PaperDynamics()),
        HomeConfig(dynamics=RoutineDynamics(outlook_days=40)),
        replace(SMALL, dynamics=rules),
    ]
    group = SampledHomes(PriorGraph.default(), configs, Streams(0, "test", range(4)))
    num_slots, codes = alone.num_slots, alone.object_code[0]
    np.testing.assert_array_equal(
        group.transition_rows(np.full(num_slots, 3), codes)[:, : alone.num_place_codes],
        alone.transition_rows(np.zeros(num_slots, dtype=int), codes),
    )
    places = follow(alone, 100)[0]
    np.testing.assert_array_equal(follow(group, 100)[3, :num_slots], places)


def test_things_are_away_for_lunch_and_back_after_it():
    places = follow(make(replace(STRICT, step_seconds=600)), 7 * 144)
    away = find_away(places).any(axis=1)  # (H, T + 1)
    hour = np.arange(away.shape[1]) / 6 % 24
    # Lunch takes 42 to 78 minutes from twelve: from 12:10 to 12:40 always, after 13:20 never.
    assert away[:, (hour > 12.1) & (hour < 12.6)].all()
    assert not away[:, (hour < 12) | (hour > 13.4)].any()
    is_out = places == -1
    assert not is_out[:, : 4 * 4 * 3].any()


def test_things_of_an_occasion_go_together():
    places = follow(make(STRICT, num_homes=20), 24)
    away = find_away(places)[:, :, 12]
    lunch = np.array(
        [np.unique(row[own]) for row, own in zip(places[:, :, 12], away, strict=True) if own.any()],
        dtype=object,
    )
    assert all(len(spots) == 1 for spots in lunch)
    most = max(round(STRICT.max_things_share * 48), 1)
    assert 1 < away.sum(axis=1).max() <= most


def test_the_week_has_two_kinds_of_days():
    rules = replace(STRICT, occasions=(replace(LUNCH, weekend_share=0.0, weekend_hour=15.0),))
    moved = (np.diff(follow(make(rules), 24 * 21), axis=2) != 0).any(axis=(0, 1))
    days = moved.reshape(21, 24).any(axis=1).reshape(3, 7)
    assert days[:, :5].all()  # the first day is a Monday
    assert not days[:, 5:].any()
    late = replace(STRICT, occasions=(replace(LUNCH, weekend_hour=15.0),))
    away = find_away(follow(make(late), 24 * 7 - 1)).any(axis=(0, 1)).reshape(7, 24)
    assert away[:5, 12].all()
    assert not away[:5, 15].any()
    assert away[5:, 15].all()
    assert not away[5:, 12].any()


def test_a_week_begins_where_the_start_says():
    rules = replace(STRICT, occasions=(replace(LUNCH, weekend_share=0.0),))
    homes = make(replace(rules, start_time="2024-05-10T20:00"))  # a Friday
    assert homes.clock[0].tolist() == [4 * 86_400 + 20 * 3600, 3600]
    moved = (np.diff(follow(homes, 72), axis=2) != 0).any(axis=(0, 1))
    hours = np.flatnonzero(moved)
    # Monday's lunch is 16 + 48 hours after Friday, 20:00: step 64 looks just when it begins.
    assert hours.min() == 63
    assert hours.max() < 67


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_days_are_omitted_as_often_as_the_law_says(share):
    rules = replace(STRICT, occasions=(replace(LUNCH, weekday_share=share, weekend_share=share),))
    places = follow(make(rules, num_homes=30), 24 * 60)
    lunches = find_away(places)[:, :, 12::24].any(axis=1)[:, :60]
    has_any = lunches.any(axis=1)  # the spot may be where the things are kept
    found = lunches[has_any].mean()
    error = np.sqrt(share * (1 - share) / lunches[has_any].size)
    assert abs(found - share) < 4 * error


def test_hours_scatter_with_all_their_spreads():
    # Variances add up: person 1, habit 0.5, drift 0.5, jitter 0.25 hours -> 1.25 hours.
    rules = replace(
        STRICT,
        person_spread_hours=1.0,
        habit_spread_hours=0.5,
        drift_hours=0.5,
        jitter_hours=0.25,
        step_seconds=600,
    )
    places = follow(make(rules, num_homes=200), 144)
    away = find_away(places).any(axis=1)
    begins = away.argmax(axis=1)[away.any(axis=1)] / 6
    spread = np.sqrt(1.0 + 0.25 + 0.25 + 0.0625)
    assert len(begins) > 150
    assert begins.mean() == pytest.approx(12 + 1 / 12, abs=4 * spread / np.sqrt(len(begins)))
    assert begins.std() == pytest.approx(spread, rel=0.2)


def test_drifts_last_for_days():
    rules = replace(STRICT, drift_hours=1.0, drift_days=5.0, step_seconds=600)
    places = follow(make(rules, num_homes=60), 144 * 40)
    away = find_away(places).any(axis=1)[:, :-1].reshape(60, 40, 144)
    away = away[away.any(axis=2).all(axis=1)]
    begins = away.argmax(axis=2) / 6  # (homes, days)
    scatter = begins - begins.mean()
    for days in (1, 5):
        product = (scatter[:, days:] * scatter[:, :-days]).mean() / scatter.var()
        assert product == pytest.approx(np.exp(-days / 5), abs=0.15)


def test_what_is_left_lies_until_the_evening():
    rules = replace(STRICT, left_share=1.0, tidy_share=1.0, tidy_hour=22.0)
    places = follow(make(rules, num_homes=10), 48)
    away = find_away(places).any(axis=1)
    assert away[:, 12:22].all(axis=1).sum() == away.any(axis=1).sum() > 5
    assert not away[:, 22:36].any()


def test_washing_up_collects_what_a_meal_has_left():
    clear = Occasion("clear", "washing up", 15.0, 15.0, 60, 1.0, 1.0)
    rules = replace(
        STRICT, occasions=(LUNCH, clear), left_share=1.0, tidy_share=0.0, collect_share=1.0
    )
    homes = make(rules, num_homes=10)
    own = homes.lives[0].state.own_place[:, :, 0]
    places = follow(homes, 48)
    items = homes.lives[0].habits.item
    for home in range(10):
        lunch, clearing = (set(items[home, 0, n]) - {-1} for n in (0, 1))
        only_lunch = list(lunch - clearing)
        assert (places[home, only_lunch, 20] == own[home, only_lunch]).all()


def test_people_carry_things_out_and_bring_them_back():
    out = Occasion("job", "leaving", 9.0, 9.0, 240, 1.0, 1.0)
    rules = replace(STRICT, occasions=(out, LUNCH), step_seconds=3600)
    places = follow(make(rules, num_homes=12), 24)
    is_out = places[:, : 4 * 4 * 3] == -1
    assert is_out[:, :, 10].any(axis=1).sum() >= 10  # 168 to 312 minutes from nine
    assert not is_out[:, :, [0, 8, 15, 24]].any()
    assert (places[:, :, 24] == places[:, :, 0]).all()
    # Who is out at twelve does not have lunch at home.
    stays = is_out[:, :, 13].any(axis=1)
    at_home = find_away(places)[stays, : is_out.shape[1], 12] & ~is_out[stays][:, :, 12]
    assert not at_home.any()
    inside = replace(SMALL, dynamic_nodes=False)
    places = follow(make(rules, config=inside), 24)
    assert (places[:, : 4 * 4 * 3] >= 0).all()


def test_the_last_thing_is_never_carried_out():
    out = Occasion("job", "leaving", 9.0, 9.0, 240, 1.0, 1.0)
    single = HomeConfig(rooms=("kitchen",), furniture_per_room=2, objects_per_furniture=1)
    rules = replace(STRICT, occasions=(out,), max_things_share=1.0)
    homes = make(rules, num_homes=20, config=single)
    for _ in range(24):
        homes.evolve()
        assert homes.is_present.any(axis=1).all()
        assert (homes.num_objects == homes.is_present.sum(axis=1)).all()


def test_what_nobody_uses_never_moves():
    places = follow(make(replace(RoutineDynamics(), static_share=1.0)), 24 * 7)
    assert not find_away(places).any()


def test_moved_says_what_is_elsewhere_than_a_step_before():
    homes = make(RoutineDynamics())
    for _ in range(60):
        before = homes.object_place.copy()
        homes.evolve()
        is_elsewhere = (homes.object_place // 2 != before // 2) & homes.is_present
        np.testing.assert_array_equal(homes.object_moved, is_elsewhere)


@pytest.mark.slow
def test_the_long_run_is_where_things_are_in_the_long_run():
    homes = make(replace(RoutineDynamics(), new_share=0.0, outlook_days=960), num_homes=3)
    before = homes.object_place.copy()
    hours = homes.lives[0].count_hours()
    assert homes.lives[0].count_hours() is hours
    np.testing.assert_array_equal(homes.object_place, before)
    places = follow(homes, 24 * 960)[:, :, 1:]
    counts = np.stack(
        [(places == place).sum(axis=2) for place in range(homes.num_place_codes)], axis=2
    )
    is_used = counts.any(axis=2)
    found = counts[is_used] / counts[is_used].sum(axis=1, keepdims=True)
    expected = hours[is_used] / hours[is_used].sum(axis=1, keepdims=True)
    rows = homes.transition_rows(np.zeros(5, dtype=int), homes.object_code[0, :5])
    assert rows.sum(axis=1) == pytest.approx(np.ones(5), abs=1e-5)
    # Half the distance between distributions: the share of time that they disagree on.
    assert (np.abs(found - expected).sum(axis=1) / 2).mean() < 0.02


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"start_time": "noon"}, r"start_time and step_seconds must .* 'noon'"),
        ({"step_seconds": 0}, "step_seconds must"),
        ({"min_residents": 3, "max_residents": 2}, "residents must be 1 to 4.*3 to 2"),
        ({"max_residents": 5}, "residents must be 1 to 4"),
        ({"away_share": 0.9}, "add up to at most 1, got 1.1"),
        ({"left_share": 1.5}, r"left_share must lie in \[0, 1\], got 1.5"),
        ({"jitter_hours": -1}, "jitter_hours must lie in 0 to 24 hours, got -1"),
        ({"drift_days": 0}, "drift_days must be at least 0.01, got 0"),
        ({"tidy_hour": 2}, "tidy_hour must lie in 4 to 28, got 2"),
        ({"min_use": 0.9, "max_use": 0.5}, "min_use must be at most max_use"),
        ({"occasions": ()}, "occasions must be one or more"),
        ({"occasions": (LUNCH, LUNCH)}, "different names"),
        ({"occasions": (replace(LUNCH, kind="sailing"),)}, "kind must be one of .*sailing"),
        ({"occasions": (replace(LUNCH, after="dinner"),)}, "after must be an occasion"),
        ({"occasions": (replace(LUNCH, minutes=0),)}, "minutes must be above 0"),
    ],
)
def test_bad_rules_are_refused(fields, message):
    with pytest.raises(ValueError, match=message):
        RoutineDynamics(**fields)


def test_rules_come_back_from_json():
    rules = HomeConfig(dynamics=replace(STRICT, drift_days=3.0))
    assert HomeConfig.from_json(rules.describe()) == rules
