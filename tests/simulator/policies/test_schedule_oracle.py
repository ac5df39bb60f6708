"""The oracle that knows how people live, where their days are certain and where they are not."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from simulator.policies import POLICIES
from simulator.policies.oracles import ScheduleOracle, find_hours_alike
from simulator.policies.registry import check_policies, find_policy, list_policies, make_policy
from simulator.tasks.evaluation import evaluate_policy
from simulator.world.config import HomeConfig
from simulator.world.mixture.source import MixtureSource
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from simulator.world.streams import Streams
from tests.homes import make_strict_life

CERTAIN = make_strict_life(minutes=40)  # over at 12:52 at the latest
SMALL = HomeConfig(furniture_per_room=4, objects_per_furniture=3)


def make_source(rules):
    return SampledSource(home=replace(SMALL, dynamics=rules))


def play(name, rules, num_homes=3, num_steps=48):
    streams = Streams(0, "test", range(num_homes))
    return evaluate_policy(find_policy(name).make, make_source(rules), streams, num_steps)


def test_hours_alike_are_of_one_kind_of_day():
    friday_noon = 4 * 86400 + 12 * 3600.0
    # Two weeks from Friday noon: at 12:00 + 3 h there are ten weekdays and four days of weekends.
    on_friday = find_hours_alike(friday_noon, 3 * 3600.0, 14 * 24)
    assert on_friday.tolist() == [day * 24 + 3 for day in (0, 3, 4, 5, 6, 7, 10, 11, 12, 13)]
    on_saturday = find_hours_alike(friday_noon, 27 * 3600.0, 14 * 24)
    assert on_saturday.tolist() == [day * 24 + 3 for day in (1, 2, 8, 9)]
    # Thirteen hours later it is 1:00 on Saturday.
    over_midnight = find_hours_alike(friday_noon, 13 * 3600.0, 14 * 24)
    assert over_midnight.tolist() == [day * 24 + 13 for day in (0, 1, 7, 8)]


@pytest.mark.slow
def test_a_certain_life_is_known_beforehand():
    homes = make_source(CERTAIN).make(Streams(0, "test", range(3)))
    lived = homes.sample_hours(60)
    for hour in range(60):
        np.testing.assert_array_equal(lived[:, hour], homes.object_furniture)
        homes.evolve()
    np.testing.assert_array_equal(homes.sample_hours(60), lived)  # still from step 0


def test_who_knows_a_certain_life_is_always_right():
    """Whatever detection misses, and although the long run is wrong at noon."""
    assert play("schedule_oracle", CERTAIN).is_correct.all()
    assert not play("oracle", CERTAIN).is_correct.all()


@pytest.mark.slow
def test_knowing_the_hours_is_better_than_knowing_the_long_run():
    by_hour, long_run = (
        play(name, RoutineDynamics(), 8, 80) for name in ("schedule_oracle", "oracle")
    )
    assert by_hour.is_correct.mean() > long_run.is_correct.mean() + 0.05


def test_looks_weigh_the_days_by_hand(make_tiny_memory):
    """A thing is at 0 on three of four days and at 1 on the other; a look at 0 does not see it."""
    days = 210
    place = np.zeros((1, 24 * days, 2), dtype=np.int16)
    place[0, :, 0] = np.arange(24 * days) // 24 % 4 == 3
    place[0, :, 1] = 3  # another thing, which never moves
    homes = SimpleNamespace(
        clock=np.array([[0.0, 3600.0]]),
        detection_error=np.array([0.25]),
        object_code=np.array([[7, 8]]),
        sample_hours=lambda num: place[:, :num],
    )
    policy = ScheduleOracle(homes)
    memory = make_tiny_memory()
    policy.reset(memory)
    for _ in range(12):
        memory.step()
    queries = memory.query(*(np.array([number]) for number in (0, 7, 0, 0)))
    scores = policy.scores(memory, queries)[0]
    assert scores[:2] == pytest.approx([0.75, 0.25], abs=0.02)  # a weekday: 149 samples
    change = memory.observe(np.array([0]), np.array([0]), np.array([], int), np.array([], int))
    policy.observe(memory, change)
    # Days with the thing there: 0.02 + 0.96 x 0.25 = 0.26; without: 0.98. 3 x 0.26 : 0.98.
    scores = policy.scores(memory, queries)[0]
    assert scores[0] == pytest.approx(0.78 / 1.76, abs=0.02)


def test_it_plays_where_people_have_schedules():
    assert "schedule_oracle" in list_policies(make_source(RoutineDynamics()))
    assert "schedule_oracle" not in POLICIES
    for source in (SampledSource(), MixtureSource()):
        assert "schedule_oracle" not in list_policies(source)
        with pytest.raises(ValueError, match=r"got schedule_oracle, which reads their true sched"):
            check_policies(["schedule_oracle"], source)
    with pytest.raises(NotImplementedError, match="no schedules"):
        SampledSource().make(Streams(0, "test", range(1))).sample_hours(2)


def test_a_home_is_played_the_same_beside_others():
    source = make_source(RoutineDynamics())
    both, one = (
        evaluate_policy(
            lambda homes: make_policy("schedule_oracle", homes), source, Streams(0, "test", own), 20
        )
        for own in ([0, 1], [1])
    )
    np.testing.assert_allclose(both.likelihood[1:], one.likelihood)
