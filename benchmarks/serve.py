"""`python -m sgm.serve` under load: 20 clients, 200 `where_is` and 50 `observe` a second.

The server is a process of its own with the network that ships, the clients are threads of this one,
on this machine alone: two cores are what both have. Each client has a timetable, and a request is
late from the time at which it was to be sent, so that a server that stops cannot slow its clients
down and look fast. The home has 32 pieces of furniture and 200 objects, which were seen a time step
before the server begins; the looks are at one place after the other, 200 of them in a time step at
most.

Then all of it once more at twice the load, named `twice`.

Figures beside the p99 of all requests: of each call, the median, the latest one, requests that were
answered in a second, milliseconds of the server's processor time for each request, which others on
the machine count little for, and how many were refused, or lost: never answered.
"""

from __future__ import annotations

import http.client
import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
from _measure import Benchmark, Measure, run
from _robot import Robot

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

NUM_CLIENTS = 20
NUM_ASKED, NUM_LOOKS = 200, 50  # requests of all clients in a second
STEP_SECONDS = 4.0  # so that looks are spread over steps as a robot's are over hours


def save_home(path: Path, num_objects: int) -> list[tuple[int, list[str]]]:
    """Write a home that was looked around in; returns what is seen at each place."""
    robot = Robot()
    robot.remember(num_objects)
    begin = datetime.now().replace(microsecond=0) - timedelta(seconds=STEP_SECONDS)
    memory = SceneGraphMemory(clock=Clock(begin, STEP_SECONDS))
    for label in robot.memory.layout.room_labels:
        memory.add_room(label)
    for piece in robot.memory.layout.furniture.values():
        memory.add_furniture(piece.label, piece.room, piece.description)
    seen: dict[int, list[str]] = {place: [] for place in memory.furniture_ids}
    for room in robot.memory.to_dict()["rooms"]:
        for node in room["furniture"]:
            seen[node["id"]] = [
                thing["description"] for thing in node["objects"] if thing["is_there"]
            ]
    for place, names in seen.items():
        memory.observe(place, [Sighting(name) for name in names])
    memory.step()
    memory.save(path)
    return list(seen.items())


@dataclass(frozen=True, slots=True)
class Running:
    """A server that runs: its port, and the number of its process."""

    port: int
    process_id: int


@contextmanager
def run_server(path: Path, *more: str) -> Iterator[Running]:
    """Run the command, with more options."""
    options = ["--port", "0", "--rate", "100000", "--accept_jump", *more]
    command = [sys.executable, "-W", "ignore", "-m", "sgm.serve", str(path), *options]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        line = process.stdout.readline()
        try:
            yield Running(int(line.rstrip().rstrip("/").rpartition(":")[2]), process.pid)
        finally:
            process.terminate()


class LoadClient:
    """Sends requests at given times over one connection, and notes how late each is answered."""

    def __init__(self, port: int, plan: list[tuple[float, str, str]]) -> None:
        """Send `plan`: seconds from the start, call and body of each request."""
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
        self._plan = plan
        self.late: list[tuple[str, float]] = []
        self.num_refused = 0

    def send(self, call: str, body: str) -> int:
        """Send a request; returns the status of the answer."""
        return self.ask(call, body)[0]

    def ask(self, call: str, body: str) -> tuple[int, bytes]:
        """Send a request; returns the status and the body of the answer."""
        self._connection.request("POST", f"/v1/{call}", body, {"Content-Type": "application/json"})
        answer = self._connection.getresponse()
        return answer.status, answer.read()

    def run(self, begin: float) -> None:
        """Keep to the plan."""
        for seconds, call, body in self._plan:
            wait = begin + seconds - time.perf_counter()
            if wait > 0:
                time.sleep(wait)
            try:
                status = self.send(call, body)
            except (OSError, http.client.HTTPException):  # lost; the next one opens a connection
                self._connection.close()
                continue
            self.late.append((call, time.perf_counter() - begin - seconds))
            self.num_refused += status != 200
        self.close()

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


def read_processor_times(port: int) -> tuple[float, float]:
    """Return the processor seconds of the server, and of the process that reads for it."""
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
    connection.request("GET", "/metrics")
    lines = connection.getresponse().read().decode().splitlines()
    connection.close()
    values = dict(line.split() for line in lines if not line.startswith("#"))
    names = ("sgm_process_cpu_seconds_total", "sgm_reader_cpu_seconds_total")
    server, reader = (float(values[name]) for name in names)
    return server, reader


def wait_for_reader(port: int, client: LoadClient) -> None:
    """Ask until a second process answers, if the server has one."""
    end = time.perf_counter() + 20
    while os.cpu_count() != 1 and time.perf_counter() < end:
        client.send("where_is", '{"thing":"mug"}')
        if read_processor_times(port)[1] > 0:
            break
        time.sleep(0.1)


def make_plan(
    looks: list[tuple[int, list[str]]], seconds: float, times: int, rng: np.random.Generator
) -> list[tuple[float, str, str]]:
    """Return what one client sends at so many times the load, at even times from a random one."""
    names = [name for _, seen in looks for name in seen]
    plan = []
    for call, rate in (("where_is", NUM_ASKED * times), ("observe", NUM_LOOKS * times)):
        every = NUM_CLIENTS / rate
        for moment in np.arange(rng.uniform(0, every), seconds, every).tolist():
            if call == "where_is":
                body = {"thing": names[int(rng.integers(len(names)))]}
            else:
                place, seen = looks[int(rng.integers(len(looks)))]
                kept = [name for name in seen if rng.random() < 0.8]
                body = {"place": place, "seen": kept}
            plan.append((moment, call, json.dumps(body)))
    return sorted(plan)


def load(port: int, plans: list[list[tuple[float, str, str]]]) -> dict[str, float]:
    """Send the plans of all clients; returns how late they were answered, ms, and what it took."""
    clients = [LoadClient(port, plan) for plan in plans]
    used, begin = sum(read_processor_times(port)), time.perf_counter() + 0.2
    threads = [threading.Thread(target=client.run, args=(begin,)) for client in clients]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    took = time.perf_counter() - begin
    used = sum(read_processor_times(port)) - used
    late: dict[str, list[float]] = {"where_is": [], "observe": []}
    for client in clients:
        for call, seconds in client.late:
            late[call].append(seconds * 1000)
    every = np.array([delay for values in late.values() for delay in values])
    return {
        "p99": float(np.quantile(every, 0.99)),
        **{f"{call} p99": float(np.quantile(values, 0.99)) for call, values in late.items()},
        "median of requests": float(np.median(every)),
        "latest": float(every.max()),
        "answered a second": len(every) / took,
        "processor ms a request": used * 1000 / len(every),
        "refused": float(sum(client.num_refused for client in clients)),
        "lost": float(sum(map(len, plans)) - len(every)),
    }


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Look around."""
    num_objects, seconds = (20, 1.0) if tiny else (200, 20.0)
    rng = np.random.default_rng(0)

    def measure() -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory(prefix="serve-") as folder:
            path = Path(folder) / "home.sgm"
            looks = save_home(path, num_objects)
            with run_server(path) as server:
                return load_twice(server.port, looks)

    def load_twice(port: int, looks: list[tuple[int, list[str]]]) -> tuple[float, dict[str, float]]:
        first = LoadClient(port, [])
        for place, seen in looks:
            first.send("observe", json.dumps({"place": place, "seen": seen}))
        wait_for_reader(port, first)
        first.close()
        once, twice = (
            load(port, [make_plan(looks, seconds, times, rng) for _ in range(NUM_CLIENTS)])
            for times in (1, 2)
        )
        return once.pop("p99"), once | {f"twice: {name}": value for name, value in twice.items()}

    size = f"{NUM_CLIENTS} clients, {seconds:g} s, 32 furniture and {num_objects} objects"
    return measure, size


if __name__ == "__main__":
    benchmark = Benchmark("sgm.serve under load", "ms, p99", 50, is_higher_better=False)
    run(benchmark, prepare, repeats=3)
