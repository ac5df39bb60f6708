import pytest

from simulator.box_world.world import BoxWorld
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture
def make_world():
    """Make small homes of boxes."""

    def make(home=0, furniture=4, things=3, **rules):
        config = HomeConfig(furniture_per_room=furniture, objects_per_furniture=things, **rules)
        return BoxWorld(SampledSource(home=config).make(Streams(3, "test", [home])))

    return make


@pytest.fixture
def source():
    """Homes that are smaller still."""
    return SampledSource(home=HomeConfig(furniture_per_room=2, objects_per_furniture=2))


@pytest.fixture
def make_small_world(source):
    """Make one of these, of boxes."""
    return lambda home=0: BoxWorld(source.make(Streams(1, "test", [home])))
