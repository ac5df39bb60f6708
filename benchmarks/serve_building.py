"""`python -m sgm.serve` of a building: every call of the server, the first time and later.

A fleet is four servers that run beside each other, as behind a proxy: each is a process of its own
with the memory of a building of 500 places and 5,000 things, and its log. Every call is made over
HTTP, of one server after the other: its first call, and later ones about other things.

The figure is the slowest call of all, in seconds by the wall clock. Beside it are the slowest first
one of each call and the median of the later ones, each by the wall clock and by the processor time
of its server, which others on the machine count little for. Last is what one server of the fleet
takes: processor seconds until it answers and for all calls, MB of memory at most and on disk.
"""

from __future__ import annotations

import json
import shutil
import sys
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from _measure import Benchmark, Measure, run
from serve import LoadClient, run_server

from sgm.memory.scene_graph_memory import SceneGraphMemory

sys.path.insert(0, str(Path(__file__).parent / "growth"))
from building import fill_building

NUM_SERVERS = 4
NUM_ROUNDS = 4  # the first one, and later ones
NEVER_SEEN = "purple gizmo"


def plan_calls(
    places: list[int], names: list[str], since: int, number: int
) -> Iterator[tuple[str, dict[str, Any]]]:
    """Plan every call once, about things that no other round is about.

    The search goes on with the id that the server gives (`search_id` is filled in).
    """
    red, blue, other, kept = names[4 * number : 4 * number + 4]
    place, next_place = places[2 * number : 2 * number + 2]
    yield "where_is", {"thing": red}
    yield "where_is", {"thing": f"{NEVER_SEEN} {number}"}
    yield "search_start", {"thing": blue, "from": [1.0, 2.0]}
    yield "search_next", {"result": "not_found"}
    yield "observe", {"place": place, "seen": [red, other]}
    yield "where_is", {"thing": kept}
    yield "note_moved", {"thing": red, "place": next_place, "by": "anna"}
    yield "picked_up", {"thing": red}
    yield "put_down", {"thing": red, "place": place}
    yield "list_places", {}
    yield "list_things", {"place": place}
    yield "list_things", {}
    yield "history", {"thing": red}
    yield "changes", {"since": since}
    yield "rename", {"thing": other, "name": f"odd thing {number}"}
    yield "where_is", {"thing": kept}
    yield "merge", {"thing": red, "other": blue}
    yield "split", {"thing": blue}
    yield "forget", {"thing": kept}
    yield "add_room", {"label": f"annex {number}"}
    yield "add_place", {"label": "desk", "room": f"annex {number}", "position": [1.0, 2.0]}
    yield "where_is", {"thing": red}


def make_calls(
    client: LoadClient, process_id: int, calls: Iterator[tuple[str, dict[str, Any]]]
) -> Iterator[tuple[str, float, float]]:
    """Make calls one after the other; yields their names, seconds and those of the processor."""
    search_id = ""
    for name, arguments in calls:
        if name == "search_next":
            arguments = {**arguments, "search_id": search_id}
        used, begin = read_processor_time(process_id), time.perf_counter()
        status, answer = client.ask(name, json.dumps(arguments))
        seconds = time.perf_counter() - begin
        yield name, seconds, read_processor_time(process_id) - used
        if status != 200:
            raise RuntimeError(f"{name} must be answered, got {status}: {answer.decode()}")
        search_id = json.loads(answer).get("search_id", search_id)


def read_processor_time(process_id: int) -> float:
    """Return the processor seconds of a process, by its clock (clock_getcpuclockid of Linux)."""
    return time.clock_gettime((~process_id << 3) | 2)


def read_most_memory(process_id: int) -> float:
    """Return the MB that a process had at most."""
    lines = Path(f"/proc/{process_id}/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1e3


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Fill a building."""
    num_places = 20 if tiny else 500
    num_servers = 1 if tiny else NUM_SERVERS
    memory = fill_building(num_places, 10 * num_places, 10 * num_places)

    def measure() -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory(prefix="building-") as folder:
            return measure_fleet(memory, Path(folder), num_servers)

    size = f"{num_servers} servers, {num_places} places and {10 * num_places} things each"
    return measure, size


def measure_fleet(
    memory: SceneGraphMemory, folder: Path, num_servers: int
) -> tuple[float, dict[str, float]]:
    """Begin servers, and make all calls of each."""
    homes = [folder / str(number) / "home.sgm" for number in range(num_servers)]
    filled = folder / "filled.sgm"  # `memory` goes on owning it
    memory.save(filled)
    for home in homes:
        home.parent.mkdir()
        shutil.copy(filled, home)
    rng = np.random.default_rng(0)
    names = rng.permutation(memory.descriptions).tolist()
    took: dict[str, list[float]] = defaultdict(list)  # by call, time, and first or later
    starts, used, most, disk = [], [], [], []
    with ExitStack() as stack:
        servers = [stack.enter_context(run_server(home, "--processes", "1")) for home in homes]
        for server, home in zip(servers, homes, strict=True):
            starts.append(read_processor_time(server.process_id))
            client, known = LoadClient(server.port, []), set()
            for number in range(NUM_ROUNDS):
                calls = plan_calls(list(memory.furniture_ids), names, memory.time - 10, number)
                for name, seconds, processor in make_calls(client, server.process_id, calls):
                    when = "later" if name in known else "first"
                    took[f"{name}: {when}"].append(seconds)
                    took[f"{name}: {when}, processor"].append(processor)
                    known.add(name)
            client.close()
            used.append(read_processor_time(server.process_id) - starts[-1])
            most.append(read_most_memory(server.process_id))
            disk.append(sum(file.stat().st_size for file in home.parent.iterdir()) / 1e6)
    slowest = max(max(values) for name, values in took.items() if "processor" not in name)
    return slowest, {
        **{name: (max if "first" in name else median)(took[name]) for name in sorted(took)},
        "processor seconds of a start": median(starts),
        "processor seconds of all calls": median(used),
        "MB of memory": median(most),
        "MB on disk": median(disk),
    }


if __name__ == "__main__":
    benchmark = Benchmark(
        "sgm.serve of a building, the slowest call", "s", 1, is_higher_better=False
    )
    run(benchmark, prepare, repeats=3)
