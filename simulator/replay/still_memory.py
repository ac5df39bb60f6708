"""A memory of one moment, without a log: what it says itself of the past."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterator

from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.thing import ThingName
from simulator.replay.past_things import PastThings
from simulator.replay.story import PastLook, PastStatement, Story


class StillMemory(Story):
    """One memory as it is; of the past it tells the last sighting of each object at each place."""

    def __init__(self, memory: SceneGraphMemory, title: str) -> None:
        """Take the memory of a home, which is not changed any more."""
        self.title = title
        self.clock = memory.clock
        self.first_step = self.num_steps = memory.time
        self.looks = _list_last_sightings(memory)
        self.things = PastThings()
        for look in self.looks:
            self.things.note_look(look.step, look.furniture, [(name,) for name in look.seen])
        self.statements = tuple(self._list_statements(memory))
        self._memory = memory

    def memory_at(self, step: int) -> SceneGraphMemory:
        """Return the memory.

        Raises:
            ValueError: if another step is asked for than its own.
        """
        if step != self.num_steps:
            raise ValueError(
                f"step must be {self.num_steps}, got {step}: this memory knows no other. Log looks "
                'with SceneGraphMemory(log="looks.jsonl") to look back.'
            )
        return self._memory

    def _list_statements(self, memory: SceneGraphMemory) -> Iterator[PastStatement]:
        """Yield what was said of things, each after the looks of its time step."""
        times = [look.step for look in self.looks]
        for thing, said in memory.list_statements():
            # Looks of a memory file know things by their words alone.
            self.things.note_statement(said.time, ThingName(thing.description))
            place = "" if said.furniture is None else memory.describe(said.furniture)
            yield PastStatement(
                said.time, said.kind, thing.description, said.by, said.furniture, place,
                num_looks=bisect_right(times, said.time),
            )  # fmt: skip


def _list_last_sightings(memory: SceneGraphMemory) -> tuple[PastLook, ...]:
    """List what was last seen at each place, and the last look at it if that was later."""
    found: dict[tuple[int, int], list[str]] = {}
    for room in memory.to_dict()["rooms"]:
        for furniture in room["furniture"]:
            if furniture["last_looked"] is not None:
                found.setdefault((furniture["last_looked"], furniture["id"]), [])
            for row in furniture["objects"]:
                if "by" in row:  # it was said, not seen
                    continue
                key = (row["last_seen"], furniture["id"])
                found.setdefault(key, []).append(row["description"])
    return tuple(
        PastLook(step, furniture, tuple(seen)) for (step, furniture), seen in sorted(found.items())
    )
