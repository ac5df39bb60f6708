"""Play Predict Object Location with the network for any home, which ships; in torch, too.

The goal is what torch did in float32, whose answers depended on who shares the batch.
"""

from __future__ import annotations

from functools import partial

from _any_home import compare_runtimes
from _measure import Benchmark, run
from evaluate_online import prepare

if __name__ == "__main__":
    benchmark = Benchmark("evaluate any_home, predict location", "home-steps/s", goal=5_000)
    play = partial(compare_runtimes, prepare)
    run(benchmark, play, repeats=3, uses_torch=True)
