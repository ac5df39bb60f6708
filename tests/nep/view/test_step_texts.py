"""What the page says of a step and of furniture, where people have spoken and the robot acted."""

import sqlite3
from contextlib import closing

import pytest

from nep.view.__main__ import open_source
from nep.view.answers import tell_history
from nep.view.texts import tell_furniture, tell_step
from sgm.memory.memory_event import read_events
from sgm.store.event import insert_event, read_rows
from simulator import SceneGraphMemory, Sighting
from simulator.home_options import HomeOptions
from simulator.story.past_memory import PastMemory, StillMemory

NIGHTSTAND, TABLE, DRAWER = range(3)


@pytest.fixture
def log(tmp_path):
    return tmp_path / "looks.sgm"


@pytest.fixture
def memory(log):
    """Keys were seen on the table, then moved by Anna; the robot looked at the drawer between."""
    memory = SceneGraphMemory(path=log)
    bedroom = memory.add_room("bedroom")
    for label in ("nightstand", "table", "drawer"):
        memory.add_furniture(label, bedroom)
    memory.observe(TABLE, [Sighting("keys"), Sighting("mug")])
    memory.step()
    memory.rename("keys", "car keys", "anna")
    memory.observe(DRAWER, [Sighting("fork")])
    memory.note_moved("car keys", NIGHTSTAND, "anna")
    memory.picked_up("mug")
    return memory


def tell(story, step):
    return tell_step(story, story.memory_at(step), step)


def test_a_step_of_a_log_says_who_said_what_in_order(memory, log):
    memory.step()
    memory.put_down("mug", DRAWER)
    memory.step()
    memory.split("car keys", NIGHTSTAND, "spare keys", "tom")
    memory.merge("car keys", "spare keys", "tom")
    memory.split("car keys", by="tom")
    memory.step()
    memory.forget("fork", "tom")
    memory.remove_object("spare keys")
    memory.forget(TABLE)
    story = PastMemory(read_events(log), "home")
    assert tell(story, 1) == [
        "anna said: keys is called car keys",
        "looked at drawer in bedroom: saw fork",
        "anna said: car keys at nightstand in bedroom",
        "the robot picked up mug",
    ]
    assert tell(story, 2) == ["the robot put down mug at drawer in bedroom"]
    assert tell(story, 3) == [
        "tom said: car keys at nightstand in bedroom is another thing, spare keys",
        "tom said: car keys and spare keys are one thing",
        "tom said: car keys is no longer one thing with others",
    ]
    assert tell(story, 4) == [
        "tom said: there is no fork; it is forgotten",
        "there is no spare keys; it is forgotten",
        "the robot said: table in bedroom is gone; it is forgotten",
    ]


def test_a_memory_file_says_who_said_it_instead_of_a_look(memory):
    """It said: looked at nightstand in bedroom: saw car keys."""
    story = StillMemory(memory, "home.sgm")
    assert tell(story, 1) == [
        "looked at drawer in bedroom: saw fork",
        "anna said: car keys at nightstand in bedroom",
        "the robot picked up mug",
    ]


@pytest.mark.parametrize("is_log", [True, False])
def test_furniture_says_by_what_a_thing_is_gone(memory, log, is_log):
    story = PastMemory(read_events(log), "home") if is_log else StillMemory(memory, "home.sgm")
    things, _ = tell_furniture(story, story.memory_at(1), TABLE)
    assert {row[:2] for row in things.rows} == {
        ("car keys", "said to be elsewhere"),
        ("mug", "said to be elsewhere"),
    }
    memory.step()
    memory.observe(TABLE, [])
    story = PastMemory(read_events(log), "home") if is_log else StillMemory(memory, "home.sgm")
    things, _ = tell_furniture(story, story.memory_at(2), TABLE)
    assert {row[1] for row in things.rows} == {"missing at the last look"}


def test_a_history_marks_what_was_said(memory, log):
    story = PastMemory(read_events(log), "home")
    told = tell_history(story.trace_object("car keys"), 1.0)
    assert [(step, by) for step, _, by in told["said"]] == [(1, "anna")]
    assert tell_history(story.trace_object("fork"), 1.0)["said"] == []


def test_a_log_with_a_name_of_nothing_is_refused_when_it_is_opened(memory, log):
    memory.close()
    with closing(sqlite3.connect(log)) as connection, connection:
        connection.execute("DELETE FROM snapshots WHERE event > 0")  # or none is made again
        row = next(row for row in read_rows(connection, 0) if row.kind == "rename")
        connection.execute("DELETE FROM events WHERE number = ?", (row.number,))
        forged = row._replace(arguments=row.arguments.replace('"keys"', '"x"', 1))
        insert_event(connection, forged)
    with pytest.raises(ValueError, match="every rename of a memory must be of what was added, got"):
        open_source(str(log), HomeOptions())


def test_furniture_that_is_named_and_merged_is_told_with_its_looks(memory, log):
    memory.step()
    memory.observe(TABLE, [Sighting("plate")])
    memory.name_furniture(DRAWER, "desk", "white desk")
    memory.merge_furniture(DRAWER, TABLE)
    story = PastMemory(read_events(log), "home")
    assert tell(story, 2) == [
        "looked at table in bedroom: saw plate",
        "drawer in bedroom is called white desk",
        "white desk in bedroom and table in bedroom are one piece of furniture",
    ]
    _, looks = tell_furniture(story, story.memory_at(2), DRAWER)
    assert looks.title.startswith("3 looks")  # fork, plate, and the first one at the table
    _, before = tell_furniture(story, story.memory_at(1), DRAWER)
    assert before.title.startswith("1 looks")
