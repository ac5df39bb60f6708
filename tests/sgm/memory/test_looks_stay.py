"""What is no look, within a step, keeps what the looks of this step have shown."""

import numpy as np
import pytest

from sgm.finder.finder import Finder
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian, Frequentist
from tests.sgm.memory.sessions import dump

TABLE, SHELF, DESK = range(3)
POLICIES = pytest.mark.parametrize("policy", [Frequentist, Bayesian, Adaptive])
CHANGES = {
    "furniture": lambda memory: memory.add_furniture("bathtub", 1),
    "room": lambda memory: memory.add_room("attic"),
    "name of a room": lambda memory: memory.rename_room(1, "bath"),
    "name of furniture": lambda memory: memory.name_furniture(DESK, "desk", "old desk"),
    "position": lambda memory: memory.move_furniture(DESK, position=(3.0, 1.0)),
    "map": lambda memory: memory.transform(0.3, (1.0, 2.0)),
    "thing known before": lambda memory: memory.rename("fork", "spoon"),
    "thing of this step": lambda memory: memory.rename("pen", "pencil"),
    "thing with an id": lambda memory: memory.rename("7", "book"),
    "one thing": lambda memory: memory.merge("fork", "plate"),
}


def make_memory(policy_seen: int, num_now: int) -> SceneGraphMemory:
    memory = SceneGraphMemory()
    rooms = [memory.add_room(label) for label in ("kitchen", "bathroom")]
    for label in ("table", "shelf", "desk"):
        memory.add_furniture(label, rooms[0])
    memory.observe(TABLE, [*[Sighting("lamp")] * policy_seen, Sighting("fork"), Sighting("plate")])
    memory.step()
    memory.observe(SHELF, [Sighting("lamp")] * num_now)
    memory.observe(TABLE, [Sighting("pen"), Sighting("paper", id="7")])
    memory.note_absent(DESK, "pen")
    return memory


def rank(memory, policy):
    ranking = Finder(policy()).rank(memory, "lamp")
    places = {place.furniture: place.probability for place in ranking}
    return np.array([places[n] for n in (TABLE, SHELF, DESK)])


@POLICIES
@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("num_before", [1, 2])
@pytest.mark.parametrize("num_now", [1, 2])
def test_no_other_thing_changes(policy, change, num_before, num_now):
    """A lamp that two were seen of went from 3 % to 48 % at its old place."""
    memory = make_memory(num_before, num_now)
    before = rank(memory, policy)
    CHANGES[change](memory)
    np.testing.assert_allclose(rank(memory, policy), before, atol=0.05)
    memory.observe(DESK, [])
    assert memory.ask(["lamp"]).num_instances.tolist() == [max(num_before, num_now)]


@pytest.mark.parametrize("change", CHANGES)
def test_it_is_saved_as_it_is(change, tmp_path):
    memory = make_memory(1, 2)
    CHANGES[change](memory)
    memory.save(tmp_path / "home.sgm")
    for other in (memory.copy(), SceneGraphMemory.load(tmp_path / "home.sgm")):
        assert dump(other) == dump(memory)
        assert other.to_dict() == memory.to_dict()
        np.testing.assert_array_equal(rank(other, Adaptive), rank(memory, Adaptive))


def test_what_was_renamed_has_been_seen_and_missed_under_its_new_name():
    memory = make_memory(1, 1)
    memory.rename("pen", "pencil")
    memory.rename("7", "book")
    assert [memory.last_seen(thing).steps_ago for thing in ("pencil", "7")] == [0, 0]
    assert memory.last_seen("pencil").times_looked == 1
    assert memory.ask(["pencil"]).looks.negative[0].tolist() == [0, 1, 1]
    assert not {"pen", "paper"} & set(memory.descriptions)
