"""A look for one thing alone is a look for it: it counts, ages and is kept as one for it."""

import json

import numpy as np
import pytest

from sgm.arrays.table import make_table
from sgm.evidence.question import Question
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.lone_looks import LoneLooks, note_lone_look
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian, LastSeenUnlessAbsent
from sgm.replay.replay import replay
from sgm.schema import LONE_LOOKS, NUM_LOOKS_KEPT

DAY = 24
TABLE, COUNTER, DESK, SHELF = range(4)


def make_memory(**arguments):
    """Keys and a bowl on the table, where they were seen once."""
    memory = SceneGraphMemory(**arguments)
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    for label, room in (("table", kitchen), ("counter", kitchen), ("desk", study)):
        memory.add_furniture(label, room)
    memory.add_furniture("shelf", study)
    memory.observe(TABLE, [Sighting("keys"), Sighting("bowl")])
    return memory


def look_for_keys(memory, finder, how):
    """Look for the keys where they are thought to be, and find none; return where that was."""
    place = finder.rank(memory, "keys")[0].furniture
    if how == "note_absent":
        memory.note_absent(place, "keys")
    elif how == "search":
        search = finder.search(memory, "keys")
        assert search.next().place.furniture == place
        search.not_found()
    else:
        memory.observe(place, [Sighting("bowl")] if place == TABLE else [])
    return place


@pytest.mark.parametrize("policy", [Adaptive, Bayesian, LastSeenUnlessAbsent])
@pytest.mark.parametrize("how", ["note_absent", "search"])
def test_days_of_not_found_send_the_robot_elsewhere(policy, how):
    """All eight searches began at the table; looks at all of the place ended that."""
    firsts = {}
    for way in (how, "observe"):
        memory, finder = make_memory(), Finder(policy())
        firsts[way] = []
        for _ in range(8):
            memory.step(DAY)
            firsts[way].append(look_for_keys(memory, finder, way))
    assert len(set(firsts[how])) >= 3
    assert abs(firsts[how].count(TABLE) - firsts["observe"].count(TABLE)) <= 1


@pytest.mark.parametrize("policy", [Adaptive, Bayesian])
def test_what_is_believed_is_nearly_what_a_whole_look_says(policy):
    finder, beliefs = Finder(policy()), {}
    for whole in (False, True):
        memory = make_memory()
        beliefs[whole] = []
        for _ in range(8):
            memory.step(DAY)
            if whole:
                memory.observe(TABLE, [Sighting("bowl")])
            else:
                memory.note_absent(TABLE, "keys")
            places = {place.furniture: place.probability for place in finder.rank(memory, "keys")}
            beliefs[whole].append(places[TABLE])
    np.testing.assert_allclose(beliefs[False], beliefs[True], atol=0.03)
    assert beliefs[False][-1] < 0.05


def test_it_is_counted_as_a_look_for_the_thing():
    memory = make_memory()
    for _ in range(3):
        memory.step(DAY)
        memory.note_absent(TABLE, "keys")
    seen = memory.last_seen("keys")
    assert (seen.is_there, seen.times_seen, seen.times_looked) == (False, 1, 4)
    assert [event.kind for event in memory.history("keys")] == ["missed", "seen"]
    assert [(change.kind, change.thing) for change in memory.changes(1)] == [("gone", "keys")]
    memory.observe(TABLE, [Sighting("keys")])
    assert memory.last_seen("keys").is_there


def test_nothing_else_learns_of_it():
    """What is counted of others, and of the place, is as if there had been no look."""
    memory, other = make_memory(), make_memory()
    for day in range(6):
        for one in (memory, other):
            one.step(DAY)
        memory.note_absent(TABLE if day % 2 else COUNTER, "keys")
    assert memory.last_seen("bowl") == other.last_seen("bowl")
    assert memory.count_things()[COUNTER] == other.count_things()[COUNTER]
    np.testing.assert_array_equal(
        memory.batch.furniture_num_observed, other.batch.furniture_num_observed
    )
    finder = Finder(Adaptive())
    for thing in ("bowl", "plate"):
        pairs = zip(finder.rank(memory, thing), finder.rank(other, thing), strict=True)
        assert all(abs(a.probability - b.probability) < 0.05 for a, b in pairs)
        asked = memory.ask([thing])
        assert Question.gather(asked.batch, asked.queries).lone is None


def test_of_several_things_of_a_name_each_is_missed_and_of_an_id_that_one():
    memory = make_memory()
    memory.observe(SHELF, [Sighting("mug", id="7"), Sighting("mug", id="8")])
    memory.step()
    memory.note_absent(SHELF, "7")
    assert [memory.last_seen(number).is_there for number in ("7", "8")] == [False, True]
    memory.note_absent(SHELF, "mug")
    assert [memory.last_seen(number).is_there for number in ("7", "8")] == [False, False]


def test_what_was_merged_is_one_thing_that_is_missed():
    memory = make_memory()
    memory.observe(SHELF, [Sighting("cup", id="4"), Sighting("beaker", id="5")])
    memory.merge("4", "5")
    memory.step()
    memory.note_absent(SHELF, "cup")
    assert not memory.last_seen("cup").is_there
    memory.split("4")
    assert not memory.last_seen("beaker").is_there


def test_a_thing_that_was_never_seen_is_looked_for_over_days():
    """Each new step took the looks of the earlier ones for none."""
    memory, finder = make_memory(), Finder(Adaptive())
    first, elsewhere = finder.rank(memory, "passport")[0].furniture, []
    for _ in range(5):
        elsewhere.append(finder.rank(memory, "passport").elsewhere)
        for place in (TABLE, COUNTER, DESK, SHELF):
            memory.note_absent(place, "passport")
        memory.step()
    assert elsewhere == sorted(elsewhere)
    assert elsewhere[-1] > elsewhere[1] + 0.05
    assert "passport" not in memory.descriptions
    memory.observe(first, [Sighting("passport")])  # from now on these are looks for this thing
    memory.step()
    lone = memory.batch.find_lone_looks(np.array([memory.descriptions.index("passport")]))
    assert lone.num_looks.tolist() == [[5, 5, 5, 5]]
    assert memory.last_seen("passport").is_there


def live(memory):
    """Days with looks for known and unknown things, whole and in part, in a step and apart."""
    for day in range(12):
        memory.note_absent(day % 4, "keys", 0.4 + day % 2 / 2)
        memory.note_absent(day % 3, "passport")
        if day == 5:
            memory.observe(SHELF, [Sighting("passport"), Sighting("mug", id="7")])
            memory.note_absent(SHELF, "7")
            memory.note_absent(SHELF, "passport")
        if day == 8:
            memory.merge_furniture(TABLE, COUNTER)
            memory.add_furniture("sideboard", 0)
            return
        memory.step(DAY)


@pytest.mark.filterwarnings("error")
def test_it_is_kept_in_files_copies_and_logs(tmp_path):
    log = tmp_path / "looks.sgm"
    memory = make_memory(path=log)
    live(memory)
    memory.note_absent(DESK, "keys")
    memory.save(tmp_path / "home.sgm")
    *_, (replayed, line, _) = replay(read_events(log))  # and made the change of the last line
    assert line.kind == "absent"
    others = (SceneGraphMemory.load(tmp_path / "home.sgm"), memory.copy(), replayed)
    finder = Finder(Adaptive())
    for steps in (0, 3):
        memory.step(steps)
        for other in others:
            other.step(steps)
            assert json.dumps(other.to_dict()) == json.dumps(memory.to_dict())
            for thing in ("keys", "passport", "spoon"):
                assert finder.rank(other, thing) == finder.rank(memory, thing)


def test_looks_of_a_step_that_find_the_same_count_once():
    memory = make_memory()
    memory.step()
    for _ in range(50):
        memory.note_absent(TABLE, "keys")
    assert memory.last_seen("keys").times_looked == 2
    memory.observe(TABLE, [Sighting("keys")])  # it came back, and went
    memory.note_absent(TABLE, "keys")
    assert not memory.last_seen("keys").is_there


def test_the_hour_of_a_look_for_it_alone_counts_too():
    """Keys that are looked for at noon alone, and not found then, are out at noon."""
    from datetime import datetime

    def go_on(miss):
        memory = make_memory(clock=Clock(datetime(2026, 11, 16, 0), 3600))
        for _ in range(20):
            memory.step(8)
            memory.observe(TABLE, [Sighting("keys"), Sighting("bowl")])
            memory.step(4)
            miss(memory)
            memory.step(12)
        return Finder(Bayesian()).rank(memory, "keys", at=memory.time + 12).elsewhere

    apart = go_on(lambda memory: memory.note_absent(TABLE, "keys"))
    assert apart > go_on(lambda memory: None) + 0.01


def test_looks_are_gathered_by_hand():
    looks = make_table(LONE_LOOKS)
    for time, coverage in ((1, 0.3), (2, 0.3), (4, 1.0), (4, 1.0), (9, 0.2)):
        note_lone_look(looks, 5, 2, time, coverage)
    # .3 and .3 are one look, of step 2; those of step 4 are one; .2 is none yet.
    lone = LoneLooks.of(looks, np.array([5, 6, 5]), 3)
    assert lone.num_looks.tolist() == [[0, 0, 2], [0, 0, 0], [0, 0, 2]]
    assert lone.last.tolist() == [[-1, -1, 4], [-1, -1, -1], [-1, -1, 4]]
    times = np.full((3, 3, 2), -1, dtype=np.int32)
    times[:, 2] = [0, 3]
    assert lone.add_to(times)[:, 2].tolist() == [[3, 4], [0, 3], [3, 4]]
    assert LoneLooks.of(looks, np.array([6]), 3) is None


def test_of_many_looks_the_latest_are_kept_apart():
    looks = make_table(LONE_LOOKS)
    for time in range(30):
        note_lone_look(looks, 0, 0, time, 1.0)
    assert looks.num_rows == NUM_LOOKS_KEPT
    assert sorted(looks["time"].tolist()) == list(range(22, 30))
    assert LoneLooks.of(looks, np.array([0]), 1).num_looks.tolist() == [[30]]
