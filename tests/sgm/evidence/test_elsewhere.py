"""Things at no known place: by hand, and homes in which it is plain."""

from datetime import datetime, timedelta
from functools import cache

import numpy as np
import pytest

from sgm.belief import Detector
from sgm.evidence.elsewhere import compute_elsewhere, compute_out
from sgm.evidence.question import Question
from sgm.finder.finder import Finder
from sgm.finder.object_finder import ObjectFinder
from sgm.memory.clock import Clock
from sgm.policies import Adaptive, Bayesian, Frequentist, Myopic, Priors
from sgm.prior.prior_graph import PriorGraph
from simulator import SceneGraphMemory, Sighting
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams

THINGS = [f"{colour} mug" for colour in "red green blue white black grey brown pink".split()]
START = datetime(2026, 11, 9, 6)  # a Monday
STEP = 1800


def live(thing="car keys", days=9, until=7.0, clock=True):
    """A home whose keys leave at 8:30 on working days and are back at 17:30.

    Everything is looked at every half hour from six to eleven.
    """
    memory = SceneGraphMemory(clock=Clock(START, STEP) if clock else None)
    hall, kitchen = memory.add_room("hall"), memory.add_room("kitchen")
    dresser = memory.add_furniture("dresser", hall)
    counter, shelf = (memory.add_furniture(label, kitchen) for label in ("counter", "shelf"))
    while True:
        now = START + memory.time * timedelta(seconds=STEP)
        hour = now.hour + now.minute / 60
        if (now - START).days >= days - 1 and hour >= until and hour >= 6:
            return memory
        if 6 <= hour < 23:
            is_out = now.weekday() < 5 and 8.5 <= hour < 17.5
            memory.observe(dresser, [] if is_out else [Sighting(thing)])
            memory.observe(counter, [Sighting("kettle"), Sighting("mug")])
            memory.observe(shelf, [Sighting("book")])
        memory.step()


@pytest.fixture(scope="module")
def memory():
    return live()  # until Tuesday of the second week, 7:00, after six working days


def say(finder, memory, thing, hour, minute, day=17):
    at = datetime(2026, 11, day, hour, minute)
    return finder.rank(memory, thing, at=at).elsewhere


@pytest.mark.parametrize("make", [lambda: Finder(Bayesian()), lambda: Finder(Adaptive())])
def test_keys_are_out_on_working_mornings_and_back_in_the_evening(memory, make):
    finder = make()
    assert say(finder, memory, "car keys", 9, 50) > 0.75
    assert say(finder, memory, "car keys", 13, 0) > 0.85
    assert say(finder, memory, "car keys", 20, 0) < 0.1
    assert say(finder, memory, "car keys", 9, 50, day=21) < 0.3  # a Saturday
    assert finder.rank(memory, "car keys").elsewhere < 0.1  # seen an hour ago, at six
    for thing in ("kettle", "mug", "book"):
        assert say(finder, memory, thing, 9, 50) < 0.05


def test_the_network_knows_working_mornings_too(memory):
    """Less surely than the rule: that is at least .75 sure in the morning."""
    finder = ObjectFinder.load()
    morning, noon, evening, saturday = (
        say(finder, memory, "car keys", *when) for when in ((9, 50), (13, 0), (20, 0), (9, 50, 21))
    )
    assert min(morning, noon) > 0.5
    assert max(evening, saturday) < 0.3
    for thing in ("kettle", "mug", "book"):
        assert say(finder, memory, thing, 9, 50) < 0.05


def test_it_is_learnt_and_no_matter_of_names():
    memory = live("red thing")
    assert say(Finder(Bayesian()), memory, "red thing", 9, 50) > 0.75


@pytest.mark.slow
def test_a_negative_look_says_more_where_it_goes_out(memory):
    """Not at its place at nine on a working day: out. At seven in the evening: left, or moved."""
    said = {}
    for hour in (9, 19):
        later = live(until=8.0)  # Tuesday, seen at half past seven
        now = START + later.time * timedelta(seconds=STEP)
        later.step((hour - now.hour) * 2)
        for furniture in later.furniture_ids:
            later.observe(furniture, [])
        later.step()
        said[hour] = Finder(Bayesian()).rank(later, "car keys").elsewhere
    assert said[9] > 0.9
    assert said[9] > said[19]


def ask(memory, *names):
    asked = memory.ask(names)
    return compute_elsewhere(asked.batch, asked.queries)


def test_never_seen_by_hand():
    """Two looks at each of three places, whose miss rate was not counted: .2.

    .2 (1.8 + 1) / (9 + 1) of what is in the home is missed; a tenth was elsewhere before.
    """
    memory = SceneGraphMemory()
    room = memory.add_room("study")
    places = [memory.add_furniture(label, room) for label in ("desk", "shelf", "sofa")]
    assert ask(memory, "piano") == pytest.approx(0.1)
    for _ in range(2):
        for place in places:
            memory.observe(place, [])
        memory.step()
    missed = 0.2 * 0.28
    assert ask(memory, "piano") == pytest.approx(0.1 / (0.1 + 0.9 * missed))


def test_last_seen_by_hand():
    """Nine steps of an hour ago; it was not looked for since, so that only time tells."""
    memory = SceneGraphMemory()
    desk = memory.add_furniture("desk", memory.add_room("study"))
    memory.observe(desk, [Sighting("mug")])
    assert ask(memory, "mug") == pytest.approx(0.1)  # not before this step
    memory.step(9)
    # Moves per hour: (.5 / 15) of the home, 1.5 / (1.5 x 30) of the thing itself, as before.
    assert ask(memory, "mug") == pytest.approx(0.1 * (1 - np.exp(-9 / 30)), rel=1e-6)


def test_without_a_clock_nothing_is_out():
    asked = live(days=3, clock=False, until=7).ask(["car keys"])
    assert compute_out(Question.gather(asked.batch, asked.queries), np.full((1, 3), 1 / 3)) == 0


def look_around(leave):
    """Four places that are looked at in turn; from step 20 on, half of the things may be gone."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(label, room) for label in ("table", "shelf", "fridge", "bed")]
    for step in range(40):
        here = [n for n in range(8) if n % 4 == step % 4 and not (leave and step >= 20 and n < 4)]
        memory.observe(places[step % 4], [Sighting(THINGS[n], relation="in") for n in here])
        memory.step()
    return memory


def test_what_is_nowhere_has_left_and_what_was_just_seen_has_not():
    left = ask(look_around(leave=True), *THINGS)
    assert (left[:4] > 0.5).all()
    assert (left[4:] < 0.1).all()


def test_many_homes_are_each_by_themselves():
    rules = RoutineDynamics(carry_share=0.9, step_seconds=3600)
    config = HomeConfig(furniture_per_room=3, objects_per_furniture=3, dynamics=rules)

    def compute(numbers):
        homes = SampledHomes(
            PriorGraph.household(), [config] * len(numbers), Streams(0, "test", numbers)
        )
        rollout = Rollout(homes, Adaptive())
        for _ in predict_locations(rollout, 40):
            pass
        batch = rollout.memory
        rows = np.flatnonzero(batch.objects["num_observed"] > 0)
        columns = (batch.objects[name][rows] for name in ("home", "key", "label", "type"))
        left = compute_elsewhere(batch, batch.query(*columns))
        own = batch.objects["home"][rows] == numbers.index(1)
        return left[own][np.argsort(batch.objects["key"][rows][own])]

    alone = compute([1])
    assert ((alone >= 0) & (alone < 1)).all()
    assert alone.max() > alone.min()
    np.testing.assert_allclose(compute([0, 1, 2]), alone, atol=1e-9)


@cache
def miss_twelve_times(thing, was_seen):
    """A memory of twelve looks at each of 20 places, of which none showed the thing."""
    memory = SceneGraphMemory()
    places = [
        memory.add_furniture(label, memory.add_room(room))
        for room in ("kitchen", "bedroom", "bathroom", "living room")
        for label in ("desk", "shelf", "cabinet", "table", "dresser")
    ]
    if was_seen:
        memory.observe(places[5], [Sighting(thing)])
        memory.step()
    for _ in range(12):
        for place in places:
            memory.observe(place, [Sighting("plate")] if place == places[0] else [])
        memory.step()
    return memory


@pytest.mark.parametrize("policy", [Bayesian, Adaptive, Frequentist, Priors, Myopic])
@pytest.mark.parametrize("thing", ["passport", "scissors", "zorb"])
@pytest.mark.parametrize("was_seen", [False, True])
def test_twelve_looks_at_all_places_leave_next_to_nothing(policy, thing, was_seen):
    """Each look misses a fifth; whatever the prior says, and wherever it was before."""
    memory = miss_twelve_times(thing, was_seen)
    for detector in (None, Detector(miss_rate=0.2)):
        ranking = Finder(policy(), detector).rank(memory, thing)
        assert max(place.probability for place in ranking) < 0.01
        assert ranking.elsewhere > 0.98
