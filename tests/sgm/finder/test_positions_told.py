"""Answers say where a thing was seen, as long as it may be there, and how to stand before it."""

import json
import math

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.eyes import Box
from sgm.finder.answers import PlaceFound, to_json, write_json
from sgm.finder.ranking import tell_point
from sgm.finder.service import MemoryService
from sgm.ros.live_memory import LiveMemory
from sgm.serve.answer_schema import make_schema

AT = (1.9, 3.1, 0.95)


def make_home(position=AT, interior="none"):
    """A counter 0 with a mug, and a table 1."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    memory.add_furniture("counter", room, box=Box((2, 3, 0.45), (0.6, 2, 0.9), 0.0, interior))
    memory.add_furniture("table", room, box=Box((5, 3, 0.4), (0.8, 1.2, 0.8)))
    relation = "onTop" if interior == "none" else "in"
    memory.observe(0, [Sighting("mug", relation, position=position)])
    memory.step(2)
    return memory


FINDER = Finder(Adaptive())


def test_a_ranking_says_where_it_was_seen():
    counter, table = FINDER.rank(make_home(), "mug")
    assert (counter.position, table.position) == (AT, None)
    assert counter.why.startswith("at 1.9, 3.1, 0.95, seen here 2 steps ago")
    assert "at 1.9" not in table.why
    assert tell_point((-0.001, 12.345, 3.0)) == "0, 12.35, 3"


def test_it_is_not_said_once_a_look_has_missed_it():
    memory = make_home()
    memory.observe(0, [])
    ranking = FINDER.rank(memory, "mug")
    assert all(place.position is None for place in ranking)
    assert "1.9" not in str(ranking)


def test_a_plan_says_where_to_look_and_what_to_open():
    plan = FINDER.search_plan(make_home(), "mug", start=(0, 0))
    assert plan.looks[0].instruction == "look on the counter in kitchen, at 1.9, 3.1, 0.95"
    plan = FINDER.search_plan(make_home(interior="door"), "mug", start=(0, 0))
    assert plan.looks[0].instruction == "open the counter in kitchen"


def test_the_service_says_it_in_numbers():
    service = MemoryService(make_home(), FINDER, now=None)
    answer = to_json(service.where_is("mug"))
    assert answer["places"][0]["position"] == answer["last_seen"]["position"] == list(AT)
    assert "position" not in answer["places"][1]
    (row,) = to_json(service.list_things())["rows"]
    assert row["position"] == list(AT)
    look = service.search_start("mug").next
    assert look.position == AT
    x, y, yaw = look.pose
    assert (x, y) == pytest.approx((3.0, 3.1))  # before the mug
    assert abs(yaw) == pytest.approx(math.pi)


def test_without_positions_answers_do_not_have_them():
    service = MemoryService(make_home(position=None), FINDER, now=None)
    for answer in (service.where_is("mug"), service.list_things(), service.search_start("mug")):
        assert b"position" not in write_json(answer)
        assert b"pose" not in write_json(answer)
    service.memory.step()
    assert service.search_start("mug").next.pose is None


def test_the_schema_says_that_it_may_be_left_out():
    schema = make_schema(PlaceFound)
    assert "position" in schema["properties"]
    assert "position" not in schema["required"]
    assert "why" in schema["required"]
    assert json.dumps(schema)


def test_a_robot_is_sent_before_the_thing():
    live = LiveMemory(make_home(), FINDER)
    look = live.find_next("mug")
    assert look.target == AT
    assert look.position == pytest.approx((3.0, 3.1))
    assert look.outcome.endswith("at 1.9, 3.1, 0.95")
    live = LiveMemory(make_home(position=None), FINDER)
    look = live.find_next("mug")
    assert (look.target, look.position) == (None, pytest.approx((3.0, 3.0)))
    sofa = live.memory.add_furniture("sofa", 0, position=(7.0, 1.0))  # without a box
    assert live.find_stand(sofa) == ((7.0, 1.0), 0.0)
