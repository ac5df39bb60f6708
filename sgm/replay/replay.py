"""The memory at every event of a file: what it held before each, and how it went on."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from sgm.memory.memory_event import MemoryEvent
from sgm.memory.replayer import Replayer
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.prior.prior_graph import PriorGraph


def replay(
    events: Sequence[MemoryEvent], prior: PriorGraph | None = None
) -> Iterator[tuple[SceneGraphMemory, MemoryEvent, Mapping[int, int]]]:
    """Yield the memory before each event of a file, the event, and ids of furniture.

    The memory is one and grows; after the last one it is the one that wrote the file, to the bit.
    The ids are those of the memory, by those of the file.

    Questions of `ask`, `rank` and finders change no memory and are in no file. Where a memory
    starts again, it is that one from then on.

    Args:
        events: from `read_events`, the first a "start".
        prior: of the memory; None for the one that the file names, if it ships, else the household
            prior.

    Raises:
        ValueError: if there is none, or one names a room or furniture that there is not.
    """
    if not events:
        raise ValueError("memory file must have an event, got none. Look around with it first.")
    replayer = Replayer(SceneGraphMemory(prior, clock=events[0].values["clock"]), prior)
    for event in events:
        yield replayer.memory, event, replayer.furniture
        replayer.apply(event)
