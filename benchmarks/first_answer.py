"""`ObjectFinder.load()` and its first answer in a fresh interpreter, as a robot starts.

The imports count, the interpreter's own start does not; torch, DGL and Lightning are hidden, as
where they are not installed.
"""

from __future__ import annotations

import json
import subprocess
import sys

from _measure import Benchmark, Measure, run

_CODE = """
import json, resource, sys, time
for name in ("torch", "dgl", "lightning", "scipy"):
    sys.modules[name] = None
start = time.perf_counter()
from nep import ObjectFinder, SceneGraphMemory, Sighting
memory = SceneGraphMemory()
room = memory.add_room("kitchen")
table, sink = (memory.add_furniture(name, room) for name in ("table", "sink"))
memory.observe(table, [Sighting("red mug")])
memory.step()
ObjectFinder.load().rank(memory, "red mug")
seconds = time.perf_counter() - start
kilobytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
print(json.dumps([seconds, kilobytes / 1024]))
"""


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Answer once, so that all files are in memory."""

    def measure() -> tuple[float, dict[str, float]]:
        command = [sys.executable, "-c", _CODE]
        done = subprocess.run(command, capture_output=True, text=True, check=True)
        seconds, megabytes = json.loads(done.stdout)
        return seconds, {"MB at most": megabytes}

    if not tiny:
        measure()
    return measure, "a home of 2 places"


if __name__ == "__main__":
    benchmark = Benchmark("load any_home, first answer", "s", 3, is_higher_better=False)
    run(benchmark, prepare)
