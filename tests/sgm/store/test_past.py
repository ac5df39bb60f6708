"""Where a thing was, answered from the file by its index: all stays, not one a place."""

import sqlite3
from contextlib import closing
from datetime import datetime

import pytest

from sgm.finder.finder import Finder
from sgm.finder.past_places import find_past_places
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.policies import Adaptive
from sgm.replay.followed_memory import FollowedMemory
from sgm.store.home_reader import HomeReader

MONDAY = datetime(2026, 11, 16, 0, 0)


@pytest.fixture
def home(tmp_path):
    """A laptop that is on the desk by day, from 8 to 17, and on the table else, for a week."""
    memory = SceneGraphMemory(clock=Clock(MONDAY, 3600), path=tmp_path / "home.sgm")
    room = memory.add_room("study")
    desk, table = memory.add_furniture("desk", room), memory.add_furniture("table", room)
    for hour in range(7 * 24):
        is_day = 8 <= hour % 24 <= 17
        memory.observe(desk, [Sighting("laptop")] if is_day else [])
        memory.observe(table, [] if is_day else [Sighting("laptop"), Sighting("lamp")])
        memory.step()
    return memory


def list_seen(memory, thing):
    return [
        (event.time, event.furniture) for event in memory.history(thing) if event.kind == "seen"
    ]


def test_every_stay_is_told_by_its_last_sighting(home):
    # Each day has three stays: on the table until 7, on the desk until 17, on the table again,
    # which ends on the next morning: eight on the table, seven on the desk.
    expected = [(24 * day + 17, 0) for day in range(7)] + [(24 * day + 7, 1) for day in range(7)]
    assert list_seen(home, "laptop") == sorted([*expected, (167, 1)], reverse=True)
    assert list_seen(home, "lamp") == [(167, 1)]
    alone = home.copy()  # without a file, the last sighting at each place
    assert list_seen(alone, "laptop") == [(167, 1), (161, 0)]


def test_where_it_was_at_an_hour_of_any_day(home):
    with SceneGraphMemory.open(home.path) as again:
        for hour, place in ((34, 0), (44, 1), (10, 0), (3, 1)):
            (was,) = find_past_places(again, "laptop", hour, hour)
            assert (was.furniture, was.time, was.probability) == (place, hour, 1)


def test_a_question_has_all_of_it_and_says_what_is_left_out(home):
    service = MemoryService(home, Finder(Adaptive()), now=None)  # it is Monday, 0:00
    listed = service.history("laptop", k=4)
    assert (len(listed.rows), listed.left_out) == (4, 15 + 1 - 4)  # one look missed it since
    for words, place in (
        ("yesterday at 10", "desk"),
        ("yesterday at 19", "table"),
        ("last Tuesday at 10", "desk"),
        ("last Tuesday at 22", "table"),
    ):
        answer = service.ask(f"where was the laptop {words}")
        assert answer.said == f"The laptop was at the {place} in study (100%).", words


def test_who_reads_along_tells_the_same(home):
    followed = FollowedMemory(home.path)
    home.observe(0, [Sighting("laptop", confidence=0.9)])
    followed.catch_up()
    assert followed.memory.history("laptop") == home.history("laptop")
    for hour in (0, 10, 167, 168):
        known = home.list_known("laptop", hour, hour)
        assert followed.memory.list_known("laptop", hour, hour) == known
    followed.close()


def test_what_is_forgotten_is_told_no_more(home):
    home.forget("laptop")
    home.observe(0, [Sighting("laptop")])
    assert list_seen(home, "laptop") == [(168, 0)]
    home.forget(1)  # the table
    assert list_seen(home, "lamp") == [(167, None)]


def test_several_of_one_name_are_told_by_the_last_at_each_place(tmp_path):
    memory = SceneGraphMemory(path=tmp_path / "home.sgm")
    room = memory.add_room("study")
    places = [memory.add_furniture(name, room) for name in ("desk", "table")]
    for _ in range(5):
        for place in places:
            memory.observe(place, [Sighting("mug")])
        memory.step()
    assert list_seen(memory, "mug") == [(4, 1), (4, 0)]


def test_merged_renamed_and_parted_things_are_told_as_such(home):
    home.rename("lamp", "bright lamp")
    assert list_seen(home, "bright lamp") == [(167, 1)]
    home.observe(0, [Sighting("notebook")])
    home.merge("laptop", "notebook")
    assert list_seen(home, "laptop")[:2] == [(168, 0), (167, 1)]
    home.split("notebook")
    assert list_seen(home, "laptop")[0] == (167, 1)
    assert list_seen(home, "notebook") == [(168, 0)]


def rename_what_is_renamed(memory):
    memory.rename("lamp", "torch")
    memory.rename("torch", "lantern")


def forget_and_rename(memory):
    memory.forget("cup")
    memory.rename("lamp", "cup")


def rename_merged(memory):
    memory.merge("mug", "cup")
    memory.rename("mug", "beaker")


@pytest.mark.parametrize(
    "change",
    [
        lambda memory: memory.rename("mug", "keys"),
        lambda memory: memory.rename("lamp", "keys"),
        rename_what_is_renamed,
        forget_and_rename,
        rename_merged,
        lambda memory: (memory.merge("mug", "cup"), memory.split("cup")),
        lambda memory: (memory.merge("lamp", "cup"), memory.rename("cup", "keys")),
        lambda memory: memory.split("lamp", 1, "torch"),
    ],
)
@pytest.mark.parametrize("waits", [False, True])
def test_the_last_at_each_place_is_what_a_memory_without_a_file_tells(tmp_path, change, waits):
    """Of things with an id and without, whatever they are called by now."""
    memory = SceneGraphMemory(path=tmp_path / "home.sgm")
    room = memory.add_room("study")
    desk, table = memory.add_furniture("desk", room), memory.add_furniture("table", room)
    memory.observe(desk, [Sighting("mug", id="a"), Sighting("lamp"), Sighting("cup")])
    memory.step()
    memory.observe(table, [Sighting("mug", id="a"), Sighting("lamp", "in"), Sighting("lamp")])
    memory.step(int(waits))
    change(memory)
    for _ in range(2):
        other = memory.copy()
        for node in {*other.descriptions} - {"mug"} | {"a"}:
            told, expected = (
                {(event.kind, event.furniture, event.relation, event.time) for event in kept}
                for kept in (memory.history(node), other.history(node))
            )
            assert {row for row in expected if row[0] == "seen"} <= told
        assert len(list_seen(memory, "a")) >= 2
        memory.step()
        memory.observe(desk, [Sighting("mug", id="a"), Sighting("lamp"), Sighting("cup")])


def test_an_index_finds_it(home):
    with HomeReader(home.path) as reader:
        plan = reader.select(
            "EXPLAIN QUERY PLAN SELECT * FROM sighting_rows WHERE thing IN "
            "(SELECT thing FROM things WHERE key IN ('laptop')) AND time BETWEEN 3 AND 9 "
            "ORDER BY time DESC LIMIT 1"
        )
    assert any("USING PRIMARY KEY (thing=? AND time>? AND time<?)" in row[-1] for row in plan)


@pytest.mark.parametrize(
    "change",
    [
        "time = 'noon'",
        "time = 1152921504606846976",
        "place = NULL",
        "relation = 'under'",
        "confidence = 7",
        "confidence = 'sure'",
        "said = 'dance'",
        "by = x'00'",
    ],
)
def test_what_was_forged_is_one_line(home, change):
    path = home.path
    home.close()
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute(f"UPDATE sighting_rows SET {change} WHERE place = 1 AND time = 167")
    with SceneGraphMemory.open(path) as again:
        with pytest.raises(ValueError, match="every sighting of a memory file must be one"):
            again.history("lamp")


def test_a_place_that_there_is_in_the_file_alone_is_left_out(home):
    with closing(sqlite3.connect(home.path)) as connection, connection:
        connection.execute("INSERT INTO places VALUES (9, 'x', 'x', 0, NULL, NULL, 0, NULL, 1)")
        connection.execute("UPDATE sighting_rows SET place = 9 WHERE thing = 1 AND time < 160")
    assert {place for _, place in list_seen(home, "laptop")} <= {0, 1}
