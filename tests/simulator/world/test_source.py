"""A source says beforehand what its homes will be."""

import pickle

import numpy as np
import pytest

from simulator.policies import list_policies
from simulator.world.config import HomeConfig
from simulator.world.dynamics import DYNAMICS
from simulator.world.source import (
    TRUE_PLACE_WEIGHTS,
    TRUE_TRANSITIONS,
    Group,
    SampledSource,
)
from simulator.world.streams import Streams

HOME = HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3)


def test_sampled_homes_are_those_of_the_streams(tiny_prior):
    source = SampledSource(tiny_prior, HOME)
    homes = source.make(Streams(0, "val", range(3)))
    assert homes.num_furniture == 6
    assert source.labels == homes.labels
    assert source.list_groups(range(3)) == [Group((0, 1, 2))]
    assert source.list_groups([]) == []
    again = pickle.loads(pickle.dumps(source)).make(Streams(0, "val", [1]))
    np.testing.assert_array_equal(again.furniture_type[0], homes.furniture_type[1])


def test_sampled_homes_have_no_end_and_no_clock(tiny_prior):
    source = SampledSource(tiny_prior, HOME)
    assert (source.num_homes, source.num_steps, source.has_clock) == (None, None, False)
    source.check_homes([10**6])
    source.check_steps(10**6)
    with pytest.raises(ValueError, match=r"steps must be at least 1, got 0. Raise it"):
        source.check_steps(0)
    with pytest.raises(
        ValueError, match=r"must have a clock for features.clock, got sampled homes, in"
    ):
        source.check_clock()


def test_a_description_names_the_rules_and_the_prior(tiny_prior):
    described = SampledSource(tiny_prior, HOME).describe()
    assert described["home"]["rooms"] == ["kitchen", "bedroom"]
    assert described["home"]["furniture_per_room"] == 3
    assert described["prior"] == tiny_prior.checksum
    assert SampledSource().describe() == SampledSource(home=HomeConfig()).describe()


def test_the_ceiling_plays_only_where_moves_follow_t():
    """In homes with routines where a thing goes depends on the hour: T is not all there is."""
    assert TRUE_PLACE_WEIGHTS in SampledSource(home=HomeConfig()).knows
    people = SampledSource(home=HomeConfig(dynamics=DYNAMICS.find("routine")()))
    assert TRUE_PLACE_WEIGHTS not in people.knows
    assert TRUE_TRANSITIONS in people.knows
    assert "ceiling" not in list_policies(people)
    assert "oracle" in list_policies(people)
