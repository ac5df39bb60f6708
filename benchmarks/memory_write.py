"""What a file adds to a look: `observe` of a memory that is kept in a file, beside one that is not.

A home of 60 places and 300 things. Both memories get the same looks of five sightings, in turn, and
which of them is first changes with each look: so the two times of a look are of one moment.
The figure is the median of the differences; beside it the quartile and the median of each.

Limit: a transaction of one event and five rows by `sqlite3`, without any other Python: .06 ms.
"""

from __future__ import annotations

import tempfile
import time
from pathlib import Path

import numpy as np
from _measure import Benchmark, Measure, run

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

NUM_ROOMS, PLACES_A_ROOM, THINGS_A_PLACE = 10, 6, 5


def furnish(memory: SceneGraphMemory) -> list[int]:
    """Add rooms and furniture, and return the ids of the furniture."""
    return [
        memory.add_furniture("shelf", room, f"shelf {number}")
        for room in [memory.add_room(f"room {number}") for number in range(NUM_ROOMS)]
        for number in range(PLACES_A_ROOM * room, PLACES_A_ROOM * (room + 1))
    ]


def time_look(memory: SceneGraphMemory, place: int, seen: list[Sighting]) -> float:
    """Look, and return the milliseconds that it took."""
    begin = time.perf_counter()
    memory.observe(place, seen)
    took = (time.perf_counter() - begin) * 1000
    memory.step()
    return took


def prepare(tiny: bool) -> tuple[Measure, str]:
    """See everything once."""
    num_looks, rng = 60 if tiny else 4000, np.random.default_rng(0)

    def measure() -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory() as folder:
            kept = SceneGraphMemory(path=Path(folder) / "home.sgm")
            with kept, SceneGraphMemory() as alone:
                return compare(alone, kept)

    def compare(alone: SceneGraphMemory, kept: SceneGraphMemory) -> tuple[float, dict[str, float]]:
        memories = (alone, kept)
        places, _ = (furnish(memory) for memory in memories)
        looks = [
            [Sighting(f"thing {THINGS_A_PLACE * nth + more}") for more in range(THINGS_A_PLACE)]
            for nth in range(len(places))
        ]
        for nth, place in enumerate(places):
            for memory in memories:
                memory.observe(place, looks[nth])
                memory.step()
        times = np.zeros((num_looks, 2))  # without a file, with one
        for number, nth in enumerate(rng.integers(len(places), size=num_looks).tolist()):
            for which in (0, 1) if number % 2 else (1, 0):
                times[number, which] = time_look(memories[which], places[nth], looks[nth])
        without, within = times.T
        return float(np.median(within - without)), {
            "quartile": float(np.quantile(within, 0.25) - np.quantile(without, 0.25)),
            "median without": float(np.median(without)),
            "median with": float(np.median(within)),
        }

    size = f"{NUM_ROOMS * PLACES_A_ROOM} places, {THINGS_A_PLACE} things at each, {num_looks} looks"
    return measure, size


if __name__ == "__main__":
    benchmark = Benchmark("a look kept in a file", "ms more", 0.15, 0.06, is_higher_better=False)
    run(benchmark, prepare, repeats=3)
