"""The memory of one home: worked by hand, grown while in use, equal to the batched memory."""

import numpy as np
import pytest

from simulator import Bayesian, HouseConfig, Houses, PriorGraph, SceneGraphMemory, Sighting, Streams
from simulator.memory.memory_batch import NEVER
from simulator.memory.snapshots import take_snapshots
from simulator.policies import make_policy
from simulator.rollout import Rollout


@pytest.fixture
def home() -> tuple[SceneGraphMemory, int, int]:
    """A kitchen with a fridge and a dining table."""
    memory = SceneGraphMemory()
    kitchen = memory.add_room("kitchen")
    return (
        memory,
        memory.add_furniture("fridge", room=kitchen, description="white fridge"),
        memory.add_furniture("dining table", room=kitchen),
    )


def get_edges(memory: SceneGraphMemory, *columns: str) -> list[tuple]:
    edges = memory.batch.edges
    return list(zip(*(edges[name].tolist() for name in columns), strict=True))


def test_counters_worked_by_hand(home):
    memory, fridge, table = home
    memory.observe(table, [Sighting("large red mug"), Sighting("banana")])  # time 0
    memory.step()
    memory.observe(table, [Sighting("banana")])  # time 1: the mug is gone
    memory.step()
    memory.observe(fridge, [Sighting("large red mug", "in")])  # time 2: here it is
    # object 0 mug, 1 banana; furniture 0 fridge, 1 table
    assert get_edges(
        memory, "object", "furniture", "relation", "num_observed", "num_true", "num_changed",
        "last_observed", "last_changed", "last_true", "is_true",
    ) == [
        (0, table, 1, 2, 1, 1, 1, 1, 0, False),
        (1, table, 1, 2, 2, 0, 1, NEVER, 1, True),
        (0, fridge, 0, 1, 1, 0, 2, NEVER, 2, True),
    ]  # fmt: skip
    objects = memory.batch.objects
    assert objects["num_observed"].tolist() == [2, 2]
    assert objects["num_moved"].tolist() == [1, 0]
    assert objects["last_moved"].tolist() == [2, NEVER]
    assert objects["last_furniture"].tolist() == [fridge, table]
    assert memory.batch.furniture_num_observed.tolist() == [[1, 2]]
    assert memory.batch.furniture_last_observed.tolist() == [[2, 1]]


def test_a_place_that_was_asked_about_and_looked_at_is_remembered_as_empty(home):
    memory, _, table = home
    memory.step()
    memory.query("small mug")
    memory.observe(table, [])
    assert get_edges(memory, "furniture", "num_observed", "num_true", "is_true") == [
        (table, 1, 0, False)
    ]
    memory.step()  # hypothetical edges end with the step: the next look leaves none
    memory.observe(table, [])
    assert get_edges(memory, "furniture", "num_observed") == [(table, 2)]


def test_negative_evidence_changes_the_order(home):
    memory, _, table = home
    counter = memory.add_furniture("counter top", room=0)
    assert memory.rank(Bayesian(), "large red mug")[0][0] == counter  # says the prior
    for _ in range(10):
        memory.step()
        memory.observe(table, [Sighting("large red mug")])
    assert memory.rank(Bayesian(), "large red mug")[0][0] == table
    for _ in range(10):
        memory.step()
        memory.observe(table, [])
    assert memory.rank(Bayesian(), "large red mug")[0][0] == counter


def test_furniture_added_later_keeps_history_and_renews_the_prior(home):
    memory, fridge, table = home
    memory.observe(table, [Sighting("mug")])
    before = get_edges(memory, "prior")
    memory.add_furniture("counter top", room=0)
    assert memory.batch.furniture_num_observed.tolist() == [[0, 1, 0]]
    # The prior of a mug now has one more place to spread over.
    assert get_edges(memory, "prior")[0] < before[0]
    ranked = [furniture for furniture, _ in memory.rank(Bayesian(), "mug")]
    assert sorted(ranked) == [0, 1, 2]
    assert ranked[-1] == fridge  # mugs are never in a fridge
    assert memory.describe(fridge) == "white fridge in kitchen"


@pytest.mark.parametrize(
    ("description", "label"),
    [
        ("large red mug", "mug"),
        ("glass salt shaker", "salt shaker"),
        ("whole fat milk", "whole fat milk"),  # not "milk": the longest known type
        ("bright flux capacitor", "capacitor"),
        ("mug", "mug"),
    ],
)
def test_type_of_a_description(home, description, label):
    memory, _, table = home
    memory.observe(table, [Sighting(description)])
    assert memory.batch.labels[memory.batch.objects["label"][0]] == label


def test_an_unknown_object_may_be_anywhere(home):
    memory, _, _ = home
    scores = dict(memory.rank(Bayesian(), "flux capacitor"))
    assert all(np.isfinite(score) for score in scores.values())


def test_equal_to_the_memory_of_a_simulated_home():
    """The same looks through the friendly interface give the same snapshot."""
    houses = Houses(PriorGraph.default(), HouseConfig(), Streams(3, "val", [0]))
    rollout = Rollout(houses, make_policy("bayesian", houses))
    prior, memory = houses.prior, SceneGraphMemory()
    rooms = [memory.add_room(room) for room in houses.config.rooms]
    for node, room in zip(houses.furniture_type[0], houses.furniture_room, strict=True):
        memory.add_furniture(prior.furniture[node].label, room=rooms[room])
    table = houses.object_descriptions
    for step in rollout.run(15):
        code = int(rollout.memory.objects["key"][step.queries.object[0]])
        memory.step()
        query = memory.query(table.text(code))
        batched, single = (
            take_snapshots(rollout.memory, step.queries), take_snapshots(memory.batch, query)
        )  # fmt: skip
        for names in (
            ("query_prior",),
            ("furniture_prob",),
            ("furniture_num_observed",),
            ("object_label", "object_num_observed", "object_last_observed", "object_num_moved"),
            ("edge_furniture", "edge_relation", "edge_prior", "edge_num_observed",
             "edge_num_true", "edge_last_changed", "edge_is_true"),
        ):  # fmt: skip
            np.testing.assert_array_equal(_sort_rows(single, names), _sort_rows(batched, names))
        # What the rollout is about to see, sighted again by hand.
        furniture = int(step.choice[0])
        before = rollout.memory.furniture_num_observed.copy()
        seen = _see(rollout, furniture)
        assert (rollout.memory.furniture_num_observed == before).all()
        memory.observe(furniture, seen)


def _sort_rows(snapshots, names) -> np.ndarray:
    """Columns side by side, rows in an order of their own: nodes may be numbered differently."""
    columns = [getattr(snapshots, name).ravel() for name in names]
    columns = [
        np.array(snapshots.labels)[column] if name.endswith("label") else column
        for name, column in zip(names, columns, strict=True)
    ]
    rows = [tuple(row) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return np.array(rows if len(names) == 1 else sorted(rows), dtype=object)


def _see(rollout: Rollout, furniture: int) -> list[Sighting]:
    """Predict the detections of the coming look from a copy of its random stream."""
    houses = rollout.houses
    stream = houses.streams.rows("detection", houses.num_slots)
    uniform = stream.next()[0]
    stream._cursor -= 1
    slots = np.flatnonzero(
        (houses.object_furniture[0] == furniture) & (uniform >= houses.config.detection_error)
    )
    table = houses.object_descriptions
    return [
        Sighting(
            table.text(int(houses.object_code[0, slot])),
            ("in", "onTop")[houses.object_place[0, slot] % 2],
        )
        for slot in slots
    ]


def test_bad_input_is_refused(home):
    memory, fridge, _ = home
    with pytest.raises(KeyError, match=r"got 7; there are 2 furniture nodes"):
        memory.observe(7, [])
    with pytest.raises(KeyError, match=r"got 3; there are 1 rooms"):
        memory.add_furniture("shelf", room=3)
    with pytest.raises(ValueError, match=r"relation must be one of in, onTop, got 'behind'"):
        Sighting("mug", relation="behind")
    for empty in ("", "  "):
        with pytest.raises(ValueError, match=r"description must be a non-empty text"):
            Sighting(empty)
        with pytest.raises(ValueError, match=r"room label must be a non-empty text"):
            memory.add_room(empty)
        with pytest.raises(ValueError, match=r"description must be a non-empty text"):
            memory.query(empty)
    with pytest.raises(ValueError, match=r"must have furniture before a query"):
        SceneGraphMemory().query("mug")
    assert len(memory.batch.edges) == 0
    memory.observe(fridge, [])
    assert memory.batch.furniture_num_observed.tolist() == [[1, 0]]
