"""Laws of any session: its log makes the memory again, a call that raises changes nothing."""

import inspect
import random
import sys
import tempfile
from datetime import datetime
from pathlib import Path
from threading import Thread

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from simulator import Clock, SceneGraphMemory, Sighting
from tests.sgm.memory.sessions import CALLS, FURNITURE, THINGS, call, dump

CLOCK = Clock(datetime(2026, 11, 20, 8), 600)
# Some sightings of a session are doubtful ones.
pytestmark = pytest.mark.filterwarnings("ignore:.* confidences of a look are below")

calls = st.sampled_from((*sorted(CALLS), "observe", "observe", "add_furniture")).flatmap(
    lambda name: st.tuples(st.just(name), CALLS[name])
)
# How a session goes on after some calls: nothing; a snapshot is written; the file is opened as
# after a crash, or after it was closed.
turns = st.sampled_from(("", "", "save", "open", "save and open", "open again"))
sessions = st.lists(st.tuples(st.lists(calls, max_size=12), turns), min_size=1, max_size=5)


@pytest.fixture(autouse=True)
def no_disk(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda file: None)  # hundreds of saves, no crash to survive


def play(folder, session, memory):
    """Play a session; return the memory that it ends with."""
    file = folder / "looks.sgm"
    for own, turn in session:
        for name, arguments in own:
            call(memory, name, arguments)
        if turn in ("save", "save and open"):
            memory.save(file)
        if turn == "open again":
            memory.close()
        if turn != "save" and turn:
            memory = SceneGraphMemory.open(file)
    return memory


def make_again(log):
    *_, (memory, _, _) = replay(read_events(log))
    return memory


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(sessions, st.sampled_from((None, CLOCK)))
def test_the_log_of_a_session_makes_the_memory_again_to_the_bit(session, clock):
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "looks.sgm"
        memory = SceneGraphMemory(clock=clock, path=log)
        memory.add_furniture("fridge", memory.add_room("kitchen"))
        memory.add_furniture("desk", memory.add_room("study"))
        memory = play(Path(folder), session, memory)
        again = make_again(log)
        assert dump(again) == dump(memory)
        for each in (memory, again):  # and they go on alike
            each.step()
            for furniture in each.furniture_ids:
                each.observe(furniture, [Sighting("Milk")])
        assert dump(again) == dump(memory)


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(sessions, st.sampled_from((None, CLOCK)))
def test_a_saved_memory_goes_on_as_it_would_have(session, clock):
    with tempfile.TemporaryDirectory() as folder:
        log, file = Path(folder) / "looks.sgm", Path(folder) / "home.sgm"
        memory = SceneGraphMemory(clock=clock, path=log)
        memory.add_furniture("fridge", memory.add_room("kitchen"))
        memory = play(Path(folder), session, memory)
        memory.save(file)
        again = SceneGraphMemory.load(file)
        for own, _ in session:
            for name, arguments in own:
                assert str(call(again, name, arguments)) == str(call(memory, name, arguments))
        assert dump(again) == dump(memory)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(st.lists(calls, max_size=25), st.lists(calls, max_size=15), st.sampled_from((None, CLOCK)))
def test_a_copy_goes_its_own_way_and_the_same_one(first, last, clock):
    memory = SceneGraphMemory(clock=clock)
    memory.add_furniture("fridge", memory.add_room("kitchen"))
    for name, arguments in first:
        call(memory, name, arguments)
    copied, content = memory.copy(), dump(memory)
    assert dump(copied) == content
    errors = [str(call(copied, name, arguments)) for name, arguments in last]
    assert dump(memory) == content
    changed = dump(copied)
    assert [str(call(memory, name, arguments)) for name, arguments in last] == errors
    assert dump(memory) == dump(copied) == changed
    resolved = [[each.resolve(thing) for thing in THINGS] for each in (memory, copied)]
    assert resolved[0] == resolved[1]


def test_a_room_with_furniture_that_was_removed(tmp_path):
    log = tmp_path / "looks.sgm"
    memory = SceneGraphMemory(path=log)
    study = memory.add_room("study")
    memory.add_furniture("desk", study)
    memory.remove_room(study)
    memory = SceneGraphMemory.open(log)
    assert dump(make_again(log)) == dump(memory)


def test_a_question_between_looks_is_saved(tmp_path):
    memory = SceneGraphMemory()
    desk = memory.add_furniture("desk", memory.add_room("study"))
    memory.observe(desk, [Sighting("pen")])
    memory.query("lamp")
    memory.save(tmp_path / "home.sgm")
    again = SceneGraphMemory.load(tmp_path / "home.sgm")
    for each in (memory, again):
        each.observe(desk, [])  # it did not show the lamp that was asked for
    assert dump(again) == dump(memory)
    assert "lamp" in again.descriptions


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(sessions, st.lists(calls, min_size=8, max_size=30), st.sampled_from((None, CLOCK)))
def test_a_call_that_raises_changes_nothing(session, last, clock):
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "looks.sgm"
        memory = SceneGraphMemory(clock=clock, path=log)
        memory.add_furniture("fridge", memory.add_room("kitchen"))
        memory = play(Path(folder), session, memory)
        for name, arguments in last:
            before = dump(memory), log.read_bytes()
            if call(memory, name, arguments) is not None:
                assert (dump(memory), log.read_bytes()) == before, (name, arguments)


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.lists(calls, max_size=12), st.lists(calls, min_size=8, max_size=20))
def test_a_call_whose_line_cannot_be_written_changes_nothing(first, last):
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "looks.sgm"
        memory = SceneGraphMemory(path=log)
        memory.add_furniture("fridge", memory.add_room("kitchen"))
        for name, arguments in first:
            call(memory, name, arguments)
        log.rename(log.with_suffix(".old"))
        log.mkdir()  # no file any more
        before, time = dump(memory), memory.time
        for name, arguments in last:
            error = call(memory, name, arguments)
            stays = name in ("step", "step_to") and arguments[0] in (0, time)
            assert error is not None or stays, name
            assert dump(memory) == before


def test_all_calls_that_write_are_tried():
    """A new method is either tried here or among the readers of test_threads.py."""
    from tests.sgm.memory.test_threads import READERS

    public = {name for name in dir(SceneGraphMemory) if not name.startswith("_")}
    files = {"load", "open", "path", "transaction", "sync", "close"}  # tried in test_open.py
    files |= {"parts"}  # what replays call, in sgm/replay
    assert public == {*CALLS, *READERS, *files}
    assert all(callable(getattr(SceneGraphMemory, name)) for name in CALLS)
    assert inspect.ismethod(SceneGraphMemory.load)


def test_a_step_that_no_date_is_at_is_refused(tmp_path):
    log = tmp_path / "looks.sgm"
    for memory in (
        SceneGraphMemory(clock=Clock(datetime(2026, 11, 20)), path=log),
        SceneGraphMemory(clock=Clock(datetime(2026, 11, 20))),
    ):
        with pytest.raises(
            ValueError, match="num_steps must be at most 366 days after the present step"
        ):
            memory.step(10**9)
        with pytest.raises(ValueError, match="must be a date before the year 10000"):
            memory.step(10**9, accept_jump=True)
        for accept_jump in (False, True):
            with pytest.raises(ValueError, match="must be a date before the year 10000"):
                memory.step_to(10**9, accept_jump=accept_jump)
        assert memory.time == 0
        memory.step()
        assert memory.time == 1
    assert [line.kind for line in read_events(log)] == ["start", "step"]


@pytest.mark.parametrize("has_log", [False, True])
def test_a_clock_by_which_the_present_is_no_date_is_refused(tmp_path, has_log):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm" if has_log else None)
    memory.step(10**9)
    memory.save(tmp_path / "home.sgm")
    with pytest.raises(ValueError, match="must be a date before the year 10000"):
        memory.start_clock(CLOCK)
    assert memory.clock is None
    with pytest.raises(ValueError, match="must be a date before the year 10000"):
        SceneGraphMemory.load(tmp_path / "home.sgm", clock=CLOCK)


@pytest.mark.slow
def test_the_log_of_several_threads_makes_the_memory_again_to_the_bit(tmp_path):
    log = tmp_path / "looks.sgm"
    memory = SceneGraphMemory(path=log)
    for room in ("kitchen", "study"):
        number = memory.add_room(room)
        for label in FURNITURE:
            memory.add_furniture(label, number)
    problems = []

    def work(seed):
        rng = random.Random(seed)
        try:
            for _ in range(250):
                name, arguments = draw(rng)
                error = call(memory, name, arguments)
                if error is not None and not isinstance(error, (KeyError, ValueError)):
                    raise error
        except BaseException as error:
            problems.append(error)

    def draw(rng):
        number = rng.choice([*memory.furniture_ids, 99])  # gone a moment later, perhaps
        room, thing = rng.choice([*memory.layout.rooms, 99]), rng.choice(THINGS)
        seen = [Sighting(rng.choice(THINGS)) for _ in range(rng.randrange(3))]
        return rng.choices(
            [
                ("observe", (number, seen)),
                ("note_absent", (number, thing)),
                ("step", (1,)),
                ("query", (thing,)),
                ("remove_object", (thing,)),
                ("remove_furniture", (number,)),
                ("remove_room", (room,)),
                ("add_room", ("hall",)),
                ("add_furniture", ("shelf", room)),
                ("move_furniture", (number, room)),
            ],
            (24, 6, 6, 4, 4, 2, 1, 3, 9, 4),
        )[0]

    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        threads = [Thread(target=work, args=(seed,)) for seed in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert not problems
    assert len(read_events(log)) > 400
    assert dump(make_again(log)) == dump(memory)
