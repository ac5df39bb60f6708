"""How long `from simulator import *` takes in a fresh interpreter, its own start left out.

`import simulator` alone loads next to nothing: its names are loaded when they are first used.
Limit: importing numpy and scipy's part that is used, which `import numpy` alone measures.
"""

from __future__ import annotations

import subprocess
import sys

from _measure import Benchmark, Measure, run

_CODE = "import time; t = time.perf_counter(); {}; print(time.perf_counter() - t)"


def measure_import(statement: str) -> float:
    """Return the seconds that an import takes in a fresh interpreter."""
    code = _CODE.format(statement)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return float(done.stdout)


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Nothing to prepare."""
    others = {
        "a memory": "from simulator import SceneGraphMemory",
        "the package": "import simulator",
        "numpy": "import numpy",
    }

    def measure() -> tuple[float, dict[str, float]]:
        figures = {name: measure_import(statement) for name, statement in others.items()}
        return measure_import("from simulator import *"), figures

    return measure, "all public names"


if __name__ == "__main__":
    benchmark = Benchmark("from simulator import *", "s", 0.3, is_higher_better=False)
    run(benchmark, prepare)
