"""Looks as tests of what had been said before them."""

from dataclasses import replace
from datetime import datetime, timedelta

import numpy as np
import pytest

from sgm.evidence.similar_moments import PastMoments, compare_moments
from sgm.finder.tested_looks import TestedLooks
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

MONDAY = datetime(2026, 1, 5)
THINGS = ("keys", "wallet", "phone")


def gather(memory, *things):
    """Return moments with one detector, which the memory counts anew with each look."""
    asked = memory.ask(things, before_looks=False)
    past = PastMoments.gather(asked.batch, asked.queries)
    return replace(past, detection=np.full(len(things), 0.9))


def list_seen(memory):
    return [name for name in THINGS if name in memory.descriptions]


@pytest.mark.parametrize("seed", range(4))
def test_they_say_what_the_memory_had_said_before_each_look(seed):
    """The oracle asks a robot's memory before each look, and sees what comes."""
    memory, rng = SceneGraphMemory(clock=Clock(MONDAY, 1800)), np.random.default_rng(seed)
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(f"shelf {number}", room) for number in range(3)]
    tests = []
    for day in range(14):
        for hour in np.sort(rng.choice(np.arange(6, 23), 4, replace=False)).tolist():
            memory.step_to(MONDAY + timedelta(days=day, hours=hour + 1))
            at = {thing: (day * number + hour // 8) % 4 for number, thing in enumerate(THINGS)}
            looked = rng.permutation(3)[: rng.integers(1, 4)].tolist()
            for thing in list_seen(memory):
                past = gather(memory, thing)
                said = compare_moments(past).join()[0][0]
                place = int(said.argmax())
                if place in looked:
                    tests.append((float(said[place]), at[thing] == place))
            for place in looked:
                seen = [thing for thing in THINGS if at[thing] == place]
                memory.observe(places[place], [Sighting(thing) for thing in seen])
    tested = TestedLooks(1000)
    tested.add(gather(memory, *THINGS))
    sure, right = tested.score()
    assert tested.num_looks == len(tests) > 30
    assert sure == pytest.approx(np.mean([said for said, _ in tests]), abs=1e-9)
    assert right == pytest.approx(np.mean([is_right for _, is_right in tests]))
    few = TestedLooks(20)
    for thing in THINGS:  # thing by thing is the same
        few.add(gather(memory, thing))
    few.score()
    assert few.num_looks == 20


def test_no_looks_say_nothing():
    tested = TestedLooks(10)
    assert np.isnan(tested.score()).all()
    assert tested.num_looks == 0
