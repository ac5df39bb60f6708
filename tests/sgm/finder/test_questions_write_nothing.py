"""A question leaves every array and attribute of the memory, and of what it reads, as it was."""

from collections.abc import Mapping
from datetime import datetime
from threading import Lock, RLock

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sgm.belief import Detector
from sgm.finder.finder import Finder
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.names.aliases import AliasTable
from sgm.policies.adaptive import Adaptive
from sgm.policies.heuristics import Bayesian
from sgm.prior.prior_graph import PriorGraph
from tests.sgm.memory.sessions import CALLS, call

# What is derived from the rest and made when it is first read.
DERIVED = {"_snapshot", "derived", "_names", "_furniture", "_called"}
DERIVED |= {"_descriptions", "_numbers", "_first_numbers", "_indexes"}  # of things and names
# What a memory is given and shares with others, which has tests of its own; and locks.
NO_CONTENT = (AliasTable, PriorGraph, type(Lock()), type(RLock()))


def capture(value, within=()):
    """Return all that a value holds, as it is now; what has no content of its own by identity."""
    if isinstance(value, np.ndarray):
        return str(value.dtype), value.shape, value.tobytes()
    if value is None or isinstance(value, (bool, int, float, str, bytes, type, np.generic)):
        return repr(value)
    if id(value) in within:  # a part refers to what it is in
        return within.index(id(value))
    within = (*within, id(value))
    if isinstance(value, Mapping):
        return [(capture(key, within), capture(held, within)) for key, held in value.items()]
    if isinstance(value, (set, frozenset)):
        return sorted(map(repr, value))
    if isinstance(value, (list, tuple)):
        return [capture(held, within) for held in value]
    if isinstance(value, NO_CONTENT) or callable(value):
        return id(value)
    names = [*getattr(value, "__dict__", ())]
    names += [name for kind in type(value).__mro__ for name in getattr(kind, "__slots__", ())]
    names = [name for name in names if hasattr(value, name) and name not in DERIVED]
    return [(name, capture(getattr(value, name), within)) for name in names] or id(value)


def capture_memory(memory):
    """All that a memory holds; its parts have a state that they share, and what warns of looks."""
    return capture((memory._state, memory._looks.watch))


def test_capture_sees_an_array_and_an_attribute_that_change():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("study"))
    memory.observe(shelf, [Sighting("mug")])
    before = capture_memory(memory)
    assert capture_memory(memory) == before
    memory.batch.edges["num_true"] += 1
    assert capture_memory(memory) != before
    memory.batch.edges["num_true"] -= 1
    assert capture_memory(memory) == before
    memory.batch.history.miss_rate = 0.5
    assert capture_memory(memory) != before


# Every public call of a memory that writes nothing, by name.
QUESTIONS = {
    "ask": lambda memory, name: memory.ask([name, "fork"], question=name, miss_rate=0.5),
    "changes": lambda memory, name: memory.changes(0),
    "copy": lambda memory, name: memory.copy(),
    "count_things": lambda memory, name: memory.count_things(),
    "describe": lambda memory, name: memory.describe(0),
    "find_called": lambda memory, name: memory.find_called(Sighting("fridge").name),
    "find_carried": lambda memory, name: memory.find_carried(name),
    "find_furniture": lambda memory, name: memory.find_furniture(name),
    "find_nearest": lambda memory, name: memory.find_nearest((1.0, 0.3)),
    "find_places": lambda memory, name: memory.find_places(name),
    "get_pose": lambda memory, name: memory.get_pose(0),
    "get_position": lambda memory, name: memory.get_position(0),
    "history": lambda memory, name: memory.history(name),
    "last_seen": lambda memory, name: memory.last_seen(name),
    "list_furniture": lambda memory, name: memory.list_furniture(0),
    "list_ids": lambda memory, name: memory.list_ids(name),
    "list_known": lambda memory, name: memory.list_known(name, 0, 3),
    "list_named": lambda memory, name: memory.list_named(name, place=0),
    "list_seen": lambda memory, name: memory.list_seen([name]),
    "list_statements": lambda memory, name: memory.list_statements(),
    "name_seen": lambda memory, name: memory.name_seen(0, [Sighting(name)]),
    "places_of": lambda memory, name: memory.places_of(name),
    "rank": lambda memory, name: memory.rank(Bayesian(), name),
    "read_sentence": lambda memory, name: memory.read_sentence(f"where is the {name}?"),
    "resolve": lambda memory, name: memory.resolve(name),
    "resolve_exact": lambda memory, name: memory.resolve_exact(name),
    "to_dict": lambda memory, name: memory.to_dict(),
    "to_frame": lambda memory, name: memory.to_frame(),
    "to_spark_dsg": lambda memory, name: memory.to_spark_dsg(),
}
# What is about the file, or makes a memory.
OTHER_CALLS = {"close", "load", "open", "save", "sync", "transaction"}
FINDERS = [
    Finder(Bayesian()),
    Finder(Adaptive(), Detector(miss_rate=0.4)),
    Finder(Adaptive(), asks_moved=0.5),
]


def ask_finders(memory, name):
    """Ask each kind of finder for a rank, a plan and the first place of a search."""
    for finder in FINDERS:
        finder.rank(memory, name)
        finder.rank(memory, name, at=memory.time + 5)
        finder.search_plan(memory, name)
        finder.search(memory, name).next()


calls = st.sampled_from((*sorted(CALLS), "observe", "observe", "add_furniture")).flatmap(
    lambda name: st.tuples(st.just(name), CALLS[name])
)


def test_every_public_call_is_a_question_or_is_not():
    public = {
        name
        for name, value in vars(SceneGraphMemory).items()
        if not name.startswith("_") and not isinstance(value, property)
    }
    assert public == {*QUESTIONS, *CALLS, *OTHER_CALLS}
    assert not {*QUESTIONS} & {*CALLS}


@pytest.mark.slow
@settings(max_examples=20, deadline=None)
@given(st.lists(calls, max_size=20), st.sampled_from(("large red mug", "mug", "a", "unicorn")))
@pytest.mark.filterwarnings("ignore:.* confidences of a look are below")
def test_a_question_leaves_the_memory_as_it_was(session, name):
    pytest.importorskip("pandas", reason="pandas is not installed")
    pytest.importorskip("spark_dsg", reason="spark_dsg is not installed")
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20, 8), 600))
    memory.add_furniture("fridge", memory.add_room("kitchen"))
    memory.observe(0, [Sighting("large red mug", embedding=(1.0, 0.1))])
    for written, arguments in session:
        call(memory, written, arguments)
    memory.add_furniture("desk", memory.add_room("study"))
    assert memory.batch.num_furniture  # a new layout is taken over when it is read
    before = capture_memory(memory)
    for question in (*QUESTIONS.values(), ask_finders):
        try:
            question(memory, name)
        except (KeyError, ValueError):
            pass  # the session has removed what it is about
    assert capture_memory(memory) == before


def test_a_given_miss_rate_is_of_the_question_alone():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("study"))
    memory.observe(shelf, [Sighting("mug")])
    memory.step()
    asked = memory.ask(["mug"], miss_rate=0.5)
    assert asked.queries.miss_rate == asked.queries.take(np.array([0])).miss_rate == 0.5
    assert asked.queries.join(memory.ask(["mug"]).queries).miss_rate == 0.5
    assert memory.ask(["mug"]).queries.miss_rate is None
    assert capture(asked.batch.history) == capture(memory.batch.history)


@pytest.mark.parametrize("finder", FINDERS)
def test_a_finder_leaves_what_it_was_given_as_it_was(finder):
    """Several questions may be about one state: what one writes there, the others would read."""
    memory = SceneGraphMemory()
    room = memory.add_room("study")
    for label in ("shelf", "desk"):
        memory.add_furniture(label, room)
    memory.observe(0, [Sighting("mug")])
    memory.step()
    memory.observe(0, [])
    asked = memory.ask(["mug"], miss_rate=0.4)
    before = capture(asked)
    finder._compute_posterior(asked)
    assert capture(asked) == before
