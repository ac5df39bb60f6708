"""A sentence is read whole, or asked back: several things, what is not meant, places, owners."""

from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive

START = datetime(2026, 11, 18, 7, 30)  # a Wednesday
SEEN = {
    "counter": ("red mug", "blue mug", "keys", "wallet", "bowl"),
    "dinner table": ("pringles",),
    "cabinet": ("pringles", "hiking boots"),
    "desk": ("anna's phone", "tom's phone", "tom's keys", "tablet"),
    "sofa": ("remote",),
}
ROOMS = {
    "counter": 0,
    "drawer": 0,
    "sink": 0,
    "dinner table": 0,
    "cabinet": 0,
    "desk": 1,
    "sofa": 2,
}


@pytest.fixture
def service():
    memory = SceneGraphMemory(clock=Clock(START, 600))
    for room in ("kitchen", "study", "living room"):
        memory.add_room(room)
    places = {label: memory.add_furniture(label, room) for label, room in ROOMS.items()}
    for label, place in places.items():
        memory.observe(place, [Sighting(name) for name in SEEN.get(label, ())])
    memory.step()
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(
    ("asked", "taken"),
    [
        ("keys and wallet", [("keys", "tom's keys"), ("wallet",)]),
        ("keys, wallet", [("keys", "tom's keys"), ("wallet",)]),
        ("the wallet or the tablet", [("wallet",), ("tablet",)]),
        ("red/blue mug", [("red mug",), ("blue mug",)]),
        ("red and blue mug", [("red mug",), ("blue mug",)]),
        ("the red mug and the blue one", [("red mug",), ("blue mug",)]),
        ("both mugs", [("red mug",), ("blue mug",)]),
        ("all the mugs", [("red mug",), ("blue mug",)]),
        ("my wallet or Tom's keys", [("wallet",), ("tom's keys",)]),
        ("both the bowl and the remote", [("bowl",), ("remote",)]),
        (["bowl", "where is the remote?"], [("bowl",), ("remote",)]),
        ("not the red mug", [("blue mug",)]),
        ("non-red mug", [("blue mug",)]),
        ("the mug that isn't blue", [("red mug",)]),
        ("any mug but the red one", [("blue mug",)]),
        ("a mug other than the blue mug", [("red mug",)]),
        ("the mug, not the red one", [("blue mug",)]),
        ("the phone that is not Anna's", [("tom's phone",)]),
        ("mug red", [("red mug",)]),
        ("phone belonging to anna", [("anna's phone",)]),
        ("the phone of Anna", [("anna's phone",)]),
        ("the phone on the desk that belongs to Tom", [("tom's phone",)]),
        ("the mug on the counter that is red", [("red mug",)]),
        ("phones on the desk", [("anna's phone", "tom's phone")]),
        ("the mug, red", [("red mug",)]),
        ("anything red", [("red mug",)]),
        ("all two mugs", [("red mug",), ("blue mug",)]),
        ("the phone that doesn't belong to Tom", [("anna's phone",)]),
        ("not Tom's phone, the other one", [("anna's phone",)]),
        ("the phone that Anna left on the desk", [("anna's phone", "tom's phone")]),
    ],
)
def test_what_is_asked_for_is_answered_thing_by_thing(service, asked, taken):
    answer = service.where_is(asked)
    answers = [answer, *(answer.also or ())]
    assert answer.status == "ok", answer.ask
    assert [one.taken_for for one in answers] == taken


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ("anything but the red one", "'anything'"),
        ("it", "What do you mean by 'it'?"),
        ("where are they?", "'they'"),
        ("the red one", "'one'"),
        ("zorb wallet", "'zorb'"),
        ("the wallet on the moon", "'on the moon'"),
        ("the mug that I used", "'that i used'"),
        ("what is on the desk?", "another question"),
        ("I put the keys in the drawer", "another question"),
        ("my phone", "anna's phone or tom's phone"),
        ("our phone", "anna's phone or tom's phone"),
        ("their phone", "anna's phone or tom's phone"),
        ("the mug in the sink", "None is known in the sink."),
        ("the tablet in the kitchen", "The tablet is at the desk in study."),
        ("kitchen tablet", "None is known in kitchen."),
        ("the mug that is not on the counter", "All that is known is on the counter."),
        ("keys and bowel", "Nothing is known as 'bowel'."),
        ("ankle boots and keys", "hiking boots"),
        ("the bowl for the party", "'party'"),
    ],
)
def test_what_was_not_understood_is_said(service, asked, words):
    answer = service.where_is(asked)
    assert answer.status != "ok"
    assert words in answer.ask


def test_what_is_at_the_place_of_the_question_comes_first(service):
    for place in ("dinner table", "cabinet"):
        answer = service.where_is(f"the pringles on the {place}")
        assert (answer.status, answer.places[0].name) == ("ok", f"{place} in kitchen")
    search = service.search_start("the pringles on the dinner table")
    assert search.next is not None


def test_who_speaks_says_whose_it_is(service):
    assert service.where_is("my phone", speaker="Anna").taken_for == ("anna's phone",)
    assert service.where_is("my keys", speaker="tom").taken_for == ("tom's keys",)
    assert service.where_is("my wallet", speaker="anna").taken_for == ("wallet",)
    assert service.search_start("my phone").search_id == ""
    assert service.search_start("my phone", speaker="tom").thing == "tom's phone"
    assert service.note_moved("my phone", "drawer", "anna").thing == "anna's phone"


@pytest.mark.parametrize(
    ("asked", "moved"),
    [
        ("the keys and the wallet", ("keys", "wallet")),
        ("both mugs", ("red mug", "blue mug")),
        ("the red mug, the blue mug and the bowl", ("red mug", "blue mug", "bowl")),
        ("pringles on the dinner table", ("pringles",)),
        ("the tablet", ("tablet",)),
    ],
)
def test_a_write_is_of_each_thing(service, asked, moved):
    before = service.memory.descriptions
    assert service.note_moved(asked, "drawer", "anna").status == "ok"
    assert service.memory.descriptions == before, "nothing is new"
    rows = service.list_things("drawer").rows
    assert {row.thing for row in rows} == set(moved)


def test_a_write_takes_one_of_several_from_where_it_is_said_to_be(service):
    assert service.note_moved("the pringles on the dinner table", "drawer", "anna").status == "ok"
    rows = service.list_things(kind="pringles").rows
    assert {row.name for row in rows if row.is_there} == {
        "cabinet in kitchen",
        "drawer in kitchen",
    }


@pytest.mark.parametrize(
    "asked",
    [
        "it",
        "them",
        "everything",
        "not the red mug",
        "both phones and it",
        "two pringles",
        "the mug on the counter",
        "the tablet in the sink",
        "keys yesterday",
        "I put the keys in the drawer",
        "anything but the red mug",
        "the bowl on the moon",
        "anything red",
        "something to drink",
        "all four mugs",
    ],
)
def test_what_is_no_name_is_not_written(service, asked):
    for call in (
        lambda: service.note_moved(asked, "drawer", "anna"),
        lambda: service.picked_up(asked),
        lambda: service.forget(asked, by="anna"),
    ):
        before = service.memory.to_dict()
        noted = call()
        assert noted.status != "ok"
        assert noted.ask
        assert (service.memory.to_dict(), service.memory.carried) == (before, ())


def test_one_tour_finds_several(service):
    service.memory.observe(2, [Sighting("bowl")])
    begun = service.search_start(["the wallet", "bowl", "keys"])
    assert begun.left == ("the wallet", "bowl", "keys")
    things = {
        "counter in kitchen": ["wallet"],
        "sink in kitchen": ["bowl"],
        "sofa in living room": [],
    }
    answer, looks = begun, 0
    while answer.next is not None and len(answer.left) > 1:
        seen = [Sighting(name) for name in things.get(answer.next.name, ())]
        answer, looks = service.search_next(answer.search_id, "seen", seen), looks + 1
        assert answer.looks == looks
    assert answer.left == ("keys",)
    assert "the wallet: found at counter in kitchen" in answer.outcome
    done = service.search_next(answer.search_id, "found")
    assert (done.is_found, done.left, done.next) == (True, (), None)


def test_a_tour_asks_which_of_several_was_found(service):
    begun = service.search_start("wallet and bowl")
    asked = service.search_next(begun.search_id, "found")
    assert (asked.status, asked.looks, asked.candidates) == ("ambiguous", 0, ("wallet", "bowl"))
    found = service.search_next(begun.search_id, "found", thing="wallet")
    assert (found.left, found.looks) == (("bowl",), 1)
    with pytest.raises(ValueError, match="descriptions must be a list of things"):
        service.finder.search_several(service.memory, "keys")


@pytest.mark.parametrize(
    ("label", "asked"),
    [
        ("mug_track_9", "mug 9"),
        ("3_soap bottle", "soap bottle 3"),
        ("ycb_025_mug", "mug 25"),
        ("object 12 (cup)", "cup 12"),
    ],
)
def test_numbers_of_trackers_are_no_words(label, asked):
    memory = SceneGraphMemory()
    memory.observe(memory.add_furniture("desk", memory.add_room("study")), [Sighting(label)])
    assert memory.resolve(asked).matches == (label,)
    assert memory.resolve(asked.rpartition(" ")[0]).matches == (label,)


def test_a_past_time_is_answered_by_what_is_known_of_it(service):
    memory = service.memory
    memory.step(59)  # 17:30
    memory.observe(0, [Sighting(name) for name in SEEN["counter"] if name != "wallet"])
    memory.observe(6, [Sighting("wallet"), Sighting("remote")])
    memory.step(100)  # the next day at 10:10
    then = service.where_is("where was the wallet yesterday at 7:30?")
    assert (then.status, then.places[0].name) == ("ok", "counter in kitchen")
    assert then.places[0].probability == pytest.approx(1.0)
    evening = service.where_is("where was the wallet yesterday evening?")
    assert evening.places[0].name == "sofa in living room"
    between = service.where_is("where was the wallet yesterday at 9?", k=2).places
    assert [place.name for place in between] == ["counter in kitchen", "sofa in living room"]
    assert 0.5 < between[0].probability < 1
    assert service.where_is("where was the wallet on monday?").status == "unknown"
    noon = service.where_is("where will the wallet be at noon?")
    assert (noon.status, noon.at.iso) == ("ok", "2026-11-19T12:00:00")
    assert service.where_is("where will the wallet be?").ask == "When?"
    assert service.where_is("where was the wallet since monday?").status == "ambiguous"
