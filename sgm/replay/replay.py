"""A memory as it was: the changes of a log made again, one by one."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from sgm.memory.clock import Clock
from sgm.memory.log_reader import LogLine
from sgm.memory.memory_content import MemoryContent
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.memory.thing import STATEMENTS, Statement, ThingName
from sgm.prior.prior_graph import PriorGraph, find_shipped
from sgm.schema import RELATIONS


def replay(
    lines: Sequence[LogLine], prior: PriorGraph | None = None
) -> Iterator[tuple[SceneGraphMemory, LogLine, Mapping[int, int]]]:
    """Yield the memory before each line of a log, the line, and ids of furniture.

    The memory is one and grows; after the last line it is the one that wrote the log, to the bit.
    The ids are those of the memory, by those of the log.

    Questions of `ask`, `rank` and finders change no memory and are in no log. Where a memory was
    started again, it is that one from then on.

    Args:
        lines: from `read_log`, the first a "start".
        prior: of the memory; None for the one that the log names, if it ships, else the household
            prior.

    Raises:
        ValueError: if there is no line, or one names a room or furniture that there is not.
    """
    if not lines:
        raise ValueError("log must have a line, got none. Look around with it first.")
    replayer = Replayer(SceneGraphMemory(prior, clock=lines[0].values["clock"]), prior)
    for line in lines:
        yield replayer.memory, line, replayer.furniture
        replayer.apply(line)


class Replayer:
    """Makes the changes of lines in a memory, whose ids may be others than those of the log.

    Attributes:
        memory: what is changed.
        furniture: ids in the memory by those in the log.
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        *,
        gives_new_ids: bool = False,
    ) -> None:
        """Begin with an empty memory; without prior and clock, those that start have the log's.

        With `gives_new_ids` no id is given twice, even where a new memory begins, so that its
        furniture is distinguished from what was there before.
        """
        self.memory = memory
        memory.parts.looks.watch.warns_of_scores = False  # the process that looked was warned
        self._prior = prior
        self._clock = clock
        self._gives_new_ids = gives_new_ids
        self._rooms: dict[int, int] = {}  # id in the memory by id in the log
        self.furniture: dict[int, int] = {}

    def copy(self) -> Replayer:
        """Return one that goes on alone."""
        other = Replayer(
            self.memory.copy(), self._prior, self._clock, gives_new_ids=self._gives_new_ids
        )
        other._rooms, other.furniture = dict(self._rooms), dict(self.furniture)
        return other

    def apply(self, line: LogLine) -> None:
        """Make a change.

        Raises:
            ValueError: if it names a room or furniture that was never added.
        """
        try:
            self._apply(line)
        except KeyError as error:
            raise ValueError(
                f"every {line.kind} of a log must be of what was added, got {error.args[0]} at "
                f"time step {line.time}. Mend the line, or take it out."
            ) from None

    def _apply(self, line: LogLine) -> None:
        memory, kind, values = self.memory, line.kind, line.values
        place = self._find(None if kind == "furniture" else values.get("furniture"))
        if kind == "start":
            self._start(line)
        elif kind == "room":
            self._rooms[values["room"]] = memory.add_room(values["label"])
        elif kind == "rename_room":
            memory.rename_room(self._rooms[values["room"]], values["label"])
        elif kind == "furniture":
            about = map(values.get, ("description", "position", "box", "open_cost"))
            furniture = memory.add_furniture(values["label"], self._rooms[values["room"]], *about)
            self.furniture[values["furniture"]] = furniture
        elif kind == "move":
            room, position = self._rooms[values["room"]], values["position"]
            memory.move_furniture(place, room, position, values.get("box"))
        elif kind == "name":
            memory.name_furniture(place, values["label"], values["description"])
        elif kind == "merge_furniture":
            memory.merge_furniture(place, self.furniture.pop(values["other"]))
        elif kind == "remove_room":
            self._remove_room(values["room"])
        elif kind == "remove_furniture":
            furniture = self.furniture.pop(values["furniture"])
            memory.parts.layout.remove_furniture(furniture, values.get("by"))
        elif kind == "remove_object":
            node = (values["description"], values.get("id", ""), values.get("by"))
            memory.parts.statements.remove_object(*node)
        elif kind == "look":
            seen = [Sighting(*arguments) for arguments in values["seen"]]
            coverage = values["coverage"]
            if isinstance(coverage, tuple):
                coverage = dict(zip(RELATIONS, coverage, strict=True))
            memory.observe(place, seen, coverage, values.get("hidden", ()))
        elif kind == "absent":
            memory.note_absent(place, values["description"], values["coverage"])
        elif kind in STATEMENTS:
            relation, speaker, sure = values.get("relation"), values["by"], values["confidence"]
            statement = Statement(memory.time, kind, place, relation, speaker, sure)
            was_at = self._find(values.get("was_at"))
            memory.parts.statements.note(ThingName.from_json(values), statement, was_at)
        elif kind == "rename":
            memory.rename(ThingName.from_json(values), values["name"], values["by"])
        elif kind == "merge":
            memory.merge(ThingName.from_json(values), values["other"], values["by"])
        elif kind == "split":
            memory.split(ThingName.from_json(values), by=values["by"])
        elif kind == "split_off":
            memory.split(ThingName.from_json(values), place, values["name"], values["by"])
        elif kind == "transform":
            memory.transform(values["angle"], values["shift"], values["map_id"])
        elif kind == "query":
            memory.query(values["description"])
        else:
            memory.step(values["num_steps"], accept_jump=True)

    def _find(self, number: int | None) -> Any:
        """Return the furniture here that a log means by a number; None where it names none."""
        return None if number is None else self.furniture[number]

    def _start(self, line: LogLine) -> None:
        content: MemoryContent = line.values["memory"]
        prior = self._prior or find_shipped(content.prior) or PriorGraph.household()
        if self._clock is not None:
            content = replace(content, clock=self._clock)
        if self._gives_new_ids and not content.layout.num_rooms_ever:  # a new memory
            layout = replace(
                self.memory.layout, rooms={}, furniture={}, map_id=content.layout.map_id
            )
            content = replace(content, layout=layout)
        self.memory.parts.files.go_on_from(content, prior)
        self._rooms = {number: number for number in content.layout.rooms}
        self.furniture.clear()
        self.furniture.update((number, number) for number in content.layout.furniture)

    def _remove_room(self, number: int) -> None:
        """Remove a room with its furniture, whose numbers then lead nowhere."""
        gone = self.memory.list_furniture(self._rooms[number])
        self.memory.remove_room(self._rooms.pop(number))
        for key in [key for key, furniture in self.furniture.items() if furniture in gone]:
            del self.furniture[key]
