"""One decision of a robot on one memory: fold in a look, ask, score with NEP-HEAT, rank.

One thread, whatever `--threads` says. The memory is that of a home of full size after 100 looks.

The limit counts calls, since a single home pays for little else: 169 operations of torch at 3 us,
some 250 of numpy at 1 us, operators among them, and 680 calls of Python functions at 0.1 us.
Arithmetic adds 14.3 million floating-point operations (200 nodes, 281 edges, 8.5 query edges) at 65
a nanosecond, 0.2 ms.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np
from _measure import Benchmark, Measure, run
from _network import make_policy

from sgm.policies.heuristics import Bayesian
from sgm.policies.policy import Policy
from sgm.prior.prior_graph import PriorGraph
from simulator.tasks.predict_location import predict_locations
from simulator.tasks.rollout import Rollout, sample_query
from simulator.world.config import HomeConfig
from simulator.world.sampled_homes import SampledHomes
from simulator.world.streams import Streams


def prepare(tiny: bool, make: Callable[[], Policy] = make_policy) -> tuple[Measure, str]:
    """Remember 100 looks; `make` makes the network."""
    num_looks, num_decisions = (5, 3) if tiny else (100, 300)
    homes = SampledHomes(PriorGraph.default(), HomeConfig(), Streams(0, "val", [0]))
    policy, rollout = make(), Rollout(homes, Bayesian())
    policy.reset(rollout.memory)  # it may ask for counts
    for _ in predict_locations(rollout, num_looks):
        pass
    home = np.zeros(1, dtype=np.int64)

    def measure() -> tuple[float, dict[str, float]]:
        seconds, choice = [], np.zeros(1, dtype=np.int64)
        for _ in range(num_decisions):
            rollout.evolve()
            slots = sample_query(homes)
            start = time.perf_counter()
            rollout.look(choice)
            _, queries = rollout.ask_for(home, slots)
            ranking = np.argsort(-policy.scores(rollout.memory, queries)[0])
            seconds.append(time.perf_counter() - start)
            choice = ranking[:1]
        milliseconds = np.sort(seconds) * 1000
        return float(np.median(milliseconds)), {"p99": float(np.quantile(milliseconds, 0.99))}

    return measure, f"{num_decisions} decisions on one home of full size"


if __name__ == "__main__":
    benchmark = Benchmark("decide, NEP-HEAT", "ms, median", 2, limit=1.05, is_higher_better=False)
    run(benchmark, prepare, repeats=3, uses_torch=True, threads=1)
