"""A building with more and more places and things: what every call of its memory costs.

`python benchmarks/growth/building.py PLACES THINGS LOOKS` prints that of one, in JSON: seconds of
the processor, by call, and MB of the process and of the file.
"""

from __future__ import annotations

import gc
import json
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from datetime import datetime
from pathlib import Path
from typing import TypeVar

import numpy as np
from curves import Point

from sgm.finder.object_finder import ObjectFinder
from sgm.finder.service import MemoryService
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.prior.prior_graph import PriorGraph

PLACES_PER_ROOM = 10
LOOKS_PER_STEP = 10
MOVED_PER_ROUND = 0.05  # share of the things, between two rounds of looks
MISS_RATE = 0.1
_LOOKS = ("red", "blue", "green", "white", "black", "grey", "wooden", "metal", "small", "large")
_REPEATS = 9  # of every call; the quickest counts
_Answer = TypeVar("_Answer")


def name_things(count: int) -> list[str]:
    """Name things as a tracker does: "red mug 1", "blue mug 1", ..., "red mug 2"."""
    labels = [object_type.label for object_type in PriorGraph.household().objects]
    rounds = [divmod(key // len(labels), len(_LOOKS)) for key in range(count)]
    return [
        f"{_LOOKS[look]} {labels[key % len(labels)]} {number + 1}"
        for key, (number, look) in enumerate(rounds)
    ]


def fill_building(num_places: int, num_things: int, num_looks: int) -> SceneGraphMemory:
    """Return a robot's memory of a building with positions, whose things move between looks.

    Rooms are those of a home, over and over, on a grid of 6 x 6 m each. The robot goes round all
    places, in another order each time, ten looks an hour.
    """
    rng, prior = np.random.default_rng(0), PriorGraph.household()
    memory = SceneGraphMemory(prior, Clock(datetime(2026, 11, 2)))
    by_room = {
        room: [
            furniture_type.label
            for furniture_type in prior.furniture
            if furniture_type.room == room
        ]
        for room in prior.rooms
    }
    num_rooms = -(-num_places // PLACES_PER_ROOM)
    width = int(np.ceil(np.sqrt(num_rooms)))
    for number in range(num_places):
        room, in_room = divmod(number, PLACES_PER_ROOM)
        room_type = prior.rooms[room % len(prior.rooms)]
        if in_room == 0:
            room_id = memory.add_room(f"{room_type} {room}")
        labels = by_room[room_type]
        corner = 6.0 * np.array([room % width, room // width])
        x, y = corner + rng.uniform(0.5, 5.5, 2)
        label = labels[in_room % len(labels)]
        memory.add_furniture(label, room_id, f"{label} {number}", (float(x), float(y)))
    ids = memory.furniture_ids
    texts = name_things(num_things)
    place_of = rng.integers(0, num_places, num_things)
    for look in range(num_looks):
        if look % num_places == 0:
            order = rng.permutation(num_places)
            moved = rng.random(num_things) < MOVED_PER_ROUND
            place_of[moved] = rng.integers(0, num_places, int(moved.sum()))
        place = order[look % num_places]
        present = np.flatnonzero(place_of == place)
        seen = present[rng.random(len(present)) >= MISS_RATE]
        memory.observe(ids[place], [Sighting(texts[key]) for key in seen])
        if (look + 1) % LOOKS_PER_STEP == 0:
            memory.step()
    return memory


class _Clock:
    """Seconds of the processor by call, the least of some."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}

    def time(self, name: str, work: Callable[[], _Answer], is_first: bool = False) -> _Answer:
        """Time a call, and return what it returns.

        Where calls are always made in the same order, the garbage collector runs in the same one of
        them each time. So it waits, as in `timeit`, but for what `is_first`, which is made once.
        """
        if not is_first:
            gc.disable()
        begin = time.process_time()
        answer = work()
        passed = time.process_time() - begin
        gc.enable()
        self.seconds[name] = min(self.seconds.get(name, np.inf), passed)
        return answer


def measure_calls(path: Path) -> dict[str, float]:
    """Return the seconds of each call of a memory that is loaded from a file, and MB."""
    clock = _Clock()
    memory = clock.time("load", lambda: SceneGraphMemory.load(path), is_first=True)
    finder = ObjectFinder.load()
    service = MemoryService(memory, finder, now=None)
    names, ids, rng = memory.descriptions, memory.furniture_ids, np.random.default_rng(0)

    def pick() -> str:
        return names[int(rng.integers(len(names)))]

    clock.time("first where_is", lambda: service.where_is(pick()), is_first=True)
    for _ in range(20):  # as many as make others come along in the next step
        finder.rank(memory, pick(), k=5)
    for _ in range(_REPEATS):
        clock.time("where_is", lambda: service.where_is(pick()))
        service.observe(ids[int(rng.integers(len(ids)))], [Sighting(pick())])
        memory.step()
        clock.time("first rank of a step", lambda: finder.rank(memory, pick(), k=5))
        clock.time("where_is of a thing never seen", lambda: service.where_is("purple gizmo"))
        clock.time("changes", lambda: service.changes(memory.time - 10))
        clock.time("list_places", service.list_places)
        clock.time("list_things", service.list_things)
        clock.time("history", lambda: service.history(pick()))
        search = clock.time("search", lambda: finder.search(memory, pick(), (1.0, 2.0)))
        for _ in range(3):
            if clock.time("next", search.next) is None:
                break
            search.not_found()
        place, thing = ids[int(rng.integers(len(ids)))], pick()
        clock.time("observe", lambda p=place, t=thing: service.observe(p, [Sighting(t)]))
    with tempfile.TemporaryDirectory() as folder:
        for turn in range(_REPEATS):
            clock.time("rename", lambda t=turn: service.rename(pick(), f"odd thing {t}"))
            clock.time("where_is after a rename", lambda: service.where_is(pick()))
            clock.time("copy", memory.copy)
            clock.time("to_dict", memory.to_dict)
            clock.time("save", lambda: memory.save(Path(folder) / "home.sgm"))
    megabytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3
    file = path.stat().st_size / 1e6
    return {**clock.seconds, "memory of the process in MB": megabytes, "file in MB": file}


def measure_building(
    by_places: list[tuple[int, int]], by_things: list[tuple[int, int]]
) -> Iterator[Point]:
    """More and more places with ten things each, and things in a hundred places, ten looks each.

    Each building in a process of its own that loads it, so that its memory is that of the building.
    """
    for grown, sizes in (("places", by_places), ("things in 100 places", by_things)):
        for num_places, num_things in sizes:
            arguments = map(str, (num_places, num_things, 10 * num_places))
            done = subprocess.run(
                [sys.executable, __file__, *arguments], capture_output=True, text=True, check=True
            )
            size = num_places if grown == "places" else num_things
            for name, cost in json.loads(done.stdout).items():
                yield Point(f"{name}, by {grown}", size, cost)


def main(num_places: int, num_things: int, num_looks: int) -> None:
    """Fill a building, and print what the calls of its memory cost, each in a process of its own.

    With a file as its only argument, this module measures the calls of the memory in it.
    """
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "building.sgm"
        begin = time.process_time()
        fill_building(num_places, num_things, num_looks).save(path)
        look = (time.process_time() - begin) / num_looks
        done = subprocess.run(
            [sys.executable, __file__, str(path)], capture_output=True, text=True, check=True
        )
    print(json.dumps({"look while it is filled": look, **json.loads(done.stdout)}))


if __name__ == "__main__":
    if len(sys.argv) == 2:
        print(json.dumps(measure_calls(Path(sys.argv[1]))))
    else:
        main(*map(int, sys.argv[1:]))
