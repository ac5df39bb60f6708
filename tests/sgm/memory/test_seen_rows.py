"""Lists of what was seen: as those cut from all that a memory holds, by other means."""

import numpy as np
import pytest

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

NAMES = ("red mug", "mug", "milk", "keys", "book", "lamp")


def make_memory(seed):
    """Things that come and go, some of them with ids, merged, or at furniture that was removed."""
    rng = np.random.default_rng(seed)
    memory = SceneGraphMemory()
    room = memory.add_room("kitchen")
    places = [memory.add_furniture(label, room) for label in ("fridge", "sink", "table", "shelf")]
    for _ in range(30):
        names = rng.choice(NAMES, rng.integers(0, 4), replace=False)
        seen = [
            Sighting(
                str(name), str(rng.choice(["in", "onTop"])), id=str(rng.integers(2)) + str(name)
            )
            if name in ("book", "lamp")
            else Sighting(str(name), str(rng.choice(["in", "onTop"])))
            for name in names
        ]
        memory.observe(int(rng.choice(places)), seen)
        memory.step(int(rng.integers(0, 2)))
    if seed % 2:
        memory.merge("red mug", "mug")
    if seed % 3 == 0:
        memory.remove_furniture(places[3])
    return memory


def list_all(memory):
    """Rows (thing, place, relation, is_there, time) of `to_dict`, the latest first."""
    home = memory.to_dict()
    rows = [
        (seen["description"], node["id"], seen["relation"], seen["is_there"], seen["last_seen"])
        for room in home["rooms"]
        for node in room["furniture"]
        for seen in node["objects"]
    ]
    rows += [(own["description"], None, None, False, own["last_seen"]) for own in home["unplaced"]]
    return sorted(rows, key=lambda row: (-row[4], row[0]))


def keep_current(rows):
    """Of each thing where it is, or if it is nowhere, where it was seen last."""
    placed, told, kept = {row[0] for row in rows if row[3]}, set(), []
    for row in rows:
        if row[3] or row[0] not in placed | told:
            kept.append(row)
            told.add(row[0])
    return kept


def read(rows):
    return [(thing, at.furniture, at.relation, at.is_there, at.time) for thing, at in rows]


def compare(found, expected, most):
    """Of what was seen in one step, any may come first, and any one may stand for a thing."""
    assert [row[4] for row in found] == [row[4] for row in expected[:most]]
    assert [row[0] for row in found] == [row[0] for row in expected[:most]]


@pytest.mark.parametrize("seed", range(8))
def test_lists_are_as_cut_from_all(seed):
    memory = make_memory(seed)
    rows = list_all(memory)
    for most in (3, 50):
        found, num_all = memory.list_seen(most=most)
        expected = keep_current(rows)
        assert num_all == len(expected)
        compare(read(found), expected, most)
        assert {row for row in read(found) if row[3]} <= set(rows)
    for place in memory.furniture_ids:
        expected = [row for row in rows if row[1] == place and row[3]]
        found, num_all = memory.list_seen(furniture=place, most=50)
        assert (sorted(map(str, read(found))), num_all) == (sorted(map(str, expected)), len(found))
        assert memory.count_things()[place][0] == len(expected)
    for name in NAMES:
        expected = keep_current([row for row in rows if row[0] == name])
        found, num_all = memory.list_seen([name], most=50)
        assert num_all == len(expected)
        compare(read(found), expected, 50)


def test_the_last_look_at_each_place():
    memory = make_memory(1)
    last = {
        node["id"]: node["last_looked"]
        for room in memory.to_dict()["rooms"]
        for node in room["furniture"]
    }
    assert {place: looked for place, (_, looked) in memory.count_things().items()} == last
