"""The memory of one home: worked by hand, changed while in use, equal to the batched memory."""

import json
from copy import deepcopy

import numpy as np
import pytest

from sgm.memory.sighting import SeenAt
from sgm.names.words import MAX_LENGTH
from sgm.schema import MAX_TIME, NEVER
from simulator import (
    Bayesian,
    HomeConfig,
    PriorGraph,
    SampledHomes,
    SceneGraphMemory,
    Sighting,
    Streams,
)
from simulator.policies import make_policy
from simulator.snapshots.taken import take_snapshots
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout
from tests.snapshot_columns import list_columns


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
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(3, "val", [0]))
    rollout = Rollout(homes, make_policy("bayesian", homes))
    prior, memory = homes.prior, SceneGraphMemory(homes.prior)
    rooms = [memory.add_room(room) for room in homes.configs[0].rooms]
    for node, room in zip(homes.furniture_type[0], homes.furniture_room[0], strict=True):
        memory.add_furniture(prior.furniture[node].label, room=rooms[room])
    table = homes.object_descriptions
    for step in predict_locations(rollout, 15):
        code = int(rollout.memory.objects["key"][step.queries.object[0]])
        memory.step()
        query = memory.query(table.text(code))
        batched, single = (
            take_snapshots(rollout.memory, step.queries),
            take_snapshots(memory.batch, query),
        )
        for names in (
            ("query_prior",),
            ("furniture.prob",),
            ("furniture.num_observed",),
            ("objects.label", "objects.num_observed", "objects.last_observed", "objects.num_moved"),
            (
                "edges.furniture",
                "edges.relation",
                "edges.prior",
                "edges.num_observed",
                "edges.num_true",
                "edges.last_changed",
                "edges.is_true",
            ),
        ):
            np.testing.assert_array_equal(_sort_rows(single, names), _sort_rows(batched, names))
        # What the rollout is about to see, sighted again by hand.
        furniture = int(step.choice[0])
        before = rollout.memory.furniture_num_observed.copy()
        seen = _see(rollout, furniture)
        assert (rollout.memory.furniture_num_observed == before).all()
        memory.observe(furniture, seen)


def _sort_rows(snapshots, names) -> np.ndarray:
    """Columns side by side, rows in an order of their own: nodes may be numbered differently."""
    known = list_columns(snapshots)
    columns = [known[name].ravel() for name in names]
    columns = [
        np.array(snapshots.labels)[column] if name.endswith("label") else column
        for name, column in zip(names, columns, strict=True)
    ]
    rows = [tuple(row) for row in zip(*(column.tolist() for column in columns), strict=True)]
    return np.array(rows if len(names) == 1 else sorted(rows), dtype=object)


def _see(rollout: Rollout, furniture: int) -> list[Sighting]:
    """Predict the detections of the coming look from a copy of its random stream."""
    homes = rollout.homes
    stream = homes.streams.rows("detection", homes.num_slots)
    uniform = deepcopy(stream).take()[0]
    slots = np.flatnonzero(
        (homes.object_furniture[0] == furniture) & (uniform >= homes.configs[0].detection_error)
    )
    table = homes.object_descriptions
    return [
        Sighting(
            table.text(int(homes.object_code[0, slot])),
            ("in", "onTop")[homes.object_place[0, slot] % 2],
        )
        for slot in slots
    ]


def test_names_are_compared_by_their_words(home):
    memory, fridge, table = home
    memory.observe(table, [Sighting("Large_Red  Mug"), Sighting("large red mug")])
    memory.observe(fridge, [Sighting("LARGE red mug ", "in")])
    assert memory.descriptions == ("Large_Red  Mug",)
    assert memory.batch.objects["num_observed"].tolist() == [2]
    shouted = SceneGraphMemory()
    shouted.add_furniture("Dining_Table", room=shouted.add_room("KITCHEN"))
    assert shouted.batch.labels[2:4] == ["kitchen", "dining table"]
    assert shouted.batch.place_prior.furniture_prob[0, 0] > 0
    for text in ("氷", "café crème", "cafe\u0301 crème", "кружка", "🫖", "ß", "x" * MAX_LENGTH):
        memory.observe(table, [Sighting(text)])
        assert memory.last_seen(text).furniture == table
    assert len(memory.descriptions) == 7  # both ways to write é are one


def test_an_object_may_be_at_two_places_at_once(home):
    memory, fridge, table = home
    memory.observe(fridge, [Sighting("apple", "in")] * 2)
    memory.observe(table, [Sighting("apple")])
    memory.step()
    assert [(p.furniture, p.relation, p.is_there) for p in memory.places_of("apple")] == [
        (table, "onTop", True),  # the later look of the step
        (fridge, "in", True),
    ]
    memory.observe(fridge, [])  # the other apple is still believed to be on the table
    assert [p.is_there for p in memory.places_of("apple")] == [True, False]


def test_when_was_it_last_seen(home):
    memory, fridge, table = home
    assert memory.last_seen("milk") is None
    memory.query("milk")
    assert memory.last_seen("milk") is None  # asked for, not seen
    memory.step(2)
    memory.observe(fridge, [Sighting("milk", "in")])  # time 2
    memory.step(3)
    memory.observe(fridge, [])
    memory.step(4)
    assert memory.last_seen("MILK") == SeenAt(
        time=2,
        steps_ago=7,
        furniture=fridge,
        relation="in",
        is_there=False,
        times_seen=1,
        times_looked=2,
    )
    memory.observe(table, [Sighting("milk")])
    assert [place.furniture for place in memory.places_of("milk")] == [table, fridge]


def test_removing_furniture_takes_its_edges_and_leaves_objects_and_ids(home):
    memory, fridge, table = home
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.observe(table, [Sighting("mug"), Sighting("milk")])
    memory.step()
    memory.remove_furniture(fridge)
    assert memory.furniture_ids == (table,)
    assert memory.describe(table) == "dining table in kitchen"
    # objects 0 milk, 1 mug; the table is now the first of the batch
    assert get_edges(memory, "object", "furniture", "is_true") == [(0, 0, True), (1, 0, True)]
    assert memory.batch.furniture_num_observed.tolist() == [[1]]
    assert [furniture for furniture, _ in memory.rank(Bayesian(), "milk")] == [table]
    with pytest.raises(KeyError, match="got 0; there are 1 furniture nodes"):
        memory.observe(fridge, [])
    assert memory.add_furniture("fridge", room=0) == 2  # an id is never given twice


def test_an_object_whose_place_was_removed_is_unplaced(home):
    memory, fridge, table = home
    memory.observe(table, [Sighting("milk")])
    memory.step()
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.remove_furniture(fridge)
    last = memory.last_seen("milk")
    assert (last.time, last.furniture, last.relation, last.is_there) == (1, None, None, False)
    assert memory.places_of("milk")[1].furniture == table
    assert memory.to_dict()["unplaced"] == [{"description": "milk", "last_seen": 1}]
    # Where it comes from is not known any more, so that seeing it elsewhere is no move.
    assert memory.batch.objects["num_moved"].tolist() == [1]
    memory.step()
    memory.observe(table, [Sighting("milk")])
    assert memory.batch.objects["num_moved"].tolist() == [1]
    assert memory.to_dict()["unplaced"] == []


def test_removing_a_room_takes_its_furniture(home):
    memory, fridge, _ = home
    attic = memory.add_room("attic")
    hammock = memory.add_furniture("hammock", room=attic)
    memory.observe(fridge, [Sighting("milk", "in")])
    memory.observe(hammock, [Sighting("book")])
    memory.remove_room(0)
    assert memory.furniture_ids == (hammock,)
    assert memory.describe(hammock) == "hammock in attic"
    assert get_edges(memory, "object", "furniture") == [(1, 0)]
    with pytest.raises(KeyError, match=r"room must be an id from add_room, got 0; there are 1"):
        memory.remove_room(0)
    memory.remove_room(attic)
    assert memory.num_furniture == 0
    assert memory.descriptions == ("milk", "book")


def test_removing_an_object_forgets_it(home):
    memory, _, table = home
    memory.observe(table, [Sighting("milk"), Sighting("mug"), Sighting("book")])
    memory.remove_object("Mug")
    assert memory.descriptions == ("milk", "book")
    assert get_edges(memory, "object", "furniture") == [(0, table), (1, table)]
    assert memory.last_seen("mug") is None
    with pytest.raises(KeyError, match=r"got 'mug'; there are 2 objects"):
        memory.remove_object("mug")
    memory.observe(table, [Sighting("mug")])
    assert memory.last_seen("mug").times_seen == 1


def test_rooms_furniture_and_objects_as_json(home):
    memory, fridge, table = home
    memory.observe(fridge, [Sighting("milk", "in"), Sighting("egg", "in")])
    memory.step()
    memory.observe(fridge, [Sighting("milk", "in")])
    view = json.loads(json.dumps(memory.to_dict()))
    milk = {
        "description": "milk",
        "relation": "in",
        "is_there": True,
        "last_seen": 1,
        "times_seen": 2,
        "times_looked": 2,
    }
    egg = {**milk, "description": "egg", "is_there": False, "last_seen": 0, "times_seen": 1}
    assert view == {
        "time": 1,
        "rooms": [
            {
                "id": 0,
                "label": "kitchen",
                "furniture": [
                    {
                        "id": fridge,
                        "label": "fridge",
                        "description": "white fridge",
                        "last_looked": 1,
                        "objects": [milk, egg],
                    },
                    {
                        "id": table,
                        "label": "dining table",
                        "description": "dining table",
                        "last_looked": None,
                        "objects": [],
                    },
                ],
            }
        ],
        "unplaced": [],
    }


def test_many_steps_at_once_are_steps_one_by_one(home):
    memory, fridge, _ = home
    memory.query("milk")
    memory.step(0)
    memory.observe(fridge, [])  # still in the step of the query: remembered as empty
    assert get_edges(memory, "num_observed") == [(1,)]
    memory.step(5)
    memory.step()
    assert memory.time == 6
    for bad in (-1, 1.5, "2"):
        with pytest.raises(ValueError, match=rf"num_steps must .* got {bad!r}"):
            memory.step(bad)
    with pytest.raises(ValueError, match=r"time must be at most .* at time 6"):
        memory.step(MAX_TIME)
    assert memory.time == 6


def test_bad_input_is_refused(home):
    memory, fridge, _ = home
    with pytest.raises(KeyError, match=r"got 7; there are 2 furniture nodes"):
        memory.observe(7, [])
    with pytest.raises(KeyError, match=r"got 3; there are 1 rooms"):
        memory.add_furniture("shelf", room=3)
    with pytest.raises(ValueError, match=r"relation must be one of in, onTop, got 'behind'"):
        Sighting("mug", relation="behind")
    for empty in ("", "  ", "_", None, 7, ["mug"], {"label": "mug"}):
        with pytest.raises(ValueError, match=r"description must be a non-empty text"):
            Sighting(empty)
        with pytest.raises(ValueError, match=r"room label must be a non-empty text"):
            memory.add_room(empty)
        with pytest.raises(ValueError, match=r"description must be a non-empty text"):
            memory.query(empty)
    with pytest.raises(ValueError, match=r"must have furniture before a query"):
        SceneGraphMemory().query("mug")
    long = "x" * (MAX_LENGTH + 1)
    with pytest.raises(ValueError, match=r"must have at most 200 characters, got 201 in 'xxx"):
        Sighting(long)
    with pytest.raises(ValueError, match=r"furniture description must have at most 200"):
        memory.add_furniture("shelf", room=0, description=long)
    for odd in ("mug\x00", "\ud83e", "a\x1bb"):
        with pytest.raises(ValueError, match=r"must not hold control characters or half a char"):
            memory.add_room(odd)
    for node in ([0], None, 0.0, "fridge"):
        with pytest.raises(KeyError, match=r"furniture must be an id from add_furniture"):
            memory.observe(node, [])
        with pytest.raises(KeyError, match=r"room must be an id from add_room"):
            memory.remove_room(node)
    with pytest.raises(TypeError, match=r"seen must hold Sighting objects, got 'milk' at white fr"):
        memory.observe(fridge, ["milk"])
    assert memory.batch.edges.num_rows == 0
    assert memory.furniture_ids == (0, 1)
    memory.observe(fridge, [])
    assert memory.batch.furniture_num_observed.tolist() == [[1, 0]]
