"""The paper's homes of several sizes, beside the mixture."""

import numpy as np

from simulator.world.mixture.paper_homes import PaperSizesSource
from simulator.world.mixture.source import MixtureSource
from simulator.world.streams import Streams


def test_sizes_rules_and_words():
    source = PaperSizesSource()
    homes = source.make(Streams(0, "train", range(40)))
    sizes = homes.home_num_furniture
    assert {4, 32} <= set(sizes.tolist()) <= {4, 8, 12, 16, 24, 32, 60}
    assert homes.views == ("true",) * 40
    assert homes.clock is None
    assert {config.move_share for config in homes.configs} == {0.05}
    assert list(source.labels) == list(MixtureSource().labels)
    assert source.describe() != MixtureSource().describe()


def test_every_home_is_in_one_group_and_the_same_in_any():
    source = PaperSizesSource()
    groups = source.list_groups(range(10))
    assert sorted(home for group in groups for home in group.homes) == list(range(10))
    assert {group.play_steps for group in groups} == {30, 100, 200}
    together = source.make(Streams(0, "train", range(5)))
    alone = source.make(Streams(0, "train", [3]))
    own = together.object_place[3]
    np.testing.assert_array_equal(own[own >= 0], alone.object_place[0][alone.object_place[0] >= 0])
