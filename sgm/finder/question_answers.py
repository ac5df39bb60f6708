"""Answers a sentence of a person: its kind, the answer in words, and the numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from sgm.finder.answers import Answered, ChangeRow, EventRow, ThingRow, WhereIs, WhereOne
from sgm.finder.asked_things import WHERE_KINDS, count_step, is_present
from sgm.finder.meanings import MOST_CANDIDATES, Unclear, doubt, tell_doubt
from sgm.finder.past_places import find_past_places
from sgm.finder.said_places import find_said_places
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.asking import Asking, make_asking
from sgm.names.phrase import make_phrase_reader
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence

_SURE, _LIKELY = 0.9, 0.5  # probabilities from which on it "is" there, and "is probably"
_MOST_ROWS = 20


class QuestionAnswers:
    """Answers sentences by the calls of a service that only read.

    The kinds are those of the table of questions (`sentences.txt`), the answers are written by that
    of answers (`answers.txt`). Nothing else is understood: then it is asked back.
    """

    def __init__(self, calls: Any, text: str, speaker: str) -> None:
        """Answer a sentence by calls, a `ReadCalls`; `speaker` is who says "my"."""
        self._calls, self._text, self._speaker = calls, text, speaker
        self._memory: SceneGraphMemory = calls.memory
        self._asking: Asking = make_asking(self._memory.language)
        self._phrases = make_phrase_reader(self._memory.language)
        self._sentence: Sentence = self._memory.read_sentence(text, speaker)

    def answer(self) -> Answered:
        """Return the answer, or what to ask."""
        kind = self._sentence.kind
        try:
            if kind in (
                "is_at",
                "is_there",
                "count",
                "what_at",
                "which",
                "room",
                "when",
                "who",
                "moved",
                "history",
            ):
                answered: Answered = getattr(self, f"_tell_{kind}")()
            elif kind == "changes":
                answered = self._tell_changes()
            elif kind in WHERE_KINDS and self._sentence.things:
                answered = self._tell_where()
            else:
                raise Unclear("unknown", self._say("no question"), ())
        except Unclear as unclear:
            return self._make(said=unclear.ask, unclear=unclear)
        return answered

    def _make(self, said: str, unclear: Unclear | None = None, **found: Any) -> Answered:
        now = self._calls.tell_time(self._memory.time, self._memory.time)
        kind = self._sentence.kind
        kind = "where" if kind == "thing" else kind
        told = {"status": "ok", "ask": "", "candidates": (), **tell_doubt(unclear)}
        return Answered(kind=kind, said=said, text=self._text, **{"at": now, **told, **found})

    def _say(self, sentence: str, thing: str = "", **values: object) -> str:
        return self._asking.tell(sentence, thing, **values)

    def _resolve(self, thing: str) -> Resolution:
        """Return what a thing means; raises Unclear where that is to be asked."""
        resolution: Resolution = self._calls.finder.resolve(self._memory, thing)
        unclear = doubt(resolution)
        if unclear is not None:
            raise unclear
        return resolution

    def _get_only(self) -> str:
        """Return the one thing that is asked for."""
        things = self._sentence.things
        if len(things) != 1:
            ask = self._say("several", names=self._asking.list_names(things))
            raise Unclear("ambiguous", ask, things[:MOST_CANDIDATES])
        return things[0]

    def _refuse_time(self) -> None:
        """Raise Unclear where a time was said that the answer does not use."""
        said, clock = self._sentence.time, self._memory.clock
        if said is not None and clock is not None and said.link == "at":
            now = clock.get_time(self._memory.time)
            if is_present(*said.find(now, self._sentence.tense), now, self._sentence.tense):
                return
        if self._sentence.time is not None:
            words = (self._sentence.time.words,)
            raise Unclear("ambiguous", self._asking.tell_unused(words), ())

    def _tell_where(self) -> Answered:
        """Say where things are, were or will be."""
        answer = self._calls.where_is(self._text, speaker=self._speaker)
        answers: list[WhereOne] = [answer, *(answer.also or ())]
        if answer.status != "ok":
            unclear = Unclear(answer.status, answer.ask, answer.candidates)
            return self._make(answer.ask, unclear, where=tuple(answers), at=answer.at)
        tense = "was" if answer.at.step < self._memory.time else "is"
        tense = "will" if answer.at.step > self._memory.time else tense
        said = " ".join(self._tell_place(found, tense) for found in answers)
        first = answer.places[0].probability if answer.places else answer.with_robot
        return self._make(said, where=tuple(answers), at=answer.at, probability=first)

    def _tell_place(self, found: WhereOne, tense: str) -> str:
        """Say in a sentence where one thing is."""
        name = self._name(found.thing, found.taken_for)
        if found.asked_for != "thing":
            places = self._asking.list_names([place.name for place in found.places], "and")
            return self._say("place" if found.asked_for == "place" else "room", places=places)
        best = found.places[0] if found.places else None
        if found.with_robot > (best.probability if best else 0.0):
            return self._say("with robot", name, percent=_percent(found.with_robot))
        if best is None or found.elsewhere > best.probability:
            return self._say("elsewhere", name, percent=_percent(found.elsewhere))
        sure = "sure" if best.probability >= _SURE else "likely"
        sure = sure if best.probability >= _LIKELY else "perhaps"
        where = self._asking.say_the(best.name)
        return self._say(f"{tense} {sure}", name, where=where, percent=_percent(best.probability))

    def _name(self, thing: str, taken_for: Sequence[str]) -> str:
        """Return how a thing is called in the answer: as it was taken, or as it was asked for."""
        if len(taken_for) == 1:
            return taken_for[0]
        phrase = self._phrases.read(thing)
        return self._asking.strip_article(phrase.name or thing)

    def _tell_is_at(self) -> Answered:
        """Say whether a thing is at a place, or whether there is one; or was, at a time."""
        past = self._find_past()
        thing = self._get_only()
        phrase = self._phrases.read(thing)
        if not phrase.where or not phrase.name or phrase.excluded:
            raise Unclear("unknown", self._say("no question"), ())
        places = find_said_places(self._memory, phrase.where)
        if not places:
            self._refuse_place(phrase.where)
        resolution = self._resolve(phrase.name)
        where = self._say_places(phrase.where, places)
        if past is not None:
            return self._tell_was_at(resolution, past, where, places)
        ranking = self._calls.finder.rank(self._memory, phrase.name)
        among = [place for place in ranking if place.furniture in places]
        chance = 1.0
        for place in among:
            chance *= 1 - place.probability
        chance = 1 - chance
        found = self._calls.where_is(phrase.name, speaker=self._speaker)
        name = self._name(found.thing, found.taken_for)
        if chance >= _LIKELY:
            said = self._say("yes", name, where=where, percent=_percent(chance))
        else:
            best = self._tell_place(found, "is")
            said = f"{self._say('no', where=where, percent=_percent(chance))} {best}"
        return self._make(said, where=(_drop_also(found),), probability=chance)

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
        return count_step(self._memory, begin), count_step(self._memory, end)

    def _tell_was_at(
        self, resolution: Resolution, past: tuple[int, int], where: str, places: Sequence[int]
    ) -> Answered:
        """Say whether a thing was at a place in a time that has passed."""
        name = self._name(resolution.question, resolution.matches)
        was = [
            found
            for match in resolution.matches
            for found in find_past_places(self._memory, match, *past)
        ]
        if not was:
            raise Unclear("unknown", self._say("not known then", name), ())
        at = self._calls.tell_time(past[1], self._memory.time)
        chance = min(sum(found.probability for found in was if found.furniture in places), 1.0)
        percent = _percent(chance)
        if chance >= _LIKELY:
            said = self._say("yes then", name, where=where, percent=percent)
            return self._make(said, probability=chance, at=at)
        said = self._say("no", where=where, percent=percent)
        best = max(was, key=lambda found: found.probability)
        if best.furniture is not None:
            place_name = self._asking.say_the(self._calls.tell_name(best.furniture))
            sure = "was sure" if best.probability >= _SURE else "was likely"
            percent = _percent(best.probability)
            said = f"{said} {self._say(sure, name, where=place_name, percent=percent)}"
        return self._make(said, probability=chance, at=at)

    def _tell_is_there(self) -> Answered:
        """Say whether there is a thing, and where."""
        if self._phrases.read(self._get_only()).where:
            return self._tell_is_at()
        self._refuse_time()
        return self._tell_where()

    def _say_places(self, where: str, places: Sequence[int]) -> str:
        """Return the words of a place, as they were said, or as the language calls that place."""
        if not self._asking.is_translated:
            return where
        layout = self._memory.layout
        rooms = {str(layout.rooms[layout.furniture[place].room]) for place in places}
        name = layout.describe(places[0]) if len(places) == 1 else next(iter(rooms))
        return self._asking.translate(name)

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
        return self._make(self._say("count", number=len(rows), names=told), things=tuple(rows))

    def _list_rows(self, thing: str) -> Sequence[ThingRow]:
        resolution = self._resolve(thing)
        found = [
            self._calls.list_things(kind=name, k=_MOST_ROWS).rows for name in resolution.matches
        ]
        rows = {(row.thing, row.place): row for listed in found for row in listed}
        return [row for row in rows.values() if row.thing in resolution.matches]

    def _find_places(self, where: str) -> list[int]:
        places = find_said_places(self._memory, where)
        if not places:
            self._refuse_place(where)
        return places

    def _refuse_place(self, where: str) -> None:
        """Raise Unclear for a place that there is not."""
        _, name = self._phrases.split_where(where)
        raise Unclear("ambiguous", self._say("no place", name=name), ())

    def _tell_what_at(self) -> Answered:
        """Say what is at a place, or in a room."""
        self._refuse_time()
        places = self._find_places(self._sentence.where)
        rows = self._list_at(places)
        return self._tell_rows(self._sentence.where, places, rows)

    def _tell_rows(self, where: str, places: Sequence[int], rows: Sequence[ThingRow]) -> Answered:
        where = self._say_places(where, places)
        if not rows:
            return self._make(self._say("nothing there", where=where))
        names = self._asking.list_names([row.thing for row in rows], "and", plain=True)
        return self._make(self._say("things there", where=where, names=names), things=tuple(rows))

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
        return self._tell_rows(phrase.where, places, [row for row in found if row.place in places])

    def _tell_room(self) -> Answered:
        """Say in which room a thing is."""
        self._refuse_time()
        thing = self._get_only()
        self._resolve(thing)
        found = self._calls.where_is(thing, speaker=self._speaker)
        if found.asked_for != "thing":
            return self._tell_where()
        layout, chances = self._memory.layout, dict[str, float]()
        for place in self._calls.finder.rank(self._memory, thing):
            room = str(layout.rooms[layout.furniture[place.furniture].room])
            chances[room] = chances.get(room, 0.0) + place.probability
        room, chance = max(chances.items(), key=lambda pair: pair[1])
        chance = min(chance, 1.0)
        name = self._name(found.thing, found.taken_for)
        where = self._asking.say_the(room)
        said = self._say("in room", name, where=where, percent=_percent(chance))
        return self._make(said, where=(_drop_also(found),), probability=chance)

    def _tell_when(self) -> Answered:
        """Say when and where a thing was last seen."""
        self._refuse_time()
        thing = self._get_only()
        self._resolve(thing)
        found = self._calls.where_is(thing, speaker=self._speaker)
        name = self._name(found.thing, found.taken_for)
        seen = found.last_seen
        if seen is None:
            return self._make(self._say("never seen", name), where=(_drop_also(found),))
        where = self._asking.say_the(seen.name)
        said = self._say("last seen", name, where=where, when=seen.at.words)
        return self._make(said, where=(_drop_also(found),))

    def _tell_who(self) -> Answered:
        """Say who moved a thing last, or has it."""
        self._refuse_time()
        thing = self._get_only()
        resolution = self._resolve(thing)
        listed = self._calls.history(thing, _MOST_ROWS)
        told = [row for row in listed.rows if row.by]
        name = self._name(thing, resolution.matches)
        if not told:
            return self._make(self._say("nobody", name), events=listed.rows)
        return self._make(self._tell_event(told[0]), events=listed.rows)

    def _tell_event(self, row: EventRow) -> str:
        """Say one thing that is known of a thing."""
        where = self._asking.say_the(row.name) if row.name else ""
        return self._say(
            row.what, row.thing, where=where, when=row.at.words, who=self._asking.tell_who(row.by)
        )

    def _tell_history(self) -> Answered:
        """Say where a thing has been."""
        thing = self._get_only()
        self._resolve(thing)
        listed = self._calls.history(thing, _MOST_ROWS)
        begin, _ = self._find_span()
        rows = [row for row in listed.rows if row.at.step >= begin]
        if not rows:
            return self._make(self._say("no history"))
        return self._make(" ".join(map(self._tell_event, rows)), events=tuple(rows))

    def _find_span(self) -> tuple[int, int]:
        """Return the time steps of the time that was said; of none, all."""
        said, clock, now = self._sentence.time, self._memory.clock, self._memory.time
        if said is None:
            return 0, now
        if clock is None:
            raise Unclear("ambiguous", self._say("no clock", words=said.words), ())
        begin, end = said.find(clock.get_time(now), "past")
        if said.link == "before":
            return 0, count_step(self._memory, begin)
        last = now if said.link == "since" else min(count_step(self._memory, end), now)
        return count_step(self._memory, begin), last

    def _list_changes(self, things: Sequence[str] | None) -> list[ChangeRow]:
        begin, end = self._find_span()
        rows = self._calls.changes(max(begin, 0), self._calls.most_rows).rows
        return [
            row for row in rows if row.at.step <= end and (things is None or row.thing in things)
        ]

    def _tell_change(self, row: ChangeRow) -> str:
        told = {
            name: self._asking.say_the(place) if place else ""
            for name, place in (("before", row.from_name), ("where", row.to_name))
        }
        return self._say(f"change {row.what}", row.thing, when=row.at.words, who=row.by, **told)

    def _tell_moved(self) -> Answered:
        """Say whether a thing was moved."""
        thing = self._get_only()
        resolution = self._resolve(thing)
        rows = [row for row in self._list_changes(resolution.matches) if row.what != "new"]
        name = self._name(thing, resolution.matches)
        if not rows:
            return self._make(self._say("not moved", name))
        said = f"{self._say('yes alone')} {self._tell_some(rows)}"
        return self._make(said, changes=tuple(rows))

    def _tell_changes(self) -> Answered:
        """Say what has changed."""
        rows = self._list_changes(None)
        if not rows:
            return self._make(self._say("no changes"))
        order = sorted(rows, key=lambda row: row.what == "new")  # what moved or is gone first
        return self._make(self._tell_some(order), changes=tuple(rows))

    def _tell_some(self, rows: Sequence[ChangeRow]) -> str:
        """Say the first changes, and how many more there are."""
        said = " ".join(map(self._tell_change, rows[:MOST_CANDIDATES]))
        more = len(rows) - MOST_CANDIDATES
        return f"{said} {self._say('more changes', number=more)}" if more > 0 else said


def _percent(probability: float) -> str:
    return f"{probability:.0%}"


def _drop_also(found: WhereOne) -> WhereOne:
    return replace(found, also=None) if isinstance(found, WhereIs) else found
