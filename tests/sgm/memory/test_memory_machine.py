"""Random sequences of operations on a memory: it agrees with plain lists, and survives restarts."""

import json
import tempfile
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
    run_state_machine_as_test,
)

from sgm.policies.policy import compute_probabilities
from simulator import Bayesian, SceneGraphMemory, Sighting
from simulator.snapshots.taken import take_snapshots

ROOMS = ("kitchen", "Living_Room", "attic", "Küche")
FURNITURE = ("fridge", "counter top", "sofa", "hammock", "本棚")
OBJECTS = ("large red mug", "milk", "flux capacitor", "氷", "small mug", "Zero Fat Milk")
SIGHTINGS = st.lists(
    st.builds(Sighting, st.sampled_from(OBJECTS), st.sampled_from(("in", "onTop"))), max_size=4
)


class MemoryMachine(RuleBasedStateMachine):
    """A memory beside plain lists of what was done to it."""

    def __init__(self):
        super().__init__()
        self.folder = tempfile.TemporaryDirectory()
        self.file = Path(self.folder.name) / "home.sgm"

    @initialize()
    def start(self):
        self.memory = SceneGraphMemory()
        self.time = 0
        self.rooms: dict[int, str] = {}
        self.furniture: dict[int, int] = {}  # room by id
        # (furniture, description, relation) -> [times seen, last seen, is it there]
        self.seen: dict[tuple[int, str, str], list] = {}
        self.last_seen: dict[str, int] = {}

    def teardown(self):
        self.folder.cleanup()

    @rule(label=st.sampled_from(ROOMS))
    def add_room(self, label):
        room = self.memory.add_room(label)
        assert room not in self.rooms
        self.rooms[room] = label

    @precondition(lambda self: self.rooms)
    @rule(data=st.data(), label=st.sampled_from(FURNITURE))
    def add_furniture(self, data, label):
        room = data.draw(st.sampled_from(sorted(self.rooms)))
        furniture = self.memory.add_furniture(label, room, f"old {label}")
        assert furniture not in self.furniture
        self.furniture[furniture] = room

    @precondition(lambda self: self.furniture)
    @rule(data=st.data(), seen=SIGHTINGS)
    def observe(self, data, seen):
        furniture = data.draw(st.sampled_from(sorted(self.furniture)))
        self.memory.observe(furniture, seen)
        for place, state in self.seen.items():
            if place[0] == furniture:
                state[2] = False
        for description, relation in {(one.description, one.relation) for one in seen}:
            state = self.seen.setdefault((furniture, description, relation), [0, 0, False])
            state[:] = state[0] + 1, self.time, True
            self.last_seen[description] = self.time

    @rule(num_steps=st.integers(0, 3))
    def step(self, num_steps):
        self.memory.step(num_steps)
        self.time += num_steps

    @precondition(lambda self: self.furniture)
    @rule(description=st.sampled_from(OBJECTS))
    def ask(self, description):
        ranking = self.memory.rank(Bayesian(), description)
        assert sorted(furniture for furniture, _ in ranking) == sorted(self.furniture)
        scores = np.array([[score for _, score in ranking]])
        assert not np.isnan(scores).any()
        assert np.isfinite(scores).any()
        probability = compute_probabilities(scores, "weights")
        assert abs(probability.sum() - 1) < 1e-9

    @precondition(lambda self: self.rooms)
    @rule(data=st.data())
    def remove_room(self, data):
        room = data.draw(st.sampled_from(sorted(self.rooms)))
        self.memory.remove_room(room)
        del self.rooms[room]
        for furniture in [f for f, of in self.furniture.items() if of == room]:
            self.forget_furniture(furniture)

    @precondition(lambda self: self.furniture)
    @rule(data=st.data())
    def remove_furniture(self, data):
        furniture = data.draw(st.sampled_from(sorted(self.furniture)))
        self.memory.remove_furniture(furniture)
        self.forget_furniture(furniture)

    def forget_furniture(self, furniture):
        del self.furniture[furniture]
        self.seen = {place: state for place, state in self.seen.items() if place[0] != furniture}

    @precondition(lambda self: self.memory.descriptions)
    @rule(data=st.data())
    def remove_object(self, data):
        description = data.draw(st.sampled_from(self.memory.descriptions))
        self.memory.remove_object(description)
        self.seen = {place: state for place, state in self.seen.items() if place[1] != description}
        self.last_seen.pop(description, None)

    @rule()
    def restart(self):
        self.memory.save(self.file)
        first = self.file.read_bytes()
        loaded = SceneGraphMemory.load(self.file)
        assert loaded.to_dict() == self.memory.to_dict()
        if self.furniture and self.memory._state.asked is not None:
            row = self.memory._state.asked
            assert_equal_snapshots(
                take_snapshots(self.memory.batch, self.memory._state.query_row(row)),
                take_snapshots(loaded.batch, loaded._state.query_row(row)),
            )
        loaded.save(self.file)
        assert self.file.read_bytes() == first
        self.memory = loaded

    @invariant()
    def it_agrees_with_plain_lists(self):
        if not hasattr(self, "memory"):
            return
        view = json.loads(json.dumps(self.memory.to_dict()))
        assert view["time"] == self.memory.time == self.time
        assert [room["label"] for room in view["rooms"]] == list(self.rooms.values())
        found = {
            (furniture["id"], one["description"], one["relation"]): [
                one["times_seen"],
                one["last_seen"],
                one["is_there"],
            ]
            for room in view["rooms"]
            for furniture in room["furniture"]
            for one in furniture["objects"]
        }
        assert found == self.seen
        for description in OBJECTS:
            last = self.memory.last_seen(description)
            assert (None if last is None else last.time) == self.last_seen.get(description)

    @invariant()
    def counters_are_consistent(self):
        if not hasattr(self, "memory"):
            return
        batch = self.memory.batch
        edges, objects = batch.edges, batch.objects
        assert objects.num_rows == len(self.memory.descriptions)
        assert (edges["num_true"] <= edges["num_observed"]).all()
        assert (edges["num_changed"] < np.maximum(edges["num_observed"], 1)).all()
        assert (edges["is_true"] <= (edges["last_true"] == edges["last_observed"])).all()
        assert (edges["furniture"] < len(self.furniture)).all()
        assert (edges["object"] < objects.num_rows).all()
        assert (objects["num_moved"] <= objects["num_observed"]).all()
        for column in ("last_observed", "last_changed", "last_true"):
            assert (edges[column] <= self.time).all()
        looks = batch.furniture_num_observed[0]
        assert (edges["num_observed"] <= looks[edges["furniture"]]).all()


def assert_equal_snapshots(one, other):
    for field in fields(one):
        mine, theirs = getattr(one, field.name), getattr(other, field.name)
        np.testing.assert_equal(mine, theirs, field.name)


@pytest.mark.slow
def test_random_sequences_of_operations(monkeypatch):
    monkeypatch.setattr("os.fsync", lambda file: None)  # hundreds of saves, no crash to survive
    run_state_machine_as_test(
        MemoryMachine, settings=settings(max_examples=40, stateful_step_count=25, deadline=None)
    )
