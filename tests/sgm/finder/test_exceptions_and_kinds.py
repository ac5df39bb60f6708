"""What is left out of a kind, by whose it is or where; and things whose kind is not known."""

import pytest

from sgm import Adaptive, Finder, SceneGraphMemory, Sighting
from sgm.finder.service import MemoryService

PLACES = {
    "shelf": ["doll", "zorbit", "mug"],
    "box": ["gizmo", "Tomasz's charger", "charger"],
    "desk": ["charger 2"],
}


@pytest.fixture(scope="module")
def service():
    memory = SceneGraphMemory()
    room = memory.add_room("den")
    for place, things in PLACES.items():
        furniture = memory.add_furniture(place, room=room)
        memory.observe(furniture, [Sighting(thing) for thing in things])
    memory.step()
    return MemoryService(memory, Finder(Adaptive()), None)


@pytest.mark.parametrize(
    "asked",
    [
        "any charger except the one that belongs to Tomasz",
        "where is any charger except the ones owned by Tomasz?",
        "a charger other than the one belonging to Tomasz",
    ],
)
def test_the_one_of_a_person_is_left_out(service, asked):
    answer = service.ask(asked)
    assert answer.status == "ok", answer.said
    assert "Tomasz" not in answer.said
    assert answer.where[0].taken_for[0].startswith("charger")


def test_the_one_at_a_place_is_left_out(service):
    said = service.ask("where is a charger except the one on the desk?").said
    assert "charger is at the box" in said
    assert "at the desk" not in said
    assert service.ask("where is a mug except the one on the shelf?").status != "ok"


def test_an_exception_that_is_not_understood_is_asked_back(service):
    answer = service.ask("any charger besides the one Tomasz bought")
    assert answer.status == "ambiguous"
    assert "'tomasz bought'" in answer.said


def test_things_of_a_kind_that_is_not_known_are_named(service):
    said = service.ask("what toys are on the shelf?").said
    assert said == "On the shelf: doll. Of a kind that I do not know: zorbit."
    said = service.ask("what toys are in the box?").said
    assert said == "Nothing is known in the box. Of a kind that I do not know: gizmo."
    # A mug is no broad kind: what is none is known not to be one.
    assert service.ask("which mugs are on the shelf?").said == "On the shelf: mug."


def test_the_room_of_a_thing_is_not_that_of_others_of_its_kind():
    memory = SceneGraphMemory()
    for room, place, thing in (("den", "sofa", "cushion"), ("loft", "bed", "pillow")):
        furniture = memory.add_furniture(place, room=memory.add_room(room))
        memory.observe(furniture, [Sighting(thing)])
    memory.step()
    answer = MemoryService(memory, Finder(Adaptive()), None).ask("which room is the pillow in?")
    assert "The pillow is in the loft" in answer.said
