"""Pictures of sightings: texts that are kept by place, and given back whatever happens."""

import json

import pytest

from sgm import SceneGraphMemory, Sighting
from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.memory_event import read_events
from sgm.memory.sighting import MOST_PICTURE
from sgm.memory.thing import MOST_PICTURES
from sgm.policies import Bayesian
from sgm.replay.replay import replay
from tests.sgm.memory.sessions import dump


@pytest.fixture
def memory(tmp_path):
    """A shelf 0, a table 1 and a desk 2."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("study")
    for name in ("shelf", "table", "desk"):
        memory.add_furniture(name, room)
    return memory


def see(memory, place, picture=None, name="mug", **about):
    memory.observe(place, [Sighting(name, picture=picture, **about)])
    memory.step()


def find(memory, name="mug"):
    return {seen.furniture: seen.picture for seen in memory.places_of(name)}


def test_each_place_has_the_latest_picture(memory):
    see(memory, 0, "a.jpg")
    see(memory, 1, "b.jpg")
    see(memory, 0, "c.jpg")
    see(memory, 0)  # the latest that had one
    assert find(memory) == {0: "c.jpg", 1: "b.jpg"}
    assert memory.last_seen("mug").picture == "c.jpg"
    doubtful = Sighting("mug", confidence=0.2, picture="doubtful.jpg")  # counts as not seen
    memory.observe(1, [doubtful, Sighting("pen"), Sighting("key")])
    assert find(memory)[1] == "b.jpg"
    see(memory, 2)
    assert memory.last_seen("mug").picture is None


def test_all_that_tells_of_a_thing_gives_it_back(memory):
    see(memory, 0, "a.jpg")
    see(memory, 1, "b.jpg")
    assert [event.picture for event in memory.history("mug") if event.kind == "seen"] == [
        "b.jpg", "a.jpg"
    ]  # fmt: skip
    moved = next(change for change in memory.changes(0) if change.kind == "moved")
    assert (moved.to_place, moved.picture) == (1, "b.jpg")
    rows, _ = memory.list_seen()
    assert [(name, seen.picture) for name, seen in rows] == [("mug", "b.jpg")]
    home = memory.to_dict()["rooms"][0]["furniture"]
    assert [row["objects"][0]["picture"] for row in home[:2]] == ["a.jpg", "b.jpg"]
    ranking = Finder(Bayesian()).rank(memory, "mug")
    assert {place.furniture: place.picture for place in ranking} == {
        0: "a.jpg", 1: "b.jpg", 2: None
    }  # fmt: skip


def test_log_file_and_copy_have_them(memory, tmp_path):
    see(memory, 0, "a.jpg", id=7)
    see(memory, 1, "b.jpg", position=(1, 2, 3), id=7)
    see(memory, 2, "c.jpg", name="pen")
    memory.save(tmp_path / "home.sgm")
    *_, (again, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    for other in (again, SceneGraphMemory.load(tmp_path / "home.sgm"), memory.copy()):
        assert dump(other) == dump(memory)
        assert find(other) == {0: "a.jpg", 1: "b.jpg"}
        assert find(other, "pen") == {2: "c.jpg"}


def test_they_follow_furniture_and_things(memory):
    see(memory, 0, "a.jpg")
    see(memory, 1, "b.jpg")
    see(memory, 2, "c.jpg", name="cup")
    memory.merge("cup", "mug")
    assert find(memory, "cup") == {0: "a.jpg", 1: "b.jpg", 2: "c.jpg"}
    assert memory.to_dict()["rooms"][0]["furniture"][2]["objects"][0]["picture"] == "c.jpg"
    memory.split("cup")
    assert find(memory) == {0: "a.jpg", 1: "b.jpg"}
    memory.split("mug", 1, "goblet")
    assert (find(memory), find(memory, "goblet")) == ({0: "a.jpg"}, {1: "b.jpg"})
    memory.merge_furniture(2, 0)  # the desk was the shelf
    assert find(memory) == {2: "a.jpg"}
    memory.rename("mug", "tea mug")
    assert find(memory, "tea mug") == {2: "a.jpg"}
    memory.remove_furniture(2)
    assert set(find(memory, "tea mug").values()) <= {None}
    memory.forget("goblet")
    assert "goblet" not in memory.descriptions


def test_few_are_kept(memory):
    room = memory.add_room("attic")
    places = [memory.add_furniture("box", room) for _ in range(MOST_PICTURES + 3)]
    for number, place in enumerate(places):
        see(memory, place, f"{number}.jpg")
    kept = [picture for picture in find(memory).values() if picture]
    assert kept == [f"{number}.jpg" for number in reversed(range(3, MOST_PICTURES + 3))]


@pytest.mark.parametrize("picture", ["", "a\nb", 7, b"a.jpg", "x" * (MOST_PICTURE + 1), ["a.jpg"]])
def test_what_is_no_picture_is_refused(picture):
    with pytest.raises(ValueError, match="picture must be a path or an id, a text of 1 to 500"):
        Sighting("mug", picture=picture)


def test_the_calls_of_a_server_give_it_back(memory):
    service = MemoryService(memory, Finder(Bayesian()))
    heard = []
    service.subscribe(heard.append)
    service.observe("shelf", [Sighting("mug", picture="a.jpg")])
    assert heard[-1].changes[0].picture == "a.jpg"
    found = service.where_is("mug")
    assert found.last_seen.picture == "a.jpg"
    assert [place.picture for place in found.places] == [None] * 3  # a short answer has one
    assert service.where_is("mug", k=1).places[0].picture == "a.jpg"
    assert service.history("mug").rows[0].picture == "a.jpg"
    assert service.list_things().rows[0].picture == "a.jpg"
    assert service.changes(0).rows[0].picture == "a.jpg"


def test_an_altered_file_is_refused(memory, tmp_path):
    see(memory, 0, "a.jpg")
    content = memory.parts.state.get_content().to_json()
    assert json.loads(json.dumps(content))["pictures"] == [[0, [[0, 0, "onTop", "a.jpg"]]]]
    for wrong in ([0, 9, "in", "a"], [5, 0, "in", "a"], [0, 0, "at", "a"], [0, 0, "in", None]):
        with pytest.raises(ValueError, match="picture"):
            type(memory.parts.state.get_content()).from_json(
                {**content, "pictures": [[0, [wrong]]]}
            )
