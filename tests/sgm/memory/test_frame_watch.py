"""A look for every frame of a camera: noticed once, and no harm to what is believed."""

import json
import warnings
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.look import MOST_LOOKS
from sgm.memory.memory_looks import LookPerFrameWarning
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.heuristics import Bayesian


def make_memory(clock=None, path=None):
    """A mug that was at the desk in six of ten steps, and on the shelf in the others."""
    memory = SceneGraphMemory(clock=clock, path=path)
    room = memory.add_room("study")
    desk, shelf = (memory.add_furniture(label, room) for label in ("desk", "shelf"))
    for number in range(10):
        there, other = (desk, shelf) if number % 5 < 3 else (shelf, desk)
        memory.observe(there, [Sighting("mug")])
        memory.observe(other, [])
        memory.step()
    return memory, desk, shelf


def tell_frames(memory, furniture, number, seen=()):
    for _ in range(number):
        memory.observe(furniture, list(seen))


def list_warnings(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return [str(one.message) for one in caught if one.category is LookPerFrameWarning]


def test_frames_of_one_step_are_told_once():
    memory, desk, shelf = make_memory()
    with pytest.warns(
        LookPerFrameWarning, match=r"looks must be few in a time step, got more than"
    ):
        tell_frames(memory, desk, MOST_LOOKS + 1)
    assert list_warnings(lambda: tell_frames(memory, shelf, 300)) == []  # once per memory
    other, desk, _ = make_memory()
    (told,) = list_warnings(lambda: tell_frames(other, desk, 300))
    assert "more than 10 at desk in study" in told
    assert "Join the frames of a visit to one look" in told


def test_a_warning_names_the_line_of_the_caller():
    memory, desk, _ = make_memory()
    with pytest.warns(LookPerFrameWarning) as caught:
        tell_frames(memory, desk, MOST_LOOKS + 1)
    assert caught[0].filename == __file__


@pytest.mark.filterwarnings("ignore::sgm.memory.memory_looks.LookPerFrameWarning")
@pytest.mark.parametrize("seen", [(), (Sighting("mug"),)])
def test_hundreds_of_frames_are_one_look(seen):
    """The counts of the desk were those of the frames for ever after."""
    beliefs = []
    for number in (MOST_LOOKS, 300):
        memory, desk, _ = make_memory()
        tell_frames(memory, desk, number, seen)
        memory.step(3)
        beliefs.append(
            [(p.furniture, p.probability) for p in Finder(Bayesian()).rank(memory, "mug")]
        )
        assert memory.batch.furniture_num_observed[0].tolist() == [10 + 1, 10]
    assert beliefs[0] == beliefs[1]


@pytest.mark.filterwarnings("ignore::sgm.memory.memory_looks.LookPerFrameWarning")
def test_what_a_late_frame_shows_is_remembered(tmp_path):
    memory, desk, _ = make_memory(path=tmp_path / "looks.sgm")
    tell_frames(memory, desk, 50)
    memory.observe(desk, [Sighting("keys"), Sighting("pen", confidence=0.3)])
    tell_frames(memory, desk, 50)
    memory.observe(desk, [Sighting("keys"), Sighting("keys"), Sighting("pen")])
    assert memory.last_seen("keys").times_seen == 1  # of one step
    assert memory.last_seen("pen").times_seen == 1
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    for one in (memory, copy):
        tell_frames(one, desk, 20)
        one.step()
    assert json.dumps(copy.to_dict()) == json.dumps(memory.to_dict())


@pytest.mark.parametrize("clock", [None, Clock(datetime(2026, 11, 16), step_seconds=0.1)])
def test_a_step_per_frame_is_noticed(clock):
    memory, desk, _ = make_memory(clock)

    def watch():
        for _ in range(120):
            memory.observe(desk, [Sighting("mug"), Sighting("pen")])
            memory.step()

    (told,) = list_warnings(watch)
    assert "looks must lie some time apart, got more than 100 in a row" in told
    assert ("of 0.1 s" in told) == (clock is not None)


def test_looks_of_a_day_are_no_frames():
    """A camera that watches a desk every ten minutes; a search that comes back four times."""
    memory, desk, shelf = make_memory(Clock(datetime(2026, 11, 16), step_seconds=600))

    def watch():
        for _ in range(144):
            memory.observe(desk, [Sighting("mug")])
            memory.step()
        for _ in range(4):
            memory.observe(desk, [])
            memory.observe(shelf, [])
        for _ in range(20):  # parts of a view
            memory.observe(shelf, [], coverage=0.2)

    assert list_warnings(watch) == []
