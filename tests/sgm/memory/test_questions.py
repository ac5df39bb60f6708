"""What looks say about things that are asked for, against plain loops."""

import numpy as np
import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting


def live(rng: np.random.Generator) -> tuple[SceneGraphMemory, list[str]]:
    """A memory of six places and eight things after forty looks, some of half a place."""
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(f"shelf {letter}", room) for letter in "abcdef"]
    names = [
        f"{colour} {kind}" for colour in ("red", "blue") for kind in ("mug", "pan", "pen", "toy")
    ]
    for _ in range(40):
        if rng.random() < 0.5:
            memory.step()
        seen = [
            Sighting(name, ("in", "onTop")[rng.integers(2)], rng.choice((0.6, 0.7, 0.9, 1.0)))
            for name in names
            if rng.random() < 0.2
        ]
        coverage = 1.0 if rng.random() < 0.6 else {"in": rng.random(), "onTop": 1.0}
        memory.observe(places[rng.integers(6)], seen, coverage)
    return memory, names


def test_looks_are_those_of_plain_loops():
    for seed in range(6):
        memory, names = live(np.random.default_rng(seed))
        names = [*names, "green hat"]  # was never seen
        asked = memory.ask(names)
        now, looks, current = asked.current.time, asked.looks, asked.current.edges
        for thing, row in enumerate(asked.rows):
            seen = np.zeros(6)
            for edge in np.flatnonzero(current["object"] == row):
                place = current["furniture"][edge]
                is_one = asked.num_instances[thing] == 1  # at the place of its last look alone
                is_last = place == asked.current.objects["last_furniture"][row]
                if current["last_true"][edge] == now and (is_last or not is_one):
                    seen[place] = max(seen[place], current["confidence"][edge])
            assert looks.seen[thing].tolist() == seen.tolist()
        together = looks.negative.sum(axis=0)
        alone = [memory.ask([name]).looks.negative[0] for name in names]
        np.testing.assert_array_equal(together, np.sum(alone, axis=0))


def test_sightings_of_several_things_are_those_of_each():
    memory, names = live(np.random.default_rng(9))
    found = memory.ask(names).sightings
    alone = [seen for name in names for seen in memory.ask([name]).sightings]
    assert list(found) == sorted(alone, key=lambda seen: -seen.time)
    assert len({seen.furniture for seen in found}) == 6


def test_edges_of_a_thing_that_is_asked_for_twice_are_listed_once():
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    table, sink = (memory.add_furniture(name, room) for name in ("table", "sink"))
    memory.observe(table, [Sighting("red mug")])
    memory.step()
    memory.observe(sink, [Sighting("red mug"), Sighting("fork")])
    asked = memory.ask(["red mug", "fork", "red mug", "pan"])
    assert asked.rows.tolist() == [0, 1, 0, -1]
    assert asked.edges.tolist() == [0, 1, 2]
    once = memory.ask(["red mug"])
    assert once.edges.tolist() == [0, 1]
    assert sorted(asked.sightings, key=repr) == sorted(
        [*once.sightings, *once.sightings, *memory.ask(["fork"]).sightings], key=repr
    )


@pytest.mark.parametrize("question", ["?!", "...", " ", "", "\u200b", 3, None, ["mug"], b"mug"])
def test_a_question_without_a_word_is_refused_by_every_call(question):
    memory, names = live(np.random.default_rng(0))
    calls = (
        memory.resolve,
        memory.last_seen,
        memory.history,
        lambda asked: memory.resolve(asked, among=names),
    )
    for call in calls:
        with pytest.raises(ValueError, match=r"must (hold a word|be a non-empty text), got "):
            call(question)
