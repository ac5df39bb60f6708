"""Every place that distinguishes kinds of events knows each that is declared, and no other."""

import json

import pytest

import nep.view.texts as texts
import sgm.memory.replayer as replayer
import sgm.store.event_kinds as event_kinds
import sgm.store.event_rows as event_rows
import simulator.story.past_memory as past_memory
import simulator.story.past_things as past_things
import simulator.trace.log_reader as log_reader
from sgm.memory.memory_event import MemoryEvent, parse_rows
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.asking import make_asking
from sgm.store.event import StoredEvent
from sgm.store.event_kinds import EVENT_KINDS, PLACED, STATEMENTS, EventKind
from simulator.story.past_memory import PastMemory
from simulator.story.past_things import PastThings
from simulator.story.story import PastStatement
from simulator.trace.from_log import make_trace

TABLES = {
    "a memory made again": replayer.CHANGES,
    "tables of the database": event_rows.CHANGES,
    "a story": past_memory.PARTS,
    "names in a story": past_things.CHANGES,
    "a trace of a log": log_reader.READS,
}
# What is told of every kind of a story that tells something, in words.
TOLD = {kind for kind, part in past_memory.PARTS.items() if part.startswith("told")}

VALUES = ("thing", "was", "where", "when", "who", "is")


@pytest.mark.parametrize("kind", EVENT_KINDS)
def test_every_place_says_what_it_does_with_a_kind(kind):
    assert [name for name, table in TABLES.items() if kind not in table] == []
    assert kind not in TOLD or kind in texts.STATEMENT_TEXTS


def test_no_place_knows_a_kind_that_is_not_declared():
    for name, table in (*TABLES.items(), ("texts", texts.STATEMENT_TEXTS)):
        assert set(table) <= set(EVENT_KINDS), name
    assert set(texts.STATEMENT_TEXTS) == TOLD


def test_statements_are_what_is_said_of_where_a_thing_is():
    assert STATEMENTS == ("moved", "picked_up", "put_down")
    assert PLACED == ("moved", "put_down")
    for kind in STATEMENTS:  # and are told in an answer
        assert "mug" in make_asking("en").say(kind, **dict.fromkeys(VALUES, "mug"))


@pytest.fixture
def painted(monkeypatch):
    """An event of a kind that is declared, and that nobody does anything with."""
    kinds = {**EVENT_KINDS, "paint": EventKind(about="layout", arguments=("furniture", "colour"))}
    monkeypatch.setattr(event_kinds, "EVENT_KINDS", kinds)
    return MemoryEvent("paint", 0, {"furniture": 0, "colour": "red"})


@pytest.mark.parametrize(
    ("module", "use"),
    [
        ("sgm.memory.replayer", lambda line: replayer.Replayer(SceneGraphMemory()).apply(line)),
        ("simulator.story.past_memory", lambda line: PastMemory([line], "home")),
        ("simulator.story.past_things", lambda line: PastThings().note_change(line, {})),
        ("simulator.trace.log_reader", lambda line: make_trace([line])),
        ("nep.view.texts", lambda line: texts.tell_statement(PastStatement(0, line.kind, "", ""))),
    ],
)
def test_a_kind_that_a_place_does_not_know_is_refused(painted, module, use):
    with pytest.raises(
        ValueError, match=rf"kind of an event must be one of .*, got 'paint' in {module}\. Say"
    ):
        use(painted)


def test_tables_of_the_database_refuse_it_and_nothing_is_written(tmp_path):
    with SceneGraphMemory(path=tmp_path / "home.sgm") as memory:
        file = memory.parts.state.file
        number = file.number
        with pytest.raises(ValueError, match=r"got 'paint' in sgm\.store\.event_rows\. Say there"):
            file.append("paint", 0, {"colour": "red"}, {"colour": "red"})
        assert file.number == number


@pytest.mark.parametrize("kind", ["start", "paint"])
def test_a_file_holds_no_other_kind(tmp_path, kind):
    row = StoredEvent(number=1, time=0, kind=kind, arguments=json.dumps({}), by=None)
    with pytest.raises(ValueError, match=rf"event 1 of a memory file must be .* got .*'{kind}'"):
        parse_rows([row], tmp_path / "home.sgm")
