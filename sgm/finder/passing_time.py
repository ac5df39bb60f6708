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


def note_fault(memory: SceneGraphMemory, steady: SteadyClock, warn: Callable[[str], None]) -> None:
    """Say that a clock is wrong, and note in the file of the memory what it said."""
    state = memory.parts.state
    with state.lock:
        state.write("step", num_steps=0, wall=steady.tell_reading(memory.clock))
    warn(steady.tell(memory.clock))
