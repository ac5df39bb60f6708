"""A memory as it was: the events of a file made again, one by one."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Generic, Protocol, TypeVar

from sgm.layout.layout import Layout
from sgm.memory.clock import Clock
from sgm.memory.memory_content import MemoryContent
from sgm.memory.memory_event import MemoryEvent
from sgm.memory.sighting import Sighting
from sgm.memory.thing import Statement, ThingName
from sgm.prior.prior_graph import PriorGraph, find_shipped
from sgm.schema import RELATIONS
from sgm.store.event_kinds import get_by_kind


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
            ValueError: if it names a room or furniture that was never added, or is of a kind that
                `CHANGES` does not list.
        """
        change = get_by_kind(CHANGES, event.kind, __name__)
        try:
            change(self, event)
        except KeyError as error:
            raise ValueError(
                f"every {event.kind} of a memory must be of what was added, got {error.args[0]} at "
                f"time step {event.time}. Use a copy of the file."
            ) from None

    def _find(self, event: MemoryEvent, name: str = "furniture") -> Any:
        """Return the furniture here that an argument means; None where it names none."""
        number = event.values.get(name)
        return None if number is None else self.furniture[number]

    def _start(self, event: MemoryEvent) -> None:
        content: MemoryContent = event.values["memory"]
        if self._clock is not None:
            content = replace(content, clock=self._clock)
        if self._gives_new_ids and not content.layout.num_rooms_ever:  # a new memory
            layout = self.memory.parts.layout.layout
            layout = replace(layout, rooms={}, furniture={}, map_id=content.layout.map_id)
            content = replace(content, layout=layout)
        self._go_on_from(content)
        self.start_from(content.layout)

    def _configure(self, event: MemoryEvent) -> None:
        """Go on with what is set otherwise from then on."""
        values = event.values
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

    def _step(self, event: MemoryEvent) -> None:
        self.memory.parts.clock.step(event.values["num_steps"], accept_jump=True)

    def _add_room(self, event: MemoryEvent) -> None:
        values = event.values
        self._rooms[values["room"]] = self.memory.parts.layout.add_room(values["label"])

    def _rename_room(self, event: MemoryEvent) -> None:
        values = event.values
        self.memory.parts.layout.rename_room(self._rooms[values["room"]], values["label"])

    def _remove_room(self, event: MemoryEvent) -> None:
        """Remove a room with its furniture, whose numbers then lead nowhere."""
        layout, number = self.memory.parts.layout, event.values["room"]
        gone = layout.list_furniture(self._rooms[number])
        layout.remove_room(self._rooms.pop(number))
        for key in [key for key, furniture in self.furniture.items() if furniture in gone]:
            del self.furniture[key]

    def _add_furniture(self, event: MemoryEvent) -> None:
        values = event.values
        about = map(values.get, ("description", "position", "box", "open_cost"))
        add = self.memory.parts.layout.add_furniture
        furniture = add(values["label"], self._rooms[values["room"]], *about)
        self.furniture[values["furniture"]] = furniture

    def _move_furniture(self, event: MemoryEvent) -> None:
        place, room = self._find(event), self._rooms[event.values["room"]]
        about = map(event.values.get, ("position", "box", "open_cost"))
        self.memory.parts.layout.move_furniture(place, room, *about)

    def _name_furniture(self, event: MemoryEvent) -> None:
        names = event.values["label"], event.values["description"]
        self.memory.parts.layout.name_furniture(self._find(event), *names)

    def _merge_furniture(self, event: MemoryEvent) -> None:
        kept, gone = self._find(event), self.furniture.pop(event.values["other"])
        self.memory.parts.layout.merge_furniture(kept, gone)

    def _remove_furniture(self, event: MemoryEvent) -> None:
        furniture = self.furniture.pop(event.values["furniture"])
        self.memory.parts.layout.remove_furniture(furniture, event.values.get("by"))

    def _transform(self, event: MemoryEvent) -> None:
        turn = map(event.values.get, ("angle", "shift", "map_id"))
        self.memory.parts.layout.transform(*turn)

    def _take_look(self, event: MemoryEvent) -> None:
        place, values = self._find(event), event.values
        seen = [Sighting(*arguments) for arguments in values["seen"]]
        coverage = values["coverage"]
        if isinstance(coverage, tuple):
            coverage = dict(zip(RELATIONS, coverage, strict=True))
        hidden, is_named = values.get("hidden", ()), values.get("is_named", False)
        self.memory.parts.looks.take(place, seen, coverage, hidden, is_named=is_named)

    def _note_absent(self, event: MemoryEvent) -> None:
        about = event.values["description"], event.values["coverage"]
        self.memory.parts.looks.note_absent(self._find(event), *about)

    def _note_statement(self, event: MemoryEvent) -> None:
        parts, values = self.memory.parts, event.values
        place, was_at = self._find(event), self._find(event, "was_at")
        relation, speaker, sure = values.get("relation"), values["by"], values["confidence"]
        statement = Statement(parts.state.time, event.kind, place, relation, speaker, sure)
        parts.statements.note(ThingName.from_json(values), statement, was_at)

    def _rename(self, event: MemoryEvent) -> None:
        about = ThingName.from_json(event.values), event.values["name"], event.values["by"]
        self.memory.parts.statements.rename(*about)

    def _merge(self, event: MemoryEvent) -> None:
        about = ThingName.from_json(event.values), event.values["other"], event.values["by"]
        self.memory.parts.statements.merge(*about)

    def _split(self, event: MemoryEvent) -> None:
        thing, speaker = ThingName.from_json(event.values), event.values["by"]
        self.memory.parts.statements.split(thing, by=speaker)

    def _split_off(self, event: MemoryEvent) -> None:
        place, thing = self._find(event), ThingName.from_json(event.values)
        name, speaker = event.values["name"], event.values["by"]
        self.memory.parts.statements.split(thing, place, name, speaker)

    def _remove_object(self, event: MemoryEvent) -> None:
        values = event.values
        thing = values["description"], values.get("id", ""), values.get("by")
        self.memory.parts.statements.remove_object(*thing)

    def _ask(self, event: MemoryEvent) -> None:
        self.memory.parts.questions.query(event.values["description"])


# What each kind changes in the memory.
CHANGES: Mapping[str, Callable[[Replayer[Any], MemoryEvent], None]] = {
    "start": Replayer._start,
    "configure": Replayer._configure,
    "step": Replayer._step,
    "room": Replayer._add_room,
    "rename_room": Replayer._rename_room,
    "remove_room": Replayer._remove_room,
    "furniture": Replayer._add_furniture,
    "move": Replayer._move_furniture,
    "name": Replayer._name_furniture,
    "merge_furniture": Replayer._merge_furniture,
    "remove_furniture": Replayer._remove_furniture,
    "transform": Replayer._transform,
    "look": Replayer._take_look,
    "absent": Replayer._note_absent,
    "moved": Replayer._note_statement,
    "picked_up": Replayer._note_statement,
    "put_down": Replayer._note_statement,
    "rename": Replayer._rename,
    "merge": Replayer._merge,
    "split": Replayer._split,
    "split_off": Replayer._split_off,
    "remove_object": Replayer._remove_object,
    "query": Replayer._ask,
}
