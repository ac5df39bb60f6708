"""What a robot's looks of one home are worth there: the questions, and how answers are measured."""

import numpy as np
import pytest

from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from tools.bench.robot_life import RobotLife


@pytest.fixture(scope="module")
def life():
    rules = HomeConfig(
        furniture_per_room=2,
        objects_per_furniture=2,
        dynamics=RoutineDynamics(),
        looks="random",
        looks_per_step=2,
    )
    return RobotLife.record(SampledSource(None, rules), 12, 24, home=1, seed=5)


def test_questions_are_about_what_is_there_half_of_them_about_what_moved(life):
    truth = life.run.truth
    asked = list(life.ask(40, 0.5))
    assert len(asked) == 24 * 40
    num_moved = num_steps = 0
    for one in asked:
        step = one.memory.time
        assert step > 12
        ids = one.memory.furniture_ids
        found = truth.find([one.description], len(ids))
        assert {ids[place] for place in np.flatnonzero(found[step])} == one.places
        any_moved = (truth.furniture[step] != truth.furniture[step - 1])[
            truth.furniture[step] >= 0
        ].any()
        num_steps += any_moved
        num_moved += any_moved and (found[step] != found[step - 1]).any()
    assert num_steps > 200
    # half of them, and by chance some more; two of a kind may have changed places
    assert 0.4 < num_moved / num_steps < 0.75
    again = [(one.memory.time, one.description) for one in life.ask(40, 0.5)]
    assert again == [(one.memory.time, one.description) for one in asked]


def test_of_questions_about_anything_few_are_about_what_moved(life):
    truth, num_moved = life.run.truth, 0
    asked = list(life.ask(40, 0.0))
    for one in asked:
        found = truth.find([one.description], len(one.memory.furniture_ids))
        num_moved += (found[one.memory.time] != found[one.memory.time - 1]).any()
    there = truth.furniture[13:] >= 0
    share = ((truth.furniture[13:] != truth.furniture[12:-1]) & there).sum() / there.sum()
    assert num_moved / len(asked) == pytest.approx(share, abs=0.05)
