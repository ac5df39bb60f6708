"""Twice ten minutes of a server with clients, and of a node that looks: does memory grow?

The server is a process of its own (`python -m sgm.serve`) with its second process. Six clients ask
for known and for new names, look, list, search and move places. They call tools of MCP, come and
go, listen to the feed, and ask what is refused. The node is another process: a `LiveMemory` in a
home of 60 places. It takes two frames a second, and is asked meanwhile.

First as in a home that is lived in: a client asks five times a second, and says a name that the
server has never read once a minute. Then with `many names`: as fast as it may, each time a new one.

The figure is how many times as much all processes together hold in the last quarter of the first
soak as in the third. Beside it are the growth in the second half, MB a minute by least squares, and
the size of each process at half time and at the end. Open files then, and the median and the p99 of
answers in the second and in the last quarter, follow.

What may grow is the memory itself, since new things are remembered. Stores of words grow until they
are full: a name costs some 11 kB in all of them, most of it for the last 2,000 names, the rest for
10,000.
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
from contextlib import suppress
from itertools import count
from pathlib import Path

import numpy as np
from _measure import Benchmark, Measure, run
from serve import LoadClient, run_server, save_home

NUM_CLIENTS = 6
EVERY_SECONDS = 5.0  # in which sizes are read
FRAMES_A_SECOND = 2.0
# Seconds of a client between two requests, and for which it says one name that is new.
PACES = {"": (0.2, 60.0), "many names: ": (0.05, 0.0)}
_SYLLABLES = [consonant + vowel for consonant in "bdfgklmnprst" for vowel in "aeiou"]
_JSON = {"Content-Type": "application/json", "Accept": "application/json, text/event-stream"}


class MixedClient(LoadClient):
    """Sends requests of all kinds, one after the other, and notes how late each is answered."""

    def __init__(
        self,
        port: int,
        looks: list[tuple[int, list[str]]],
        pace: tuple[float, float],
        seed: int,
    ) -> None:
        """Ask a server about what is seen at each place, at one of the `PACES`."""
        super().__init__(port, [])
        self._port, self._looks = port, looks
        self._pause, self._name_seconds = pace
        self._name, self._named = "", -np.inf
        self._names = [name for _, seen in looks for name in seen]
        self._rng = np.random.default_rng(seed)
        self._search = ""
        self.answered: list[tuple[float, float]] = []  # when, and after how long, seconds
        self.num_lost = 0

    def work(self, begin: float, seconds: float) -> None:
        """Ask until the time is over."""
        while (now := time.perf_counter()) < begin + seconds:
            try:
                self._ask_something()
            except (OSError, http.client.HTTPException):
                self._connection.close()
                self.num_lost += 1
            self.answered.append((now - begin, time.perf_counter() - now))
            time.sleep(self._pause)
        self.close()

    def _ask_something(self) -> None:
        rng = self._rng
        place, seen = self._looks[int(rng.integers(len(self._looks)))]
        name, new = self._names[int(rng.integers(len(self._names)))], self._make_name()
        chance = rng.random()
        if chance < 0.4:
            self.send("where_is", json.dumps({"thing": name}))
        elif chance < 0.5:
            self.send("where_is", json.dumps({"thing": new}))
        elif chance < 0.65:
            kept = [thing for thing in seen if rng.random() < 0.8]
            key = str(rng.integers(2**62))
            self.send("observe", json.dumps({"place": place, "seen": kept, "key": key}))
        elif chance < 0.66:
            self.send("observe", json.dumps({"place": place, "seen": [*seen, new]}))
        elif chance < 0.75:
            for call, body in (("list_places", {}), ("list_things", {}), ("changes", {"since": 0})):
                self.send(call, json.dumps(body))
        elif chance < 0.8:
            status, answer = self.ask("search_start", json.dumps({"thing": name}))
            if status == 200:  # it was not too busy
                self._search = json.loads(answer)["search_id"]
        elif chance < 0.85 and self._search:
            body = {"search_id": self._search, "result": "not_found"}
            self.send("search_next", json.dumps(body))
        elif chance < 0.88:
            self.send(
                "move_place", json.dumps({"place": place, "position": rng.random(2).tolist()})
            )
        elif chance < 0.94:
            self._ask_tool(name)
        elif chance < 0.97:
            self.send("observe", json.dumps({"place": new, "seen": []}))
            self.send(new.replace(" ", "_"), "{}")
            self.close()
        else:
            self._listen(place, seen)

    def _make_name(self) -> str:
        now = time.perf_counter()
        if now >= self._named + self._name_seconds:
            words = ("".join(self._rng.choice(_SYLLABLES, 3)) for _ in range(2))
            self._name, self._named = " ".join(words), now
        return self._name

    def _ask_tool(self, name: str) -> None:
        call = {"name": "where_is", "arguments": {"thing": name}}
        body = {"jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": call}
        self._connection.request("POST", "/mcp", json.dumps(body), _JSON)
        self._connection.getresponse().read()

    def _listen(self, place: int, seen: list[str]) -> None:
        listener = http.client.HTTPConnection("127.0.0.1", self._port, timeout=10)
        listener.request("GET", "/v1/feed")
        listener.getresponse().read(4)
        self.send("observe", json.dumps({"place": place, "seen": seen}))
        listener.close()


def run_node() -> None:
    """Look and be asked, until the standard input ends."""
    from eyes import make_boxes

    from sgm import Adaptive, Finder, SceneGraphMemory
    from sgm.eyes import Detection, Intrinsics, Pose
    from sgm.ros import LiveMemory

    memory = SceneGraphMemory()
    room = memory.add_room("hall")
    for box in make_boxes().values():
        memory.add_furniture("shelf", room, box=box)
    live = LiveMemory(memory, Finder(Adaptive()), step_seconds=60)
    camera, rng = Intrinsics(525.0, 525.0, 319.5, 239.5, 640, 480), np.random.default_rng(0)
    threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
    depth = rng.uniform(0.5, 5.0, (480, 640))
    for frame in count():
        middle, angle = np.array([0.7, 0.8, 1.4]), 0.1 * frame
        pose = Pose.look_at(middle, middle + np.array([np.cos(angle), np.sin(angle), -0.4]))
        corners = rng.uniform((0, 0), (560, 400), (10, 2))
        seen = [
            Detection(f"thing {number}", 0.8, (*corner, *(corner + 60)))
            for number, corner in enumerate(corners)
        ]
        live.builder.frame(frame / FRAMES_A_SECOND, pose, camera, seen, depth)
        live.rank(f"thing {frame % 10}", 3)
        live.find_next(f"thing {frame % 10}")
        time.sleep(1 / FRAMES_A_SECOND)


def read_size(process: int) -> float:
    """Return the MB that a process holds."""
    lines = Path(f"/proc/{process}/status").read_text().splitlines()
    return next(int(line.split()[1]) / 1024 for line in lines if line.startswith("VmRSS"))


def count_files(process: int) -> int:
    """Return how many files a process has open."""
    return len(os.listdir(f"/proc/{process}/fd"))


def list_children(process: int) -> list[int]:
    """Return the processes that one has begun."""
    text = Path(f"/proc/{process}/task/{process}/children").read_text()
    return [int(number) for number in text.split()]


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Look around."""
    seconds, num_objects = (12.0, 20) if tiny else (600.0, 100)

    def measure() -> tuple[float, dict[str, float]]:
        ratios, figures = {}, {}
        for name, pace in PACES.items():
            ratios[name], more = soak_at(pace)
            figures |= {f"{name}{key}": value for key, value in more.items()}
        first, second = ratios.values()
        return first, figures | {"many names: times": second}

    def soak_at(pace: tuple[float, float]) -> tuple[float, dict[str, float]]:
        with tempfile.TemporaryDirectory(prefix="soak-") as folder:
            path = Path(folder) / "home.sgm"
            looks = save_home(path, num_objects)
            options = ("--step_seconds", "10", "--snapshot_seconds", "60")
            command = [sys.executable, "-W", "ignore", __file__, "--node"]
            with run_server(path, *options) as server:
                clients = [MixedClient(server.port, looks, pace, n) for n in range(NUM_CLIENTS)]
                with subprocess.Popen(command, stdin=subprocess.PIPE) as node:
                    try:
                        return soak(clients, server.process_id, node.pid, seconds)
                    finally:
                        node.terminate()

    size = f"{NUM_CLIENTS} clients, a node, {len(PACES)} x {seconds:g} s, {num_objects} objects"
    return measure, size


def soak(
    clients: list[MixedClient], server: int, node: int, seconds: float
) -> tuple[float, dict[str, float]]:
    """Ask for some time; returns the ratio of what is held, and further figures."""
    begin = time.perf_counter()
    threads = [threading.Thread(target=client.work, args=(begin, seconds)) for client in clients]
    for thread in threads:
        thread.start()
    sizes: list[tuple[float, dict[str, float]]] = []
    files: list[int] = []
    every = min(EVERY_SECONDS, seconds / 8)
    while (now := time.perf_counter() - begin) < seconds:
        with suppress(OSError, StopIteration):  # one of them has ended just now
            readers = list_children(server)
            held = {"server": read_size(server), "node": read_size(node)}
            held["reader"] = sum(map(read_size, readers))
            sizes.append((now, held))
            files.append(sum(map(count_files, (server, *readers, node))))
        time.sleep(every)
    for thread in threads:
        thread.join()
    second = [(when, held) for when, held in sizes if when >= seconds / 2]
    times = np.array([when for when, _ in second])
    totals = np.array([sum(held.values()) for _, held in second])
    is_last = times >= seconds * 3 / 4
    ratio = float(totals[is_last].mean() / totals[~is_last].mean())
    figures = {"MB a minute": float(np.polyfit(times / 60, totals, 1)[0])}
    late = np.array([answer for client in clients for answer in client.answered])
    for name in second[0][1]:
        figures[f"{name} MB at half time"] = second[0][1][name]
        figures[f"{name} MB at the end"] = second[-1][1][name]
    figures["files at half time"] = files[-len(second)]
    figures["files at the end"] = files[-1]
    for name, first, last in (("second quarter", 0.25, 0.5), ("last quarter", 0.75, 1.0)):
        within = (late[:, 0] >= first * seconds) & (late[:, 0] < last * seconds)
        figures[f"median ms, {name}"] = float(np.median(late[within, 1])) * 1000
        figures[f"p99 ms, {name}"] = float(np.quantile(late[within, 1], 0.99)) * 1000
    figures["requests"] = float(len(late))
    figures["lost"] = float(sum(client.num_lost for client in clients))
    return ratio, figures


if __name__ == "__main__":
    if "--node" in sys.argv:
        run_node()
    else:
        benchmark = Benchmark("memory in a soak", "times", 1.01, is_higher_better=False)
        run(benchmark, prepare, repeats=1)
