"""Time of a live memory passes by stamps, questions and nights; what is in view is an answer."""

from collections import deque
from datetime import datetime, timedelta
from types import SimpleNamespace as Message

import numpy as np
import pytest

from sgm import Bayesian, Clock, Finder, SceneGraphMemory
from sgm.eyes import FurnitureMapper, Pose
from sgm.memory.memory_event import read_events
from sgm.replay.replay import replay
from sgm.ros import HomeMap, LiveMemory
from tests.sgm.eyes.scenes import CAMERA, FLOOR, TABLE, look_around, put_on, render
from tests.sgm.ros.messages import (
    make_camera_info,
    make_depth,
    make_detections,
    make_quaternion,
    make_transform,
)
from tests.sgm.ros.test_feed import MAP, find_box, play

MUG = put_on(TABLE, 0.1, 0.3)
POSES = look_around(TABLE.center)[:8]
TURN = [(np.cos(angle), np.sin(angle), -0.2) for angle in np.linspace(0.2, 3.0, 18)]  # ahead
START = datetime(2026, 11, 16, 20, 0).timestamp()
DAY = 86400.0


class Wall:
    """A clock on the wall, which stands until it is set."""

    def __init__(self, now=START):
        self.now = now

    def __call__(self):
        return self.now


def make(memory=None, wall=None, **options):
    if memory is None:
        memory = SceneGraphMemory()
        HomeMap.from_values(MAP).add_to(memory)
    said = []
    wall = Wall() if wall is None else wall
    live = LiveMemory(memory, Finder(Bayesian()), now=wall, on_warning=said.append, **options)
    return live, wall, said


def look(live, wall, start, things=(("mug", MUG),)):
    """Look at the table for 1.4 s, with a right clock, and end the visit."""
    wall.now = start
    play(live.feed, POSES, things, start=start)
    live.finish()


def show(live, wall, time, things=(("mug", MUG),), pose=POSES[0]):
    """Show one frame, whose visit goes on."""
    wall.now = time
    bodies = [body for _, body in things]
    live.feed.take_camera(make_camera_info(CAMERA))
    turn = make_quaternion(pose.rotation)
    transform = make_transform(time, "map", "camera", pose.position, turn)
    live.feed.take_transforms(Message(transforms=[transform]))
    live.feed.take_depth(make_depth(time, render([TABLE, FLOOR, *bodies], pose)))
    rows = [(name, 0.9, find_box(body, pose)) for name, body in things]
    live.feed.take_detections(make_detections(time, rows))


def test_the_clock_begins_with_the_first_stamp_and_its_log_replays(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "looks.sgm")
    HomeMap.from_values(MAP).add_to(memory)
    live, wall, said = make(memory)
    look(live, wall, START)
    assert memory.clock is not None
    assert timedelta(0) <= memory.clock.start - datetime.fromtimestamp(START) < timedelta(seconds=5)
    assert memory.clock.step_seconds == 600
    look(live, wall, START + 3600)
    assert (memory.time, said) == (6, [])
    ((again, *_),) = deque(replay(read_events(tmp_path / "looks.sgm")), maxlen=1)
    assert again.clock == memory.clock
    memory.save(tmp_path / "home.sgm")
    assert SceneGraphMemory.load(tmp_path / "home.sgm").clock == memory.clock
    with pytest.raises(ValueError, match="memory must have no clock to get one, got Clock"):
        memory.start_clock(Clock(datetime(2026, 1, 1)))


def test_a_clock_of_a_memory_in_use_begins_at_its_present():
    live, wall, _ = make()
    live.memory.step(7)
    look(live, wall, START)
    assert live.memory.time == 7
    assert live.memory.clock.get_time(7) == pytest.approx(
        datetime.fromtimestamp(START), abs=timedelta(seconds=5)
    )
    known = Clock(datetime.fromtimestamp(START - 7200), 3600)
    memory = SceneGraphMemory(clock=known)
    HomeMap.from_values(MAP).add_to(memory)
    live, wall, said = make(memory, step_seconds=600)
    look(live, wall, START)
    assert (memory.clock, memory.time, said) == (known, 2, [])  # its own steps


def test_stamps_of_a_simulation_make_steps_without_a_date():
    live, wall, _ = make(local_time=lambda stamp: None)
    look(live, wall, 100.0)
    look(live, wall, 100.0 + 1500)
    assert (live.memory.time, live.memory.clock) == (2, None)


def test_a_quiet_night_is_a_night():
    """No frame comes from 20:00 to 7:00, 66 steps; the question comes at 7:00."""
    live, wall, said = make()
    look(live, wall, START)
    wall.now = START + 11 * 3600
    seen = live.rank("mug")[0].last_seen
    assert (live.memory.time, seen.steps_ago) == (66, 66)
    assert "yesterday at 20:00" in str(live.rank("mug"))
    wall.now += 600
    live.find_next("mug")
    wall.now += 600
    live.list_markers("mug")
    assert (live.memory.time, said) == (68, [])


@pytest.mark.parametrize("asks_first", [False, True])
def test_a_memory_that_was_off_for_a_week_has_a_week_behind_it(tmp_path, asks_first):
    live, wall, _ = make()
    look(live, wall, START)
    live.memory.save(tmp_path / "home.sgm")
    later = START + 7 * DAY
    live, wall, said = make(SceneGraphMemory.load(tmp_path / "home.sgm"), Wall(later))
    if asks_first:  # before any message has come
        assert live.rank("mug")[0].last_seen.steps_ago == 1008
    look(live, wall, later, things=())
    assert (live.memory.time, said) == (1008, [])
    assert live.memory.last_seen("mug").is_there is False


def test_a_question_before_the_clock_is_set_takes_no_time_from_it(tmp_path):
    """The clock of a simulation says 0 until it begins, that of a small machine 1970."""
    live, wall, _ = make()
    look(live, wall, START)
    live.memory.save(tmp_path / "home.sgm")
    live, wall, said = make(SceneGraphMemory.load(tmp_path / "home.sgm"), Wall(0.0))
    assert live.rank("mug")[0].last_seen.steps_ago == 0
    wall.now = START + 66 * 600
    assert live.rank("mug")[0].last_seen.steps_ago == 66
    look(live, wall, START + 67 * 600, things=())
    assert (live.memory.time, said) == (67, [])


def test_messages_of_another_clock_than_that_on_the_wall_are_right():
    """A recording of last year is played: its stamps count, and what has passed since."""
    live, wall, said = make()
    play(live.feed, POSES, [("mug", MUG)], start=START - 365 * DAY)
    live.finish()
    assert live.memory.clock.start.year == 2025
    wall.now += 1300
    live.rank("mug")
    assert (live.memory.time, said) == (2, [])


def test_one_wrong_reading_of_the_clock_does_not_stop_time():
    """20 days ahead before the time server was reached, then right: three days of looks."""
    live, wall, said = make()
    look(live, wall, START + 20 * DAY)
    look(live, wall, START)
    assert len(said) == 1
    assert "the clock of the messages went back: it says 2026-11-16T20:00" in said[0]
    assert "20 days, 0:00:01 before the time of the memory" in said[0]
    assert live.feed.counts["times that the clock was set back"] == 1
    for day in (1, 2, 3):
        before = live.memory.time
        look(live, wall, START + day * DAY, things=())
        assert live.memory.time - before == pytest.approx(144, abs=1)
    assert live.memory.last_seen("mug").is_there is False
    assert len(said) == 1


def test_a_restart_after_a_wrong_clock_goes_on_from_where_it_was(tmp_path):
    live, wall, _ = make()
    look(live, wall, START)
    look(live, wall, START + 20 * DAY)
    live.memory.save(tmp_path / "home.sgm")
    live, wall, said = make(SceneGraphMemory.load(tmp_path / "home.sgm"), Wall(START + 1000))
    before = live.memory.time
    live.rank("mug")
    look(live, wall, START + 1000)
    look(live, wall, START + 1000 + DAY)
    assert live.memory.time - before == pytest.approx(144, abs=1)
    assert len(said) == 1


def test_more_than_a_month_must_be_said_to_be_right(tmp_path):
    live, wall, _ = make()
    look(live, wall, START)
    live.memory.save(tmp_path / "home.sgm")
    later = START + 60 * DAY
    live, wall, said = make(SceneGraphMemory.load(tmp_path / "home.sgm"), Wall(later))
    look(live, wall, later)
    assert live.memory.time == 0
    assert "was set ahead: it says 2027-01-15T20:00" in said[0]
    assert "More than 31 days are not believed" in said[0]
    look(live, wall, later + 1300)
    assert live.memory.time == 2
    for asks_first in (True, False):
        memory = SceneGraphMemory.load(tmp_path / "home.sgm")
        live, wall, said = make(memory, Wall(later), accept_jump=True)
        if asks_first:
            live.rank("mug")
        look(live, wall, later)
        assert (live.memory.time, said) == (60 * 144, [])


@pytest.mark.parametrize("days", [0.1, 20, 60])
def test_a_stamp_ahead_moves_no_memory(days, tmp_path):
    """The clock of the machine, or of one message alone, is ahead for a moment."""
    for is_of_machine in (True, False):
        memory = SceneGraphMemory(path=(path := tmp_path / f"{is_of_machine}.sgm"))
        HomeMap.from_values(MAP).add_to(memory)
        even = [0.0]
        live, wall, said = make(memory, monotonic=lambda even=even: even[0])
        look(live, wall, START)
        for passed in (60, 120):
            even[0] = passed
            play(live.feed, POSES, [("mug", MUG)], start=START + passed + days * DAY)
            wall.now = START + passed + days * DAY * is_of_machine
            live.rank("mug")
            live.finish()
        assert (live.memory.time, len(said)) == (0, 1)
        assert "the clock of the messages was set ahead: it says 20" in said[0]
        even[0] = 3600
        look(live, wall, START + 3600, things=())
        assert (live.memory.time, len(said)) == (6, 1)
        assert not live.memory.last_seen("mug").is_there
        walls = [event.values["wall"] for event in read_events(path) if "wall" in event.values]
        assert len(walls) == 1
        ((again, *_),) = deque(replay(read_events(path)), maxlen=1)
        assert again.to_dict() == memory.to_dict()


def test_a_night_in_which_the_machine_slept_is_believed_after_a_step():
    even = [0.0]
    live, wall, said = make(monotonic=lambda: even[0])
    look(live, wall, START)
    for passed in (60, 300, 700):
        even[0] = passed
        look(live, wall, START + 11 * 3600 + passed)
    assert (live.memory.time, len(said)) == (67, 1)
    assert live.memory.last_seen("mug").steps_ago == 0


@pytest.mark.parametrize("now", [START, 100.0, START + 300 * DAY])
def test_a_recording_is_played_at_any_rate_with_gaps_and_again(now):
    """Its stamps count, whatever the clock of the machine says meanwhile."""
    live, _, said = make(wall=Wall(now), monotonic=lambda: 0.0)
    first = START - 100 * DAY
    for number in range(4):
        play(live.feed, POSES, [("mug", MUG)], start=first + number * 4000)
        live.finish()
    assert (live.memory.time, said) == (20, [])
    play(live.feed, POSES, start=first)  # it begins anew
    live.finish()
    before = live.memory.time
    for number in range(1, 4):
        play(live.feed, POSES, start=first + number * 4000)
        live.finish()
    assert (before, live.memory.time, len(said)) == (20, 40, 1)
    assert "the clock of the messages went back" in said[0]
    assert not live.memory.last_seen("mug").is_there


def test_a_short_recording_that_is_played_again_and_again_lets_time_pass():
    live, _, _ = make()
    for _ in range(12):
        for number in range(5):
            play(live.feed, POSES, start=START - 100 * DAY + number * 60)
        live.finish()
    assert live.memory.time >= 3  # twelve times four minutes


def test_what_is_in_view_now_is_an_answer():
    live, wall, _ = make()
    for number in range(5):
        show(live, wall, START + 0.2 * number)
    answer = live.rank("the mug")
    assert answer[0].probability > 0.9
    assert answer[0].evidence.is_in_view
    assert "in view now at 2.11, 0.3, 0.75" in str(answer)
    assert ", in view now, at 2.11, 0.3, 0.75" in live.find_next("mug").outcome
    assert live.list_markers("mug")[0].probability == answer[0].probability
    assert live.memory.last_seen("mug") is None  # the visit goes on
    before = str(live.rank("mug"))
    assert str(live.rank("mug")) == before  # asking is no look
    for number in range(5, 10):
        show(live, wall, START + 0.2 * number)
    live.finish()
    assert live.memory.last_seen("mug").times_looked == 1
    assert not live.rank("mug")[0].evidence.is_in_view


def test_a_thing_on_furniture_that_is_not_drawn_yet_is_in_view_now():
    """Where no map is known: it lies at a spot, and on the table when that is drawn."""
    memory = SceneGraphMemory()
    live, wall, _ = make(memory, discover=FurnitureMapper(memory))
    things, poses = (("mug", MUG), ("table", TABLE)), look_around(TABLE.center, num=30)
    for number in range(4):
        show(live, wall, START + 0.2 * number, things, poses[number])
    answer = live.rank("mug")
    assert answer[0].evidence.is_in_view
    assert answer[0].position == pytest.approx(MUG.center, abs=0.05)
    assert "in view now" in live.find_next("mug").outcome
    assert str(live.rank("mug")) == str(answer)  # asking is no look
    for number in range(4, 8):  # and not where the camera has turned away
        show(live, wall, START + 2 + 0.2 * number, (("table", TABLE),), poses[number])
    for number in range(8, 30):
        show(live, wall, START + 2 + 0.2 * number, things, poses[number])
    live.finish()
    assert live.rank("mug")[0].name.startswith("table")
    assert memory.resolve("mug").matches == ("mug",)
    assert len(memory.ask(["mug"]).rows) == 1


def test_a_thing_that_was_in_view_is_no_more_when_it_gets_a_spot():
    memory = SceneGraphMemory()
    live, wall, _ = make(memory, discover=FurnitureMapper(memory))
    for number in range(4):
        show(live, wall, START + 0.2 * number)
    turned = [Pose.look_at(POSES[3].position, POSES[3].position + ahead) for ahead in TURN]
    for number, pose in enumerate(turned, 4):  # the mug goes out of the image
        show(live, wall, START + 0.2 * number, (), pose)
    answer = live.rank("mug")
    assert answer[0].last_seen.is_there
    assert not answer[0].evidence.is_in_view


def test_that_a_thing_has_left_is_seen_at_once():
    live, wall, _ = make()
    look(live, wall, START)
    for number in range(8):
        show(live, wall, START + 3600 + 0.2 * number, things=(), pose=POSES[number])
    answer = live.rank("mug")
    assert "in view now" not in str(answer)
    assert answer[0].last_seen.is_there is False
    assert live.memory.last_seen("mug").is_there


def test_a_camera_that_is_off_shows_nothing():
    live, wall, _ = make()
    for number in range(5):
        show(live, wall, START + 0.2 * number)
    wall.now += 3600
    answer = live.rank("mug")
    assert not answer[0].evidence.is_in_view
    assert (live.memory.time, answer[0].last_seen.steps_ago) == (6, 6)
    assert live.memory.last_seen("mug").is_there
