"""The same decision as in `decide.py` by the network for any home, which ships.

One thread. The limit counts calls, as there: 1,288 of Python functions at 0.1 us and 670 into
numpy and torch at 1 us; operators on their arrays come on top. Arithmetic adds 8.4 million
floating-point operations (32 places, three members) at 65 a nanosecond, 0.13 ms.
"""

from __future__ import annotations

from functools import partial

from _measure import Benchmark, run
from decide import prepare

from nep.players.policy import NEPPolicy

if __name__ == "__main__":
    benchmark = Benchmark("decide, any_home", "ms, median", 3, limit=0.93, is_higher_better=False)
    play = partial(prepare, make=partial(NEPPolicy.load, "any_home"))
    run(benchmark, play, repeats=3, uses_torch=True, threads=1)
