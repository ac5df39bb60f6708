"""The time of a memory passes by a clock, and what is wrong with that is said."""

from __future__ import annotations

import math
from collections.abc import Callable

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.steady_clock import SteadyClock


def pass_time(memory: SceneGraphMemory, seconds: float, step_seconds: float) -> int:
    """Let the time of a memory pass until so many seconds after step 0; return how many steps."""
    num_steps = math.floor(seconds / step_seconds + 1e-9) - memory.time
    if num_steps > 0:
        memory.step(num_steps, accept_jump=True)
    return max(num_steps, 0)


def read_clock(
    memory: SceneGraphMemory,
    steady: SteadyClock,
    reading: float,
    step_seconds: float,
    warn: Callable[[str], None],
    *,
    accept_jump: bool,
) -> float:
    """Return what time it is, seconds since step 0; arguments as of `SteadyClock.read`.

    That the clock was found to be wrong is said, and what it said is noted in the file of the
    memory.
    """
    num_faults = steady.num_faults
    now = steady.read(reading, memory.time * step_seconds, step_seconds, accept_jump=accept_jump)
    if steady.num_faults > num_faults:
        state = memory.parts.state
        with state.lock:
            state.write("step", num_steps=0, wall=steady.tell_reading(memory.clock))
        warn(steady.tell(memory.clock))
    return now
