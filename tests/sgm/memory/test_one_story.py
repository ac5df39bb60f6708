"""Where a thing is: all that tells it tells the same."""

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

HERE = (1.0, 2.0, 0.5)
MUG, NAMED = Sighting("mug", position=HERE), Sighting("mug", id="m", position=HERE)


class Home:
    """A home with three places, and whether its looks are of one step."""

    def __init__(self, is_one_step):
        self.memory = SceneGraphMemory()
        hall = self.memory.add_room("hall")
        self.places = [self.memory.add_furniture(label, hall) for label in ("desk", "shelf", "bed")]
        self.is_one_step = is_one_step

    def look(self, place, *seen):
        if not self.is_one_step:
            self.memory.step()
        self.memory.observe(self.places[place], seen)


def move(home, *places, thing=MUG):
    for place in places:
        home.look(place, thing)


def miss(home):
    move(home, 0, 1)
    home.look(1)


def see_two(home):
    home.look(0, MUG, MUG)
    home.look(1, MUG)


def say(home):
    move(home, 0, 1)
    home.memory.note_moved("mug", home.places[2], "anna")


def pick_up(home):
    move(home, 0, 1)
    home.memory.picked_up("mug")


def merge(home, *names):
    home.look(0, Sighting("cup"))
    home.look(1, MUG)
    home.memory.merge(*(names or ("mug", "cup")))


def take_one(home):
    """Who says from where one was taken says that there are several."""
    move(home, 0, 1)
    home.memory.note_moved("mug", home.places[2], "anna", was_at=home.places[0])


def remove(home):
    move(home, 0, 1)
    home.memory.remove_furniture(home.places[1])


def remove_of_merged(home):
    merge(home)
    home.memory.remove_furniture(home.places[1])


def remove_before(home):
    move(home, 0, 1)
    home.memory.remove_furniture(home.places[0])


def remove_said(home):
    say(home)
    home.memory.remove_furniture(home.places[2])


def remove_room(home):
    attic = home.memory.add_room("attic")
    home.places.append(home.memory.add_furniture("box", attic))
    move(home, 0, 3)
    home.memory.remove_room(attic)


def merge_places(home):
    move(home, 0, 1)
    home.memory.merge_furniture(home.places[1], home.places[2])


def find(home):
    move(home, 0, 1)
    home.memory.note_found(home.places[2], "mug")


def look_for(home):
    move(home, 0, 1)
    home.memory.note_absent(home.places[1], "mug")


# What happens, and the places where the mug is then.
STORIES = {
    "moved": (lambda home: move(home, 0, 1), {1}),
    "moved on": (lambda home: move(home, 0, 1, 2), {2}),
    "with an id": (lambda home: move(home, 0, 1, thing=NAMED), {1}),
    "there and back with an id": (lambda home: move(home, 0, 1, 0, thing=NAMED), {0}),
    "to and fro with an id": (lambda home: move(home, 0, 1, 0, 1, thing=NAMED), {1}),
    "missed where it went": (miss, set()),
    "looked for where it went": (look_for, set()),
    "two at once": (see_two, {0, 1}),
    "said to be elsewhere": (say, {2}),
    "one of several said to be elsewhere": (take_one, {1, 2}),
    "picked up": (pick_up, set()),
    "two names of one": (merge, {1}),
    "two names of one, the other way": (lambda home: merge(home, "cup", "mug"), {1}),
    "its place is gone": (remove, set()),
    "its place is gone, of two names of one": (remove_of_merged, set()),
    "where it was is gone": (remove_before, {1}),
    "where it was said to be is gone": (remove_said, set()),
    "its room is gone": (remove_room, set()),
    "its place is another one, too": (merge_places, {1}),
    "found": (find, {2}),
}


@pytest.fixture(params=[True, False], ids=["in one step", "step by step"])
def home(request):
    return Home(request.param)


@pytest.mark.parametrize("name", STORIES)
def test_all_that_tells_where_a_thing_is_tells_the_same(home, name):
    happen, expected = STORIES[name]
    happen(home)
    memory = home.memory
    present = {home.places[place] for place in expected}
    seen = memory.places_of("mug")
    assert {place.furniture for place in seen if place.is_there} == present
    assert (seen[0].is_there, seen[0].furniture in present) in ((True, True), (False, False))
    listed, _ = memory.list_seen(["mug", "cup"])
    assert {place.furniture for _, place in listed if place.is_there} == present
    listed, _ = memory.list_seen()
    assert {place.furniture for _, place in listed if place.is_there} == present
    is_named = {
        place: memory.list_named("mug", "cup", place=place) for place in memory.furniture_ids
    }
    assert {place for place, things in is_named.items() if things} == present
    assert {place.furniture for place in seen if place.position is not None} <= present
    at = {place: memory.list_seen(furniture=place)[1] for place in memory.furniture_ids}
    assert {place for place, number in at.items() if number} == present
    assert {place for place, (number, _) in memory.count_things().items() if number} == present
    (room,) = memory.to_dict()["rooms"]
    told = {
        node["id"]
        for node in room["furniture"]
        if any(thing["is_there"] for thing in node["objects"])
    }
    assert told == present
    service = MemoryService(memory, Finder(Adaptive()), now=None)
    rows = service.list_things(k=50).rows
    assert {row.place for row in rows if row.is_there} == present
    last = service.where_is("mug").last_seen
    assert last is not None
    assert (last.place if last.is_there else None) in (present or {None})
    moved = [change for change in memory.changes(0) if change.kind == "moved"]
    assert {change.to_place for change in moved} <= present
    if present:
        ranking = Finder(Adaptive()).rank(memory, "mug")
        assert {place.furniture for place in ranking.places[: len(present)]} == present
        for place in ranking:
            seen_here = place.evidence.seen
            assert (seen_here is not None and seen_here.is_there) == (place.furniture in present)


def test_it_is_said_that_a_thing_was_seen_elsewhere_since(home):
    move(home, 0, 1)
    for place in Finder(Adaptive()).rank(home.memory, "mug"):
        assert ("; seen elsewhere since" in place.why) == (place.furniture == home.places[0])


def test_a_thing_that_is_back_is_where_it_was_seen_last(home):
    move(home, 0, 1, 0, thing=NAMED)
    assert home.memory.last_seen("m").furniture == home.places[0]
    assert Finder(Adaptive()).rank(home.memory, "m")[0].furniture == home.places[0]


@pytest.mark.parametrize("known", [None, "large red mug"])
def test_looks_before_the_first_sighting_are_none_since(home, known):
    """It said "seen here in this step; not found here in 1 look for it since"."""
    memory, (desk, shelf, _) = home.memory, home.places
    if known:
        memory.observe(shelf, [Sighting(known)])
    memory.note_absent(desk, "red mug")
    memory.step()
    memory.observe(desk, [Sighting("red mug")])
    for name in ("red mug", "large red mug", "mug"):
        for place in Finder(Adaptive()).rank(memory, name):
            assert "since" not in place.why
    memory.note_absent(desk, "red mug")
    assert (
        "in latest" in str(memory.last_seen("red mug")) or not memory.last_seen("red mug").is_there
    )
