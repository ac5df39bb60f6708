"""A server's calls on a small memory, in which a few names were seen."""

import pytest

from sgm import Bayesian, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService


@pytest.fixture
def make_service():
    """Make one of a kitchen with a counter and a drawer; the names were seen at the counter."""

    def make(*seen):
        memory = SceneGraphMemory()
        kitchen = memory.add_room("kitchen")
        memory.add_furniture("counter", kitchen)
        memory.add_furniture("drawer", kitchen)
        service = MemoryService(memory, Finder(Bayesian()), None)
        service.observe("counter", [Sighting(name) for name in seen])
        return service

    return make
