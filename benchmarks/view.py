"""An answer of the page: ranking with reasons, search plan and map, as data for the browser.

One thread, whatever `--threads` says. The home has 200 places in 12 rooms and 1,000 objects, which
were looked at twice.
"""

from __future__ import annotations

import json
import time

import numpy as np
from _measure import Benchmark, Measure, run

from nep.view.answers import Desk
from nep.view.page_state import Judges, Stage
from simulator import PriorGraph, SceneGraphMemory, Sighting
from simulator.story.past_memory import StillMemory


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Remember everything."""
    num_places, num_objects, num_answers = (24, 60, 2) if tiny else (200, 1000, 50)
    prior, rng, memory = PriorGraph.default(), np.random.default_rng(0), SceneGraphMemory()
    rooms = [memory.add_room(prior.rooms[room % 4]) for room in range(12)]
    labels = [furniture_type.label for furniture_type in prior.furniture]
    for place in range(num_places):
        label = labels[7 * place % len(labels)]
        memory.add_furniture(label, rooms[place % 12], f"{label} {place}")
    names = [
        f"{object_type.label} {n}" for n in range(num_objects) for object_type in prior.objects
    ][:num_objects]
    for _ in range(2):
        place_of = rng.integers(0, num_places, num_objects)
        for place in memory.furniture_ids:
            seen = [Sighting(names[thing]) for thing in np.flatnonzero(place_of == place)]
            memory.observe(place, seen)
        memory.step()
    desk = Desk(Stage(lambda: StillMemory(memory, "home")), Judges())

    def measure() -> tuple[float, dict[str, float]]:
        seconds = []
        for name in names[:num_answers]:
            start = time.perf_counter()
            state = desk.tell_state(memory.time)
            text = json.dumps([state, desk.answer(memory.time, name, "heat")])
            seconds.append(time.perf_counter() - start)
        return float(np.median(seconds)) * 1000, {"kB": len(text) / 1000}

    return measure, f"{num_answers} answers, {num_places} places, {num_objects} objects"


if __name__ == "__main__":
    benchmark = Benchmark("an answer of the page", "ms, median", 100, is_higher_better=False)
    run(benchmark, prepare, repeats=3, uses_torch=True, threads=1)
