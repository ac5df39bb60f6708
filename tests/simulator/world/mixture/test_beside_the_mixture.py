"""The paper's homes of several sizes, and homes that people live in, beside the mixture."""

import numpy as np
import pytest

from sgm.policies import Bayesian
from simulator.tasks.rollout import Rollout
from simulator.testing import check_homes
from simulator.world.mixture.lived_in_homes import LivedInSource, draw_sessions
from simulator.world.mixture.paper_homes import PaperSizesSource
from simulator.world.mixture.source import MixtureSource
from simulator.world.streams import Streams


def test_sizes_rules_and_words_of_the_papers_homes():
    source = PaperSizesSource()
    homes = source.make(Streams(0, "train", range(40)))
    sizes = homes.home_num_furniture
    assert {4, 32} <= set(sizes.tolist()) <= {4, 8, 12, 16, 24, 32, 60}
    assert homes.views == ("true",) * 40
    assert homes.clock is None
    assert {config.move_share for config in homes.configs} == {0.05}
    assert list(source.labels) == list(MixtureSource().labels)
    assert source.describe() != MixtureSource().describe()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("pace", "lengths"), [("minutes", {30, 60, 120, 300}), ("hours", {600, 1200, 1800, 3600, 7200})]
)
def test_sessions_people_looks_and_a_clock_that_some_do_not_know(pace, lengths):
    source = LivedInSource(pace=pace)
    homes = source.make(Streams(0, "train", range(60)))
    kinds = [type(config.dynamics).__name__ for config in homes.configs]
    assert 0.5 < kinds.count("SessionDynamics") / 60 < 0.9
    assert set(kinds) == {"SessionDynamics", "RoutineDynamics"}
    assert {config.looks for config in homes.configs} == {"policy", "patrol", "random"}
    rounds = [
        config
        for config, size in zip(homes.configs, homes.home_num_furniture, strict=True)
        if config.looks_per_step > 3
    ]
    assert rounds
    assert all(config.looks_per_step == sum(config.room_sizes) for config in rounds)
    is_known = ~np.isnan(homes.clock).any(axis=1)
    assert 0.5 < is_known.mean() < 0.9
    assert set(homes.clock[is_known, 1].tolist()) == lengths
    assert len(set(homes.home_num_furniture.tolist())) > 10
    assert list(source.labels) == list(MixtureSource().labels)
    assert source.describe() != LivedInSource(pace=pace, session_share=0.1).describe()


def test_a_robot_rests_between_its_looks_alike_in_all_homes_of_a_split():
    source = LivedInSource()
    pauses = source.make(Streams(0, "train", [3])).pauses
    assert np.array_equal(pauses, source.make(Streams(0, "train", [4, 5])).pauses)
    assert not np.array_equal(pauses, source.make(Streams(1, "train", [3])).pauses)
    assert not np.array_equal(pauses, source.make(Streams(0, "val", [3])).pauses)
    assert 0.02 < (pauses > 1).mean() < 0.25
    assert pauses.min() == 1
    assert 500 < pauses.max() <= 1500
    rollout = Rollout(source.make(Streams(0, "train", [3])), Bayesian())
    for asked in range(1, 30):
        rollout.evolve()
        assert rollout.memory.time == pauses[:asked].sum()


def test_lived_in_homes_keep_the_contract_and_draw_from_wide_ranges():
    check_homes(LivedInSource().make, num_steps=4)
    rules = [
        draw_sessions(np.random.default_rng(seed), "2024-05-06T00:00", 60.0, 100)
        for seed in range(300)
    ]
    per_day = [
        row.sessions_per_day * row.session_minutes / 60 * row.moves_per_hour for row in rules
    ]
    assert min(per_day) < 5
    assert max(per_day) > 1000
    assert 100 < max(row.moves_per_hour for row in rules) <= 500  # five of each thing
    assert 0.3 < np.mean([row.work_share > 0 for row in rules]) < 0.7
    assert min(row.use_minutes for row in rules) < 1 < 20 < max(row.use_minutes for row in rules)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"pace": "days"}, "pace must be one of minutes, hours, got 'days'"),
        ({"session_share": 1.5}, r"session_share must lie in \[0, 1\], got 1.5"),
    ],
)
def test_options_out_of_range_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        LivedInSource(**options)


@pytest.mark.parametrize(
    ("source", "lives"),
    [(PaperSizesSource(), {30, 100, 200}), (LivedInSource(), {30, 100, 300})],
)
def test_every_home_is_in_one_group_and_the_same_in_any(source, lives):
    groups = source.list_groups(range(20))
    assert sorted(home for group in groups for home in group.homes) == list(range(20))
    assert {group.play_steps for group in groups} == lives
    together = source.make(Streams(0, "train", range(5)))
    alone = source.make(Streams(0, "train", [3]))
    own = together.object_place[3]
    np.testing.assert_array_equal(own[own >= 0], alone.object_place[0][alone.object_place[0] >= 0])
