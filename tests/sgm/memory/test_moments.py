"""Which of the latest moments at each place showed a thing."""

import sqlite3
from contextlib import closing
from datetime import datetime, timedelta

import numpy as np
import pytest

from sgm.memory.moments import MISSED, NUM_MOMENTS, SHOWN, Moments
from sgm.schema import NEVER
from simulator import Clock, SceneGraphMemory, Sighting

MONDAY = datetime(2026, 11, 16, 8)
DRESSER, SHELF = 0, 1


def make_home(step_seconds=600, clock=True):
    memory = SceneGraphMemory(clock=Clock(MONDAY, step_seconds) if clock else None)
    hall = memory.add_room("hall")
    for label in ("dresser", "shelf"):
        memory.add_furniture(label, hall)
    return memory


def look(memory, place, *things, **part):
    memory.observe(place, [Sighting(thing) for thing in things], **part)


def list_said(memory):
    """List for each thing and place the moments that say something, in order of time."""
    batch, said = memory.batch, {}
    moments, edges = batch.history.moments, batch.edges
    states = moments.get_states(np.arange(edges.num_rows))
    for row in range(edges.num_rows):
        place = int(edges["furniture"][row])
        times = moments.times[0, place]
        known = np.flatnonzero((states[row] > 0) & (times != NEVER))
        known = known[np.argsort(times[known])]
        thing = memory._state.things[int(edges["object"][row])].description
        pairs = zip(times[known].tolist(), states[row, known].tolist(), strict=True)
        if len(known):
            said[thing, place] = list(pairs)
    return said


def test_looks_of_half_an_hour_are_one_moment_by_the_clock():
    memory = make_home()  # steps of ten minutes from 8:00
    look(memory, DRESSER, "keys")  # step 0
    memory.step()
    look(memory, DRESSER)  # 8:10: the same moment, which showed them
    memory.step(2)
    look(memory, DRESSER)  # 8:30
    memory.step()
    look(memory, DRESSER, "keys")  # 8:40: the same moment showed them after all
    memory.step(2)
    look(memory, DRESSER)  # 9:00
    look(memory, SHELF)  # nothing was ever seen there
    assert list_said(memory) == {("keys", DRESSER): [(1, SHOWN), (4, SHOWN), (6, MISSED)]}


def test_looks_for_one_thing_and_hidden_ones_say_nothing_of_others():
    memory = make_home(3600)
    look(memory, DRESSER, "keys", "wallet")
    memory.step()
    memory.note_absent(DRESSER, "keys")
    memory.step()
    look(memory, DRESSER, hidden=["wallet"])
    memory.step()
    memory.note_moved("keys", DRESSER, "anna")  # no look
    assert list_said(memory) == {
        ("keys", DRESSER): [(0, SHOWN), (1, MISSED), (2, MISSED)],
        ("wallet", DRESSER): [(0, SHOWN)],
    }


def test_no_more_moments_are_kept_than_may_be_and_the_oldest_goes():
    memory = make_home(3600)
    look(memory, DRESSER, "keys", "wallet")
    for number in range(1, NUM_MOMENTS + 10):
        memory.step()
        look(memory, DRESSER, *(["keys"] if number % 3 == 0 else []))
    said = list_said(memory)
    first = 10
    expected = [
        (time, SHOWN if time % 3 == 0 else MISSED) for time in range(first, first + NUM_MOMENTS)
    ]
    assert said["keys", DRESSER] == expected
    assert {state for _, state in said["wallet", DRESSER]} == {MISSED}


def test_without_a_clock_nothing_is_kept_and_takes_no_memory():
    memory = make_home(clock=False)
    look(memory, DRESSER, "keys")
    moments = memory.batch.history.moments
    assert not moments.is_counted
    assert moments.times.strides == (0, 0, 0)
    assert not moments.get_states(np.arange(1)).any()


def live(memory, num_steps=40, seed=0):
    rng = np.random.default_rng(seed)
    for _ in range(num_steps):
        memory.step(int(rng.integers(1, 9)))
        for place in rng.permutation(2)[: rng.integers(1, 3)].tolist():
            names = np.array(["keys", "wallet", "phone"])[rng.random(3) < 0.5].tolist()
            look(memory, place, *names)
    return memory


def test_copies_files_and_replays_keep_them(tmp_path):
    memory = live(make_home())
    said = list_said(memory)
    memory.step()
    memory.save(tmp_path / "home.sgm")
    again, copied = SceneGraphMemory.load(tmp_path / "home.sgm"), memory.copy()
    for other in (again, copied):
        assert list_said(other) == said
    for each in (memory, again, copied):
        live(each, seed=1)
    assert list_said(again) == list_said(copied) == list_said(memory) != said
    data = memory.batch.history.moments.to_columns(_places(memory))
    read = Moments.from_columns(data, 2, memory.batch.edges.num_rows, memory.time)
    again = read.to_columns(_places(memory))
    assert again.keys() == data.keys()
    assert all(np.array_equal(again[name], column) for name, column in data.items())


def _places(memory):
    return memory.batch.edges["furniture"]


def test_places_that_are_one_have_the_moments_of_both():
    memory = make_home(3600)
    look(memory, DRESSER, "keys")
    memory.step()
    look(memory, SHELF, "wallet")
    memory.step()
    look(memory, DRESSER)
    look(memory, SHELF, "keys")
    memory.step()
    look(memory, SHELF)
    memory.merge_furniture(DRESSER, SHELF)
    assert list_said(memory) == {
        ("keys", DRESSER): [(0, SHOWN), (2, MISSED), (2, SHOWN), (3, MISSED)],
        ("wallet", DRESSER): [(1, SHOWN), (2, MISSED), (3, MISSED)],
    }


def test_things_that_are_one_have_the_moments_of_both():
    memory = make_home(3600)
    look(memory, DRESSER, "keys")
    memory.step()
    look(memory, DRESSER, "car keys")
    memory.step()
    look(memory, DRESSER)
    memory.merge("keys", "car keys")
    fused = memory.batch.fuse()
    assert fused.edges.num_rows == 1
    states = fused.history.moments.get_states(np.arange(1))[0]
    assert sorted(states[states > 0].tolist()) == [MISSED, SHOWN, SHOWN]


def test_what_is_removed_takes_its_moments_along():
    memory = make_home(3600)
    for thing in ("keys", "wallet"):
        look(memory, DRESSER, thing)
        look(memory, SHELF, thing)
        memory.step()
    said = list_said(memory)
    memory.remove_object("keys")
    assert list_said(memory) == {key: value for key, value in said.items() if key[0] == "wallet"}
    memory.remove_furniture(DRESSER)
    (only,) = list_said(memory).values()
    assert only == said["wallet", SHELF]
    memory.add_furniture("hook", 0)
    assert memory.batch.history.moments.times.shape[1] == 2


@pytest.mark.parametrize(
    "change",
    [
        {"num_times": [1]},
        {"num_times": [2, 0]},
        {"num_times": [-1, 2]},
        {"num_times": [2, 0], "times": [1, 0]},
        {"num_times": [NUM_MOMENTS + 1, 0], "times": list(range(NUM_MOMENTS + 1))},
        {"times": [-1]},
        {"times": [10_001]},
        {"times": [0.5]},
        {"num_runs": [2]},
        {"num_runs": [1, 1]},
        {"runs": [3 * NUM_MOMENTS + 3]},
        {"runs": [3 * NUM_MOMENTS - 3 + SHOWN]},
        {"runs": [0.5]},
        {"runs": [-3]},
    ],
)
def test_moments_that_fit_no_home_are_refused(change):
    data = {
        "num_times": [1, 0],
        "times": [4],
        "num_runs": [1],
        "runs": [3 * NUM_MOMENTS + SHOWN],
    }
    read = Moments.from_columns(data, 2, 1, 10_000)
    assert read.states.tolist() == [[SHOWN] * NUM_MOMENTS]
    with pytest.raises(ValueError, match="moments"):
        Moments.from_columns(data | change, 2, 1, 10_000)


@pytest.mark.slow
def test_the_file_is_at_most_a_fifth_larger(tmp_path):
    """Of a home that a robot has lived in for a month, three looks each half hour."""
    memory, rng = make_home(1800), np.random.default_rng(0)
    for number in range(10):
        memory.add_furniture(f"shelf {number}", 0)
    at = rng.integers(0, 12, 40)
    memory_start = memory.clock.start
    for step in range(0, 30 * 48, 2):
        memory.step_to(memory_start + timedelta(seconds=1800 * (step + 1)))
        at[rng.integers(0, 40, 2)] = rng.integers(0, 12, 2)
        for place in rng.permutation(12)[:3].tolist():
            look(memory, place, *(f"thing {n}" for n in np.flatnonzero(at == place)))
    path = tmp_path / "home.sgm"
    memory.save(path)
    everything = path.stat().st_size
    with closing(sqlite3.connect(path)) as file:
        (moments,) = file.execute(
            "SELECT sum(length(numbers)) FROM snapshot_arrays WHERE name GLOB 'moments.*'"
        ).fetchone()
    assert moments < 0.2 * (everything - moments), (moments, everything)
