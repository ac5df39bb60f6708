"""What is expected at a place at a time."""

from datetime import timedelta

import pytest

from sgm.finder.days_seen import count_days
from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from tests.sgm.finder.tablet_home import MONDAY, make_home


@pytest.fixture(scope="module")
def finder():
    return Finder(Adaptive())


@pytest.fixture(scope="module")
def home():
    return make_home()


def get(expected, name):
    return next(thing for thing in expected if thing.thing == name)


def test_it_says_what_it_rests_on(finder, home):
    memory, table, _ = home
    noon = MONDAY + timedelta(days=14, hours=12)
    tablet = get(finder.expect(memory, table, at=noon), "tablet")
    # Before Monday noon of the first week it had not been seen there: of that day the look that
    # showed it counts. Ten workdays, nine with it.
    days = tablet.days
    assert (days.num_seen, days.num_looked, days.is_workday) == (9, 10, True)
    assert str(tablet).endswith("%, at this hour on 9 of 10 workdays")
    sunday = get(finder.expect(memory, table, at=noon + timedelta(days=6)), "tablet")
    days = sunday.days
    assert (days.num_seen, days.num_looked, days.is_workday) == (0, 4, False)
    assert sunday.probability < tablet.probability
    assert str(sunday).endswith("%, at this hour on 0 of 4 weekend days")


def test_an_hour_apart_is_this_hour_and_two_are_not(finder, home):
    memory, table, _ = home
    for hour, number in ((13, 10), (14, 0)):
        at = MONDAY + timedelta(days=14, hours=hour)
        days = get(finder.expect(memory, table, at=at), "tablet").days
        assert (0 if days is None else days.num_looked) == number


def test_probabilities_are_those_of_rank_and_ordered(finder, home):
    memory, table, shelf = home
    for place in (table, shelf):
        expected = finder.expect(memory, place)
        for thing in expected:
            ranking = finder.rank(memory, thing.thing, exactly=True)
            (found,) = [each for each in ranking if each.furniture == place]
            assert thing.probability == found.probability
        probabilities = [thing.probability for thing in expected]
        assert probabilities == sorted(probabilities, reverse=True)
    assert {thing.thing for thing in finder.expect(memory, table)} == {"lamp", "tablet"}
    assert [thing.thing for thing in finder.expect(memory, shelf)] == ["tablet"]


def test_all_things_are_believed_at_once_and_days_are_counted_once(monkeypatch):
    memory, places = make_mixed_home()
    believed, counted = [], []

    class Counting(Adaptive):
        def believe(self, batch, queries):
            believed.append(len(queries.object))
            return super().believe(batch, queries)

    def count(asked):
        counted.append(len(asked.rows))
        return count_days(asked)

    monkeypatch.setattr("sgm.finder.expected_things.count_days", count)
    expected = Finder(Counting()).expect(memory, places[0])
    assert len(expected) == 4
    assert believed == counted == [4]  # the mug with the id is one of two that are called mug


def test_things_of_one_name_copies_and_what_is_carried_are_as_in_rank(finder):
    memory, places = make_mixed_home()
    for place in places:
        for thing in finder.expect(memory, place):
            ranking = finder.rank(memory, thing.thing, exactly=True)
            (found,) = [each for each in ranking if each.furniture == place]
            assert thing.probability == pytest.approx(found.probability, abs=1e-12)


def make_mixed_home():
    """Mugs with an id and without, two cups at once, a pen that the robot took, and a bowl."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(place, room) for place in ("table", "shelf")]
    table, shelf = places
    seen = ["mug", "cup", "cup", "pen"]
    memory.observe(table, [Sighting("mug", id="a"), *(Sighting(name) for name in seen[1:])])
    memory.observe(shelf, [Sighting(name) for name in ("mug", "bowl")])
    memory.step(3)
    memory.picked_up("pen")
    memory.observe(table, [Sighting("cup"), Sighting("mug", id="a")])
    memory.step()
    return memory, places


def test_things_with_ids_are_each_expected(finder):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    table, shelf = (memory.add_furniture(place, room) for place in ("table", "shelf"))
    memory.observe(table, [Sighting("mug", id="a")])
    memory.observe(shelf, [Sighting("mug", id="b")])
    (mug,) = finder.expect(memory, table)
    assert (mug.thing, mug.days, mug.why) == ("a", None, "")
    assert str(mug) == f"a: {mug.probability:.0%}"


def test_what_a_person_says_is_there_is_expected(finder):
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    table, shelf = (memory.add_furniture(place, room) for place in ("table", "shelf"))
    memory.observe(shelf, [Sighting("keys")])
    memory.step()
    memory.note_moved("keys", table, by="anna")
    (keys,) = finder.expect(memory, table)
    assert keys.thing == "keys"
    assert keys.probability > 0.5


def test_an_unknown_place_and_a_past_time_are_refused(finder, home):
    memory, table, _ = home
    with pytest.raises(KeyError, match="furniture"):
        finder.expect(memory, 99)
    with pytest.raises(ValueError, match="at must"):
        finder.expect(memory, table, at=MONDAY)


def test_of_an_empty_place_nothing_is_expected(finder):
    memory = SceneGraphMemory()
    table = memory.add_furniture("table", memory.add_room("kitchen"))
    assert finder.expect(memory, table) == []
