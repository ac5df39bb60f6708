import pytest

from simulator.box_world.world import BoxWorld
from simulator.world.config import HomeConfig
from simulator.world.source import SampledSource
from simulator.world.streams import Streams


@pytest.fixture
def source():
    """Small homes."""
    return SampledSource(home=HomeConfig(furniture_per_room=2, objects_per_furniture=2))


@pytest.fixture
def make_world(source):
    """Make small homes of boxes."""
    return lambda home=0: BoxWorld(source.make(Streams(1, "test", [home])))
