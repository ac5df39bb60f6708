"""Answers what happened: when a thing was seen, who moved it, where it has been, what changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from typing import Any

from sgm.finder.answers import Answered, ChangeRow, EventRow, WhereIs, WhereOne
from sgm.finder.asked_things import count_step, count_steps, is_present
from sgm.finder.meanings import MOST_CANDIDATES, Unclear, doubt, tell_doubt
from sgm.finder.said_places import find_said_places
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.names.asking import Asking, make_asking
from sgm.names.phrase import BEYOND, make_phrase_reader
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence
from sgm.names.speaker_words import make_speaker_reader
from sgm.names.words import POSSESSIVE, normalize

_MOST_ROWS = 20


class EventAnswers:
    """Answers sentences about what happened, by the calls of a service that only read."""

    def __init__(self, calls: Any, text: str, speaker: str) -> None:
        """Answer a sentence by calls, a `ReadCalls`; `speaker` is who says "my"."""
        self._calls, self._text = calls, text
        self._memory: SceneGraphMemory = calls.memory
        self._asking: Asking = make_asking(self._memory.language)
        self._phrases = make_phrase_reader(self._memory.language)
        self._asked, told = make_speaker_reader(self._memory.language).take(text, self._owners)
        self._speaker = told or speaker
        self._sentence: Sentence = self._memory.read_sentence(self._asked, self._speaker)

    @cached_property
    def _owners(self) -> frozenset[str]:
        """People of whom something is known to be theirs."""
        names = map(normalize, self._memory.descriptions)
        parted = (name.partition(f"{POSSESSIVE} ") for name in names)
        return frozenset(owner for owner, is_owned, _ in parted if is_owned)

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

    def _resolve_one(self, thing: str) -> Resolution:
        """Return what a thing means; raises Unclear for several: each has a past of its own."""
        resolution = self._resolve(thing)
        if len(resolution.matches) > 1:
            near = resolution.matches[:MOST_CANDIDATES]
            raise Unclear("ambiguous", self._asking.ask_which(near), near, thing)
        return resolution

    def _find_places(self, where: str) -> list[int]:
        if self._phrases.find_relation(where) == BEYOND:
            raise Unclear("ambiguous", self._say("no relation", where=where), ())
        places = find_said_places(self._memory, where)
        unread = self._phrases.find_negations(where)
        if unread and places:  # "on the desk and not on the desk"
            raise Unclear("ambiguous", self._asking.tell_unused(unread), ())
        if not places:
            self._refuse_place(where)
        called = {word for n in places for word in self._memory.describe(n).casefold().split()}
        beside = tuple(word for word in self._phrases.find_links(where) if word not in called)
        if beside:  # "on the counter with the kettle"
            raise Unclear("ambiguous", self._asking.tell_unused(beside), ())
        return places

    def _refuse_place(self, where: str) -> None:
        """Raise Unclear for a place that there is not."""
        _, name = self._phrases.split_where(where)
        raise Unclear("ambiguous", self._say("no place", name=name), ())

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

    def _name(self, thing: str, taken_for: Sequence[str]) -> str:
        """Return how a thing is called in the answer: as it was taken, or as it was asked for."""
        if len(taken_for) == 1:
            return taken_for[0]
        phrase = self._phrases.read(thing)
        return self._asking.strip_article(phrase.name or thing)

    def _tell_when(self) -> Answered:
        """Say when and where a thing was last seen."""
        self._refuse_time()
        thing = self._get_only()
        self._resolve_one(thing)
        found = self._calls.where_is(thing, speaker=self._speaker)
        name = self._name(found.thing, found.taken_for)
        seen = found.last_seen
        if seen is None:
            return self._make(self._say("never seen", name), where=(drop_also(found),))
        where = self._asking.say_the(seen.name)
        said = self._say("last seen", name, where=where, when=seen.at.words)
        return self._make(said, where=(drop_also(found),))

    def _tell_when_at(self) -> Answered:
        """Say when a thing was last seen at a place."""
        thing = self._get_only()
        phrase = self._phrases.read(thing)
        if not phrase.where or not phrase.name or phrase.excluded:
            raise Unclear("unknown", self._say("no question"), ())
        resolution = self._resolve_one(phrase.name)
        places = self._find_places(phrase.where)
        begin, end = self._find_span()
        listed = self._calls.history(phrase.name, self._calls.most_rows)
        rows = [
            row
            for row in listed.rows
            if row.what in ("seen", "put_down")
            and row.place in places
            and begin <= row.at.step <= end
        ]
        name = self._name(phrase.name, resolution.matches)
        is_ever = self._phrases.asks_no_time(self._asked)  # "did it use to be there?"
        if not rows:
            never = self._say("never seen there", name, where=phrase.where)
            return self._make(f"{self._say('no alone')} {never}" if is_ever else never)
        last = max(rows, key=lambda row: row.at.step)
        yes = f"{self._say('yes alone')} " if is_ever else ""
        return self._make(f"{yes}{self._tell_event(last)}", events=(last,))

    def _tell_whose(self) -> Answered:
        """Say whose a thing is, where its name says so, and whether it is a person's."""
        self._refuse_time()
        resolution = self._resolve(self._get_only())
        told = self._tell_owners(resolution)
        asked, owned = self._sentence.where, resolution.matches[0].partition(f"{POSSESSIVE} ")
        if asked and len(resolution.matches) == 1 and owned[1]:
            said = self._say("yes alone" if asked == owned[0] else "no alone")
            told = f"{said} {told}"
        return self._make(told)

    def _tell_owners(self, resolution: Resolution) -> str:
        """Say whose the things are that a name means."""
        told = []
        for name in resolution.matches[:MOST_CANDIDATES]:
            owner, is_owned, _ = name.partition(f"{POSSESSIVE} ")
            owner = owner.split()[-1].capitalize()
            told.append(self._say("owner" if is_owned else "no owner", name, owner=owner))
        return " ".join(told)

    def _tell_when_moved(self) -> Answered:
        """Say when a thing was moved last; with a place, to where it is."""
        resolution = self._resolve_one(self._get_only())
        rows = [row for row in self._list_changes(resolution.matches) if row.what != "new"]
        name = self._name(self._get_only(), resolution.matches)
        if not rows:
            return self._make(self._say("never moved", name))
        return self._make(self._tell_change(rows[0]), changes=tuple(rows[:1]))

    def _tell_who(self) -> Answered:
        """Say who moved a thing last, or has it."""
        self._refuse_time()
        thing = self._get_only()
        resolution = self._resolve_one(thing)
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
        first, last = count_steps(self._memory, begin, end)
        return first, now if said.link == "since" else min(last, now)

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
        sentence = (
            "new somewhere" if row.what == "new" and not row.to_name else f"change {row.what}"
        )
        return self._say(sentence, row.thing, when=row.at.words, who=row.by, **told)

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


def drop_also(found: WhereOne) -> WhereOne:
    """Return an answer about one thing, without those about others."""
    return replace(found, also=None) if isinstance(found, WhereIs) else found
