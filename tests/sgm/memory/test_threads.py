"""Threads that share a memory: every reading call beside one that writes, and files and logs."""

import random
import sys
from contextlib import suppress
from datetime import datetime
from importlib.util import find_spec
from threading import Barrier, Thread

import numpy as np
import pytest

from sgm.belief import Detector
from sgm.files import write_whole
from sgm.finder.finder import Finder
from sgm.names.name import Name
from simulator import Bayesian, Clock, SceneGraphMemory, Sighting

PAIR = ("cup", "saucer")  # always seen together, at the same places
FINDER = Finder(Bayesian())  # one for all threads


def see_pair(home):
    """Check that a home was not read in the middle of a change."""
    for room in home["rooms"]:
        for furniture in room["furniture"]:
            cup, saucer = (
                [row for row in furniture["objects"] if row["description"] == name] for name in PAIR
            )
            for row in (*cup, *saucer):
                del row["description"]
            assert cup == saucer


def search(memory):
    look = FINDER.search(memory, "cup", start=(0.0, 0.0)).next()
    assert look is None or 0 <= look.place.probability <= 1


def rank(memory, **options):
    ranking = FINDER.rank(memory, "cup", **options)
    values = np.array([ranking.elsewhere, *(place.probability for place in ranking)])
    assert ((values >= 0) & (values <= 1)).all()
    assert sorted(place.furniture for place in ranking) == sorted({p.furniture for p in ranking})


def save(memory, folder, name):
    memory.save(folder / "home.sgm")  # all threads save to one path
    see_pair(SceneGraphMemory.load(folder / "home.sgm").to_dict())


def compare_layout(memory):
    layout = memory.layout
    assert {node.room for node in layout.furniture.values()} <= set(layout.rooms)


# Every public call of a memory that reads; `n` is a number of furniture or rooms that there may be.
READERS = {
    "ask": lambda memory, n: memory.ask(["cup", "unicorn"], before_looks=n % 2 == 0),
    "batch": lambda memory, n: memory.batch.num_furniture,
    "boxes": lambda memory, n: memory.boxes,
    "carried": lambda memory, n: memory.carried,
    "changes": lambda memory, n: memory.changes(n),
    "clock": lambda memory, n: memory.clock.step_seconds,
    "language": lambda memory, n: memory.language,
    "read_sentence": lambda memory, n: memory.read_sentence("the mug", ""),
    "copy": lambda memory, n: see_pair(memory.copy().to_dict()),
    "describe": lambda memory, n: memory.describe(n),
    "count_things": lambda memory, n: memory.count_things(),
    "descriptions": lambda memory, n: memory.descriptions,
    "find_called": lambda memory, n: memory.find_called(Name.read("shelf")),
    "find_nearest": lambda memory, n: memory.find_nearest([1.0, 0.0]),
    "find_furniture": lambda memory, n: memory.find_furniture("shelf"),
    "furniture_ids": lambda memory, n: memory.furniture_ids,
    "get_position": lambda memory, n: memory.get_position(n),
    "get_pose": lambda memory, n: memory.get_pose(n, (1.0, 2.0, 0.5)),
    "history": lambda memory, n: memory.history("mug"),
    "last_seen": lambda memory, n: memory.last_seen("cup"),
    "layout": lambda memory, n: compare_layout(memory),
    "list_known": lambda memory, n: memory.list_known("mug", n, n),
    "list_furniture": lambda memory, n: memory.list_furniture(n),
    "list_ids": lambda memory, n: memory.list_ids("mug"),
    "list_named": lambda memory, n: memory.list_named("cup", "mug", place=n % 2 or None),
    "list_seen": lambda memory, n: memory.list_seen(["mug"]),
    "score_calibration": lambda memory, n: memory.score_calibration,
    "map_id": lambda memory, n: memory.map_id,
    "name_seen": lambda memory, n: memory.name_seen(n, [Sighting("mug")]),
    "num_furniture": lambda memory, n: memory.num_furniture,
    "places_of": lambda memory, n: memory.places_of("large mug"),
    "rank": lambda memory, n: memory.rank(Bayesian(), "cup"),
    "find_places": lambda memory, n: memory.find_places("shelf"),
    "find_carried": lambda memory, n: memory.find_carried("mug"),
    "resolve": lambda memory, n: memory.resolve("mug"),
    "resolve_exact": lambda memory, n: memory.resolve_exact("mug"),
    "save": None,  # needs a folder
    "time": lambda memory, n: memory.time,
    "list_statements": lambda memory, n: memory.list_statements(),
    "to_dict": lambda memory, n: see_pair(memory.to_dict()),
    "to_frame": lambda memory, n: memory.to_frame(),
    "to_spark_dsg": lambda memory, n: memory.to_spark_dsg(),
}
FINDER_READERS = {
    "rank": lambda memory, n: rank(memory),
    "rank later": lambda memory, n: rank(memory, at=memory.time + 5_000),
    "resolve": lambda memory, n: FINDER.resolve(memory, "mug"),
    "search": lambda memory, n: search(memory),
    "search_plan": lambda memory, n: FINDER.search_plan(memory, "cup", start=(0.0, 0.0), k=6),
    "detector": lambda memory, n: Detector.estimate(memory.copy()),
}
BY_NUMBER = (
    "describe",
    "get_pose",
    "get_position",
    "list_furniture",
    "list_named",
    "name_seen",
)
NEEDED = {"to_frame": "pandas", "to_spark_dsg": "spark_dsg"}


def write(memory, rng, num_calls):
    """Make calls of all kinds that write."""
    for _ in range(num_calls):
        rooms, furniture = list(memory.layout.rooms), memory.furniture_ids
        place, thing = rng.choice(furniture), rng.choice(("large mug", "pen", "red mug", "box"))
        pair = [Sighting(name) for name in PAIR] if rng.random() < 0.5 else []
        kind = rng.random()
        if kind < 0.5:
            memory.observe(place, [*pair, Sighting(thing)], rng.choice((1.0, 0.4)))
        elif kind < 0.6:
            memory.note_absent(place, thing)
        elif kind < 0.7:
            memory.step()
        elif kind < 0.72:
            memory.query(thing)
        elif kind < 0.74:
            memory.picked_up("pen", confidence=0.9)
        elif kind < 0.75:
            memory.note_moved("pen", place, "anna")
        elif kind < 0.8 and thing in memory.descriptions:
            memory.remove_object(thing)
        elif kind < 0.85 and len(furniture) > 5:
            memory.remove_furniture(place)
        elif kind < 0.88 and len(rooms) > 2 and len(furniture) > 9:
            memory.remove_room(rng.choice(rooms))
            if not memory.furniture_ids:
                memory.add_furniture("shelf", memory.add_room("hall"), position=(1.0, 1.0))
        elif kind < 0.92:
            memory.move_furniture(place, rng.choice(rooms), (rng.random(), rng.random()))
        elif len(furniture) < 14:
            room = memory.add_room("hall") if rng.random() < 0.3 else rng.choice(rooms)
            memory.add_furniture("shelf", room, f"shelf {rng.randrange(9)}", (rng.random(), 2.0))


@pytest.fixture
def quick_switches():
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    yield
    sys.setswitchinterval(interval)


def run_all(works):
    """Run functions, each in a thread; return what they raised."""
    problems, start = [], Barrier(len(works))

    def run(work):
        start.wait()
        try:
            work()
        except BaseException as error:
            problems.append(error)

    threads = [Thread(target=run, args=(work,)) for work in works]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return problems


@pytest.mark.slow
@pytest.mark.parametrize("of", ["memory", "finder"])
def test_every_reading_call_beside_one_that_writes(of, tmp_path, quick_switches, monkeypatch):
    monkeypatch.setattr("os.fsync", lambda file: None)  # no crash to survive
    memory = SceneGraphMemory(clock=Clock(datetime(2026, 11, 20), 60), path=tmp_path / "home.sgm")
    for room in ("kitchen", "study", "hall"):
        number = memory.add_room(room)
        for turn in range(3):
            memory.add_furniture("shelf", number, position=(turn, number))
    memory.observe(0, [Sighting(name) for name in PAIR])
    calls = FINDER_READERS
    if of == "memory":
        calls = {name: call for name, call in READERS.items() if call is not None}
        calls["save"] = lambda memory, n: save(memory, tmp_path, n)
        calls = {name: own for name, own in calls.items() if _is_installed(name)}
    is_over, num_read = [], dict.fromkeys(calls, 0)

    def work():
        rng = random.Random(1)
        try:
            write(memory, rng, 1500)
            while min(num_read.values()) <= 5 and not is_over:
                write(memory, rng, 50)
        finally:
            is_over.append(True)

    def read(seed):
        rng = random.Random(seed)
        try:
            read_on(rng)
        finally:
            is_over.append(True)

    def read_on(rng):
        while not is_over:
            name = rng.choice(list(calls))
            if name in BY_NUMBER:
                with suppress(KeyError):  # it is not there, or no longer
                    calls[name](memory, rng.randrange(12))
            else:
                calls[name](memory, rng.randrange(12))
            num_read[name] += 1

    assert not run_all([work, *(lambda seed=seed: read(seed) for seed in range(3))])
    assert min(num_read.values()) > 5  # each of them while it was written


def _is_installed(name):
    return name not in NEEDED or find_spec(NEEDED[name]) is not None


def test_what_was_asked_is_not_changed_by_what_is_seen_later():
    memory = SceneGraphMemory()
    shelf = memory.add_furniture("shelf", memory.add_room("hall"))
    memory.observe(shelf, [Sighting("cup")])
    asked, layout = memory.ask(["cup"]), memory.layout
    before = asked.current.edges["num_true"].tolist()
    memory.observe(shelf, [Sighting("cup"), Sighting("pen")])
    memory.remove_room(0)
    assert asked.current.edges["num_true"].tolist() == before
    assert list(layout.furniture) == [shelf]


def test_a_later_time_is_asked_of_the_looks_so_far():
    """What a finder has learnt of a state is not that of the next one with as many edges."""
    memory = SceneGraphMemory()
    hall = memory.add_room("hall")
    shelves = [memory.add_furniture("shelf", hall, f"shelf {number}") for number in range(3)]
    for _ in range(6):
        memory.step()
        memory.observe(shelves[0], [Sighting("cup"), Sighting("pen")])
    memory.step()
    finder = Finder(Bayesian())
    for shelf in shelves:
        finder.rank(memory, "cup", at=memory.time + 40)
        memory.observe(shelf, [])
        found = finder.rank(memory, "cup", at=memory.time + 40)
        assert found == Finder(Bayesian()).rank(memory, "cup", at=memory.time + 40)


def test_furniture_that_is_added_during_a_search():
    memory = SceneGraphMemory()
    hall = memory.add_room("hall")
    memory.add_furniture("shelf", hall, position=(1.0, 0.0))
    search = FINDER.search(memory, "cup", start=(0.0, 0.0))
    near = memory.add_furniture("table", hall, position=(0.5, 0.0))
    unknown = memory.add_furniture("chair", hall)  # no way is known to it
    visited = []
    while (look := search.next()) is not None:
        visited.append(look.place.furniture)
        search.not_found()
    assert near in visited
    assert unknown not in visited


def test_threads_that_write_one_file(tmp_path, quick_switches):
    path = tmp_path / "home.sgm"
    contents = [bytes([number]) * 20_000 for number in range(4)]

    def work(content):
        for _ in range(150):
            write_whole(path, content)
            assert path.read_bytes() in contents

    assert not run_all([lambda content=content: work(content) for content in contents])
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_memories_that_are_saved_to_one_file(tmp_path, quick_switches):
    path = tmp_path / "home.sgm"
    memories = []
    for label in ("kitchen", "study"):
        memory = SceneGraphMemory()
        memory.add_furniture("shelf", memory.add_room(label))
        memories.append(memory)

    def work(memory):
        for _ in range(60):
            memory.save(path)
            assert SceneGraphMemory.load(path).num_furniture == 1

    assert not run_all([lambda memory=memory: work(memory) for memory in memories])
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
