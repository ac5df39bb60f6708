"""A trace from the events of a robot's memory: where things were, as far as its looks tell."""

from __future__ import annotations

import math
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby

from sgm.memory.memory_event import MemoryEvent
from simulator.trace.events import GONE, Event
from simulator.trace.layout import get_label
from simulator.trace.log_reader import COUNTED, LoggedLook, LoggedSpot, LogReader, Name
from simulator.trace.trace import Trace


@dataclass(slots=True)
class LoggedThing:
    """One object of the trace, as it was last seen."""

    name: str
    description: str
    place: int = GONE  # also since it was seen absent there
    spot: LoggedSpot = field(default_factory=lambda: LoggedSpot(relation=0))
    time_s: float = -math.inf
    unseen: float = 0.0  # parts of looks at its place that did not show it since


def make_trace(lines: Sequence[MemoryEvent], name: str = "home") -> Trace:
    """Make a trace from the events of a memory.

    Where a thing was between two looks is unknown. The trace says: where it was last seen, until

    - it is seen elsewhere, said to be there, or put there by the robot: it is there from then on,
      and moved in that step;
    - a look at its place does not show it, or looks at parts of it that make half a look: then it
      has left the home, until it is seen again. So nothing is said, and nothing asked, of a thing
      that the robot itself did not know of.

    An event has the position at which the thing was seen first since it is there, in the frame of
    the map that the memory had last.

    Things are distinguished by their words, as in the memory. Of one name there are as many as were
    seen in one time step; which one is seen is not told: one that stayed, else one that is gone,
    else the one whose last sighting is longest ago. Furniture that was moved
    stands where it stood last; what lay on furniture that was removed is gone. What was taken out
    of the memory (`remove_object`) was never there. A sighting of less than one half is none.

    Raises:
        ValueError: if nothing was seen, or a line names a room or furniture that there is not.
    """
    clocks = [line.values["clock"] for line in lines if line.kind == "start"]
    starts = (clock.start for clock in clocks if clock is not None)
    reader = LogReader(min(starts, default=None))
    for line in lines:
        try:
            reader.read(line)
        except KeyError as error:
            raise ValueError(
                f"every {line.kind} of a log must be of furniture that was added, got "
                f"{error.args[0]} at time step {line.time}. Mend the line, or take it out."
            ) from None
    looks = sorted(reader.looks, key=lambda look: look.time_s)
    things = _LoggedThings(reader.descriptions)
    for time_s, group in groupby(looks, key=lambda look: look.time_s):
        things.see(time_s, list(group))
    if not things.events:
        raise ValueError(
            f"log must hold a sighting, got {len(looks)} looks without one. Log more of the home."
        )
    until_s = max(looks[-1].time_s, things.events[-1].time_s) or None
    return Trace(
        name, reader.make_layout(), tuple(things.events), start=reader.start, until_s=until_s
    )


def split_trace(trace: Trace, shares: Mapping[str, float]) -> dict[str, Trace]:
    """Cut a trace by time: "train" first, then the others.

    Each part begins with all that was at its place then.

    Args:
        trace: what is cut.
        shares: of the time by name, in order; what is left is "train". Parts of 0 are left out.

    Raises:
        ValueError: if a share is negative, or nothing is left to train on.
    """
    left = 1 - sum(shares.values())
    if min(shares.values()) < 0 or left <= 0:
        raise ValueError(
            "val_share and test_share must be 0 or more and leave some time to train on, got "
            f"{', '.join(map(str, shares.values()))}. Take 0.2 of each."
        )
    parts: dict[str, Trace] = {}
    begin_s, length_s = trace.start_s, trace.end_s - trace.start_s
    for name, share in {"train": left, **shares}.items():
        if share > 0:
            end_s = begin_s + share * length_s
            parts[name] = _cut(trace, name, begin_s, end_s)
            begin_s = end_s
    return parts


def _cut(trace: Trace, name: str, begin_s: float, end_s: float) -> Trace:
    """Return the part of a trace that begins with everything at its place."""
    event_of = {event.object: event for event in trace.events if event.time_s <= begin_s}
    events: list[Event] = []
    named: set[str] = set()
    for event in (
        *(replace(event, time_s=begin_s) for event in event_of.values()),
        *(event for event in trace.events if begin_s < event.time_s <= end_s),
    ):
        if event.furniture != GONE or event.object in named:  # what goes must have been there
            events.append(event)
            named.add(event.object)
    return replace(trace, name=name, events=tuple(events), truth=None, until_s=end_s)


class _LoggedThings:
    """Follows every thing through the looks."""

    def __init__(self, descriptions: Mapping[Name, str]) -> None:
        self.events: list[Event] = []
        self._descriptions = descriptions
        self._things: dict[Name, list[LoggedThing]] = defaultdict(list)
        self._num_called = Counter[str]()

    def see(self, time_s: float, looks: Sequence[LoggedLook]) -> None:
        """Take over all looks of one time step, in order."""
        seen: dict[Name, dict[int, list[LoggedSpot]]] = defaultdict(dict)
        for look in looks:
            for name, spots in look.seen.items():
                if len(spots) >= len(seen[name].get(look.place, ())):
                    seen[name][look.place] = spots
        for name, things in list(self._things.items()):
            self._lose(time_s, name, things, looks, seen.get(name, {}))
        for name, places in seen.items():
            self._place(time_s, name, places)

    def _lose(
        self,
        time_s: float,
        name: Name,
        things: list[LoggedThing],
        looks: Sequence[LoggedLook],
        seen: Mapping[int, Sequence[LoggedSpot]],
    ) -> None:
        """Let things go that looks at their places did not show."""
        unseen: dict[int, list[float]] = defaultdict(lambda: [0.0, 0.0])  # by relation
        for look in looks:
            if look.sought in (None, name) and name not in look.hidden:
                for relation, share in enumerate(look.coverage):
                    unseen[look.place][relation] += share
        for place, coverage in unseen.items():
            at_place = sorted((t for t in things if t.place == place), key=lambda t: -t.time_s)
            for thing in at_place[len(seen.get(place, ())) :]:
                thing.unseen += coverage[thing.spot.relation]
                if thing.unseen >= COUNTED:
                    thing.place = GONE
                    self._note(time_s, thing)

    def _place(self, time_s: float, name: Name, seen: Mapping[int, Sequence[LoggedSpot]]) -> None:
        """Say where the things of a name are that were seen."""
        things = self._things[name]
        for place, spots in seen.items():
            at_place = [thing for thing in things if thing.place == place]
            for thing, spot in zip(at_place, spots, strict=False):
                self._put(time_s, thing, place, spot)
        for place, spots in seen.items():
            num_there = sum(thing.place == place for thing in things)
            for spot in spots[num_there:]:
                away = [thing for thing in things if thing.time_s < time_s]
                away.sort(key=lambda t: (t.place != GONE, t.time_s))
                if not away:
                    things.append(self._make(name))
                    away = things[-1:]
                self._put(time_s, away[0], place, spot)

    def _make(self, name: Name) -> LoggedThing:
        description = self._descriptions[name]
        called = get_label(description)
        self._num_called[called] += 1
        number = self._num_called[called]
        return LoggedThing(called if number == 1 else f"{called} {number}", description)

    def _put(self, time_s: float, thing: LoggedThing, place: int, spot: LoggedSpot) -> None:
        is_new = (thing.place, thing.spot.relation) != (place, spot.relation)
        thing.place, thing.spot, thing.time_s, thing.unseen = place, spot, time_s, 0.0
        if is_new:
            self._note(time_s, thing)

    def _note(self, time_s: float, thing: LoggedThing) -> None:
        relation, position = thing.spot
        if thing.place == GONE:
            position = None
        self.events.append(
            Event(time_s, thing.name, thing.description, thing.place, relation, position)
        )
