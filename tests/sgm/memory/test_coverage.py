"""Looks that had the inside and the upper side of furniture in view to different parts."""

import json

import numpy as np
import pytest

from sgm.evidence.question import list_look_times
from sgm.finder.finder import Finder
from sgm.memory.look import parse_coverage, read_coverage
from sgm.memory.memory_event import read_events
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive, Bayesian
from sgm.replay.replay import replay
from simulator.trace.from_log import make_trace

SHUT = {"in": 0, "onTop": 1}


def make_memory(**more):
    memory = SceneGraphMemory(**more)
    kitchen = memory.add_room("kitchen")
    memory.add_furniture("fridge", room=kitchen)
    memory.add_furniture("table", room=kitchen)
    memory.observe(0, [Sighting("milk", "in"), Sighting("basket", "onTop")])
    return memory


def read_edges(memory, *names):
    edges = memory.batch.edges
    rows = zip(*(edges[name].tolist() for name in names), strict=True)
    return dict(zip(("milk", "basket"), rows, strict=False))


def dump(memory):
    return json.dumps(memory._state.get_content_to_save().to_json())


def test_a_shut_fridge_was_not_looked_into():
    memory = make_memory()
    for _ in range(5):
        memory.step()
        memory.observe(0, [], SHUT)
    # 5 looks at the upper side, none inside
    assert read_edges(memory, "is_true", "num_observed", "missed") == {
        "milk": (True, 1, 0.0),
        "basket": (False, 6, 5.0),
    }
    assert memory.last_seen("milk").is_there
    assert not memory.last_seen("basket").is_there
    # By far most of what the prior knows of fridges is in them: no look at the fridge.
    assert memory.batch.furniture_num_observed[0, 0] == 1


def test_parts_of_each_relation_add_up_by_hand():
    memory = make_memory()
    memory.step()
    memory.observe(0, [], {"in": 0.3, "onTop": 0.4})
    assert read_edges(memory, "missed", "is_true") == {
        "milk": (np.float32(0.3), True),
        "basket": (np.float32(0.4), True),
    }
    memory.observe(0, [], {"in": 0.3})  # .6 of the inside; nothing of the upper side
    assert read_edges(memory, "missed", "is_true") == {
        "milk": (pytest.approx(0.6), False),
        "basket": (np.float32(0.4), True),
    }


@pytest.mark.parametrize("share", [1.0, 0.7, 0.3])
def test_one_number_is_both_to_the_bit(share):
    one, both = make_memory(), make_memory()
    for memory, coverage in ((one, share), (both, {"in": share, "onTop": share})):
        memory.query("cheese")
        for _ in range(3):
            memory.step()
            memory.observe(0, [Sighting("butter", "in", 0.8)], coverage)
            memory.observe(1, [Sighting("cup", "onTop")], coverage)
    assert dump(one) == dump(both)
    assert "look_relations" not in dump(one)


def test_nothing_is_counted_against_what_was_hidden():
    memory = make_memory()
    for _ in range(3):
        memory.step()
        memory.observe(0, [Sighting("cheese", "in")], 1.0, hidden=["Milk", "never seen"])
    assert read_edges(memory, "is_true", "missed")["basket"] == (False, 3.0)
    memory.remove_object("cheese")
    assert read_edges(memory, "is_true", "missed", "num_absent")["milk"] == (True, 0.0, 0)
    assert "never seen" not in memory.descriptions


def test_probabilities_count_what_was_in_view():
    def ask(*looks, name="milk", policy=None):
        memory = make_memory()
        memory.step()
        for coverage, hidden in looks:
            memory.observe(0, [], coverage, hidden)
        ranking = Finder(policy or Bayesian()).rank(memory, name, k=2)
        return next(place.probability for place in ranking if place.furniture == 0)

    unlooked = ask()
    for policy in (Bayesian(), Adaptive()):
        before = ask(policy=policy)
        assert ask((SHUT, ()), (SHUT, ()), policy=policy) == pytest.approx(before, abs=1e-6)
        after = ask(({"in": 1, "onTop": 0}, ()), policy=policy)
        assert after / (1 - after) < 0.5 * before / (1 - before)  # all but a quarter would show it
        assert ask((1.0, ["milk"]), policy=policy) == pytest.approx(before, abs=1e-6)
    assert ask(({"in": 0.5, "onTop": 1}, ())) < unlooked
    assert ask(({"in": 1, "onTop": 0}, ())) == pytest.approx(ask((1.0, ())), abs=1e-6)
    assert ask((SHUT, ()), name="basket") < ask(name="basket")


def test_looks_of_earlier_steps_are_of_their_relation():
    memory = make_memory()
    table = 1
    memory.observe(table, [Sighting("cup", "onTop"), Sighting("ruler", "in")])
    memory.step()
    memory.observe(table, [], {"in": 0, "onTop": 1})  # most of what the prior knows is on tables
    assert memory.batch.furniture_num_observed[0].tolist() == [1, 2]
    memory.step()
    batch = memory.batch
    assert sorted(batch.history.look_relations[0, table].tolist()) == [2, *[3] * 7]
    asked = memory.ask(["cup", "ruler"], before_looks=False)
    times, row = list_look_times(asked.batch, asked.queries, asked.batch.history)
    times = times[row][:, table].max(axis=1)
    assert times.tolist() == [1, 0]


def test_saved_loaded_and_replayed_to_the_bit(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    memory.step()
    memory.observe(1, [Sighting("cup", "onTop")], {"in": 0, "onTop": 1}, ["spoon"])
    memory.step()
    memory.observe(1, [], {"onTop": 0.5}, ["cup"])
    memory.observe(0, [], SHUT, ["basket"])
    memory.save(tmp_path / "home.sgm")
    loaded = SceneGraphMemory.load(tmp_path / "home.sgm")
    assert dump(loaded) == dump(memory)
    lines = read_events(tmp_path / "looks.sgm")
    looks = [line.values for line in lines if line.kind == "look"]
    assert [(look["coverage"], look["hidden"]) for look in looks] == [
        (1.0, []),
        ((0.0, 1.0), ["spoon"]),
        ((0.0, 0.5), ["cup"]),
        ((0.0, 1.0), ["basket"]),
    ]
    *_, (again, _, _) = replay(lines)
    assert dump(again) == dump(memory)
    for one in (memory, loaded):
        one.step()
        one.observe(1, [], 1.0)
    assert dump(loaded) == dump(memory)


def test_a_trace_counts_by_relation(tmp_path):
    memory = make_memory(path=tmp_path / "looks.sgm")
    for _ in range(3):
        memory.step()
        memory.observe(0, [], SHUT, ["basket"])
    trace = make_trace(read_events(tmp_path / "looks.sgm"))
    assert {event.furniture for event in trace.events} == {0}  # nothing has gone
    memory.step()
    memory.observe(0, [], {"in": 1, "onTop": 0})
    trace = make_trace(read_events(tmp_path / "looks.sgm"))
    gone = [event.object for event in trace.events if event.furniture != 0]
    assert gone == ["milk"]


def test_history_follows_changes_of_the_layout():
    memory = make_memory()
    memory.observe(1, [], {"in": 0, "onTop": 1})
    memory.add_furniture("shelf", room=0)
    relations = memory.batch.history.look_relations[0]
    assert relations.shape[0] == 3
    assert (relations[2] == 3).all()
    memory.remove_furniture(0)
    assert memory.batch.history.look_relations[0].shape[0] == 2
    copied = memory.batch.history.copy()
    copied.look_relations[:] = 0
    assert memory.batch.history.look_relations.any()


def test_what_is_asked_for_is_sought_where_it_was_in_view():
    memory = make_memory()
    memory.step()
    memory.query("milk")
    memory.observe(0, [], SHUT)
    assert memory.batch.objects["num_sought"].tolist() == [0, 0]
    memory.observe(0, [Sighting("milk", "in")], {"in": 0.9, "onTop": 0.2})
    assert memory.batch.objects["num_still"].tolist() == [1, 0]


def test_a_batch_of_homes_counts_each_as_alone(make_tiny_memory):
    """Three homes look at once, with shares of their own."""
    shares = np.array([[0.0, 1.0], [0.4, 0.4], [1.0, 0.2]])
    fridge, nothing = 0, np.empty(0, dtype=int)

    def look(homes, shares):
        memory = make_tiny_memory(len(shares))
        for relation in (0, 1):
            home = np.arange(len(shares))
            rows = memory.ensure_objects(home, np.full(len(home), relation), home * 0, home * 0)
            memory.observe(home, home * 0 + fridge, rows, home * 0 + relation)
        memory.observe(home, home * 0 + fridge, nothing, nothing, shares)
        edges = memory.edges
        return {
            (homes[edges["home"][row]], edges["object"][row] // len(shares)): (
                edges["missed"][row].item(),
                edges["is_true"][row].item(),
            )
            for row in range(edges.num_rows)
        }

    alone = {}
    for home, share in enumerate(shares):
        alone |= look([home], share[None])
    assert look([0, 1, 2], shares) == alone
    missed = {key: value[0] for key, value in alone.items()}
    # the second look had seen 1 alone, so that 0 had been missed once before
    assert missed[0, 1] == 1.0
    assert missed[1, 1] == np.float32(0.4)
    assert missed[2, 0] - missed[0, 0] == 1.0


@pytest.mark.parametrize(
    ("coverage", "message"),
    [
        ({"in": 1.5}, r"coverage of 'in' must lie in \[0, 1\], got 1\.5 at fridge in kitchen"),
        ({"in": 0, "onTop": 0}, "coverage must be above 0 and at most 1, got 0.0 at fridge in"),
        ({}, "coverage must be above 0"),
        ({"under": 1}, "relation must be one of in, onTop, got 'under'"),
        ({"in": "all"}, r"coverage of 'in' must lie in"),
        ([0, 1], "coverage must be above 0"),
    ],
)
def test_bad_coverage(coverage, message):
    memory = make_memory()
    before = dump(memory)
    with pytest.raises(ValueError, match=message):
        memory.observe(0, [], coverage)
    assert dump(memory) == before


@pytest.mark.parametrize(
    ("hidden", "kind", "message"),
    [
        (
            "milk",
            TypeError,
            "hidden must be a list of descriptions, got 'milk' at fridge in kitchen",
        ),
        ([""], ValueError, "description of what is hidden must"),
        (3, TypeError, "hidden must be"),
    ],
)
def test_bad_hidden(hidden, kind, message):
    with pytest.raises(kind, match=message):
        make_memory().observe(0, [], 1.0, hidden)


def test_spellings_and_files():
    assert read_coverage({"inside": 0.5, "on top": 1}, "x") == (0.5, 1.0)
    assert read_coverage({"on": 1}, "x") == (0.0, 1.0)
    assert parse_coverage([0.25, 1]) == (0.25, 1.0)
    assert parse_coverage([1, 1]) == 1.0
    for data in ([0, 0], [1], [2, 0], ["a", 1]):
        with pytest.raises(ValueError, match=r"."):
            parse_coverage(data)
