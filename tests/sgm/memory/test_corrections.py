"""What people say of things, and what the robot does with them: memory, log, file, answers."""

import json
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting
from tests.sgm.memory.sessions import dump

FINDER = Finder(Bayesian())


@pytest.fixture
def memory(tmp_path):
    """Keys and a red mug on the table, since three steps of an hour; a log is written."""
    clock = Clock(datetime(2026, 11, 20, 15, 10))
    memory = SceneGraphMemory(clock=clock, path=tmp_path / "looks.sgm")
    room = memory.add_room("kitchen")
    for label in ("fridge", "table", "drawer"):
        memory.add_furniture(label, room)
    memory.observe(TABLE, [Sighting("keys"), Sighting("red mug")])
    memory.step(3)
    return memory


FRIDGE, TABLE, DRAWER = range(3)


def rank(memory, thing):
    ranking = FINDER.rank(memory, thing)
    total = sum(p.probability for p in ranking) + ranking.elsewhere + ranking.with_robot
    assert total == pytest.approx(1)
    return {place.furniture: place for place in ranking}


def test_a_person_is_believed_but_not_blindly(memory):
    memory.note_moved("the keys", DRAWER, by="anna", confidence=0.8)
    places = rank(memory, "keys")
    assert places[DRAWER].probability == pytest.approx(0.8)
    # What is left is where they were: on the table.
    assert places[TABLE].probability > 0.15
    seen = memory.last_seen("keys")
    assert (seen.furniture, seen.relation, seen.is_there, seen.by) == (DRAWER, "in", True, "anna")
    table = next(place for place in memory.places_of("keys") if place.furniture == TABLE)
    assert (table.is_there, table.by) == (False, "")


def test_who_is_trusted_less_weighs_less_later(memory):
    other = memory.copy()
    memory.note_moved("keys", DRAWER, by="anna", confidence=0.95)
    other.note_moved("keys", DRAWER, by="tim", confidence=0.5)
    for one in (memory, other):
        one.step()
    sure, doubted = (rank(one, "keys")[DRAWER].probability for one in (memory, other))
    assert sure > doubted + 0.15


def test_the_evidence_says_who_said_so(memory):
    memory.note_moved("keys", DRAWER, by="anna")  # at 18:10
    memory.step(24)
    places = rank(memory, "keys")
    assert places[DRAWER].why.startswith("anna said so yesterday at 18:10")
    assert places[TABLE].why.startswith(
        "seen here yesterday at 15:10; anna said it was moved yesterday at 18:10"
    )
    memory.observe(DRAWER, [])
    memory.step()
    assert "; not there at 18:10" in rank(memory, "keys")[DRAWER].why


@pytest.mark.parametrize("num_steps", [0, 2])
def test_later_looks_outweigh_a_statement(memory, num_steps):
    memory.note_moved("keys", DRAWER, by="anna")
    memory.step(num_steps)
    before = rank(memory, "keys")[DRAWER].probability
    memory.observe(DRAWER, [])
    assert rank(memory, "keys")[DRAWER].probability < before - 0.1
    memory.observe(FRIDGE, [Sighting("keys", "in")])
    memory.step()
    places = rank(memory, "keys")
    assert places[FRIDGE].probability > 0.4 > 0.3 > places[DRAWER].probability
    assert memory.last_seen("keys").by == ""


def test_a_statement_is_no_look(memory):
    batch = memory.batch
    before = batch.furniture_num_observed.copy()
    history = json.dumps(batch.history.to_json())
    mug = memory.places_of("red mug")
    memory.observe(DRAWER, [Sighting("spoon")])
    spoon = memory.places_of("spoon")
    before[0, DRAWER] += 1
    history = json.dumps(batch.history.to_json())
    memory.note_moved("keys", DRAWER, by="anna")
    assert (memory.batch.furniture_num_observed == before).all()
    assert json.dumps(memory.batch.history.to_json()) == history
    assert (memory.places_of("red mug"), memory.places_of("spoon")) == (mug, spoon)


def test_the_robot_carries_a_thing_until_it_puts_it_down(memory):
    memory.picked_up("red mug")
    memory.step(5)
    ranking = FINDER.rank(memory, "mug")
    assert memory.carried == ("red mug",)
    assert ranking.with_robot == 0.97
    assert "97%  with the robot" in str(ranking)
    search = FINDER.search(memory, "mug")
    assert search.next() is None
    assert search.outcome == "mug: the robot carries it (97%) after 0 looks"
    memory.put_down("mug", FRIDGE, "in")
    assert memory.carried == ()
    place = rank(memory, "mug")[FRIDGE]
    assert (place.probability, place.relation) == (pytest.approx(0.97), "in")
    assert place.why.startswith("put here by the robot")
    assert FINDER.search(memory, "mug").next().place.furniture == FRIDGE


def test_what_the_robot_does_is_no_habit_of_the_home(memory):
    """Rates of moving are learnt from looks alone."""
    before = memory.batch.history.compute_move_rate()
    memory.picked_up("red mug")
    memory.put_down("mug", FRIDGE)
    memory.observe(FRIDGE, [Sighting("red mug")])
    assert memory.batch.objects["num_moved"][1] == 0
    assert memory.batch.history.counters["num_moved"][0] == 0
    assert (memory.batch.history.compute_move_rate() <= before).all()


def test_one_of_several_of_a_kind(memory):
    memory.observe(DRAWER, [Sighting("fork", "in"), Sighting("fork", "in")])
    memory.observe(TABLE, [Sighting("keys"), Sighting("red mug"), Sighting("fork")])
    memory.picked_up("fork", was_at=TABLE)
    there = {seen.furniture: seen.is_there for seen in memory.places_of("fork") if seen.relation}
    assert there == {DRAWER: True, TABLE: False}
    memory.note_moved("fork", FRIDGE, by="anna")  # one of them; nobody says which
    there = {seen.furniture: seen.is_there for seen in memory.places_of("fork") if seen.relation}
    assert there == {DRAWER: True, TABLE: False, FRIDGE: True}


def test_things_that_were_never_seen(memory):
    memory.note_moved("drill", DRAWER, by="tom")
    memory.picked_up("parcel")
    memory.step(3)
    assert memory.last_seen("drill").by == "tom"
    assert memory.carried == ("parcel",)
    assert FINDER.rank(memory, "parcel").with_robot == 0.97


def test_a_ghost_is_forgotten(memory, tmp_path):
    memory.observe(FRIDGE, [Sighting("vase")])
    memory.forget("the vase", by="anna")
    assert memory.last_seen("vase") is None
    memory.forget(DRAWER)
    assert memory.furniture_ids == (FRIDGE, TABLE)
    lines = read_events(tmp_path / "looks.sgm")[-2:]
    assert [(line.kind, line.values["by"]) for line in lines] == [
        ("remove_object", "anna"),
        ("remove_furniture", "robot"),
    ]


def play(memory):
    memory.note_moved("keys", DRAWER, by="anna", confidence=0.75)
    memory.picked_up("red mug")
    memory.note_moved("drill", FRIDGE, "tom")
    memory.step()
    memory.observe(DRAWER, [], 0.4)
    memory.put_down("mug", FRIDGE, "in")
    memory.query("lamp")
    memory.note_moved("lamp", TABLE, "anna", "on")
    memory.observe(TABLE, [Sighting("lamp")])
    memory.forget("drill")


def test_a_log_with_statements_makes_the_memory_again(memory, tmp_path):
    play(memory)
    *_, (again, _, _) = replay(read_events(tmp_path / "looks.sgm"))
    assert dump(again) == dump(memory)
    assert FINDER.rank(again, "keys") == FINDER.rank(memory, "keys")


def test_statements_are_saved_and_go_on(memory, tmp_path):
    play(memory)
    memory.picked_up("keys")
    memory.save(tmp_path / "home.sgm")
    again = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert dump(again) == dump(memory)
    for one in (memory, again):
        one.step()
        one.put_down("keys", TABLE)
        one.remove_furniture(FRIDGE)
    assert dump(again) == dump(memory)
    assert again.last_seen("keys").by == "robot"


@pytest.mark.parametrize(
    ("call", "error", "message"),
    [
        (lambda m: m.note_moved("keys", 9, "anna"), KeyError, "furniture must be an id"),
        (lambda m: m.note_moved("keys", None, "anna"), KeyError, "furniture must be an id"),
        (lambda m: m.note_moved("keys", DRAWER, ""), ValueError, "by must be a non-empty text"),
        (lambda m: m.note_moved("keys", DRAWER, "anna", "under"), ValueError, "relation must be"),
        (
            lambda m: m.note_moved("keys", DRAWER, "anna", confidence=0.2),
            ValueError,
            r"confidence of a statement must lie in \[0.5, 1\], got 0.2 by 'anna'. Leave out",
        ),
        (
            lambda m: m.put_down("keys", DRAWER),
            ValueError,
            r"one that the robot carries to be put down, got 'keys'; it carries nothing. Call",
        ),
        (lambda m: m.forget("vase"), KeyError, "one that was seen or asked for, got 'vase'"),
        (lambda m: m.forget(9), KeyError, "furniture must be an id from add_furniture, got 9"),
        (lambda m: m.picked_up("keys", was_at=9), KeyError, "furniture must be an id"),
    ],
)
def test_bad_calls_say_what_is_wrong_and_change_nothing(memory, call, error, message):
    before = dump(memory)
    with pytest.raises(error, match=message):
        call(memory)
    assert dump(memory) == before


def test_a_name_must_mean_one_thing(memory):
    memory.observe(FRIDGE, [Sighting("blue mug")])
    with pytest.raises(
        ValueError, match=r"named exactly, got 'mug', which may be red mug, blue mug"
    ):
        memory.picked_up("mug")


@pytest.mark.parametrize(
    ("statement", "message"),
    [
        ([9, "moved", 0, "in", "anna", 0.9, [], 1], "no statement like"),  # later than now
        ([0, "danced", 0, "in", "anna", 0.9, [], 1], "no statement like"),
        ([0, "moved", 7, "in", "anna", 0.9, [], 1], "no statement like"),  # no such place
        ([0, "moved", 0, "under", "anna", 0.9, [], 1], "no statement like"),
        ([0, "picked_up", 0, "in", "robot", 0.9, [], 1], "no statement like"),
        ([0, "moved", 0, "in", "", 0.9, [], 1], "by must be a non-empty text"),
        ([0, "moved", 0, "in", "anna", 0.1, [], 1], "confidence of a statement must lie"),
        ([0, "moved", 0, "in", "anna", 0.9, [7], 1], "no statement like"),
        ([0, "moved"], "not enough values"),
    ],
)
def test_forged_statements_are_refused(memory, statement, message):
    content = memory._state.get_content()
    data = content.to_json() | {"statements": [[0, [statement]]]}
    with pytest.raises(ValueError, match=message):
        type(content).from_json(data)
