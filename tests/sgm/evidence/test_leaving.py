"""Which things have left the home: laws, and homes in which it is plain."""

import numpy as np
import pytest

from sgm.evidence.leaving import Leaving
from sgm.policies.adaptive import Adaptive
from simulator import SceneGraphMemory, Sighting
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout

THINGS = [f"{colour} mug" for colour in "red green blue white black grey brown pink".split()]


def live(leave: bool, steps: int = 40) -> tuple[SceneGraphMemory, list[int]]:
    """A home whose four places are looked at in turn; from step 20 on, half may be missing."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(label, room) for label in ("table", "shelf", "fridge", "bed")]
    for step in range(steps):
        here = [n for n in range(8) if n % 4 == step % 4 and not (leave and step >= 20 and n < 4)]
        memory.observe(places[step % 4], [Sighting(THINGS[n], relation="in") for n in here])
        memory.step()
    return memory, places


def compute(memory: SceneGraphMemory, names: list[str]) -> np.ndarray:
    asked = memory.ask(names)
    return Leaving(asked.batch).compute(asked.batch, asked.queries)


def test_what_is_nowhere_has_left_and_what_was_just_seen_has_not():
    memory, _ = live(leave=True)
    left = compute(memory, THINGS)
    assert (left[:4] > 0.9).all()
    assert (left[4:] < 0.1).all()
    assert compute(memory, ["piano"]) == 0  # never seen: not for the memory to say


def test_it_is_learnt_whether_things_leave_here():
    """The same thing, seen as long ago, and not looked for since."""
    left = []
    for leave in (True, False):
        memory, places = live(leave)
        memory.observe(places[0], [Sighting("green bottle", relation="in")])
        memory.step(24)
        left.append(compute(memory, ["green bottle"])[0])
    assert left[0] > 2 * left[1] > 0


def test_it_grows_with_time_and_survives_the_step():
    memory, _ = live(leave=True)
    before = compute(memory, THINGS)
    memory.step()
    after = compute(memory, THINGS)
    assert (after > before).all()
    assert after == pytest.approx(before, abs=0.05)


def test_many_homes_are_each_by_themselves(make_tiny_homes):
    """Shares are those of a home alone, and probabilities; more things than are learnt from."""
    rollout = Rollout(make_tiny_homes(3), Adaptive())
    for _ in predict_locations(rollout, 30):
        pass
    memory = rollout.memory
    _, queries = rollout.ask()
    together = Leaving(memory)
    assert together.weights.sum(axis=1) == pytest.approx(1)
    left = together.compute(memory, queries)
    assert ((left >= 0) & (left < 1)).all()
    only = memory.objects["home"] == 1
    assert only.any()
    seen = memory.objects["num_observed"]
    seen[~only] = 0  # nothing was seen in the other homes
    alone = Leaving(memory)
    np.testing.assert_allclose(alone.weights[1], together.weights[1])
    assert not np.allclose(alone.weights[0], together.weights[0])
    np.testing.assert_allclose(alone.weights[0], alone.weights[2])


def test_things_asked_for_are_followed_with_those_learnt_from():
    """In one call: the same weights and the same answers, to the bit; others are followed later."""
    memory, _ = live(leave=True)
    asked, others = memory.ask([*THINGS[:3], "piano"]), memory.ask(THINGS[2:])
    alone, together = Leaving(asked.batch), Leaving(asked.batch, asked.queries)
    np.testing.assert_array_equal(alone.weights, together.weights)
    for one in (asked, others):
        found = [own.compute(asked.batch, one.queries) for own in (alone, together)]
        np.testing.assert_array_equal(*found)
