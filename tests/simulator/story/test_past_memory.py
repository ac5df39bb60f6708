"""Memories of any step of the past, and what was seen, true and believed over time."""

from datetime import datetime

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import MemoryEvent, parse_rows, read_events
from sgm.store.event import StoredEvent
from simulator import (
    Bayesian,
    Clock,
    HomeConfig,
    PriorGraph,
    SampledSource,
    SceneGraphMemory,
    Sighting,
)
from simulator.story.past_memory import PastMemory, StillMemory
from simulator.story.run_recorder import record_run
from simulator.trace.from_log import make_trace
from simulator.world.routine.dynamics import RoutineDynamics


@pytest.fixture
def log(tmp_path):
    return tmp_path / "looks.sgm"


# A robot's life has sightings that are more likely wrong than right, and the memory says so.
pytestmark = pytest.mark.filterwarnings("ignore:.* confidences of a look are below:UserWarning")


def live(memory, num_steps, seed=0):
    """A robot's life: looks, partial ones too, absences and furniture that comes and goes."""
    rng = np.random.default_rng(seed)
    rooms = [memory.add_room("kitchen"), memory.add_room("study")]
    places = [memory.add_furniture("shelf", rooms[n % 2], f"shelf {n}") for n in range(5)]
    states = []
    for step in range(num_steps):
        memory.step(int(rng.integers(1, 3)))
        for place in rng.choice(places, 2, replace=False):
            seen = [Sighting(f"mug {n}", "in", rng.uniform(0.3, 1)) for n in rng.integers(0, 9, 3)]
            memory.observe(int(place), seen, coverage=float(rng.choice([0.5, 1.0])))
        memory.note_absent(places[0], "mug 3")
        if step == 4:
            memory.remove_furniture(places.pop(2))
            places.append(memory.add_furniture("desk", rooms[0], position=(1, 2)))
        if step == 6:
            memory.move_furniture(places[0], room=rooms[1])
            memory.remove_object("mug 1") if "mug 1" in memory.descriptions else None
        states.append((memory.time, memory.to_dict(), Finder(Bayesian()).rank(memory, "mug 3")))
    return states


def test_a_log_replays_to_the_memory_that_wrote_it(log):
    memory = SceneGraphMemory(path=log)
    states = live(memory, 40)
    replay = PastMemory(read_events(log), "home")
    assert replay.num_steps == memory.time
    order = np.random.default_rng(1).permutation(len(states))
    for time, home, ranking in [states[row] for row in order]:  # back and forth
        again = replay.memory_at(time)
        assert again.time == time
        assert again.to_dict() == home
        assert Finder(Bayesian()).rank(again, "mug 3") == ranking


def test_a_copy_goes_its_own_way():
    memory = SceneGraphMemory()
    live(memory, 8)
    before = memory.to_dict()
    copy = memory.copy()
    assert copy.to_dict() == before
    copy.step(3)
    copy.observe(copy.furniture_ids[0], [Sighting("new thing")])
    copy.add_furniture("bed", 0)
    assert memory.to_dict() == before


def read_both(log):
    """The events of two memories of one home, one after the other."""
    return [event for name in ("first", "second") for event in read_events(log.with_name(name))]


def test_a_new_memory_goes_on_where_the_old_one_ended(log):
    for name in ("first", "second"):
        memory = SceneGraphMemory(path=log.with_name(name))
        shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
        memory.step(4)
        memory.observe(shelf, [Sighting("mug")])
    replay = PastMemory(read_both(log), "home")
    # The second one begins a step after the first one's last, at 4: its own step 4 is step 9.
    assert [look.step for look in replay.looks] == [4, 9]
    assert replay.memory_at(9).num_furniture == 1


def test_furniture_of_a_new_memory_is_told_from_that_of_the_one_before(log):
    for name, labels in (("first", ("shelf", "table")), ("second", ("table", "shelf"))):
        memory = SceneGraphMemory(path=log.with_name(name))
        hall = memory.add_room("hall")
        for label in labels:
            memory.observe(memory.add_furniture(label, hall), [Sighting(f"mug of the {label}")])
            memory.step()
    replay = PastMemory(read_both(log), "home")
    for look in replay.looks:
        now = replay.memory_at(look.step)
        assert look.seen == (f"mug of the {now.layout.furniture[look.furniture].label}",)
    assert len({look.furniture for look in replay.looks}) == 4


def test_with_clocks_a_new_memory_begins_when_its_clock_says(log):
    for name, hour in (("first", 7), ("second", 17)):
        clock = Clock(datetime(2026, 11, 16, hour))
        memory = SceneGraphMemory(clock=clock, path=log.with_name(name))
        shelf = memory.add_furniture("shelf", memory.add_room("kitchen"))
        memory.step(2)
        memory.observe(shelf, [Sighting("mug")])
    replay = PastMemory(read_both(log), "home")
    assert [look.step for look in replay.looks] == [2, 12]
    assert replay.get_time(12) == "Mon 16 Nov 19:00"


def test_bad_logs_and_steps():
    look = MemoryEvent("look", 3, {"furniture": 7, "coverage": 1.0, "seen": []})
    with pytest.raises(ValueError, match=r"every look .* of what was added, got 7 at"):
        PastMemory([look], "home")
    values = {"furniture": 1, "label": "shelf", "room": 5, "description": "shelf", "position": None}
    with pytest.raises(ValueError, match=r"every furniture .* of what was added, got 5"):
        PastMemory([MemoryEvent("furniture", 0, values), look], "home")
    replay = PastMemory([MemoryEvent("step", 4, {"num_steps": 4})], "home")
    with pytest.raises(ValueError, match=r"step must lie in 0 to 4, got 5"):
        replay.memory_at(5)


def record_week():
    rules = HomeConfig(
        rooms=("kitchen", "bedroom"),
        furniture_per_room=3,
        objects_per_furniture=2,
        looks="patrol",
        looks_per_step=2,
        dynamics=RoutineDynamics(step_seconds=7200),
    )
    return record_run(SampledSource(PriorGraph.default(), rules), 60, home=3)


@pytest.fixture(scope="module")
def week():
    return record_week()


def test_a_run_tells_looks_questions_and_truth(week):
    assert week.num_steps == week.truth.num_steps == 60
    assert len(week.looks) == 2 * len(week.questions) == 120
    assert week.get_time(13) == "Tue 07 May 02:00"
    for look in week.looks:
        # What was seen and what was missed is what was there.
        there = week.truth.list_there(look.step, look.furniture)
        assert sorted([*look.seen, *look.missed]) == there
    missed = sum(len(look.missed) for look in week.looks)
    seen = sum(len(look.seen) for look in week.looks)
    # A quarter is missed: within five standard deviations.
    assert abs(missed - 0.25 * (missed + seen)) < 5 * np.sqrt((missed + seen) * 0.25 * 0.75)
    for question in week.questions:
        places = week.truth.find([question.description], 6)[question.step]
        assert places[question.furniture] == question.is_right


def test_the_same_run_again_is_the_same(week):
    again = record_week()
    assert again.looks == week.looks
    assert again.questions == week.questions


def test_a_history_is_what_was_seen_true_and_believed(week):
    description = week.questions[-1].description
    finder = Finder(Bayesian())
    history = week.trace_object(description, finder, num_points=61)
    assert history.hours.tolist() == [2.0 * step for step in range(61)]
    names = [week.memory_at(60).describe(number) for number in week.memory_at(60).furniture_ids]
    shown = [names.index(place) for place in history.places]
    assert (history.truth == week.truth.find([description], 6)[:, shown]).all()
    ranking = finder.rank(week.memory_at(20), description)
    believed = {place.furniture: place.probability for place in ranking}
    np.testing.assert_allclose(history.belief[20], [believed[node] for node in shown])
    looks = [look for look in week.looks if look.furniture in shown]
    assert history.look_hour.tolist() == [2.0 * look.step for look in looks]
    assert history.is_found.tolist() == [description in look.seen for look in looks]


def test_no_such_home():
    with pytest.raises(ValueError, match="steps must be at least 1, got 0"):
        record_run(SampledSource(), 0)


def test_a_still_memory_tells_its_last_sightings():
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    shelf, sink = memory.add_furniture("shelf", kitchen), memory.add_furniture("sink", kitchen)
    memory.observe(shelf, [Sighting("mug"), Sighting("bowl")])
    memory.step(3)
    memory.observe(shelf, [Sighting("bowl")])
    memory.observe(sink, [])
    still = StillMemory(memory.copy(), "home.sgm")
    found = [(look.step, look.furniture, look.seen) for look in still.looks]
    assert found == [(0, shelf, ("mug",)), (3, shelf, ("bowl",)), (3, sink, ())]
    history = still.trace_object("mug", Finder(Bayesian()))
    assert "shelf in kitchen" in history.places
    assert history.is_found.tolist()[0]
    with pytest.raises(ValueError, match=r"step must be 3, got 0"):
        still.memory_at(0)


def test_searches_on_the_grid():
    pytest.importorskip("minigrid", reason="minigrid is not installed: extra igridson")
    from simulator.igridson.recorded_searches import record_searches

    replay = record_searches(12, seed=1)
    assert replay.num_steps == 12
    assert replay.plan.has_positions
    last = {question.step: question for question in replay.questions}
    looks = {step: sum(look.step == step for look in replay.looks) for step in last}
    for step, question in last.items():
        # A search ends when it is found, or after ten looks.
        assert question.is_right or looks[step] == 10


def test_work_and_memory_follow_the_lines_not_the_steps(log, monkeypatch):
    memory = SceneGraphMemory(path=log)
    shelf = memory.add_furniture("shelf", memory.add_room("hall"))
    for num_steps in (1, 2_000_000_000, 1, 1_000_000):
        memory.observe(shelf, [Sighting("mug"), Sighting(f"cup {memory.time}")])
        memory.step(num_steps)
    copied = []
    copy = SceneGraphMemory.copy
    monkeypatch.setattr(SceneGraphMemory, "copy", lambda own: copied.append(own) or copy(own))
    replay = PastMemory(read_events(log), "home")
    assert replay.num_steps == memory.time == 2_001_000_002
    assert replay.memory_at(replay.num_steps).to_dict() == memory.to_dict()
    assert not copied  # there was none to go on from
    middle = replay.memory_at(1_000_000_000)
    assert [seen.steps_ago for seen in middle.places_of("mug")] == [999_999_999]
    asked = replay.trace_object("mug", Finder(Bayesian()), num_points=9)
    assert asked.belief.shape == (9, 1)
    assert len(copied) <= 9  # one for each step that is asked about
    assert len(replay._memories) <= 2 + 9
    assert make_trace(read_events(log)).end_s == (2_000_000_002) * 3600


def test_a_robot_that_steps_every_second(log, monkeypatch):
    """Lines that let time pass alone cost nothing; of the others every 64th memory is kept."""
    content = MemoryContent.empty(PriorGraph.household().checksum)
    lines = [MemoryEvent("start", 0, {"clock": None, "layout": content.layout, "memory": content})]
    lines.append(MemoryEvent("room", 0, {"room": 0, "label": "hall"}))
    lines.append(
        MemoryEvent(
            "furniture",
            0,
            dict.fromkeys(("position", "description"), None)
            | {"furniture": 0, "room": 0, "label": "shelf"},
        )
    )
    for second in range(1, 30_001):
        lines.append(MemoryEvent("step", second, {"num_steps": 1}))
        if second % 100 == 0:
            seen = [(f"mug {second % 7}", "in", 1.0)]
            lines.append(
                MemoryEvent("look", second, {"furniture": 0, "coverage": 1.0, "seen": seen})
            )
    copied = []
    copy = SceneGraphMemory.copy
    monkeypatch.setattr(SceneGraphMemory, "copy", lambda own: copied.append(own) or copy(own))
    replay = PastMemory(lines, "home")
    assert replay.memory_at(30_000).last_seen("mug 5").time == 30_000
    assert len(copied) == 303 // 64
    assert replay.memory_at(29_999).last_seen("mug 5").time == 29_300
    assert len(copied) == 302 // 64 + 1


@pytest.mark.parametrize(
    ("time", "arguments"),
    [
        (3000000000, '{"num_steps": 3000000000}'),
        (5, '{"num_steps": 3000000000}'),
        (5, '{"num_steps": -1}'),
        (5, '{"num_steps": 1e9}'),
    ],
)
def test_more_steps_than_a_memory_has_are_refused(log, time, arguments):
    row = StoredEvent(2, time, "step", arguments, None)
    with pytest.raises(ValueError, match=r"event 2 of a memory file must be one .* got ValueError"):
        parse_rows([row], log)


def test_logs_that_end_after_all_time_are_refused(log):
    start = datetime(2026, 11, 16)
    for name, hour in (("first", start), ("second", start.replace(year=9000))):
        SceneGraphMemory(clock=Clock(hour, 60), path=log.with_name(name))
    with pytest.raises(
        ValueError, match=r"events must end by time step 2147483646, got 2147483647"
    ):
        PastMemory(read_both(log), "home")
    end = MemoryEvent("step", 10**9, {"num_steps": 10**9})
    with pytest.raises(ValueError, match="must be a date before the year 10000"):
        PastMemory([end], "home", clock=Clock(start))


def test_a_memory_that_goes_on_is_shown_as_it_was(log):
    memory = SceneGraphMemory(path=log)
    shelf = memory.add_furniture("shelf", memory.add_room("hall"))
    memory.observe(shelf, [Sighting("mug")])
    memory.step(2)
    memory = SceneGraphMemory.open(log)
    memory.step(3)
    memory.observe(shelf, [Sighting("plate")])
    replay = PastMemory(read_events(log), "home")
    assert replay.num_steps == 5
    assert replay.memory_at(4).descriptions == ("mug",)
    assert replay.memory_at(5).descriptions == memory.descriptions == ("mug", "plate")
