"""A memory and a finder behind calls with short answers: what robots and agents ask in words."""

from __future__ import annotations

import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from functools import wraps
from threading import RLock
from typing import Any, Literal, TypeVar, cast

from sgm.finder.answers import ChangeRow, Moment, NextLook, Noted, Searching
from sgm.finder.asked_things import read_asked
from sgm.finder.finder import Finder
from sgm.finder.meanings import (
    NamedThing,
    Unclear,
    ask_room,
    ask_which,
    doubt,
    find_place,
    find_rooms,
    find_thing,
    find_things,
    tell_doubt,
)
from sgm.finder.read_calls import ReadCalls
from sgm.finder.search_plan import Look
from sgm.finder.search_several import SeveralSearch
from sgm.finder.travel_costs import find_distance
from sgm.finder.where_calls import MOST_ROWS
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.memory.steady_clock import SteadyClock
from sgm.memory.thing import ROBOT
from sgm.messages import shorten, warn_caller
from sgm.names.asking import make_asking
from sgm.names.ignored import IgnoredNames

MOST_SEARCHES = 100  # at once; the one that was not used for longest ends

Result = Literal["found", "not_found", "seen"]
_Method = TypeVar("_Method", bound=Callable[..., Noted])


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
    """

    number: int
    call: str
    thing: str
    place: int | None
    said: str
    at: Moment
    changes: tuple[ChangeRow, ...]


def _write(method: _Method) -> _Method:
    """Let a method write alone; where a name is unclear, it answers with what to ask."""

    @wraps(method)
    def write(self: MemoryService, *args: Any, **kwargs: Any) -> Noted:
        with self._writing:
            try:
                return method(self, *args, **kwargs)
            except Unclear as unclear:
                now = self.tell_time(self.memory.time, self.memory.time)
                told = tell_doubt(unclear)
                return Noted(
                    thing=unclear.thing, place=None, said="nothing was noted", at=now, **told
                )

    return cast("_Method", write)


class MemoryService(ReadCalls):
    """Every call that `python -m sgm.serve` offers over HTTP and MCP, in Python.

    Those that only read are of `ReadCalls`. Names are as people say them. A name that means several
    things, or none, is an answer with a question to the user and candidates, no error. Answers hold
    at most k rows. Time passes by itself, by the memory's clock. Threads may share a service:
    writes are made one after the other, and what only reads waits for no disk.

    Example:
        >>> service = MemoryService(memory, ObjectFinder.load())
        >>> service.where_is("the red mug").places[0].name
        'desk in study'
    """

    def __init__(
        self,
        memory: SceneGraphMemory,
        finder: Finder,
        now: Callable[[], datetime] | None = datetime.now,
        *,
        accept_jump: bool = False,
        ignore: Iterable[str] = (),
        monotonic: Callable[[], float] | None = None,
    ) -> None:
        """Serve a memory.

        Args:
            memory: with a clock, or time does not pass.
            finder: such as `ObjectFinder.load()`.
            now: tells the local time; None where the caller itself calls `memory.step`. Where it
                goes back, steps go on from the latest time (`SteadyClock`), and `clock_fault`, the
                answers of writes and the log say so.
            accept_jump: whether the first time is right, however far ahead of the memory's.
            ignore: names of what is no thing, such as "person" and "wall": `observe` leaves it out.
            monotonic: seconds that pass, from any start, by a clock that is never set; None to take
                those that `now` passes, as long as it goes ahead.

        Raises:
            TypeError: if `ignore` is a text.
            ValueError: if that time is more than a month ahead, or a name to ignore is none.
        """
        super().__init__(memory, finder)
        self._ignored = IgnoredNames(ignore)
        if now is datetime.now and monotonic is None:
            monotonic = time.monotonic
        self._clock = None if now is None else SteadyClock(now, monotonic)
        self._writing = RLock()
        self._searches: OrderedDict[str, SeveralSearch] = OrderedDict()
        self._listeners: list[Callable[[Happened], None]] = []
        self._num_happened = 0
        self._found: tuple[int, frozenset[ChangeRow]] = (-1, frozenset())  # changes of a time step
        self.let_time_pass(accept_jump=accept_jump)

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

        Every call that writes does so first.

        Raises:
            ValueError: if the time is more than a month ahead and not accepted.
        """
        clock, steady = self.memory.clock, self._clock
        if clock is None or steady is None:
            return 0
        with self._writing:
            before, num_faults = self.memory.time, steady.num_faults
            present = clock.get_date(before) or datetime.max
            now = steady.read(present, timedelta(seconds=clock.step_seconds))
            if steady.num_faults > num_faults:
                self._note_fault(now - steady.ahead, steady.tell())
            begun = clock.get_date(before + 1)
            if begun is None or now < begun:
                return 0
            self.memory.step_to(now, accept_jump=accept_jump)
            return self.memory.time - before

    @property
    def clock_fault(self) -> str:
        """What is wrong with the clock of the machine; empty if nothing is."""
        return "" if self._clock is None else self._clock.tell()

    def _note_fault(self, wall: datetime, fault: str) -> None:
        """Say that the clock of the machine went back, and note in the log what it said."""
        state = self.memory.parts.state
        with state.lock:
            state.write("step", num_steps=0, wall=wall.isoformat(timespec="seconds"))
        warn_caller(fault)

    def search_start(
        self,
        thing: str | Sequence[str],
        start: str | int | Sequence[float] | None = None,
        budget: float | None = None,
        speaker: str = "",
    ) -> Searching:
        """Begin to look for a thing, or several in one tour, and say where to look first.

        Args:
            thing: in words, "keys and wallet"; or a list of them.
            start: where the searcher is: a position in metres, or a place by id or name; where
                places have no positions, None.
            budget: most that all looks together may cost: metres and 1 for each look; without a
                start, the number of looks. None for no bound.
            speaker: who says "my".

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, the home has no place, or the start or the budget is out
                of range.
        """
        asked = read_asked(self.memory, self.finder, thing, speaker)
        unclear = asked.unclear
        try:
            if unclear is None and asked.time_words:
                ask = make_asking(self.memory.language).tell_unused((asked.time_words,))
                unclear = Unclear("ambiguous", ask, ())
            if unclear is not None:
                raise unclear
            for name in asked.things:
                resolution = self.finder.resolve(self.memory, name)
                unclear = doubt(resolution) or unclear
                if unclear is not None and (resolution.means_several or resolution.unused):
                    raise unclear
            if isinstance(start, str):
                start = find_place(self.memory, start)
        except Unclear as asks:
            words = asked.things[0] if len(asked.things) == 1 else str(thing)
            told = tell_doubt(asks)
            return Searching(search_id="", thing=words, outcome="no search was started", **told)
        if isinstance(start, int):
            self.memory.describe(start)
        elif start is not None:
            start = tuple(start)
        if start is not None and find_distance(self.memory, start) is None:
            raise ValueError(
                f"from must be left out where places have no position, got {shorten(start)}. Give "
                "all places positions, or leave it out."
            )
        search = self.finder.search_several(self.memory, asked.things, start, budget=budget)
        search.next()
        search_id = secrets.token_hex(4)
        with self._writing:
            self._searches[search_id] = search
            while len(self._searches) > MOST_SEARCHES:
                self._searches.popitem(last=False)
        is_place = all(part.ranking.asked_for != "thing" for part in search.searches)
        return _tell_search(search_id, search, None if is_place else unclear)

    def search_next(
        self,
        search_id: str,
        result: Result,
        seen: Sequence[Sighting] = (),
        coverage: float = 1.0,
        thing: str = "",
    ) -> Searching:
        """Say what came of the latest look of a search, and get the next one.

        Args:
            search_id: from `search_start`.
            result: "found" or "not_found" of the thing alone, or "seen": all that was seen.
            seen: all that was seen, if the result is "seen".
            coverage: share of the place that was in view.
            thing: of several that are looked for, the one that was found, as `left` has it.

        Raises:
            ValueError: if the result or the coverage is out of range.
        """
        if result not in ("found", "not_found", "seen"):
            raise ValueError(
                f"result must be found, not_found or seen, got {shorten(result)}. Say what came of "
                "the look."
            )
        with self._writing:
            search = self._searches.get(search_id)
            if search is None:
                ended = (
                    "there is no such search, or no longer. Call search_start again: it goes on "
                    "with what was seen."
                )
                return Searching("unknown", search_id, "", outcome=ended)
            self._searches.move_to_end(search_id)
            look, left = search.going, search.left
            if look is None:  # it is over
                return _tell_search(search_id, search)
            if result == "found" and len(left) > 1 and thing not in left:
                asks = ask_which(left, search.description, self.memory.language)
                told = _tell_search(search_id, search, asks)
                return replace(told, status="ambiguous")
            self.let_time_pass()
            if result == "found":
                search.found(thing if len(left) > 1 else "")
            elif result == "not_found":
                search.not_found(coverage)
            else:
                search.seen(seen, coverage)
            search.next()
            found = [name for name in left if name not in search.left]
            if found:
                said = f"{', '.join(found)}: found at {look.place.name}"
            else:
                said = f"{search.description}: not found at {look.place.name}"
            self._note("search_next", search.description, look.place.furniture, said)
            return _tell_search(search_id, search)

    @_write
    def observe(self, place: int | str, seen: Sequence[Sighting], coverage: float = 1.0) -> Noted:
        """Note all that was seen in a look at a place; what was not seen counts as absent.

        Args:
            place: id or name.
            seen: all that was seen there.
            coverage: share of the place that was in view.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, or the coverage is out of range.
        """
        furniture = find_place(self.memory, place, acts=True)
        self.let_time_pass()
        seen = [sighting for sighting in seen if sighting.description not in self._ignored]
        self.memory.observe(furniture, seen, coverage)
        things = "1 thing" if len(seen) == 1 else f"{len(seen)} things"
        return self._note("observe", "", furniture, f"{things} seen at {self.tell_name(furniture)}")

    @_write
    def note_moved(
        self,
        thing: str,
        place: int | str,
        by: str,
        relation: str = "in",
        confidence: float | None = None,
        was_at: int | str | None = None,
    ) -> Noted:
        """Note where a thing is now, as a person says: "I put the keys in the drawer".

        Args:
            thing: its exact name or its id; another name is a new thing.
            place: id or name.
            by: who says so.
            relation: such as "in" or "onTop" it.
            confidence: probability that it is right, from 0.5 on; None for 0.9.
            was_at: place from which one of several of its kind was taken; None for the only one.

        Raises:
            KeyError: if there is no place of an id.
            ValueError: if a name is none, or a value is out of range.
        """
        furniture = find_place(self.memory, place, thing, acts=True)
        before = self._find_any(was_at, thing)
        named = find_things(self.memory, thing, "always", by)
        self.let_time_pass()
        for known, was in named:
            taken = was if before is None else before
            self.memory.note_moved(known, furniture, by, relation, confidence, taken)
        names, verb = _join_names(named)
        said = f"{by} said that {names} {verb} at {self.tell_name(furniture)}"
        return self._note("note_moved", names, furniture, said)

    @_write
    def picked_up(self, thing: str, was_at: int | str | None = None) -> Noted:
        """Note that the robot has taken a thing, and carries it until it is put down.

        Args:
            thing: its exact name or its id; a name that is like none is a new thing.
            was_at: place from which one of several of its kind was taken; None for the only one.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none.
        """
        before = self._find_any(was_at, thing)
        named = find_things(self.memory, thing, "if_unlike")
        self.let_time_pass()
        for known, was in named:
            self.memory.picked_up(known, was if before is None else before)
        names, _ = _join_names(named)
        return self._note("picked_up", names, before, f"the robot carries {names}")

    @_write
    def put_down(self, thing: str, place: int | str, relation: str = "onTop") -> Noted:
        """Note that the robot has put down what it carried.

        Args:
            thing: in words, among what it carries.
            place: id or name.
            relation: such as "in" or "onTop" it.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, or the robot carries no such thing.
        """
        furniture = find_place(self.memory, place, thing, acts=True)
        held = [
            self.memory.find_carried(name) or name
            for name in self.memory.read_sentence(thing).things or (thing,)
        ]
        if self.memory.carried:  # else the memory says that nothing is
            named = [find_things(self.memory, name, "if_unlike") for name in held]
            held = [known for things in named for known, _ in things]
        self.let_time_pass()
        for known in held:
            self.memory.put_down(known, furniture, relation)
        names = " and ".join(held)
        said = f"the robot put {names} at {self.tell_name(furniture)}"
        return self._note("put_down", names, furniture, said)

    @_write
    def forget(
        self, thing: str | None = None, place: int | str | None = None, by: str = ROBOT
    ) -> Noted:
        """Forget a thing that is not there at all, "there is no vase", or a place that is gone.

        A thing comes back when it is seen again.

        Args:
            thing: in words; None for a place.
            place: id or name; None for a thing.
            by: who says so.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if not exactly one of the two is given, or a name is none.
        """
        if (thing is None) == (place is None):
            raise ValueError(
                "forget must get a thing or a place, got "
                f"{'none of them' if thing is None else 'both'}. Give one."
            )
        if thing is not None:
            named = find_things(self.memory, thing, speaker=by)
            self.let_time_pass()
            for known, _ in named:
                self.memory.forget(known, by)
            names = " and no ".join(known for known, _ in named)
            told, _ = _join_names(named)
            return self._note("forget", told, None, f"{by} said that there is no {names}")
        assert place is not None
        furniture = find_place(self.memory, place, acts=True)
        name = self.tell_name(furniture)
        self.let_time_pass()
        self.memory.forget(furniture, by)
        return self._note("forget", "", furniture, f"{by} said that there is no {name}")

    @_write
    def rename(self, thing: str, name: str, by: str = ROBOT) -> Noted:
        """Call a thing otherwise: "that is no cup, it is a bowl".

        What a detector calls so where it was seen is called so until the thing is renamed again.
        Of several things of one name, that holds for those with ids alone.

        Args:
            thing: in words, or its id.
            name: what it is called from now on.
            by: who says so.

        Raises:
            ValueError: if a name is none, or another thing has the new one.
        """
        known = find_thing(self.memory, thing)
        self.let_time_pass()
        has_places = self.memory.num_furniture > 0
        several = has_places and self.memory.ask([known]).num_instances.max() > 1
        self.memory.rename(known, name, by)
        said = f"{by} said that {known} is called {name}"
        if several:
            said += f"; there are several, of which ids alone tell which is no {known}"
        return self._note("rename", name, None, said)

    @_write
    def merge(self, thing: str, other: str, by: str = ROBOT) -> Noted:
        """Note that two things are one, "this is the same mug", which is called as the first.

        Args:
            thing: in words, or its id.
            other: in words, or its id.
            by: who says so.

        Raises:
            ValueError: if a name is none, both are one already, or one is carried.
        """
        first, second = (find_thing(self.memory, name) for name in (thing, other))
        self.let_time_pass()
        self.memory.merge(first, second, by)
        return self._note("merge", first, None, f"{by} said that {first} and {second} are one")

    @_write
    def split(
        self,
        thing: str,
        place: int | str | None = None,
        name: str | None = None,
        by: str = ROBOT,
    ) -> Noted:
        """Note that what was held to be one thing is two.

        Args:
            thing: in words, or its id; one that was merged is one of its own again.
            place: id or name, to tell apart what words did not: what was seen there is another
                thing; None to undo a merge.
            name: of that other thing.
            by: who says so.

        Raises:
            KeyError: if there is no place of that id, or no such thing.
            ValueError: if a name is none, nothing was merged, or the thing was seen at no other
                place.
        """
        furniture, known = self._find_any(place, thing), find_thing(self.memory, thing)
        self.let_time_pass()
        self.memory.split(known, furniture, name or "", by)
        return self._note("split", known, furniture, f"{by} said that {known} is two things")

    def _find_any(self, place: int | str | None, thing: str) -> int | None:
        return None if place is None else find_place(self.memory, place, thing, acts=True)

    @_write
    def add_room(self, label: str) -> Noted:
        """Add a room, such as "kitchen".

        Raises:
            ValueError: if the label is no name.
        """
        self.memory.add_room(label)
        return self._note("add_room", "", None, f"there is a room {label}")

    @_write
    def add_place(
        self,
        label: str,
        room: str,
        name: str | None = None,
        position: Sequence[float] | None = None,
    ) -> Noted:
        """Add a place where things may be, such as a "fridge".

        Args:
            label: what it is.
            room: its room, by name.
            name: for people, "white fridge"; None for the label.
            position: where one stands to look at it, in metres.

        Raises:
            ValueError: if a label or name is none, or the position no two numbers.
        """
        rooms = find_rooms(self.memory, room, acts=True)
        if len(rooms) != 1:
            raise ask_room(self.memory, room, rooms)
        point: Any = None if position is None else tuple(position)
        place = self.memory.add_furniture(label, rooms[0], name, point)
        return self._note("add_place", "", place, f"there is a {self.tell_name(place)}")

    def _note(self, call: str, thing: str, place: int | None, said: str) -> Noted:
        """Tell all who listen what was written, and return it."""
        now = self.tell_time(self.memory.time, self.memory.time)
        self._num_happened += 1
        if self._listeners:
            changes = self._find_new_changes()
            happened = Happened(self._num_happened, call, thing, place, said, now, changes)
            for listener in tuple(self._listeners):
                listener(happened)
        return Noted("ok", thing, place, said, now, clock_fault=self.clock_fault)

    def _find_new_changes(self) -> tuple[ChangeRow, ...]:
        """Return the changes of this time step that were not found before."""
        now = self.memory.time
        rows = self.changes(now, MOST_ROWS).rows
        known = self._found[1] if self._found[0] == now else frozenset()
        self._found = now, frozenset(rows)
        return tuple(change for change in rows if change not in known)


def _join_names(named: Sequence[NamedThing]) -> tuple[str, str]:
    """Return the names of things in one text, and the verb after it."""
    return " and ".join(known.thing for known in named), "is" if len(named) == 1 else "are"


def _tell_look(memory: SceneGraphMemory, look: Look) -> NextLook:
    """Tell where to look next, and how, where it is known where the thing was."""
    place, pose = look.place, None
    if place.position is not None:
        pose = memory.get_pose(place.furniture, place.position)
    return NextLook(place.furniture, place.name, place.probability, look.cost, place.position, pose)


def _tell_search(search_id: str, search: SeveralSearch, near: Unclear | None = None) -> Searching:
    """Tell how a search stands, and what may be meant, of which the latest look shows some."""
    look = search.going
    if near is None and search.offered:
        near = ask_which(search.offered, search.description, search.memory.language)
    return Searching(
        search_id=search_id,
        thing=search.description,
        next=None if look is None else _tell_look(search.memory, look),
        is_found=search.is_found,
        looks=search.num_looks,
        outcome=search.outcome,
        left=search.left if len(search.searches) > 1 else None,
        **{**tell_doubt(near), "status": "ok"},  # what nothing is known of is looked for, too
    )
