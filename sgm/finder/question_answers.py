"""Answers a sentence of a person: its kind, the answer in words, and the numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

from sgm.finder.answers import Answered, ThingRow, WhereIs, WhereOne
from sgm.finder.asked_things import (
    MOST_THINGS,
    WHERE_KINDS,
    AskedThings,
    count_steps,
    read_sentences,
)
from sgm.finder.event_answers import EventAnswers, drop_also
from sgm.finder.meanings import MOST_CANDIDATES, Unclear
from sgm.finder.past_places import find_past_places
from sgm.finder.ranking import count_present
from sgm.finder.said_places import find_said_places
from sgm.names.free_reading import make_free_reader
from sgm.names.phrase import BEYOND
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence
from sgm.names.words import POSSESSIVE, normalize

_SURE, _LIKELY = 0.9, 0.5  # probabilities from which on it "is" there, and "is probably"
_MOST_ROWS = 20
_MOST_TOLD = 10  # things at a place that are named


class QuestionAnswers(EventAnswers):
    """Answers sentences by the calls of a service that only read.

    The kinds are those of the table of questions (`sentences.txt`), the answers are written by that
    of answers (`answers.txt`). Nothing else is understood: then it is asked back.
    """

    def answer(self) -> Answered:
        """Return the answer, or what to ask."""
        answered = self._answer()
        if answered.status == "ok":
            return answered
        for sentence in self._read_freely():
            first, self._sentence = self._sentence, sentence
            free = self._answer()
            self._sentence = first
            if free.status == "ok":
                return free
        return answered

    def _read_freely(self) -> Iterator[Sentence]:
        """Read a sentence that no pattern fits by its words, or the one question in it."""
        reader = make_free_reader(self._memory.language)
        names = map(normalize, self._memory.descriptions)
        owned = (name.partition(f"{POSSESSIVE} ") for name in names)
        owners = frozenset(owner for owner, is_owned, _ in owned if is_owned)
        known = (self._text, cache(self._find_surely), cache(self._find_place_names), owners)
        for text in reader.find_only(*known):
            sentence = self._read_sentence(text)
            if sentence.kind not in ("thing", "command"):
                yield sentence
        read = reader.read(*known)
        if read is not None:
            things = [self._read_sentence(thing).things for thing in read.things]
            yield read._replace(things=tuple(name for named in things for name in named))

    def _read_sentence(self, text: str) -> Sentence:
        sentence: Sentence = self._memory.read_sentence(text, self._speaker)
        return sentence

    def _find_surely(self, name: str) -> tuple[str, ...]:
        """Return what a name means, if nothing is to be asked of it; else nothing."""
        found: Resolution = self._calls.finder.resolve(self._memory, name)
        is_sure = found.is_sure and not found.says_less and not found.things and not found.where
        return found.matches if is_sure and not found.unused else ()

    def _find_place_names(self, name: str) -> tuple[str, ...]:
        """Return the names of the places that a name means."""
        layout = self._memory.layout
        found = find_said_places(self._memory, name)
        return tuple(layout.describe(place) for place in found)

    def _answer(self) -> Answered:
        """Answer the sentence as it was read."""
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
                "when_moved",
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

    def _tell_where(self) -> Answered:
        """Say where things are, were or will be: of several that a name means, each."""
        elsewhere = self._tell_not_there()
        if elsewhere is not None:
            return elsewhere
        asked = read_sentences(self._memory, self._calls.finder, [self._sentence], [self._text])
        answer = self._calls.tell_asked(asked)
        meant = [
            (name, self._list_meant(found))
            for name, found in zip(asked.things, _list_answers(answer), strict=True)
        ]
        if any(names for _, names in meant):
            things = dict.fromkeys(thing for name, names in meant for thing in names or (name,))
            is_exact = all(names for _, names in meant)
            answer = self._calls.tell_asked(asked._replace(things=tuple(things), is_exact=is_exact))
        answers = _list_answers(answer)
        if answer.status != "ok":
            unclear = Unclear(answer.status, answer.ask, answer.candidates)
            return self._make(answer.ask, unclear, where=tuple(answers), at=answer.at)
        tense = "was" if answer.at.step < self._memory.time else "is"
        tense = "will" if answer.at.step > self._memory.time else tense
        said = " ".join(self._tell_place(found, tense) for found in answers)
        first = answer.places[0].probability if answer.places else answer.with_robot
        return self._make(said, where=tuple(answers), at=answer.at, probability=first)

    def _tell_not_there(self) -> Answered | None:
        """Say where the one thing of a name is that is not at the place that was said."""
        if len(self._sentence.things) != 1 or self._sentence.time is not None:
            return None
        meant: Resolution = self._calls.finder.resolve(self._memory, self._sentence.things[0])
        is_one = bool(meant.contradiction) and len(meant.matches) == 1 and meant.is_sure
        if not is_one or meant.is_not_there:
            return None
        found = self._calls.where_is(meant.matches[0])
        chance = found.places[0].probability if found.places else 0.0
        return self._make(meant.contradiction, where=(drop_also(found),), probability=chance)

    def _list_meant(self, found: WhereOne) -> tuple[str, ...]:
        """List the things that a name means, where they are few and have names of their own."""
        several = found.status == "ok" and found.asked_for == "thing" and len(found.taken_for) > 1
        few = several and (found.num_known or 0) <= MOST_THINGS
        return self._resolve(found.thing).matches if few else ()

    def _tell_place(self, found: WhereOne, tense: str) -> str:
        """Say in a sentence where one thing is."""
        name = self._name(found.thing, found.taken_for)
        if found.asked_for != "thing":
            places = self._asking.list_names([place.name for place in found.places], "and")
            return self._say("place" if found.asked_for == "place" else "room", places=places)
        if len(found.taken_for) > 1:  # too many for a sentence each
            matches = self._resolve(found.thing).matches
            names = self._asking.list_names(matches, "and")
            return self._say("count", number=len(matches), names=names)
        best = found.places[0] if found.places else None
        if found.with_robot > (best.probability if best else 0.0):
            return self._say("with robot", name, percent=_percent(found.with_robot))
        if best is None or found.elsewhere > best.probability:
            return self._say("elsewhere", name, percent=_percent(found.elsewhere))
        sure = "sure" if best.probability >= _SURE else "likely"
        sure = sure if best.probability >= _LIKELY else "perhaps"
        where, percent = self._asking.say_the(best.name), _percent(best.probability)
        said = self._say(f"{tense} {sure}", name, where=where, percent=percent)
        return f"{said}{self._tell_number(found)}"

    def _tell_number(self, found: WhereOne) -> str:
        """Say that more than one thing of that name is known, and where they may be."""
        if found.num_known is None:
            return ""
        likely = [place for place in found.places if place.probability >= _LIKELY]
        if len(likely) < 2:
            return f" {self._say('all', number=found.num_known)}"
        told = [
            f"{self._asking.say_the(place.name)} ({_percent(place.probability)})"
            for place in likely
        ]
        places = self._asking.join(told, "and")
        return f" {self._say('more known', number=found.num_known, places=places)}"

    def _tell_is_at(self) -> Answered:
        """Say whether things are at a place, or whether there is one; or were, at a time."""
        past = self._find_past()
        first, *others = self._sentence.things or ("",)
        if others and all(map(self._find_either, others)):
            return self._tell_is_at_either(first, others)
        phrases = [self._phrases.read(thing) for thing in self._sentence.things]
        said_where = phrases[-1].where if phrases else ""
        if not said_where or any(not phrase.name or phrase.excluded for phrase in phrases):
            raise Unclear("unknown", self._say("no question"), ())
        told = [
            self._tell_thing_at(phrase.name, phrase.where or said_where, past) for phrase in phrases
        ]
        if len(told) == 1:
            return told[0]
        said = " ".join(answered.said for answered in told)
        where = tuple(found for answered in told for found in answered.where)
        chance = min(answered.probability or 0.0 for answered in told)
        return replace(told[0], said=said, where=where, probability=chance)

    def _find_either(self, words: str) -> list[int]:
        """Return the other place of "in the bedroom or the office"; nothing for a thing."""
        is_thing = bool(self._calls.finder.resolve(self._memory, words).matches)
        return [] if is_thing else find_said_places(self._memory, words)

    def _tell_is_at_either(self, first: str, others: Sequence[str]) -> Answered:
        """Say at which of two places or more a thing is."""
        phrase = self._phrases.read(first)
        if not phrase.where or not phrase.name or phrase.excluded or phrase.is_not_there:
            raise Unclear("unknown", self._say("no question"), ())
        self._refuse_time()
        self._resolve_one(phrase.name)
        places = self._find_places(phrase.where)
        places += [place for words in others for place in self._find_places(words)]
        found = self._calls.where_is(phrase.name, speaker=self._speaker)
        chance = self._compute_chance(phrase.name, places)
        told = self._tell_place(found, "is")
        if chance < _LIKELY:
            where = self._asking.join([phrase.where, *others])
            told = f"{self._say('no', where=where, percent=_percent(chance))} {told}"
        return self._make(told, where=(drop_also(found),), probability=chance)

    def _tell_thing_at(self, thing: str, said: str, past: tuple[int, int] | None) -> Answered:
        """Say whether a thing is at a place, or was at a time."""
        places = self._find_places(said)
        resolution = self._resolve(thing)
        where = self._say_places(said, places)
        if past is not None:
            return self._tell_was_at(resolution, past, where, places)
        chance = self._compute_chance(thing, places)
        found = self._calls.where_is(thing, speaker=self._speaker)
        name = self._name(found.thing, found.taken_for)
        if chance < _LIKELY:
            best = self._tell_place(found, "is")
            no = f"{self._say('no', where=where, percent=_percent(chance))} {best}"
            return self._make(no, where=(drop_also(found),), probability=chance)
        if self._is_inside(thing, said, places):  # "is the milk on the fridge?"
            inside = self._phrases.say_inside(where)
            told = self._say(
                "in room", name, where=inside.partition(" ")[2], percent=_percent(chance)
            )
            return self._make(told, where=(drop_also(found),), probability=chance)
        chances = {match: self._compute_chance(match, places) for match in found.taken_for}
        likely = [match for match in found.taken_for if chances[match] >= _LIKELY]
        if len(found.taken_for) == 1 or not likely:
            likely, chances = [name], {name: chance}
        yes = [
            self._say("yes", match, where=where, percent=_percent(chances[match]))
            for match in likely
        ]
        if resolution.quantity and len(resolution.matches) <= MOST_THINGS:  # "are all mugs there?"
            away = [match for match in resolution.matches if chances.get(match, 0.0) < _LIKELY]
            asked = AskedThings(things=tuple(away), is_exact=True)
            others = _list_answers(self._calls.tell_asked(asked)) if away else []
            yes += [self._tell_place(other, "is") for other in others]
        return self._make(" ".join(yes), where=(drop_also(found),), probability=chance)

    def _compute_chance(self, thing: str, places: Sequence[int]) -> float:
        """Compute the probability that a thing, or one of a kind, is at one of some places."""
        missing = 1.0
        for place in self._calls.finder.rank(self._memory, thing):
            if place.furniture in places:
                missing *= 1 - place.probability
        return 1 - missing

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
        answered = self._tell_where()
        if answered.status == "ok" and (answered.probability or 0.0) >= _LIKELY:
            return replace(answered, said=f"{self._say('yes alone')} {answered.said}")
        return answered

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
        number = count_present(self._memory.ask(list(dict.fromkeys(names))), places)
        return self._make(self._say("count", number=number, names=told), things=tuple(rows))

    def _list_rows(self, thing: str) -> Sequence[ThingRow]:
        resolution = self._resolve(thing)
        found = [
            self._calls.list_things(kind=name, k=_MOST_ROWS).rows for name in resolution.matches
        ]
        rows = {(row.thing, row.place): row for listed in found for row in listed}
        return [row for row in rows.values() if row.thing in resolution.matches]

    def _find_places(self, where: str) -> list[int]:
        if self._phrases.find_relation(where) == BEYOND:
            raise Unclear("ambiguous", self._say("no relation", where=where), ())
        places = find_said_places(self._memory, where)
        if not places:
            self._refuse_place(where)
        return places

    def _refuse_place(self, where: str) -> None:
        """Raise Unclear for a place that there is not."""
        _, name = self._phrases.split_where(where)
        raise Unclear("ambiguous", self._say("no place", name=name), ())

    def _tell_what_at(self) -> Answered:
        """Say what is or was at a place, or in a room: "what is on the desk but the lamp?"."""
        past = self._find_past()
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
        rows = [row for row in self._list_at(places) if row.thing not in left_out]
        return self._tell_rows(where, places, rows)

    def _tell_what_was_at(
        self, where: str, places: Sequence[int], past: tuple[int, int], left_out: set[str]
    ) -> Answered:
        """Say what is known to have been at a place in a time that has passed."""
        names = [name for name in self._memory.descriptions if name not in left_out]
        was = [
            name
            for name in names
            for found in find_past_places(self._memory, name, *past)
            if found.furniture in places and found.probability >= _LIKELY
        ]
        at, where = (
            self._calls.tell_time(past[1], self._memory.time),
            self._say_places(where, places),
        )
        if not was:
            return self._make(self._say("nothing then", where=where), at=at)
        told = self._asking.list_names(was, "and", plain=True, most=_MOST_TOLD)
        named = tuple(was[:MOST_THINGS])
        asked = AskedThings(things=named, span=past, is_past=True, is_exact=True)
        answers = _list_answers(self._calls.tell_asked(asked))
        return self._make(
            self._say("things then", where=where, names=told), where=tuple(answers), at=at
        )

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

    def _is_inside(self, thing: str, said: str, places: Sequence[int]) -> bool:
        """Tell whether a thing is in what it is asked to be on, as far as is known."""
        if self._phrases.find_relation(said) != "onTop" or self._asking.is_translated:
            return False
        ranked = self._calls.finder.rank(self._memory, thing)
        return all(place.relation == "in" for place in ranked if place.furniture in places)

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
        """Say in which room things are; of several that a name means, each."""
        self._refuse_time()
        told = [self._tell_room_of(thing) for thing in self._sentence.things]
        if not all(told):
            return self._tell_where()
        said = " ".join(words for words, _, _ in filter(None, told))
        where = tuple(found for _, found, _ in filter(None, told))
        first = next(chance for _, _, chance in filter(None, told))
        return self._make(said, where=where, probability=first)

    def _tell_room_of(self, thing: str) -> tuple[str, WhereOne, float] | None:
        """Say in which room a thing is; None for what is a place."""
        resolution = self._resolve(thing)
        found = self._calls.where_is(thing, speaker=self._speaker)
        if found.asked_for != "thing":
            return None
        few = 1 < len(resolution.matches) <= MOST_CANDIDATES
        rooms = [self._find_room(name) for name in (resolution.matches if few else (thing,))]
        names = resolution.matches if few else (self._name(found.thing, found.taken_for),)
        said = [
            self._say("in room", name, where=self._asking.say_the(room), percent=_percent(chance))
            for name, (room, chance) in zip(names, rooms, strict=True)
        ]
        return " ".join(said), drop_also(found), rooms[0][1]

    def _find_room(self, thing: str) -> tuple[str, float]:
        """Return the likeliest room of a thing, and how likely it is."""
        layout, chances = self._memory.layout, dict[str, float]()
        for place in self._calls.finder.rank(self._memory, thing):
            room = str(layout.rooms[layout.furniture[place.furniture].room])
            chances[room] = chances.get(room, 0.0) + place.probability
        room, chance = max(chances.items(), key=lambda pair: pair[1])
        return room, min(chance, 1.0)


def _percent(probability: float) -> str:
    return f"{probability:.0%}"


def _list_answers(answer: WhereIs) -> list[WhereOne]:
    """List the answers of a call about one thing or several."""
    return [answer, *(answer.also or ())]
