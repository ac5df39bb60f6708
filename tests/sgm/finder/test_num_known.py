"""How many things of one name are known: as many as were seen at once, at least."""

import pytest

from sgm.finder.answers import to_json
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian


@pytest.fixture
def service():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    for label in ("table", "shelf"):
        memory.add_furniture(label, kitchen)
    return MemoryService(memory, Finder(Bayesian()), None)


@pytest.mark.parametrize(
    ("looks", "number"),
    [
        ([(0, ["plate"])], 0),
        ([(0, ["mug"])], 1),
        ([(0, ["mug", "mug", "plate"])], 2),
        ([(0, ["mug"]), (1, ["mug", "mug"])], 3),  # of one step: seen at once
        ([(0, ["mug"]), None, (1, ["mug"])], 1),  # it may have been moved
        ([(0, ["mug", "mug"]), None, (0, [])], 2),
        ([(0, ["red mug", "blue mug"])], 2),
    ],
)
def test_how_many_are_known(service, looks, number):
    for look in looks:
        if look is None:
            service.memory.step()
        else:
            service.memory.observe(look[0], [Sighting(name) for name in look[1]])
    assert service.finder.rank(service.memory, "mug").num_known == number
    assert to_json(service.where_is("mug")).get("num_known") == (number if number > 1 else None)
    assert service.list_things(kind="mug").num_known == (number or None)
    assert "num_known" not in to_json(service.list_things())


def test_things_with_ids_are_told_apart(service):
    service.memory.observe(0, [Sighting("mug", id="a"), Sighting("mug", id="b")])
    service.memory.step()
    service.memory.observe(1, [Sighting("mug", id="a")])
    assert service.where_is("mug").num_known == 2


@pytest.mark.parametrize(
    ("question", "number"),
    [
        ("how many mugs are there?", 3),
        ("how many mugs are on the table?", 2),
        ("how many plates are there?", 4),
        ("how many plates are on the shelf?", 1),  # which of the four, is not known
        ("how many things are on the table?", 3),  # both mugs, and a plate at least
    ],
)
def test_a_sentence_counts_as_the_other_calls_do(service, question, number):
    """It counted names: of three mugs of one name it said "I know 1"."""
    seen = ["mug", "mug", "plate", "plate", "plate"]
    service.memory.observe(0, [Sighting(name) for name in seen])
    service.memory.observe(1, [Sighting("plate"), Sighting("red mug")])
    said = service.ask(question).said
    assert said.startswith(f"I know {number}:")


def test_a_sentence_counts_things_with_ids_where_they_are(service):
    service.memory.observe(0, [Sighting("mug", id="a"), Sighting("mug", id="b")])
    assert service.ask("how many mugs are there?").said.startswith("I know 2:")
    service.memory.observe(0, [Sighting("mug", id="a")])
    service.memory.step()
    service.memory.observe(0, [Sighting("mug", id="a")])
    assert service.ask("how many mugs are there?").said.startswith("I know 1:")
