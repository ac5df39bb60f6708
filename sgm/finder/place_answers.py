"""Answers what is or was at a place, which things of a kind are there, and how many."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from sgm.finder.answers import Answered, ThingRow, WhereIs, WhereOne
from sgm.finder.asked_things import MOST_THINGS, AskedThings, count_steps
from sgm.finder.event_answers import EventAnswers
from sgm.finder.meanings import Unclear
from sgm.finder.past_places import find_past_places
from sgm.finder.ranking import count_present

LIKELY = 0.5  # probability from which on a thing "is probably" there
_MOST_ROWS = 20
_MOST_TOLD = 10  # things at a place that are named


class PlaceAnswers(EventAnswers):
    """Answers sentences about places, by the calls of a service that only read."""

    def _tell_count(self) -> Answered:
        """Say how many things of a kind there are, here or at a place."""
        self._refuse_time()
        places = self._find_places(self._sentence.where) if self._sentence.where else None
        if self._sentence.things:
            rows = [row for row in self._list_rows(self._get_only()) if row.is_there]
            rows = [row for row in rows if places is None or row.place in places]
        else:
            rows = self._list_at(places or ())
        names = [row.thing for row in rows]
        if not rows:
            return self._make(self._say("none"))
        told = self._asking.list_names(names, "and")
        number = count_present(self._memory.ask(list(dict.fromkeys(names))), places)
        return self._make(self._say("count", number=number, names=told), things=tuple(rows))

    def _list_rows(self, thing: str) -> Sequence[ThingRow]:
        resolution = self._resolve(thing)
        found = [
            self._calls.list_things(kind=name, k=_MOST_ROWS).rows for name in resolution.matches
        ]
        rows = {(row.thing, row.place): row for listed in found for row in listed}
        return [row for row in rows.values() if row.thing in resolution.matches]

    def _tell_what_at(self) -> Answered:
        """Say what is, was or will be at a place or in a room: "what is here but the lamp?"."""
        ahead = self._find_ahead()
        past = None if ahead is not None else self._find_past()
        where = self._sentence.where
        phrase = self._phrases.read(where)
        if phrase.excluded or phrase.is_not_there:
            where = phrase.name or where
        left_out = {name for thing in phrase.excluded for name in self._resolve(thing).matches}
        places = self._find_places(where)
        if phrase.is_not_there:  # "in the garage but not on the workbench"
            away = self._find_places(phrase.where)
            places = [place for place in places if place not in away]
        if past is not None:
            return self._tell_what_was_at(where, places, past, left_out)
        if ahead is not None:
            return self._tell_expected(where, places, ahead, left_out)
        rows = [row for row in self._list_at(places) if row.thing not in left_out]
        return self._tell_rows(where, places, rows)

    def _tell_is_empty(self) -> Answered:
        """Say whether nothing is at a place, and what is."""
        self._refuse_time()
        told = self._tell_what_at()
        first = self._say("no alone" if told.things else "yes alone")
        return replace(told, kind="what_at", said=f"{first} {told.said}")

    def _tell_what_was_at(
        self, where: str, places: Sequence[int], past: tuple[int, int], left_out: set[str]
    ) -> Answered:
        """Say what is known to have been at a place in a time that has passed."""
        names = [name for name in self._memory.descriptions if name not in left_out]
        was = [name for name in names if self._was_at(name, places, past)]
        at, where = (
            self._calls.tell_time(past[1], self._memory.time),
            self._say_places(where, places),
        )
        if not was:
            return self._make(self._say("nothing then", where=where), at=at)
        told = self._asking.list_names(was, "and", plain=True, most=_MOST_TOLD)
        named = tuple(was[:MOST_THINGS])
        asked = AskedThings(things=named, span=past, is_past=True, is_exact=True)
        answers = list_answers(self._calls.tell_asked(asked))
        return self._make(
            self._say("things then", where=where, names=told), where=tuple(answers), at=at
        )

    def _tell_expected(
        self, where: str, places: Sequence[int], ahead: int, left_out: set[str]
    ) -> Answered:
        """Say what will probably be at a place at a time to come."""
        listed = [self._calls.expect(place, ahead, self._calls.most_rows) for place in places]
        rows = [row for each in listed for row in each.rows if row.thing not in left_out]
        rows.sort(key=lambda row: -row.probability)
        at, where = listed[0].at, self._say_places(where, places)
        told = [
            f"{self._asking.translate(row.thing)} ({row.probability:.0%})"
            for row in rows
            if row.probability >= LIKELY
        ]
        said = self._say("nothing expected", where=where)
        if told:
            names = self._asking.join(told, "and", _MOST_TOLD)
            said = self._say("things expected", where=where, names=names)
        return self._make(said, at=at, expected=tuple(rows[: self._calls.most_rows]))

    def _was_at(self, name: str, places: Sequence[int], past: tuple[int, int]) -> bool:
        """Tell whether a look of a time that has passed showed a thing there, or it likely was."""
        known = self._memory.list_known(name, *past)
        is_seen = any(e.furniture in places and past[0] <= e.time <= past[1] for e in known)
        was = find_past_places(self._memory, name, *past)
        return is_seen or any(at.furniture in places and at.probability >= LIKELY for at in was)

    def _tell_rows(self, where: str, places: Sequence[int], rows: Sequence[ThingRow]) -> Answered:
        asked_on = self._phrases.find_relation(where) == "onTop" and not self._asking.is_translated
        inside = [row for row in rows if asked_on and row.relation == "in"]
        others = [row for row in rows if row not in inside]
        told = [self._tell_names(self._say_places(where, places), others)]
        if inside:  # "what is on the fridge?"
            told.append(self._tell_names(self._phrases.say_inside(where), inside))
        return self._make(" ".join(told), things=(*others, *inside))

    def _tell_names(self, where: str, rows: Sequence[ThingRow]) -> str:
        """Say what is at a place, by its words."""
        if not rows:
            return self._say("nothing there", where=where)
        told = self._asking.list_names([row.thing for row in rows], "and", True, _MOST_TOLD)
        return self._say("things there", where=where, names=told)

    def _say_places(self, where: str, places: Sequence[int]) -> str:
        """Return the words of a place, as they were said, or as the language calls that place."""
        if not self._asking.is_translated:
            return where
        layout = self._memory.layout
        rooms = {str(layout.rooms[layout.furniture[place].room]) for place in places}
        name = layout.describe(places[0]) if len(places) == 1 else next(iter(rooms))
        return self._asking.translate(name)

    def _list_at(self, places: Sequence[int]) -> list[ThingRow]:
        """List what is at places."""
        return [
            row for place in places for row in self._calls.list_things(place, k=_MOST_ROWS).rows
        ]

    def _tell_which(self) -> Answered:
        """Say which of the things of a kind are at a place: "what food is in the fridge?"."""
        self._refuse_time()
        phrase = self._phrases.read(self._get_only())
        if not phrase.where or not phrase.name or phrase.excluded:
            raise Unclear("unknown", self._say("no question"), ())
        places = self._find_places(phrase.where)
        found = [row for row in self._list_rows(phrase.name) if row.is_there]
        told = self._tell_rows(phrase.where, places, [row for row in found if row.place in places])
        at_place = {row.thing for row in self._list_at(places)}
        others = [name for name in self._resolve(phrase.name).unsorted if name in at_place]
        if not others:
            return told
        names = self._asking.list_names(others, "and", plain=True, most=_MOST_TOLD)
        return replace(told, said=f"{told.said} {self._say('unsorted', names=names)}")

    def _find_ahead(self) -> int | None:
        """Return the first time step of a time to come; None where none is meant."""
        said, clock, now = self._sentence.time, self._memory.clock, self._memory.time
        if said is None or clock is None or self._sentence.tense != "future":
            return None
        begin, end = said.find(clock.get_time(now), "future")
        if said.link != "at" or end <= clock.get_time(now):
            self._refuse_time()
        first, _ = count_steps(self._memory, begin, end)
        return first if first > now else None

    def _find_past(self) -> tuple[int, int] | None:
        """Return the time steps of a time that has passed; None where the present is meant."""
        said, clock, now = self._sentence.time, self._memory.clock, self._memory.time
        if said is None or clock is None or said.link != "at":
            self._refuse_time()
            return None
        begin, end = said.find(clock.get_time(now), "past")
        if end >= clock.get_time(now):
            self._refuse_time()
            return None
        return count_steps(self._memory, begin, end)


def list_answers(answer: WhereIs) -> list[WhereOne]:
    """List the answers of a call about one thing or several."""
    return [answer, *(answer.also or ())]
