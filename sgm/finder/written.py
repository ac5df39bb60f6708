"""Calls that change a memory: one after the other, each made once, told to those who listen."""

from __future__ import annotations

import hashlib
import json
from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from datetime import datetime
from functools import wraps
from inspect import signature
from threading import RLock
from typing import Any, TypeVar, cast

from sgm.finder.answers import (
    LEFT_OUT,
    ChangeRow,
    Moment,
    Noted,
    Searching,
    read_answer,
    write_json,
)
from sgm.finder.finder import Finder
from sgm.finder.meanings import Unclear, tell_doubt
from sgm.finder.passing_time import pass_time, read_clock
from sgm.finder.read_calls import ReadCalls
from sgm.finder.spots import find_position
from sgm.finder.where_calls import MOST_ROWS
from sgm.memory.clock import MAX_JUMP, check_ahead
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Point
from sgm.memory.steady_clock import SteadyClock, read_even_seconds
from sgm.messages import shorten, warn_caller
from sgm.names.words import MAX_LENGTH

MOST_KEYS = 5000  # of the latest writes, whose repetitions are known

_Method = TypeVar("_Method", bound=Callable[..., Noted | Searching])


@dataclass(frozen=True, slots=True)
class Happened:
    """A change that a call has made.

    Attributes:
        number: 1, 2, ... since the service began.
        call: its name.
        thing: what it was about; empty if it was about a place.
        place: id of the place; None if it was about a thing alone.
        said: in one line.
        at: when.
        changes: what it has shown to be new, moved, gone or picked up.
        position: of the place, x, y, z in the map, metres; left out where unknown.
    """

    number: int
    call: str
    thing: str
    place: int | None
    said: str
    at: Moment
    changes: tuple[ChangeRow, ...]
    position: Point | None = field(default=None, metadata=LEFT_OUT)


def writes(method: _Method) -> _Method:
    """Let a method write alone, and a repetition with the same `key` be answered as before.

    Where a name is unclear, it answers with what to ask.
    """
    parameters = signature(method)

    @wraps(method)
    def write(self: WriteCalls, *args: Any, **kwargs: Any) -> Noted | Searching:
        key = kwargs.get("key")
        with self._writing:
            with self.memory.transaction():
                if key is None:
                    answer = self._answer(method, args, kwargs)
                else:
                    said = parameters.bind(self, *args, **kwargs).arguments
                    about = compute_digest(method.__name__, {**said, "self": None})
                    before = self._find_done(key, about)
                    if before is not None:
                        return before
                    answer = self._answer(method, args, kwargs)
                    if answer.status == "ok":  # else nothing was done
                        self._keep_answer(f"key {key}", about, answer)
            self._tell_happened()
            return answer

    return cast("_Method", write)


def compute_digest(*about: object) -> str:
    """Return the SHA-256 of what a write is about, the same in every process."""
    return hashlib.sha256(repr(about).encode("utf-8", "surrogatepass")).hexdigest()


class WriteCalls(ReadCalls):
    """What all calls that write have in common; `MemoryService` has the calls."""

    def __init__(
        self,
        memory: SceneGraphMemory,
        finder: Finder,
        now: Callable[[], datetime] | None,
        monotonic: Callable[[], float] | None,
    ) -> None:
        """Change a memory, whose time `now` and `monotonic` tell, as in `MemoryService`."""
        super().__init__(memory, finder)
        if now is datetime.now and monotonic is None:
            monotonic = read_even_seconds
        self._now, self._clock = now, SteadyClock(monotonic)
        self._writing = RLock()
        self._done: OrderedDict[str, tuple[str, Noted | Searching]] = OrderedDict()  # by key
        self._listeners: list[Callable[[Happened], None]] = []
        self._num_happened = 0
        self._happened: list[Happened] = []  # to be told once it is in the file
        self._found: tuple[int, frozenset[ChangeRow]] = (-1, frozenset())  # changes of a time step

    def subscribe(self, listener: Callable[[Happened], None]) -> Callable[[], None]:
        """Have a function called after every change; returns one that ends it.

        The listener is called by the thread that made the change, which waits for it.
        """
        with self._writing:
            if not self._listeners:
                self._find_new_changes()  # what comes after these is new
            self._listeners.append(listener)

        def end() -> None:
            with self._writing:
                if listener in self._listeners:
                    self._listeners.remove(listener)

        return end

    def let_time_pass(self, *, accept_jump: bool = False) -> int:
        """Step to the present time, and return how many steps that were; time never goes back.

        Every call does so first.

        Raises:
            ValueError: if the first time is more than a month ahead and not accepted.
        """
        clock, steady = self.memory.clock, self._clock
        if clock is None or self._now is None:
            return 0
        with self._writing:
            step_seconds, present = clock.step_seconds, self.memory.time
            reading = (self._now() - clock.start).total_seconds()
            if steady.is_new and not accept_jump:
                num_steps = int(reading / step_seconds) - present
                remedy = "Check the clock of the machine; if it is right, say accept_jump."
                check_ahead(num_steps, present, clock, "time", MAX_JUMP, remedy)
            now = read_clock(
                self.memory, steady, reading, step_seconds, warn_caller, accept_jump=accept_jump
            )
            return pass_time(self.memory, now, step_seconds)

    def _come_to_present(self) -> None:
        with suppress(OSError):  # of the file: what is asked is answered all the same
            self.let_time_pass()

    @property
    def clock_fault(self) -> str:
        """What is wrong with the clock of the machine; empty if nothing is."""
        return self._clock.tell(self.memory.clock)

    def _answer(
        self, method: Callable[..., Noted | Searching], args: Any, kwargs: Any
    ) -> Noted | Searching:
        try:
            return method(self, *args, **kwargs)
        except Unclear as unclear:
            now = self.tell_time(self.memory.time, self.memory.time)
            told = tell_doubt(unclear)
            return Noted(
                thing=unclear.thing, place=None, said=self._asking.say("not noted"), at=now, **told
            )

    def _find_done(self, key: object, about: str) -> Noted | Searching | None:
        """Return what the write of a key was answered; None of a new key.

        Raises:
            ValueError: if it is no key, or the one of another write.
        """
        if not isinstance(key, str) or not 1 <= len(key) <= MAX_LENGTH:
            raise ValueError(
                f"key must be a text of 1 to {MAX_LENGTH} characters, got {shorten(key)}. Give "
                "every write one of its own, any text, or leave it out."
            )
        before, answer = self._find_answer(f"key {key}") or (about, None)
        if before != about:
            raise ValueError(
                f"key must be of one write, got {shorten(key)} of another one again. Give every "
                "write one of its own, and the same one only where you send a write again."
            )
        return answer

    def _find_answer(self, key: str) -> tuple[str, Noted | Searching] | None:
        """Return what a write was about, and its answer, also of a process before this one."""
        known, file = self._done.get(key), self.memory.parts.files.file
        if known is not None or file is None:
            return known
        found = file.find_answer(key)
        if found is None:
            return None
        about, text = found
        values = json.loads(text)
        return about, read_answer(Searching if "search_id" in values else Noted, values)

    def _keep_answer(self, key: str, about: str, answer: Noted | Searching) -> None:
        """Keep an answer, in the transaction of what it tells of."""
        file = self.memory.parts.files.file
        if file is not None:
            file.note_answer(key, about, write_json(answer).decode("utf-8", "surrogatepass"))
            return
        self._done[key] = about, answer
        while len(self._done) > MOST_KEYS:
            self._done.popitem(last=False)

    def _tell_happened(self) -> None:
        """Tell all who listen what is in the file now."""
        happened, self._happened = self._happened, []
        for change in happened:
            for listener in tuple(self._listeners):
                listener(change)

    def _note(
        self, call: str, thing: str, place: int | None, said: str, room: int | None = None
    ) -> Noted:
        """Tell all who listen what was written, and return it."""
        now = self.tell_time(self.memory.time, self.memory.time)
        position = None if place is None else find_position(self.memory.layout, place)
        self._num_happened += 1
        if self._listeners:
            changes = self._find_new_changes()
            told = call, thing, place, said, now, changes, position
            self._happened.append(Happened(self._num_happened, *told))
        number = None if room is None else int(room)  # a `RoomId` is no number of JSON
        about: dict[str, Any] = {
            "clock_fault": self.clock_fault,
            "position": position,
            "room": number,
        }
        return Noted("ok", thing, place, said, now, **about)

    def _find_new_changes(self) -> tuple[ChangeRow, ...]:
        """Return the changes of this time step that were not found before."""
        now = self.memory.time
        rows = self.changes(now, MOST_ROWS).rows
        known = self._found[1] if self._found[0] == now else frozenset()
        self._found = now, frozenset(rows)
        return tuple(change for change in rows if change not in known)
