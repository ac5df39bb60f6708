"""The calls of a service that only read: where a thing is, and lists of k rows at most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from typing import TypeVar

from sgm.finder.answers import (
    Answered,
    ChangeList,
    ChangeRow,
    EventList,
    EventRow,
    ExpectedList,
    ExpectedRow,
    LearntList,
    LearntRow,
    PatrolList,
    PatrolRow,
    PlaceList,
    PlaceRow,
    ThingList,
    ThingRow,
)
from sgm.finder.meanings import Unclear, ask_room, doubt, find_place, find_rooms, tell_doubt
from sgm.finder.question_answers import QuestionAnswers
from sgm.finder.ranking import count_known
from sgm.finder.spots import find_position, tell_position
from sgm.finder.where_calls import MOST_ROWS, WhereCalls, check_rows
from sgm.memory.noticed_changes import ThingChange
from sgm.memory.sighting import Point

DEFAULT_ROWS = 20  # of lists
DEFAULT_LOOKS = 3  # of a patrol
_MOST_POSITIONS = 500  # of things, those seen last, that a list tells

_List = TypeVar("_List", PlaceList, ThingList, EventList, ExpectedList, LearntList, PatrolList)


class ReadCalls(WhereCalls):
    """Answers about a memory, which change nothing and wait for no disk."""

    most_rows = MOST_ROWS

    def ask(self, text: str, speaker: str = "") -> Answered:
        """Answer a sentence of a person in a sentence, with the numbers beside it.

        Args:
            text: "is the remote on the sofa?", "what's in the fridge?", "where were my keys
                yesterday evening?"; the kinds are in docs/robot/sentences.md.
            speaker: who says "my".

        Raises:
            ValueError: if it is no text of one line, or the home has no place.
        """
        self._come_to_present()
        return QuestionAnswers(self, text, speaker).answer()

    def list_places(self, room: str | None = None, k: int = DEFAULT_ROWS) -> PlaceList:
        """List the places of a room, or of the home.

        Args:
            room: by name; None for all.
            k: most rows.

        Raises:
            ValueError: if the name is none, or k is out of range.
        """
        check_rows(k)
        self._come_to_present()
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
                position=layout.furniture[number].location,
                last_looked=self.tell_any(counts[number][1], now),
                things=counts[number][0],
                room_id=int(layout.furniture[number].room),
                pose=layout.compute_pose(number),
                box=layout.furniture[number].box,
                open_cost=layout.furniture[number].open_cost,
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
        check_rows(k)
        self._come_to_present()
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
        now, layout = self.memory.time, self.memory.layout
        seen, num_all = self.memory.list_seen(matches, found, k)
        rows = [
            ThingRow(
                thing=thing,
                place=seen_at.furniture,
                name=self.tell_name(seen_at.furniture),
                relation=seen_at.relation or "",
                is_there=seen_at.is_there,
                times_seen=seen_at.times_seen,
                times_looked=seen_at.times_looked,
                last_seen=self.tell_time(seen_at.time, now),
                **tell_position(layout, seen_at.furniture, seen_at.position),
                picture=seen_at.picture,
            )
            for thing, seen_at in seen
        ]
        listed = self._cut(ThingList, rows, k, now, num_all=num_all)
        if not matches or not self.memory.num_furniture:
            return listed
        return replace(listed, num_known=count_known(self.memory.ask(matches)))

    def history(self, thing: str, k: int = DEFAULT_ROWS) -> EventList:
        """List what is known of a thing over time, the latest first.

        Each stay at a place by its last sighting, the first look that missed it where it was, and
        what was said of it and done with it. A memory without a file has the last of each place.

        Args:
            thing: in words; of several things that it means, all are listed.
            k: most rows.

        Raises:
            ValueError: if the name is none, or k is out of range.
        """
        check_rows(k)
        self._come_to_present()
        resolution, now = self.finder.resolve(self.memory, thing), self.memory.time
        unclear = doubt(resolution)
        matches = resolution.matches if unclear is None else ()
        events = [(match, event) for match in matches for event in self.memory.history(match)]
        events.sort(key=lambda named: -named[1].time)
        layout, seen = self.memory.layout, self._find_positions(matches)
        rows = [
            EventRow(
                thing=match,
                what=event.kind,
                place=event.furniture,
                name=self.tell_name(event.furniture),
                relation=event.relation,
                confidence=event.confidence,
                by=event.by,
                at=self.tell_time(event.time, now),
                **tell_position(
                    layout, event.furniture, seen.get((match, event.furniture, event.time))
                ),
                picture=event.picture,
            )
            for match, event in events[:k]
        ]
        return self._cut(EventList, rows, k, now, unclear, len(events))

    def changes(self, since: datetime | int, k: int = DEFAULT_ROWS) -> ChangeList:
        """List what is new, was moved, is gone or was picked up, the latest first.

        Args:
            since: date and time, or time step, from which on it was noticed.
            k: most rows.

        Raises:
            ValueError: if it is a date and the memory has no clock, or k is out of range.
        """
        check_rows(k)
        self._come_to_present()
        changes, now = self.memory.changes(since), self.memory.time
        rows = self._tell_changes(changes[:k], now)
        return ChangeList("ok", rows, max(len(changes) - k, 0), self.tell_time(now, now))

    def expect(
        self, place: int | str, at: datetime | int | None = None, k: int = DEFAULT_ROWS
    ) -> ExpectedList:
        """List what may be at a place, of all that was ever seen or said to be there.

        Args:
            place: id or name.
            at: date and time, or time step, to come; None for now.
            k: most rows.

        Raises:
            KeyError: if there is no place of that id.
            ValueError: if a name is none, the time has passed, or k is out of range.
        """
        check_rows(k)
        self._come_to_present()
        now = self.memory.time
        try:
            found = find_place(self.memory, place)
        except Unclear as unclear:
            return self._cut(ExpectedList, [], k, now, unclear)
        rows = [
            ExpectedRow(thing=each.thing, probability=each.probability, why=each.why)
            for each in self.finder.expect(self.memory, found, at)
        ]
        return replace(self._cut(ExpectedList, rows, k, now), at=self._tell_asked_time(at))

    def next_looks(self, k: int = DEFAULT_LOOKS) -> PatrolList:
        """Say where a robot with nothing to do learns most of where things are.

        Args:
            k: most places.

        Raises:
            ValueError: if k is out of range.
        """
        check_rows(k)
        self._come_to_present()
        now, layout = self.memory.time, self.memory.layout
        looks = self.finder.next_looks(self.memory, k) if self.memory.num_furniture else []
        rows = [
            PatrolRow(
                place=look.furniture,
                name=look.name,
                gain=look.gain,
                is_new=look.is_new,
                position=find_position(layout, look.furniture),
                pose=layout.compute_pose(look.furniture),
            )
            for look in looks
        ]
        return self._cut(PatrolList, rows, k, now, num_all=self.memory.num_furniture)

    def learnt(self, k: int = DEFAULT_ROWS) -> LearntList:
        """Say what a memory with a clock has learnt of how its home goes: see `Finder.learnt`.

        Args:
            k: most rows.

        Raises:
            ValueError: if k is out of range.
        """
        check_rows(k)
        self._come_to_present()
        now = self.memory.time
        if not self.memory.num_furniture:
            return self._cut(LearntList, [], k, now)
        learnt = self.finder.learnt(self.memory)
        rows = [
            LearntRow(
                thing=each.thing,
                said=each.said,
                rhythm=each.rhythm,
                place=each.usual,
                name=each.usual_name,
                share=each.share,
                **tell_position(self.memory.layout, each.usual, None),
            )
            for each in learnt.things
        ]
        listed = replace(self._cut(LearntList, rows, k, now), said=learnt.score)
        if not learnt.num_looks:
            return listed
        return replace(listed, sure=learnt.sure, right=learnt.right, num_looks=learnt.num_looks)

    def _tell_changes(self, changes: Sequence[ThingChange], now: int) -> tuple[ChangeRow, ...]:
        layout = self.memory.layout
        seen = self._find_positions([change.thing for change in changes])
        latest = {(thing, place): position for (thing, place, _), position in seen.items()}
        return tuple(
            ChangeRow(
                what=change.kind,
                thing=change.thing,
                thing_id=change.id,
                from_place=change.from_place,
                from_name=self.tell_name(change.from_place),
                to_place=change.to_place,
                to_name=self.tell_name(change.to_place),
                after=self.tell_any(change.after, now),
                at=self.tell_time(change.time, now),
                probability=change.probability,
                by=change.by,
                from_position=find_position(layout, change.from_place),
                **tell_position(
                    layout, change.to_place, latest.get((change.thing, change.to_place)), "to_"
                ),
                picture=change.picture,
            )
            for change in changes
        )

    def _find_positions(
        self, things: Sequence[str]
    ) -> dict[tuple[str, int | None, int], Point | None]:
        """Return where things are, by description, place, and the time step of the last sighting.

        Without any, nothing; of two things of one name at one place, where the one seen last is.
        """
        if not things or not self.memory.batch.positions.num_rows:
            return {}
        seen, _ = self.memory.list_seen(list(dict.fromkeys(things)), most=_MOST_POSITIONS)
        return {
            (thing, seen_at.furniture, seen_at.time): seen_at.position
            for thing, seen_at in reversed(seen)
        }

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
            at=self.tell_time(now, now),
            **tell_doubt(unclear),
        )
