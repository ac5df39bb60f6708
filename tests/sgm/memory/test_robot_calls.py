"""What a robot tells and asks beside looks: positions, moved furniture, dates, tables."""

import math
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting, read_relation
from sgm.policies.heuristics import Bayesian
from sgm.prior.prior_graph import PriorGraph


@pytest.fixture
def memory():
    memory = SceneGraphMemory(PriorGraph.default(), Clock(datetime(2026, 11, 20, 8), 600))
    kitchen, study = memory.add_room("kitchen"), memory.add_room("study")
    fridge = memory.add_furniture("fridge", kitchen, position=(0, 4))
    memory.add_furniture("counter top", kitchen, position=(3, 0))
    memory.add_furniture("desk", study, position=(3, 4))
    memory.observe(fridge, [Sighting("milk", "IN")])
    return memory


def test_time_as_a_date(memory):
    memory.step_to(datetime(2026, 11, 20, 9, 5))  # 65 minutes: six whole steps of ten
    assert memory.time == 6
    memory.step_to(datetime(2026, 11, 20, 9, 10))
    assert memory.time == 7
    with pytest.raises(ValueError, match=r"must not be before .*, got 2026-11-20 08:00:00 at 2026"):
        memory.step_to(datetime(2026, 11, 20, 8))
    with pytest.raises(ValueError, match=r"must have a clock for a date and time, got none"):
        SceneGraphMemory().step_to(datetime(2026, 11, 20))


def test_moved_furniture_keeps_its_history(memory, tmp_path):
    memory.step()
    memory.move_furniture(0, room=1, position=(6, 6))
    assert memory.describe(0) == "fridge in study"
    assert memory.list_furniture(1) == (0, 2)
    assert memory.last_seen("milk").furniture == 0
    assert Finder(Bayesian()).rank(memory, "milk")[0].furniture == 0
    memory.save(tmp_path / "home.sgm")
    copy = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert copy.get_position(0) == (6, 6)
    assert copy.describe(0) == "fridge in study"
    memory.move_furniture(2, room=0)
    assert memory.get_position(2) is None
    for bad, message in ((dict(room=7), "room must be an id"), (dict(position=1), "two numbers")):
        with pytest.raises((KeyError, ValueError), match=message):
            memory.move_furniture(0, **bad)
    with pytest.raises(ValueError, match=r"position must be two numbers, got \(1, nan\)"):
        memory.add_furniture("sofa", 0, position=(1, math.nan))


def test_a_position_of_an_answer_is_taken_back(memory):
    """Answers have three numbers: they are where a place is put, and where a search starts."""
    plan = Finder(Bayesian()).search_plan(memory, "milk", start=(6, 1))
    position = plan.looks[0].position
    assert len(position) == 3
    stool = memory.add_furniture("stool", 0, position=position)
    assert memory.get_position(stool) == position[:2]
    memory.move_furniture(stool, position=(1, 2, 0.5))
    assert memory.get_position(stool) == (1, 2)
    memory.remove_furniture(stool)
    again = Finder(Bayesian()).search_plan(memory, "milk", start=(6, 1, 0.7))
    assert (
        again.expected_cost
        == Finder(Bayesian()).search_plan(memory, "milk", start=(6, 1)).expected_cost
    )
    before = memory.get_position(0)
    memory.transform(shift=(1, 0, 0.0))
    assert memory.get_position(0) == (before[0] + 1, before[1])


def test_positions_stand_for_distances(memory):
    plan = Finder(Bayesian()).search_plan(memory, "milk", start=(0, 0))
    # The fridge is 4 m away and has the milk; then 3 m to the desk or 5 m to the counter.
    assert [look.cost for look in plan][:2] == [5.0, 4.0]
    other = Finder(Bayesian()).search(memory, "scissors", start=2)
    assert other.next().place.furniture == 2
    memory.move_furniture(2, room=0)  # no position any more: only looks cost
    assert [look.cost for look in Finder(Bayesian()).search_plan(memory, "milk")] == [1, 1, 1]


def test_a_closed_room_is_left_out(memory):
    closed = memory.list_furniture(0)
    places = Finder(Bayesian()).rank(memory, "milk", exclude=closed)
    assert [place.furniture for place in places] == [2]
    with pytest.raises(KeyError, match="room must be an id from add_room, got 9"):
        memory.list_furniture(9)


def test_a_table_of_what_was_seen(memory):
    pandas = pytest.importorskip("pandas", reason="pandas is not installed: extra frame")
    frame = memory.to_frame()
    assert isinstance(frame, pandas.DataFrame)
    row = dict(object="milk", relation="in", furniture="fridge", room="kitchen", is_there=True)
    row |= dict(last_seen=0, times_seen=1, times_looked=1)
    assert frame.to_dict("records") == [row | dict(x=0, y=4, z=0)]
    memory.move_furniture(0, room=1)  # where there, is not known
    row |= dict(room=memory.layout.rooms[1].label)
    assert memory.to_frame().to_dict("records") == [row | dict(x=None, y=None, z=None)]
    memory.observe(0, [Sighting("milk", "in", position=(1.5, 2, 0.9))])
    assert memory.to_frame()[[*"xyz"]].to_numpy().tolist() == [[1.5, 2, 0.9]]


@pytest.mark.parametrize(
    ("written", "read"),
    [("IN", "in"), ("Inside", "in"), ("on top", "onTop"), ("ON", "onTop"), ("ontop", "onTop")],
)
def test_relations_in_any_case(written, read):
    assert Sighting("milk", written).relation == read_relation(written) == read


def test_other_relations_are_refused():
    with pytest.raises(ValueError, match="relation must be one of in, onTop, got 'under'"):
        Sighting("milk", "under")
    with pytest.raises(ValueError, match="got None"):
        Sighting("milk", None)


def test_questions_of_one_state_do_not_disturb_each_other(memory):
    """They read one copy of the memory: what a question adds to it is in no other."""
    finder, plain = Finder(Bayesian()), Finder(Bayesian())
    memory.observe(2, [Sighting("scissors")])
    alone = memory.copy()
    for name in ("gizmo", "milk", "purple widget", "scissors"):
        asked = memory.ask([name], miss_rate=0.5)
        assert asked.queries.miss_rate == 0.5
        assert asked.batch.history.counters["num_asked"][0] == 0
        assert asked.queries.more_asked.tolist() == [1]  # this one
        assert str(finder.rank(memory, name)) == str(plain.rank(alone.copy(), name))
    assert memory.descriptions == alone.descriptions
    memory.observe(0, [])  # and it is as it was when it was asked
    assert asked.current.time == 0
    assert asked.current.furniture_num_observed.sum() == 2
