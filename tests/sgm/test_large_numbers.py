"""Whole numbers of which there is no float are refused in one line, or mean no limit."""

from datetime import datetime

import pytest

from sgm.eyes import Box, Detection, Gate, Intrinsics, LookRules, Pose
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Bayesian

HUGE = 10**400


@pytest.fixture
def memory():
    memory = SceneGraphMemory()
    memory.add_furniture("table", memory.add_room("kitchen"))
    return memory


@pytest.mark.parametrize(
    "call",
    [
        lambda m: Detection("mug", HUGE, box=(0, 0, 1, 1)),
        lambda m: Detection("mug", 0.5, box=(0, 0, 1, HUGE)),
        lambda m: Intrinsics(HUGE, 1, 1, 1, 10, 10),
        lambda m: Pose.look_at((0, 0, HUGE), (1, 1, 1)),
        lambda m: Pose.look_at((0, 0, 1), (1, 1, 1), position_sd=HUGE),
        lambda m: Gate(farthest=HUGE),
        lambda m: LookRules(margin=HUGE),
        lambda m: Box((0, 0, 0), (1, 1, HUGE)),
        lambda m: Sighting("mug", confidence=HUGE),
        lambda m: Sighting("mug", embedding=[HUGE]),
        lambda m: Clock(datetime(2026, 1, 1), HUGE),
        lambda m: m.step(HUGE),
        lambda m: m.observe(0, [], coverage=HUGE),
        lambda m: m.observe(HUGE, []),
        lambda m: m.add_furniture("desk", 0, position=(HUGE, 0)),
        lambda m: m.add_furniture("desk", 0, open_cost=HUGE),
        lambda m: m.move_furniture(0, 0, position=(0, HUGE)),
        lambda m: m.transform(HUGE, (0, 0)),
        lambda m: m.transform(0, (HUGE, 0)),
        lambda m: m.note_moved("mug", 0, by="anna", confidence=HUGE),
        lambda m: Finder(Bayesian()).search(m, "mug", start=(HUGE, 0)),
        lambda m: Finder(Bayesian()).search(m, "mug", budget=HUGE),
    ],
)
def test_it_is_refused_in_one_line(memory, call):
    with pytest.raises((ValueError, KeyError, TypeError)) as caught:
        call(memory)
    message = str(caught.value.args[0])
    assert " must " in message
    assert len(message) < 500
    assert memory.time == 0
