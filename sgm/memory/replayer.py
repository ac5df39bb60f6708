"""A memory as it was: the events of a file made again, one by one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Generic, Protocol, TypeVar

from sgm.layout.layout import Layout
from sgm.memory.clock import Clock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import MemoryEvent
from sgm.memory.sighting import Sighting
from sgm.memory.thing import STATEMENTS, Statement, ThingName
from sgm.prior.prior_graph import PriorGraph, find_shipped
from sgm.schema import RELATIONS


class HasParts(Protocol):
    """A memory; its parts are a `MemoryParts`."""

    @property
    def parts(self) -> Any:
        """Its parts."""


Memory = TypeVar("Memory", bound=HasParts)


class Replayer(Generic[Memory]):
    """Makes the changes of events in a memory, whose ids may be others than those of the file.

    Attributes:
        memory: what is changed.
        furniture: ids in the memory by those in the file.
    """

    def __init__(
        self,
        memory: Memory,
        prior: PriorGraph | None = None,
        clock: Clock | None = None,
        *,
        gives_new_ids: bool = False,
    ) -> None:
        """Begin with an empty memory; without prior and clock, those of the events are taken.

        With `gives_new_ids` no id is given twice, even where a new memory begins, so that its
        furniture is distinguished from what was there before.
        """
        self.memory = memory
        memory.parts.looks.watch.warns_of_scores = False  # the process that looked was warned
        self._prior = prior
        self._clock = clock
        self._gives_new_ids = gives_new_ids
        self._rooms: dict[int, int] = {}  # id in the memory by id in the file
        self.furniture: dict[int, int] = {}

    def start_from(self, layout: Layout) -> None:
        """Go on in a memory whose ids are those of the file."""
        self._rooms = {number: number for number in layout.rooms}
        self.furniture.clear()
        self.furniture.update((number, number) for number in layout.furniture)

    def copy_to(self, memory: Memory) -> Replayer[Memory]:
        """Return one that goes on alone, with a copy of the memory."""
        other = Replayer(memory, self._prior, self._clock, gives_new_ids=self._gives_new_ids)
        other._rooms, other.furniture = dict(self._rooms), dict(self.furniture)
        return other

    def apply(self, event: MemoryEvent) -> None:
        """Make a change.

        Raises:
            ValueError: if it names a room or furniture that was never added.
        """
        try:
            self._apply(event)
        except KeyError as error:
            raise ValueError(
                f"every {event.kind} of a memory must be of what was added, got {error.args[0]} at "
                f"time step {event.time}. Use a copy of the file."
            ) from None

    def _apply(self, event: MemoryEvent) -> None:
        parts, kind, values = self.memory.parts, event.kind, event.values
        place = self._find(None if kind == "furniture" else values.get("furniture"))
        if kind == "start":
            self._start(values)
        elif kind == "configure":
            self._configure(values)
        elif kind == "room":
            self._rooms[values["room"]] = parts.layout.add_room(values["label"])
        elif kind == "rename_room":
            parts.layout.rename_room(self._rooms[values["room"]], values["label"])
        elif kind == "furniture":
            about = map(values.get, ("description", "position", "box", "open_cost"))
            furniture = parts.layout.add_furniture(
                values["label"], self._rooms[values["room"]], *about
            )
            self.furniture[values["furniture"]] = furniture
        elif kind == "move":
            about = map(values.get, ("position", "box", "open_cost"))
            parts.layout.move_furniture(place, self._rooms[values["room"]], *about)
        elif kind == "name":
            parts.layout.name_furniture(place, values["label"], values["description"])
        elif kind == "merge_furniture":
            parts.layout.merge_furniture(place, self.furniture.pop(values["other"]))
        elif kind == "remove_room":
            self._remove_room(values["room"])
        elif kind == "remove_furniture":
            furniture = self.furniture.pop(values["furniture"])
            parts.layout.remove_furniture(furniture, values.get("by"))
        elif kind == "remove_object":
            node = (values["description"], values.get("id", ""), values.get("by"))
            parts.statements.remove_object(*node)
        elif kind == "look":
            seen = [Sighting(*arguments) for arguments in values["seen"]]
            coverage = values["coverage"]
            if isinstance(coverage, tuple):
                coverage = dict(zip(RELATIONS, coverage, strict=True))
            hidden, is_named = values.get("hidden", ()), values.get("is_named", False)
            parts.looks.take(place, seen, coverage, hidden, is_named=is_named)
        elif kind == "absent":
            parts.looks.note_absent(place, values["description"], values["coverage"])
        elif kind in STATEMENTS:
            relation, speaker, sure = values.get("relation"), values["by"], values["confidence"]
            statement = Statement(parts.state.time, kind, place, relation, speaker, sure)
            was_at = self._find(values.get("was_at"))
            parts.statements.note(ThingName.from_json(values), statement, was_at)
        elif kind == "rename":
            parts.statements.rename(ThingName.from_json(values), values["name"], values["by"])
        elif kind == "merge":
            parts.statements.merge(ThingName.from_json(values), values["other"], values["by"])
        elif kind == "split":
            parts.statements.split(ThingName.from_json(values), by=values["by"])
        elif kind == "split_off":
            parts.statements.split(ThingName.from_json(values), place, values["name"], values["by"])
        elif kind == "transform":
            parts.layout.transform(values["angle"], values["shift"], values["map_id"])
        elif kind == "query":
            parts.questions.query(values["description"])
        else:
            parts.clock.step(values["num_steps"], accept_jump=True)

    def _find(self, number: int | None) -> Any:
        """Return the furniture here that a file means by a number; None where it names none."""
        return None if number is None else self.furniture[number]

    def _start(self, values: Mapping[str, Any]) -> None:
        content: MemoryContent = values["memory"]
        if self._clock is not None:
            content = replace(content, clock=self._clock)
        if self._gives_new_ids and not content.layout.num_rooms_ever:  # a new memory
            layout = self.memory.parts.layout.layout
            layout = replace(layout, rooms={}, furniture={}, map_id=content.layout.map_id)
            content = replace(content, layout=layout)
        self._go_on_from(content)
        self.start_from(content.layout)

    def _configure(self, values: Mapping[str, Any]) -> None:
        """Go on with what is set otherwise from then on."""
        content = self.memory.parts.state.get_content_to_save().copy()
        if "clock" in values and self._clock is None:
            content = replace(content, clock=values["clock"])
        if "score_calibration" in values:
            content = replace(content, score_calibration=values["score_calibration"])
        if "map" in values:
            content.layout.map_id = values["map"]
        self._go_on_from(replace(content, prior=values.get("prior", content.prior)))

    def _go_on_from(self, content: MemoryContent) -> None:
        prior = self._prior or find_shipped(content.prior) or PriorGraph.household()
        self.memory.parts.files.go_on_from(content, prior)

    def _remove_room(self, number: int) -> None:
        """Remove a room with its furniture, whose numbers then lead nowhere."""
        layout = self.memory.parts.layout
        gone = layout.list_furniture(self._rooms[number])
        layout.remove_room(self._rooms.pop(number))
        for key in [key for key, furniture in self.furniture.items() if furniture in gone]:
            del self.furniture[key]
