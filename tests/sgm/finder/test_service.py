"""Every call in Python: short answers, names as people say them, what to ask where unclear."""

from datetime import datetime, timedelta

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sgm.finder.answers import MOST_BYTES, Moment, to_json, write_json
from sgm.finder.finder import Finder
from sgm.finder.service import MOST_SEARCHES, MemoryService
from sgm.finder.where_calls import MOST_ROWS
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian

START = datetime(2026, 11, 16, 7, 30)


class Wall:
    """A clock on the wall."""

    def __init__(self):
        self.time = START

    def __call__(self):
        return self.time

    def go(self, **passed):
        self.time += timedelta(**passed)


@pytest.fixture
def wall():
    return Wall()


@pytest.fixture
def service(wall):
    service = MemoryService(SceneGraphMemory(clock=Clock(START, 600)), Finder(Bayesian()), wall)
    for room in ("kitchen", "study"):
        service.add_room(room)
    service.add_place("fridge", "kitchen", "white fridge", (1, 4))
    service.add_place("counter top", "the kitchen", None, (3, 4))
    service.add_place("desk", "study", None, (6, 1))
    return service


def test_where_is_says_place_reason_and_time(service, wall):
    service.observe("desk", [Sighting("large red mug")])
    wall.go(days=1, hours=2)
    service.let_time_pass()
    answer = service.where_is("the mug")
    assert answer.status == "ok"
    assert answer.taken_for == ("large red mug",)
    desk = next(place for place in service.where_is("the mug", k=3).places if place.place == 2)
    assert (desk.name, desk.relation) == ("desk in study", "onTop")
    assert desk.why == "seen here yesterday at 7:30"
    assert answer.last_seen.at == Moment(0, "2026-11-16T07:30:00", "yesterday at 7:30")
    assert answer.at == Moment(156, "2026-11-17T09:30:00", "at 9:30")
    assert len(write_json(answer)) <= MOST_BYTES
    ranking = service.finder.rank(service.memory, "the mug")
    assert [place.probability for place in answer.places] == [
        place.probability for place in ranking.places[: len(answer.places)]
    ]
    assert len(answer.places) + answer.left_out == 3
    assert len(service.where_is("mug", k=1).places) == 1
    assert service.where_is("mug", at=START + timedelta(days=2)).at.words == "tomorrow at 7:30"
    assert service.where_is("mug", at=200).at.step == 200


def test_where_is_says_how_many_places_are_left_out(service):
    """What has been seen nowhere had three places and none left out, of seven."""
    for label in ("shelf", "sofa", "bed", "stool"):
        service.add_place(label, "study")
    service.observe("desk", ["pen"])
    for thing in ("vase", "pen", "study", "zorb"):
        for k in (None, 1, 5, 50):
            answer = service.where_is(thing, k=k)
            num_places = 5 if thing == "study" else 7
            assert len(answer.places) + answer.left_out == num_places
    assert service.where_is("vase", k=50).left_out == 0


def test_what_to_ask_is_whole_where_an_answer_is_short(service):
    """The position of what was seen, said twice, took the place of the question."""
    service.observe("desk", [{"thing": "mug", "position": [3.2, 2.1, 0.85]}, "large red mug"])
    answer = service.where_is("how many mugs?")
    assert answer.ask == "This is another question than where a thing is; ask answers it."
    assert answer.places[0].position == (3.2, 2.1, 0.85)
    assert len(write_json(answer)) <= MOST_BYTES


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    st.lists(
        st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1).map(
            lambda text: (text * 200)[:200]
        ),
        min_size=1,
        max_size=4,
    )
)
def test_where_is_is_short_whatever_things_are_called(names):
    memory = SceneGraphMemory(clock=Clock(START))
    service = MemoryService(memory, Finder(Bayesian()), lambda: START)
    service.add_room(names[0])
    for name in names:
        memory.add_furniture("desk", 0, name)
    service.observe(0, [Sighting(name) for name in names])
    for name in (*names, names[0][:-1] + "x"):
        assert len(write_json(service.where_is(name))) <= MOST_BYTES


def test_an_ambiguous_name_is_an_answer(service):
    service.observe("desk", [Sighting("eyeglasses"), Sighting("wine glass")])
    answer = service.where_is("glasses")
    assert answer.status == "ambiguous"
    assert answer.ask == "Do you mean the eyeglasses or the wine glass?"
    assert answer.candidates == ("eyeglasses", "wine glass")
    assert service.search_start("glasses").search_id == ""
    assert service.history("glasses").status == "ambiguous"
    assert service.where_is(answer.candidates[0]).status == "ok"


def test_an_unknown_thing_offers_what_is_near(service):
    service.observe("desk", [Sighting("red mug")])
    answer = service.where_is("green mug")
    assert (answer.status, answer.candidates) == ("unknown", ("red mug",))
    assert "Do you mean the red mug?" in answer.ask
    assert answer.places, "where such things tend to be"
    nothing = service.where_is("flux capacitor")
    assert (nothing.status, nothing.candidates) == ("unknown", ())
    assert "list_things" in nothing.ask
    assert service.history("green mug").candidates == ("red mug",)
    assert service.list_things(kind="green mug").status == "unknown"


@pytest.mark.parametrize(
    "place", [2, "desk", "Desk in study", "the desk", "the desk in the study", "desks"]
)
def test_a_place_is_known_by_id_and_by_name(service, place):
    assert service.observe(place, [Sighting("mug")]).place == 2


def test_places_of_one_name_are_told_apart(service):
    service.add_place("shelf", "study")
    service.add_place("shelf", "study")
    service.add_place("shelf", "kitchen")
    answer = service.observe("shelf", [Sighting("book")])
    assert answer.status == "ambiguous"
    assert answer.candidates == (
        "shelf in study (place 3)",
        "shelf in study (place 4)",
        "shelf in kitchen",
    )
    assert service.list_things().rows == (), "nothing was noted"
    for number, name in zip((3, 4, 5), answer.candidates, strict=True):
        assert service.observe(name, []).place == number
    assert service.observe("hammock", []).status == "unknown"
    with pytest.raises(KeyError, match="furniture must be an id"):
        service.observe(99, [])


def test_a_room_is_no_place(service):
    noted = service.observe("Kitchen", [Sighting("cup")])
    assert noted.status == "ambiguous"
    assert noted.ask.startswith("'Kitchen' is a room. Do you mean the ")
    assert noted.candidates
    assert all(name.endswith("in kitchen") for name in noted.candidates)
    assert not service.memory.resolve("cup").matches


def test_a_search_goes_on_by_its_number(service):
    service.observe("desk", [Sighting("scissors")])
    begun = service.search_start("scissors", "white fridge")
    assert begun.status == "ok"
    assert not begun.is_found
    places = [begun.next.name]
    after = service.search_next(begun.search_id, "not_found")
    while after.next.name != "counter top in kitchen":
        places.append(after.next.name)
        after = service.search_next(begun.search_id, "seen", [Sighting("cup")], 0.5)
    done = service.search_next(begun.search_id, "seen", [Sighting("scissors")])
    assert (done.is_found, done.next, done.looks) == (True, None, len(places) + 1)
    assert done.outcome.startswith("scissors: found at counter top in kitchen after")
    assert service.search_next(begun.search_id, "found") == done, "it is over"
    assert service.where_is("scissors").places[0].name == "counter top in kitchen"
    assert service.search_next("none", "found").status == "unknown"


def test_a_search_may_begin_anywhere_with_positions(service):
    assert service.search_start("mug", (0.0, 0.0)).next.cost > 1
    assert service.search_start("mug", 2).status == "ok"
    assert service.search_start("mug", "hammock").status == "unknown"
    service.add_place("shelf", "study")
    line = r"from must be left out where places have no position.* shelf in study \(place 3\)"
    with pytest.raises(ValueError, match=line):
        service.search_start("mug", (0.0, 0.0))
    assert service.search_start(["mug", "pen"], "hammock").thing == "mug and pen"
    assert service.search_start("mug").next.cost == 1


def test_a_search_ends_with_its_budget(service):
    begun = service.search_start("mug", budget=2)
    assert begun.next is not None
    service.search_next(begun.search_id, "not_found")
    done = service.search_next(begun.search_id, "not_found")
    assert (done.next, done.looks) == (None, 2)
    assert "budget" in done.outcome


def test_searches_end_when_there_are_too_many(service):
    first = service.search_start("mug").search_id
    for _ in range(MOST_SEARCHES):
        last = service.search_start("mug").search_id
    assert service.search_next(first, "not_found").status == "unknown"
    assert service.search_next(last, "not_found").status == "ok"


def test_lists_have_k_rows_and_say_how_many_are_left_out(service, wall):
    service.observe("desk", [Sighting("mug"), Sighting("book"), Sighting("red pen")])
    wall.go(hours=1)
    service.observe("white fridge", [Sighting("milk", "in")])
    service.observe("desk", [Sighting("mug"), Sighting("blue pen")])
    assert [row.thing for row in service.list_things("desk").rows] == ["blue pen", "mug"]
    assert {row.thing for row in service.list_things(kind="pen").rows} == {"red pen", "blue pen"}
    every = service.list_things()
    assert [row.thing for row in every.rows] == ["blue pen", "milk", "mug", "book", "red pen"]
    gone = every.rows[-1]
    assert (gone.is_there, gone.times_seen, gone.times_looked) == (False, 1, 2)
    assert gone.last_seen.words == "at 7:30"
    two = service.list_things(k=2)
    assert (len(two.rows), two.left_out) == (2, 3)
    assert [(row.thing, row.what) for row in service.history("pens").rows] == [
        ("red pen", "missed"),
        ("blue pen", "seen"),
        ("red pen", "seen"),
    ]
    assert service.history("pens", k=1).left_out == 2
    places = service.list_places("kitchen")
    assert [row.name for row in places.rows] == [
        "white fridge in kitchen",
        "counter top in kitchen",
    ]
    assert [row.things for row in places.rows] == [1, 0]
    assert places.rows[1].last_looked is None
    assert service.list_places(k=1).left_out == 2
    assert service.list_places("bath").candidates == ("kitchen", "study")
    for k in (0, MOST_ROWS + 1, 1.5, True):
        with pytest.raises(ValueError, match="k must be a whole number from 1 to 50"):
            service.list_things(k=k)
    with pytest.raises(ValueError, match="k must be a whole number"):
        service.where_is("mug", k=0)


def test_what_was_at_a_place_that_is_gone_is_listed(service):
    service.observe("desk", [Sighting("mug")])
    service.memory.remove_furniture(2)
    (row,) = service.history("mug").rows
    assert (row.place, row.name, row.what) == (None, "", "seen")
    (row,) = service.list_things().rows
    assert (row.place, row.name, row.is_there) == (None, "", False)
    assert service.where_is("mug").last_seen.name == ""


def test_time_passes_by_the_clock_and_never_goes_back(service, wall):
    wall.go(minutes=9)
    assert service.let_time_pass() == 0
    wall.go(minutes=1)
    assert service.observe("desk", []).at.step == 1
    wall.go(hours=-5)
    with pytest.warns(UserWarning, match="the clock of the machine went back"):
        assert service.observe("desk", []).at.step == 1
    wall.go(days=40)
    with pytest.warns(UserWarning, match="More than 31 days are not believed"):
        assert service.observe("desk", []).at.step == 1
    with pytest.raises(ValueError, match="accept_jump"):
        MemoryService(service.memory, service.finder, wall)
    assert MemoryService(service.memory, service.finder, wall, accept_jump=True)
    assert service.memory.time > 5000


def test_a_memory_without_clock_counts_steps():
    memory = SceneGraphMemory()
    service = MemoryService(memory, Finder(Bayesian()))
    service.add_room("kitchen")
    service.add_place("table", "kitchen")
    service.observe("table", [Sighting("mug")])
    memory.step(3)
    assert service.where_is("mug").last_seen.at == Moment(0, None, "3 steps ago")
    assert service.where_is("mug", at=4).at.words == "in 1 step"
    assert service.where_is("mug").at.words == "now"


def test_whoever_subscribes_is_told_of_every_change(service):
    told = []
    end = service.subscribe(told.append)
    service.observe("desk", [Sighting("mug")])
    service.observe("hammock", [])  # unknown: nothing changed
    search = service.search_start("mug")
    service.search_next(search.search_id, "found")
    end()
    service.observe("desk", [])
    assert [one.call for one in told] == ["observe", "search_next"]
    assert told[0].said == "1 thing seen at desk in study"
    assert told[1].number == told[0].number + 1
    assert [(row.what, row.thing) for row in told[0].changes] == [("new", "mug")]
    assert to_json(told[0])["at"]["words"] == "at 7:30"


def test_what_people_say_and_the_robot_does(service, wall):
    service.observe("desk", [Sighting("keys"), Sighting("red mug"), Sighting("blue mug")])
    wall.go(days=1, hours=10, minutes=40)
    moved = service.note_moved("the keys", "white fridge", "anna")
    assert moved.said == "anna said that keys are at white fridge in kitchen"
    wall.go(days=1)
    service.let_time_pass()
    answer = service.where_is("keys")
    assert answer.places[0].why == "anna said so yesterday at 18:10"
    assert (answer.last_seen.by, answer.last_seen.place) == ("anna", 0)
    told = service.history("keys").rows[0]
    assert (told.by, told.what, told.at.words) == ("anna", "moved", "yesterday at 18:10")
    asked = service.picked_up("mug")
    assert (asked.status, asked.ask) == (
        "ambiguous",
        "Do you mean the red mug or the blue mug?",
    )
    assert service.memory.carried == ()
    assert service.picked_up("red mug").said == "the robot carries red mug"
    assert service.where_is("red mug").with_robot > 0.9
    assert service.search_start("red mug").next is None
    with pytest.raises(ValueError, match="thing must be one that the robot carries"):
        service.put_down("blue mug", "desk")
    assert service.put_down("mug", "hammock").status == "unknown"
    assert service.put_down("mug", "counter top").thing == "red mug"
    where = service.where_is("red mug")
    assert (where.places[0].place, where.with_robot, where.last_seen.by) == (1, 0.0, "robot")


def test_things_of_one_name_are_told_apart_by_their_ids(service):
    service.observe("desk", [Sighting("mug", id="a1"), Sighting("mug", id="b2")])
    asked = service.note_moved("the mug", "counter top", "anna")
    assert (asked.status, asked.candidates) == ("ambiguous", ("a1", "b2"))
    assert asked.ask == "Do you mean the mug a1 or the mug b2?"
    assert service.note_moved("b2", "counter top", "anna").status == "ok"
    assert service.where_is("b2").last_seen.place == 1
    assert service.where_is("a1").last_seen.place == 2
    assert {row.thing_id for row in service.changes(0).rows} == {"a1", "b2"}


def test_things_are_called_otherwise_and_found_to_be_one_or_two(service):
    service.observe("desk", [Sighting("vase"), Sighting("red mug"), Sighting("blue mug")])
    assert service.rename("the vase", "urn", "anna").said == "anna said that vase is called urn"
    assert service.where_is("urn").status == "ok"
    assert service.rename("unicorn", "horse").status == "unknown"
    assert service.rename("mug", "jug").status == "ambiguous"
    assert service.merge("red mug", "unicorn").status == "unknown"
    assert service.merge("red mug", "blue mug", "anna").status == "ok"
    assert len(service.list_things(kind="mug").rows) == 1
    assert service.split("blue mug").status == "ok"
    assert len(service.list_things(kind="mug").rows) == 2
    with pytest.raises(ValueError, match="merged"):
        service.split("blue mug")
    assert service.split("urn", "hammock", "pot").status == "unknown"


def test_changes_say_what_from_where_to_where_between_which_looks(service, wall):
    service.observe("desk", [Sighting("mug"), Sighting("vase")])
    service.observe("counter top", [])
    wall.go(hours=2)
    service.observe("desk", [])
    wall.go(hours=1)
    service.observe("counter top", [Sighting("mug")])
    changes = service.changes(START + timedelta(hours=1))
    assert changes.left_out == 0
    moved, gone = changes.rows
    assert (moved.what, moved.thing) == ("moved", "mug")
    assert (moved.from_name, moved.to_name) == ("desk in study", "counter top in kitchen")
    assert (moved.after.words, moved.at.words) == ("at 7:30", "at 10:30")
    assert (gone.what, gone.thing, gone.from_place, gone.to_place) == ("gone", "vase", 2, None)
    assert (gone.after.words, gone.at.words) == ("at 7:30", "at 9:30")
    assert 0 < gone.probability < 1
    assert service.changes(0, k=1).left_out == len(service.memory.changes(0)) - 1
    assert service.changes(START + timedelta(days=1)).rows == ()


def test_ghosts_and_places_that_are_gone_are_forgotten(service):
    service.observe("desk", [Sighting("vase"), Sighting("red mug"), Sighting("blue mug")])
    assert service.forget("the vase", by="anna").said == "anna said that there is no vase"
    assert service.where_is("vase").status == "unknown"
    assert service.forget("vase").status == "unknown"
    assert service.forget("mug").status == "ambiguous"
    assert service.forget(place="the desk").place == 2
    assert service.list_places(k=3).left_out == 0
    assert service.forget(place="desk").status == "unknown"
    for arguments in ({}, {"thing": "mug", "place": "desk"}):
        with pytest.raises(ValueError, match="forget must get a thing or a place"):
            service.forget(**arguments)


def test_every_change_is_told_once(service, wall):
    service.observe("desk", [Sighting("mug")])
    told = []
    end = service.subscribe(told.append)
    service.observe("desk", [Sighting("mug")])
    wall.go(hours=2)
    service.observe("counter top", [Sighting("mug"), Sighting("book")])
    service.observe("desk", [])
    service.observe("desk", [])
    end()
    assert [[(row.what, row.thing) for row in one.changes] for one in told] == [
        [],
        [("moved", "mug"), ("new", "book")],
        [],
        [],
    ]


def test_rooms_of_one_name_are_asked_about(service):
    service.add_room("study")
    assert service.add_place("desk", "study").status == "ambiguous"
    assert service.add_place("desk", "bath").candidates == ("kitchen", "study")
