"""The calls of a service that only read: where a thing is, and lists of k rows at most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import TypeVar

from sgm.finder.answers import (
    MOST_BYTES,
    ChangeList,
    ChangeRow,
    EventList,
    EventRow,
    LastSeen,
    Moment,
    PlaceFound,
    PlaceList,
    PlaceRow,
    ThingList,
    ThingRow,
    WhereIs,
    write_json,
)
from sgm.finder.finder import Finder
from sgm.finder.meanings import (
    MOST_CANDIDATES,
    Unclear,
    ask_room,
    ask_which,
    doubt,
    find_place,
    find_rooms,
    tell_doubt,
)
from sgm.finder.ranking import Place, Ranking
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import SeenAt
from sgm.messages import shorten, shorten_text

MOST_ROWS = 50
DEFAULT_ROWS = 20  # of lists
DEFAULT_PLACES = 3
_MOST_WHY = 80  # characters of the evidence of a place

_List = TypeVar("_List", PlaceList, ThingList, EventList)


class ReadCalls:
    """Answers about a memory, which change nothing and wait for no disk.

    Attributes:
        memory: what is remembered.
        finder: says where things are.
    """

    def __init__(self, memory: SceneGraphMemory, finder: Finder) -> None:
        self.memory = memory
        self.finder = finder

    def where_is(
        self, thing: str, at: datetime | int | None = None, k: int | None = None
    ) -> WhereIs:
        """Say where a thing may be, the likeliest place first.

        Args:
            thing: in words, "the red mug".
            at: date and time, or time step, to come; None for now.
            k: most places; None for three, or fewer where the answer would have more than 600
                bytes.

        Raises:
            ValueError: if the name is none, the home has no place, the time has passed, or k is out
                of range.
        """
        if k is not None:
            _check_rows(k)
        ranking = self.finder.rank(self.memory, thing, k or DEFAULT_PLACES, at=at)
        now, clock = self.memory.time, self.memory.clock
        seen, asked = _choose_last_seen(ranking), now
        if isinstance(at, datetime) and clock is not None:
            asked = int((at - clock.start).total_seconds() // clock.step_seconds)
        elif isinstance(at, int):
            asked = at
        last_seen = None
        if seen is not None:
            name, when = self._tell_name(seen.furniture), self._tell_time(seen.time, now)
            last_seen = LastSeen(seen.furniture, name, seen.is_there, seen.by, when, seen.position)
        answer = WhereIs(
            thing=ranking.description,
            taken_for=_list_taken(ranking),
            places=tuple(
                PlaceFound(
                    place.furniture,
                    place.name,
                    place.relation,
                    place.probability,
                    _tell_why(place),
                    place.position,
                )
                for place in ranking
            ),
            left_out=0,
            elsewhere=ranking.elsewhere,
            with_robot=ranking.with_robot,
            last_seen=last_seen,
            at=self._tell_time(asked, now),
            asked_for=ranking.asked_for,
            **tell_doubt(None if ranking.asked_for != "thing" else self._doubt(ranking)),
        )
        return answer if k is not None else _fit(answer)

    def _doubt(self, ranking: Ranking) -> Unclear | None:
        """Return what to ask about a thing, or about a place that may be meant: "left sofa"."""
        unclear = doubt(ranking.resolution)
        if unclear is None or unclear.candidates:
            return unclear
        layout, thing = self.memory.layout, ranking.description
        names = [node.description for node in layout.furniture.values()]
        likely = self.memory.resolve(thing, among=list(dict.fromkeys(names)))
        near = likely.matches or likely.doubtful
        told = [
            layout.describe(n) for n, node in layout.furniture.items() if node.description in near
        ]
        return ask_which(list(dict.fromkeys(told)), thing) if told else unclear

    def list_places(self, room: str | None = None, k: int = DEFAULT_ROWS) -> PlaceList:
        """List the places of a room, or of the home.

        Args:
            room: by name; None for all.
            k: most rows.

        Raises:
            ValueError: if the name is none, or k is out of range.
        """
        _check_rows(k)
        rooms = None if room is None else find_rooms(self.memory, room)
        if room is not None and not rooms:
            unclear = ask_room(self.memory, room, [])
            return self._cut(PlaceList, [], k, self.memory.time, unclear)
        now, layout, counts = self.memory.time, self.memory.layout, self.memory.count_things()
        furniture = sorted(
            number
            for number in layout.furniture
            if number in counts and (rooms is None or layout.furniture[number].room in rooms)
        )
        rows = [
            PlaceRow(
                place=number,
                name=layout.describe(number),
                room=str(layout.rooms[layout.furniture[number].room]),
                label=layout.furniture[number].label,
                position=layout.furniture[number].position,
                last_looked=self._tell_any(counts[number][1], now),
                things=counts[number][0],
            )
            for number in furniture[:k]
        ]
        return self._cut(PlaceList, rows, k, now, num_all=len(furniture))

    def list_things(
        self, place: int | str | None = None, kind: str | None = None, k: int = DEFAULT_ROWS
    ) -> ThingList:
        """List what is at a place, or all things of a kind, or all that is known.

        Of a place, what the last look showed; of other things, each where it is by the last looks,
        or where it was seen last.

        Args:
            place: id or name; None for all.
            kind: "mug"; None for all.
            k: most rows.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, or k is out of range.
        """
        _check_rows(k)
        matches: Sequence[str] | None = None
        try:
            found = None if place is None else find_place(self.memory, place)
            if kind is not None:
                resolution = self.finder.resolve(self.memory, kind)
                matches, unknown = resolution.matches, doubt(resolution)
                if unknown is not None and not matches:
                    raise unknown
        except Unclear as unclear:
            return self._cut(ThingList, [], k, self.memory.time, unclear)
        now = self.memory.time
        seen, num_all = self.memory.list_seen(matches, found, k)
        rows = [
            ThingRow(
                thing=thing,
                place=seen_at.furniture,
                name=self._tell_name(seen_at.furniture),
                relation=seen_at.relation or "",
                is_there=seen_at.is_there,
                times_seen=seen_at.times_seen,
                times_looked=seen_at.times_looked,
                last_seen=self._tell_time(seen_at.time, now),
                position=seen_at.position,
            )
            for thing, seen_at in seen
        ]
        return self._cut(ThingList, rows, k, now, num_all=num_all)

    def history(self, thing: str, k: int = DEFAULT_ROWS) -> EventList:
        """List what is known of a thing over time, the latest first.

        Where it was seen last at each place, the first look that missed it there, and what was said
        of it and done with it; the log has all.

        Args:
            thing: in words; of several things that it means, all are listed.
            k: most rows.

        Raises:
            ValueError: if the name is none, or k is out of range.
        """
        _check_rows(k)
        resolution, now = self.finder.resolve(self.memory, thing), self.memory.time
        unclear = doubt(resolution)
        matches = resolution.matches if unclear is None else ()
        rows = [
            EventRow(
                thing=match,
                what=event.kind,
                place=event.furniture,
                name=self._tell_name(event.furniture),
                relation=event.relation,
                confidence=event.confidence,
                by=event.by,
                at=self._tell_time(event.time, now),
            )
            for match in matches
            for event in self.memory.history(match)
        ]
        rows.sort(key=lambda event_row: -event_row.at.step)
        return self._cut(EventList, rows, k, now, unclear)

    def changes(self, since: datetime | int, k: int = DEFAULT_ROWS) -> ChangeList:
        """List what is new, was moved, is gone or was picked up, the latest first.

        Args:
            since: date and time, or time step, from which on it was noticed.
            k: most rows.

        Raises:
            ValueError: if it is a date and the memory has no clock, or k is out of range.
        """
        _check_rows(k)
        changes, now = self.memory.changes(since), self.memory.time
        rows = tuple(
            ChangeRow(
                what=change.kind,
                thing=change.thing,
                thing_id=change.id,
                from_place=change.from_place,
                from_name=self._tell_name(change.from_place),
                to_place=change.to_place,
                to_name=self._tell_name(change.to_place),
                after=self._tell_any(change.after, now),
                at=self._tell_time(change.time, now),
                probability=change.probability,
                by=change.by,
            )
            for change in changes[:k]
        )
        return ChangeList("ok", rows, max(len(changes) - k, 0), self._tell_time(now, now))

    def _cut(
        self,
        kind: type[_List],
        rows: Sequence[object],
        k: int,
        now: int,
        unclear: Unclear | None = None,
        num_all: int | None = None,
    ) -> _List:
        """Return a list of k rows at most, of `num_all` or of those given, or what to ask."""
        return kind(
            rows=tuple(rows[:k]),  # type: ignore[arg-type]
            left_out=max((len(rows) if num_all is None else num_all) - k, 0),
            at=self._tell_time(now, now),
            **tell_doubt(unclear),
        )

    def _tell_time(self, step: int, now: int) -> Moment:
        return Moment.tell(step, now, self.memory.clock)

    def _tell_any(self, step: int | None, now: int) -> Moment | None:
        return None if step is None else self._tell_time(step, now)

    def _tell_name(self, place: int | None) -> str:
        """Return the name of a place; empty if it was removed."""
        try:
            return "" if place is None else self.memory.describe(place)
        except KeyError:
            return ""


def _check_rows(k: int) -> None:
    if not isinstance(k, int) or isinstance(k, bool) or not 1 <= k <= MOST_ROWS:
        raise ValueError(
            f"k must be a whole number from 1 to {MOST_ROWS}, got {shorten(k)}. Ask for fewer rows."
        )


def _choose_last_seen(ranking: Ranking) -> SeenAt | None:
    """Return the latest sighting; of those of one time step one where the thing still is."""
    last = ranking.last_seen
    if last is None or last.is_there:
        return last
    sightings = (place.last_seen for place in ranking)
    still = (
        sighting
        for sighting in sightings
        if sighting is not None and sighting.is_there and sighting.time == last.time
    )
    return next(still, last)


def _list_taken(ranking: Ranking) -> tuple[str, ...]:
    """List what a question was taken for: things, or the places themselves."""
    if ranking.asked_for == "place":
        return tuple(place.name for place in ranking)[:MOST_CANDIDATES]
    return ranking.resolution.matches[:MOST_CANDIDATES]


def _tell_why(place: Place) -> str:
    """Say the evidence; where the thing was seen itself, other things and the prior say little."""
    evidence = place.evidence
    if evidence.seen is not None:
        place = replace(place, evidence=replace(evidence, similar=(), prior=0.0))
    return shorten_text(place.why, _MOST_WHY)


def _fit(answer: WhereIs) -> WhereIs:
    """Leave places out, then shorten names, until an answer is short enough."""
    if len(write_json(answer)) <= MOST_BYTES:
        return answer
    sizes = [len(write_json(place)) + 1 for place in answer.places]  # with a comma, but for one
    left = MOST_BYTES - len(write_json(replace(answer, places=()))) + 1
    kept = len(sizes)
    while kept > 1 and sum(sizes[:kept]) > left:
        kept -= 1
    num_left_out = answer.left_out + len(sizes) - kept
    whole = answer = replace(answer, places=answer.places[:kept], left_out=num_left_out)
    if sum(sizes[:kept]) <= left:
        return answer
    for most in (60, 40, 20, 10, 5, 1):  # names may have hundreds of letters
        if len(write_json(answer)) <= MOST_BYTES:
            break
        answer = _shorten_names(whole, most)
    return answer


def _shorten_names(answer: WhereIs, most: int) -> WhereIs:
    def cut(text: str) -> str:
        return text if len(text) <= most else f"{text[:most]}..."

    seen = answer.last_seen
    return replace(
        answer,
        thing=cut(answer.thing),
        taken_for=tuple(map(cut, answer.taken_for)),
        places=tuple(
            replace(place, name=cut(place.name), why=cut(place.why)) for place in answer.places
        ),
        last_seen=None if seen is None else replace(seen, name=cut(seen.name)),
        ask=cut(answer.ask),
        candidates=tuple(map(cut, answer.candidates)),
    )
