"""Answers say where a thing was seen, as long as it may be there, and how to stand before it."""

import json
import math
from dataclasses import is_dataclass

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.eyes import Box
from sgm.finder import answers
from sgm.finder.answers import MOST_BYTES, AnswerList, PlaceFound, to_json, write_json
from sgm.finder.evidence import tell_point
from sgm.finder.service import MemoryService
from sgm.finder.written import Happened
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


def list_answers():
    """All parts of answers."""
    kinds = vars(answers).values()
    return [
        kind
        for kind in kinds
        if is_dataclass(kind) and kind.__module__ == answers.__name__ and kind is not AnswerList
    ]


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
    answer = to_json(service.where_is("mug", k=2))
    assert answer["places"][0]["position"] == answer["last_seen"]["position"] == list(AT)
    assert answer["places"][0]["position_of"] == answer["last_seen"]["position_of"] == "thing"
    assert answer["places"][1]["position"] == [5.0, 3.0, 0.4]
    assert answer["places"][1]["position_of"] == "place"
    (row,) = to_json(service.list_things())["rows"]
    assert row["position"] == list(AT)
    look = service.search_start("mug").next
    assert (look.position, look.position_of) == (AT, "thing")
    assert look.box == service.memory.boxes[0]
    x, y, yaw = look.pose
    assert (x, y) == pytest.approx((3.0, 3.1))  # before the mug
    assert abs(yaw) == pytest.approx(math.pi)


COUNTER = (2.0, 3.0, 0.45)


def test_where_the_thing_is_unknown_the_place_is_told():
    service = MemoryService(make_home(position=None), FINDER, now=None)
    service.note_moved("keys", "table", by="anna")
    for thing in ("mug", "passport"):  # the latter is looked for where the prior says
        begun = service.search_start(thing)
        for _ in range(2):
            look = begun.next
            box = service.memory.boxes[look.place]
            assert (look.position, look.position_of, look.box) == (box.center, "place", box)
            assert look.pose == service.memory.get_pose(look.place)
            begun = service.search_next(begun.search_id, "not_found")
    assert service.where_is("mug", k=2).places[0].position == COUNTER
    assert {row.position for row in service.list_things().rows} == {COUNTER, (5.0, 3.0, 0.4)}
    assert {event.position for event in service.history("mug").rows} == {COUNTER}
    assert [row.position for row in service.list_places().rows] == [COUNTER, (5.0, 3.0, 0.4)]
    assert [row.pose for row in service.list_places().rows] == [
        service.memory.get_pose(place) for place in (0, 1)
    ]


def test_a_place_without_extents_is_where_one_stands():
    memory = SceneGraphMemory()
    memory.add_furniture("desk", memory.add_room("study"), position=(6, 1))
    memory.observe(0, [Sighting("pen"), Sighting("mug", position=(6.5, 1, 0.8))])
    service = MemoryService(memory, FINDER, now=None)
    look = service.search_start("pen").next
    assert (look.position, look.position_of, look.box) == ((6.0, 1.0, 0.0), "place", None)
    assert look.pose == (6.0, 1.0, 0.0)
    look = service.search_start("mug").next
    assert (look.position, look.pose) == ((6.5, 1.0, 0.8), (6.0, 1.0, 0.0))  # it looks to x
    plan = FINDER.search_plan(memory, "pen", start=(0, 0))
    assert [(look.position, look.pose) for look in plan] == [((6.0, 1.0, 0.0), (6.0, 1.0, 0.0))]
    live = LiveMemory(make_home(), FINDER)
    desk = live.memory.add_furniture("desk", 0, position=(6.0, 1.0))
    assert live.find_stand(desk) == ((6.0, 1.0), 0.0) == (look.pose[:2], 0.0)


def test_changes_say_from_where_to_where():
    memory = make_home()
    service = MemoryService(memory, FINDER, now=None)
    service.observe(0, [])
    service.observe(1, [Sighting("mug", position=(5.1, 3.2, 0.85))])
    (change,) = (row for row in service.changes(1).rows if row.what == "moved")
    assert change.from_position == COUNTER
    assert (change.to_position, change.to_position_of) == ((5.1, 3.2, 0.85), "thing")
    latest = next(row for row in service.history("mug").rows if row.what == "seen")
    assert (latest.position, latest.position_of) == ((5.1, 3.2, 0.85), "thing")


def test_a_home_without_positions_says_none():
    memory = SceneGraphMemory()
    memory.add_furniture("desk", memory.add_room("study"))
    memory.observe(0, [Sighting("mug")])
    service = MemoryService(memory, FINDER, now=None)
    for answer in (service.where_is("mug"), service.list_things(), service.search_start("mug")):
        assert b"position" not in write_json(answer)
        assert b"pose" not in write_json(answer)
    assert service.list_places().rows[0].position is None


@pytest.mark.parametrize("answer", [*list_answers(), Happened], ids=lambda answer: answer.__name__)
def test_what_names_a_place_says_where_it_is(answer):
    """Of every part of every answer: "place" comes with "position", "to_place" with its own."""
    names = make_schema(answer)["properties"]
    for name in names:
        if name == "place" or name.endswith("_place"):
            position = names[name.replace("place", "position")]["anyOf"]
            assert {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3} in (
                position
            )


def test_no_position_has_two_numbers():
    two = {"type": "array", "items": {"type": "number"}, "minItems": 2, "maxItems": 2}
    for answer in (*list_answers(), Happened):
        for name, schema in make_schema(answer)["properties"].items():
            assert name == "box" or two not in schema.get("anyOf", [schema])


def test_where_is_keeps_its_bound_and_the_first_position():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen with a rather long name")
    for number in range(6):
        memory.add_furniture("cabinet", room, f"cabinet number {number}", position=(number, 0))
    memory.observe(0, [Sighting("mug")])
    answer = MemoryService(memory, FINDER, now=None).where_is("mug")
    assert len(write_json(answer)) <= MOST_BYTES
    assert answer.places[0].position == (0.0, 0.0, 0.0)
    assert answer.left_out + len(answer.places) == 6


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
