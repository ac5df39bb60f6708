"""The memory of an observer who has seen everything in a recorded home at its end."""

from __future__ import annotations

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import RELATIONS, Sighting
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.trace import Trace


def remember_trace(trace: Trace, prior: PriorGraph | None = None) -> SceneGraphMemory:
    """Look once at all furniture of a recorded home at its end, without missing anything.

    A home without events is a map: its memory knows the furniture, and has looked at none of it.

    Room and furniture ids are their indices in the layout. If that says when it starts, the memory
    has a clock, with steps of an hour from the time of the looks on. The prior is the household
    prior if left out.
    """
    start = trace.start
    memory = SceneGraphMemory(prior, None if start is None else Clock(start).shift(trace.end_s))
    for room in trace.layout.rooms.values():
        memory.add_room(room.label)
    for row in trace.layout.furniture.values():
        description = row.name if row.description == row.label else row.description
        memory.add_furniture(row.label, row.room, description, row.position, row.box, row.open_cost)
    if not trace.events:
        return memory
    where = {event.object: event for event in trace.events}
    for furniture in trace.layout.furniture:
        seen = [
            Sighting(event.description, RELATIONS[event.relation])
            for event in where.values()
            if event.furniture == furniture
        ]
        memory.observe(furniture, seen)
    return memory
