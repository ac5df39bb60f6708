"""How long `import simulator` takes in a fresh interpreter, its own start left out.

Limit: importing numpy and scipy's part that is used, which `import numpy` alone measures.
"""

from __future__ import annotations

import subprocess
import sys

from _measure import Benchmark, Measure, run

_CODE = "import time; t = time.perf_counter(); import {}; print(time.perf_counter() - t)"


def measure_import(module: str) -> float:
    """Return the seconds that an import takes in a fresh interpreter."""
    done = subprocess.run(
        [sys.executable, "-c", _CODE.format(module)], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def prepare(tiny: bool) -> tuple[Measure, str]:
    """Nothing to prepare."""
    return lambda: (measure_import("simulator"), {"numpy": measure_import("numpy")}), "all of it"


if __name__ == "__main__":
    benchmark = Benchmark("import simulator", "s", 0.3, is_higher_better=False)
    run(benchmark, prepare)
