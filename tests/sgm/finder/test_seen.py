"""What was seen may be said by names, by mappings as JSON has them, or by sightings."""

import pytest

from sgm.finder.finder import Finder
from sgm.finder.seen import read_seen
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian
from sgm.serve.calls import BY_NAME
from tests.sgm.memory.sessions import dump

SAID = [
    ["mug", {"thing": "pen", "relation": "in", "confidence": 0.8, "owner": None}],
    ("mug", {"thing": "pen", "relation": "in", "confidence": 0.8}),
    (Sighting("mug"), Sighting("pen", "in", 0.8)),
    iter(["mug", Sighting("pen", "in", 0.8)]),
]


@pytest.mark.parametrize("said", SAID)
def test_what_is_said_alike_is_read_alike(said):
    assert read_seen(said) == [Sighting("mug"), Sighting("pen", "in", 0.8)]


def test_python_reads_what_http_reads():
    one = {"thing": "cup", "id": "7", "position": [1, 2, 0.9], "position_sd": 0.1, "owner": "Ann"}
    read = BY_NAME["observe"].read({"place": 0, "seen": ["pen", one]})["seen"]
    assert read_seen(["pen", one]) == read


def test_looks_and_searches_take_all_of_them():
    dumps = set()
    for said in (["mug"], [{"thing": "mug"}], [Sighting("mug")]):
        service = MemoryService(SceneGraphMemory(), Finder(Bayesian()), now=None)
        service.add_room("kitchen")
        service.add_place("table", "kitchen")
        service.observe("table", said)
        begun = service.search_start("pen")
        service.search_next(begun.search_id, "seen", said)
        dumps.add(dump(service.memory))
    assert len(dumps) == 1


@pytest.mark.parametrize(
    ("said", "line"),
    [
        ("mug", "seen must be a list of all things that were seen, got 'mug'"),
        ({"thing": "mug"}, "seen must be a list"),
        (None, "seen must be a list"),
        ([3], r"seen\[0\] must be a name, a Sighting, or a mapping of thing, relation"),
        (["pen", {"name": "mug"}], r"seen\[1\] must be a name"),
        ([{"thing": "mug", "colour": "red"}], r"seen\[0\] must be a name"),
        ([{"thing": None}], r"thing of seen\[0\] must be a name"),
        ([{"thing": "mug", "confidence": 2}], "confidence must lie in"),
        ([""], "description must"),
    ],
)
def test_what_is_none_is_refused(said, line):
    with pytest.raises(ValueError, match=line):
        read_seen(said)
