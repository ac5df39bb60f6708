"""What will be at a place, asked of a service in words; what was learnt, in two languages."""

from datetime import timedelta

import pytest

from sgm.finder.finder import Finder
from sgm.finder.service import MemoryService
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.policies import Adaptive
from tests.sgm.finder.tablet_home import MONDAY, NOON, make_home

ENGLISH = """what will be on the table tomorrow at noon?
what will be on the table tomorrow at 12?
tomorrow at noon, what will there be on the table?
what is going to be on the table tomorrow at noon?
what can I expect to find on the table tomorrow at noon?
what do you expect on the table tomorrow at noon?
will anything be on the table tomorrow at noon?
what is expected on the table tomorrow at noon?"""
GERMAN = """Was wird morgen um 12 Uhr auf dem Tisch sein?
Was wird morgen Mittag auf dem Tisch liegen?
Was wird auf dem Tisch morgen um 12 Uhr sein?
Was ist auf dem Tisch morgen Mittag zu erwarten?"""


def make_service(language="en"):
    memory, table, shelf = make_home(language)  # to Sunday, 20:00
    return MemoryService(memory, Finder(Adaptive()), None), table, shelf


@pytest.mark.parametrize(
    ("language", "asked", "said"),
    [
        *(("en", text, "Expected on the table then: lamp (") for text in ENGLISH.split("\n")),
        *(
            ("de", text, "Dann dort zu erwarten: Tisch, Küche: Lampe (")
            for text in GERMAN.split("\n")
        ),
    ],
)
def test_what_will_be_at_a_place_is_answered(language, asked, said):
    service, table, _ = make_service(language)
    answered = service.ask(asked)
    assert (answered.status, answered.kind) == ("ok", "what_at")
    assert answered.said.startswith(said)
    assert answered.at.iso == NOON.isoformat()
    assert answered.expected == service.expect(table, NOON).rows
    assert [row.thing for row in answered.expected] == ["lamp", "tablet"]


def test_what_is_unlikely_is_not_named():
    service, *_ = make_service()
    answered = service.ask("tomorrow at 20:00, what will be on the table but the lamp?")
    assert answered.said == "Nothing is expected on the table then."
    assert [row.thing for row in answered.expected] == ["tablet"]
    assert answered.expected[0].why == "at this hour on 0 of 10 workdays"


def test_of_several_places_all_are_told():
    service, *_ = make_service()
    answered = service.ask("what will be in the kitchen tomorrow at 20:00?")
    assert {row.thing for row in answered.expected} == {"lamp", "tablet"}
    assert answered.said.count("%") == 2


def test_without_a_time_the_last_look_is_told():
    service, *_ = make_service()
    answered = service.ask("what can I expect on the table?")
    assert answered.expected is None
    assert [row.thing for row in answered.things] == ["lamp"]


def test_the_past_is_still_the_past():
    service, *_ = make_service()
    answered = service.ask("what was at noon on the table?")
    assert answered.expected is None
    assert answered.at.iso == (NOON - timedelta(days=1)).isoformat()
    assert "lamp" in answered.said


def test_expect_is_a_list_with_its_time_and_reasons():
    service, table, _ = make_service()
    listed = service.expect("table", NOON)
    assert (listed.status, listed.left_out, listed.at.iso) == ("ok", 0, NOON.isoformat())
    assert {row.thing: row.why for row in listed.rows} == {
        "lamp": "at this hour on 10 of 10 workdays",
        "tablet": "at this hour on 9 of 10 workdays",
    }
    assert [row.probability for row in listed.rows] == [
        each.probability for each in service.finder.expect(service.memory, table, NOON)
    ]
    one = service.expect(table, NOON, k=1)
    assert (one.rows, one.left_out) == (listed.rows[:1], 1)
    assert service.expect("sink").status == "unknown"
    with pytest.raises(ValueError, match="k must"):
        service.expect(table, k=0)
    with pytest.raises(ValueError, match="at must"):
        service.expect(table, MONDAY)


def test_what_was_learnt_is_said_in_the_language_of_the_memory():
    service, _, shelf = make_service()
    learnt = service.finder.learnt(service.memory)
    listed = service.learnt()
    tablet = listed.rows[0]
    assert (tablet.thing, tablet.rhythm, tablet.place, tablet.name) == (
        "tablet",
        "day",
        shelf,
        "shelf in kitchen",
    )
    said = "table in kitchen on workdays at 12; shelf in kitchen in 79% of the looks"
    assert tablet.said == said
    assert (listed.sure, listed.right, listed.num_looks) == (
        learnt.sure,
        learnt.right,
        learnt.num_looks,
    )
    assert str(learnt).endswith(listed.said)
    german, *_ = make_service("de")
    tablet = german.learnt().rows[0]
    assert tablet.said == "Tisch, Küche an Werktagen um 12 Uhr; Regal, Küche bei 79% der Blicke"
    assert str(german.finder.learnt(german.memory)).startswith(f"Tablet: {tablet.said}\n")
    assert german.learnt().said.startswith("sicher zu 0.")
    short = service.learnt(k=1)
    assert (short.rows, short.left_out) == (listed.rows[:1], len(listed.rows) - 1)


def test_an_empty_memory_has_learnt_nothing():
    service = MemoryService(SceneGraphMemory(), Finder(Adaptive()), None)
    assert (service.learnt().rows, service.learnt().said, service.learnt().sure) == ((), "", None)
    service.add_room("kitchen")
    service.add_place("table", "kitchen")
    assert (service.learnt().rows, service.expect("table").rows) == ((), ())
