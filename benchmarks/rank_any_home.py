"""The same ranking as in `rank.py` by the network for any home, which ships.

One thread, whatever `--threads` says.
"""

from __future__ import annotations

from functools import partial

from _measure import Benchmark, run
from rank import prepare

if __name__ == "__main__":
    benchmark = Benchmark("rank with any_home", "ms, median", 3, is_higher_better=False)
    run(benchmark, partial(prepare, source="any_home"), repeats=3, uses_torch=True, threads=1)
