"""Play Find Object with the network for any home, which ships; in torch, too.

The goal is what torch did in float32, whose answers depended on who shares the batch.
"""

from __future__ import annotations

from functools import partial

from _any_home import compare_runtimes
from _measure import Benchmark, run
from find_online import prepare

if __name__ == "__main__":
    benchmark = Benchmark("evaluate any_home, find object", "episodes/s", goal=475)
    play = partial(compare_runtimes, prepare)
    run(benchmark, play, repeats=3, uses_torch=True)
