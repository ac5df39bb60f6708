"""On how many such days a thing was at a place at that hour, as a reason of a place."""

from datetime import timedelta

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from tests.sgm.finder.tablet_home import MONDAY, NOON, make_home


@pytest.fixture(scope="module")
def finder():
    return Finder(Adaptive())


@pytest.fixture
def home():
    return make_home()


def get_days(finder, memory, thing, at=None):
    """Days of every place that says some, by its id: seen, looked at, whether workdays."""
    return {
        place.furniture: (days.num_seen, days.num_looked, days.is_workday)
        for place in finder.rank(memory, thing, at=at)
        if (days := place.evidence.days) is not None
    }


def test_a_time_to_come_is_told_with_the_days_of_that_hour(finder, home):
    memory, table, shelf = home
    # Ten workdays: nine at the table, the fourth on the shelf.
    assert get_days(finder, memory, "tablet", NOON) == {table: (9, 10, True), shelf: (1, 10, True)}
    # The shelf showed it every morning, the table never: of nine, as the first look there was
    # before the table had ever shown it.
    morning = MONDAY + timedelta(days=14, hours=7)
    days = get_days(finder, memory, "tablet", morning)
    assert days == {table: (0, 9, True), shelf: (10, 10, True)}
    sunday = NOON + timedelta(days=6)
    days = get_days(finder, memory, "tablet", sunday)
    assert days == {table: (0, 4, False), shelf: (4, 4, False)}
    best = finder.rank(memory, "tablet", at=NOON)[0]
    assert best.furniture == table
    assert best.why.startswith("at this hour on 9 of 10 workdays; seen here ")


def test_no_look_at_that_hour_says_nothing(finder, home):
    memory, *_ = home
    assert get_days(finder, memory, "tablet", NOON + timedelta(hours=3)) == {}


def test_of_now_it_is_told_where_it_speaks_against_the_last_look(finder, home):
    memory, table, shelf = home
    # Sunday evening: the shelf shows it as on every evening.
    assert get_days(finder, memory, "tablet") == {}
    memory.step_to(NOON - timedelta(hours=5))
    memory.observe(shelf, [Sighting("tablet")])
    assert get_days(finder, memory, "tablet") == {}
    memory.step_to(NOON)  # five hours later
    assert get_days(finder, memory, "tablet") == {table: (9, 10, True), shelf: (1, 10, True)}
    assert get_days(finder, memory, "lamp") == {}, "the table shows it at every hour"
    # A look of this hour is news, whatever the days say.
    memory.observe(table, [Sighting("lamp")])
    memory.observe(shelf, [Sighting("tablet")])
    memory.step()
    assert get_days(finder, memory, "tablet") == {}


def test_two_days_say_nothing_against_a_look(finder):
    memory = SceneGraphMemory(clock=Clock(MONDAY, 1800))
    room = memory.add_room("kitchen")
    table, shelf = (memory.add_furniture(place, room) for place in ("table", "shelf"))
    told = []
    for day in range(4):
        memory.step_to(MONDAY + timedelta(days=day, hours=12))
        told.append(get_days(finder, memory, "tablet") if day else {})
        memory.observe(table, [Sighting("tablet")])
        memory.observe(shelf, [])
        memory.step_to(MONDAY + timedelta(days=day, hours=20))
        memory.observe(table, [])
        memory.observe(shelf, [Sighting("tablet")])
    # Of the shelf there are two: the first look there was before it had ever shown it.
    assert told == [{}, {}, {}, {table: (3, 3, True)}]


def test_without_a_clock_nothing_is_told(finder):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    table, shelf = (memory.add_furniture(place, room) for place in ("table", "shelf"))
    for place in (table, shelf, table):
        memory.observe(place, [Sighting("tablet")])
        memory.step()
    assert get_days(finder, memory, "tablet", memory.time + 3) == {}


@pytest.mark.parametrize(
    ("language", "thing", "said"),
    [
        ("en", "tablet", "at this hour on 9 of 10 workdays"),
        ("de", "Tablet", "um diese Zeit an 9 von 10 Werktagen"),
    ],
)
def test_a_service_says_it_in_its_language(finder, language, thing, said):
    memory, *_ = make_home(language)
    service = MemoryService(memory, finder, None)
    found = service.where_is(thing, at=NOON)
    assert found.places[0].why.startswith(said)
    (weekend,) = [place for place in service.where_is(thing, at=NOON + timedelta(days=6)).places][
        :1
    ]
    assert ("Tagen am Wochenende" in weekend.why) or ("4 of 4 weekend days" in weekend.why)
