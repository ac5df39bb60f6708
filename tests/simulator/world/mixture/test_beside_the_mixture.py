"""The paper's homes of several sizes, and homes that people live in, beside the mixture."""

import numpy as np
import pytest

from simulator.world.mixture.lived_in_homes import LivedInSource
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


def test_people_a_clock_and_one_look_at_the_answer():
    source = LivedInSource()
    homes = source.make(Streams(0, "train", range(40)))
    assert {(config.looks, config.looks_per_step) for config in homes.configs} == {("policy", 1)}
    assert {type(config.dynamics).__name__ for config in homes.configs} == {"RoutineDynamics"}
    assert not np.isnan(homes.clock).any()
    assert set(homes.clock[:, 1].tolist()) == {600, 1200, 1800, 3600, 7200}
    assert len(set(homes.home_num_furniture.tolist())) > 10
    assert list(source.labels) == list(MixtureSource().labels)
    assert source.describe() != MixtureSource(mixture=source.mixture).describe()


@pytest.mark.parametrize(
    ("source", "lives"),
    [(PaperSizesSource(), {30, 100, 200}), (LivedInSource(), {100, 300, 1000})],
)
def test_every_home_is_in_one_group_and_the_same_in_any(source, lives):
    groups = source.list_groups(range(20))
    assert sorted(home for group in groups for home in group.homes) == list(range(20))
    assert {group.play_steps for group in groups} == lives
    together = source.make(Streams(0, "train", range(5)))
    alone = source.make(Streams(0, "train", [3]))
    own = together.object_place[3]
    np.testing.assert_array_equal(own[own >= 0], alone.object_place[0][alone.object_place[0] >= 0])
