"""The same decision as in `decide.py` by the network for any home, which ships; in torch, too.

One thread. The memory is read in numpy; ONNX Runtime multiplies 8.4 million floating-point
operations (32 places, three members) at 65 a nanosecond, 0.13 ms.
"""

from __future__ import annotations

from functools import partial

from _any_home import compare_runtimes
from _measure import Benchmark, run
from decide import prepare

if __name__ == "__main__":
    benchmark = Benchmark("decide, any_home", "ms, median", 2, is_higher_better=False)
    play = partial(compare_runtimes, prepare)
    run(benchmark, play, repeats=5, uses_torch=True, threads=1)
