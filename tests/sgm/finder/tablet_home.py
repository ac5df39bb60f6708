"""A home with a rhythm of two weeks, which several tests ask."""

from datetime import datetime, timedelta

from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting

MONDAY = datetime(2026, 1, 5)
NOON = MONDAY + timedelta(days=14, hours=12)


def make_home(language="en"):
    """Two weeks: the tablet is on the table at noon of workdays but one, else on the shelf."""
    memory = SceneGraphMemory(clock=Clock(MONDAY, 1800), language=language)
    room = memory.add_room("kitchen")
    table, shelf = (memory.add_furniture(place, room) for place in ("table", "shelf"))
    for day in range(14):
        for hour in (7, 12, 20):
            memory.step_to(MONDAY + timedelta(days=day, hours=hour))
            is_out = hour == 12 and day % 7 < 5 and day != 3
            memory.observe(table, [Sighting("lamp"), *([Sighting("tablet")] if is_out else [])])
            memory.observe(shelf, [] if is_out else [Sighting("tablet")])
    return memory, table, shelf
