"""The checksum of homes: what it depends on, and what it does not."""

from dataclasses import replace

from simulator.test_sets.test_sets import compute_fingerprint
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


def test_homes_that_differ_in_anything_have_another_one(tiny_prior):
    rules = HomeConfig(rooms=("kitchen", "bedroom"), furniture_per_room=3)
    source, streams = SampledSource(tiny_prior, rules), Streams(0, "test", range(3))
    same = compute_fingerprint(source, streams, 4)
    assert compute_fingerprint(source, Streams(0, "test", range(1)), 4) == same  # the first home
    for other, own, steps in (
        (source, Streams(1, "test", range(3)), 4),
        (source, Streams(0, "val", range(3)), 4),
        (source, streams, 5),
        (SampledSource(tiny_prior, replace(rules, move_share=0.5)), streams, 4),
    ):
        assert compute_fingerprint(other, own, steps) != same
