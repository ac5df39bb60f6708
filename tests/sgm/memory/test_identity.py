"""Ids and embeddings of trackers: two things of one description stay two."""

import json

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.trace.from_log import make_trace
from tests.sgm.memory.sessions import dump

FINDER = Finder(Bayesian())
SINK, DESK, SHELF = range(3)


@pytest.fixture
def memory(tmp_path):
    """Mug 1 at the sink, mug 2 on the desk, as a tracker says; a spoon without an id."""
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    for label in ("sink", "desk", "shelf"):
        memory.add_furniture(label, room)
    memory.observe(SINK, [Sighting("mug", id="m1", embedding=(1.0, 0.0)), Sighting("spoon")])
    memory.observe(DESK, [Sighting("Mug", id="m2", embedding=np.array([0.6, 0.8]))])
    memory.step()
    return memory


def where(memory, thing):
    return {seen.furniture for seen in memory.places_of(thing) if seen.is_there}


def test_two_things_of_one_description_stay_two(memory):
    assert memory.descriptions == ("mug", "spoon", "Mug")
    assert where(memory, "m1") == {SINK}
    assert where(memory, "m2") == {DESK}
    assert where(memory, "the mug") == {SINK, DESK}
    memory.observe(SHELF, [Sighting("mug", id="m1")])
    assert where(memory, "m1") == {SHELF}  # before anyone looks at the sink
    memory.observe(SINK, [])
    assert where(memory, "m1") == {SHELF}
    assert where(memory, "m2") == {DESK}


def test_a_thing_of_a_known_id_is_that_one_whatever_it_is_called(memory):
    memory.observe(SHELF, [Sighting("coffee cup", id="m1")])
    assert len(memory.descriptions) == 3
    assert SHELF in where(memory, "m1")


def test_questions_mean_all_of_a_name_or_the_one_of_an_id(memory):
    both, one = FINDER.rank(memory, "mug"), FINDER.rank(memory, "m1")
    by_place = {place.furniture: place.probability for place in both}
    assert min(by_place[SINK], by_place[DESK]) > 0.7
    assert one[0].furniture == SINK
    assert sum(place.probability for place in one) + one.elsewhere == pytest.approx(1)
    assert one[0].probability > 0.7 > 0.2 > {p.furniture: p.probability for p in one}[DESK]


def test_a_search_for_one_of_them_is_not_ended_by_the_other(memory):
    search = FINDER.search(memory, "m2")
    assert search.next().place.furniture == DESK
    assert not search.seen([Sighting("mug", id="m1")])
    assert search.next() is not None
    assert search.seen([Sighting("mug", id="m2")])


def test_a_name_of_two_is_no_name_of_one(memory):
    with pytest.raises(ValueError, match=r"'mug', which may be mug \(id m1\), Mug \(id m2\)"):
        memory.picked_up("mug")
    memory.picked_up("m1")
    memory.note_moved("m2", SHELF, by="anna")
    assert memory.carried == ("mug",)
    assert where(memory, "m1") == set()
    assert where(memory, "m2") == {SHELF}
    memory.forget("m1")
    assert where(memory, "mug") == {SHELF}


def test_without_ids_all_is_as_ever(memory):
    assert where(memory, "spoon") == {SINK}
    memory.observe(SINK, [Sighting("mug")])  # one more, which words alone tell apart
    assert where(memory, "mug") == {SINK, DESK}
    memory.observe(SINK, [Sighting("MUG"), Sighting("the mug")])
    assert memory.descriptions == ("mug", "spoon", "Mug", "mug")


def test_the_nearest_by_embedding_is_offered(memory):
    assert memory.find_nearest([0.0, 2.0]) == [("m2", pytest.approx(0.8)), ("m1", 0.0)]
    assert memory.find_nearest([1.0, 0.0], k=1) == [("m1", 1.0)]
    assert memory.find_nearest([1.0, 0.0, 0.0]) == []  # of another maker
    memory.observe(SINK, [Sighting("mug", id="m1", embedding=[0.0, 1.0])])
    assert memory.find_nearest([0.0, 2.0], k=1) == [("m1", 1.0)]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda m: Sighting("mug", id=""), "id must be a text of 1 to 200 characters"),
        (lambda m: Sighting("mug", id=1.5), "id must be a text"),
        (lambda m: Sighting("mug", embedding=[[1.0]]), "embedding must be a row of at most 4096"),
        (lambda m: Sighting("mug", embedding=[0.0, np.nan]), "embedding must be a row"),
        (lambda m: Sighting("mug", embedding=[0.0]), "embedding must be a row"),
        (lambda m: m.find_nearest([]), "embedding and k must be a vector and at least 1"),
        (lambda m: m.find_nearest([1.0], k=0), "embedding and k must be"),
    ],
)
def test_bad_ids_and_embeddings(memory, call, message):
    with pytest.raises(ValueError, match=message):
        call(memory)


def test_ids_may_be_numbers():
    assert Sighting("mug", id=np.int64(7)).id == "7"


def test_ids_are_saved_and_logged_and_go_on(memory, tmp_path):
    memory.observe(SHELF, [Sighting("mug", id="m1", embedding=(0.0, 1.0)), Sighting("pen")])
    memory.save(tmp_path / "home.sgm")
    again = SceneGraphMemory.load(tmp_path / "home.sgm")
    *_, (replayed, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    assert dump(again) == dump(replayed) == dump(memory)
    for one in (memory, again, replayed):
        one.step()
        one.observe(SHELF, [Sighting("mug", id="m2")])
        one.forget("m1")
    assert dump(again) == dump(replayed) == dump(memory)


def test_things_of_two_ids_are_two_in_a_trace(memory, tmp_path):
    memory.observe(SHELF, [Sighting("mug", id="m1")])
    trace = make_trace(read_events(tmp_path / "looks.sgm"), "home")
    assert sorted({event.object for event in trace.events}) == ["mug", "mug 2", "spoon"]


def test_forged_ids_are_refused(memory):
    content = memory._state.get_content()
    data = json.loads(json.dumps(content.to_json()))
    for change in (
        {"ids": [[0, "m1"], [2, "m1"]]},
        {"ids": [[9, "m1"]]},
        {"ids": [[0, ""]]},
        {"embeddings": [[0, ["x"]]]},
    ):
        with pytest.raises(ValueError, match=r"two objects|not there|id must|embedding must"):
            type(content).from_json(data | change)
