"""Answers a sentence of a person: its kind, the answer in words, and the numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache

from sgm.finder.answers import Answered, WhereOne
from sgm.finder.asked_things import (
    MOST_THINGS,
    WHERE_KINDS,
    AskedThings,
    read_sentences,
)
from sgm.finder.event_answers import drop_also
from sgm.finder.meanings import MOST_CANDIDATES, Unclear
from sgm.finder.past_places import find_past_places
from sgm.finder.place_answers import LIKELY, PlaceAnswers, list_answers
from sgm.finder.said_places import find_said_places
from sgm.names.clause import Known
from sgm.names.free_reading import make_free_reader
from sgm.names.modifiers import COLOURS, spell
from sgm.names.phrase import Phrase
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence

_SURE = 0.9  # probability from which on it "is" there


class QuestionAnswers(PlaceAnswers):
    """Answers sentences by the calls of a service that only read.

    The kinds are those of the table of questions (`sentences.txt`), the answers are written by that
    of answers (`answers.txt`). Nothing else is understood: then it is asked back.
    """

    def answer(self) -> Answered:
        """Return the answer, or what to ask."""
        answered = self._answer()
        is_list = self._sentence.kind == "thing" and len(self._sentence.things) > 1
        if answered.status == "ok" and not (is_list and self._phrases.asks_yes(self._asked)):
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
        layout = self._memory.layout
        places = map(layout.describe, layout.furniture)
        words = frozenset(" ".join((*self._memory.descriptions, *places)).casefold().split())
        known = Known(
            find_thing=cache(self._find_surely),
            find_place=cache(self._find_place_names),
            owners=self._owners,
            words=words,
        )
        yield from self._read_parts(reader.find_only(self._asked, known))
        read = reader.read(self._asked, known)
        if read is not None:
            things = tuple(name for thing in read.things for name in self._list_named(thing))
            yield read._replace(things=things)
        yield from self._read_parts(reader.find_joined(self._asked, known))

    def _read_parts(self, texts: Iterator[str]) -> Iterator[Sentence]:
        """Read parts of a sentence that may be questions of their own."""
        sentences = map(self._read_sentence, texts)
        return (read for read in sentences if read.kind not in ("thing", "command"))

    def _list_named(self, thing: str) -> tuple[str, ...]:
        """List the things of a name; a "saw" is one, and nothing that was seen."""
        sentence = self._read_sentence(thing)
        return sentence.things if sentence.kind == "thing" else (thing,)

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
        names = (layout.furniture[place].description for place in found)
        return (*names, *map(layout.describe, found))

    def _answer(self) -> Answered:
        """Answer the sentence as it was read."""
        kind = self._sentence.kind
        try:
            self._refuse_colour()
            if kind in (
                "is_at",
                "is_there",
                "count",
                "what_at",
                "is_empty",
                "which",
                "room",
                "when",
                "when_at",
                "when_moved",
                "who",
                "whose",
                "together",
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
        asked = read_sentences(self._memory, self._calls.finder, [self._sentence], [self._asked])
        answer = self._calls.tell_asked(asked)
        meant = [
            (name, self._list_meant(found))
            for name, found in zip(asked.things, list_answers(answer), strict=True)
        ]
        if any(names for _, names in meant):
            things = dict.fromkeys(thing for name, names in meant for thing in names or (name,))
            is_exact = all(names for _, names in meant)
            answer = self._calls.tell_asked(asked._replace(things=tuple(things), is_exact=is_exact))
        answers = list_answers(answer)
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

    def _refuse_colour(self) -> None:
        """Raise Unclear where a colour is said that is not known of the thing."""
        for thing in self._sentence.things:
            found: Resolution = self._calls.finder.resolve(self._memory, thing)
            if not found.says_less or found.is_ambiguous:
                continue
            said = {spell(word) for name in found.matches for word in name.split()}
            words = [word for word in thing.split() if spell(word) in COLOURS - said]
            if words:
                near = found.matches[:MOST_CANDIDATES]
                ask = f"{self._say('no such', name=self._asking.strip_article(thing))} "
                raise Unclear("ambiguous", ask + self._asking.ask_which(near), near, thing)

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
        sure = sure if best.probability >= LIKELY else "perhaps"
        where, percent = self._asking.say_the(best.name), _percent(best.probability)
        said = self._say(f"{tense} {sure}", name, where=where, percent=percent)
        return f"{said}{self._tell_number(found)}"

    def _tell_number(self, found: WhereOne) -> str:
        """Say that more than one thing of that name is known, and where they may be."""
        if found.num_known is None:
            return ""
        likely = [place for place in found.places if place.probability >= LIKELY]
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
        ahead = self._find_ahead()
        past = None if ahead is not None else self._find_past()
        first, *others = self._sentence.things or ("",)
        if others and all(map(self._find_either, others)):
            return self._tell_is_at_either(first, others)
        phrases = [self._phrases.read(thing) for thing in self._sentence.things]
        said_where = phrases[-1].where if phrases else ""
        twice = any(p.is_not_there and self._phrases.read(p.name).where for p in phrases)
        is_from = any(self._phrases.split_where(p.where)[0] == "from" for p in phrases if p.where)
        if not said_where or is_from or twice or any(not p.name or p.excluded for p in phrases):
            raise Unclear("unknown", self._say("no question"), ())
        if ahead is not None:
            return self._tell_will_be_at(phrases, said_where, ahead)
        told = [
            self._tell_thing_at(
                phrase.name, phrase.where or said_where, past, is_each=bool(phrase.quantity)
            )
            for phrase in phrases
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
        if chance < LIKELY:
            where = self._asking.join([phrase.where, *others])
            told = f"{self._say('no', where=where, percent=_percent(chance))} {told}"
        return self._make(told, where=(drop_also(found),), probability=chance)

    def _tell_thing_at(
        self, thing: str, said: str, past: tuple[int, int] | None, is_each: bool = False
    ) -> Answered:
        """Say whether a thing is at a place, or was at a time.

        Of several, "are both mugs there", or "are the mugs there", it is said where each is.
        """
        places = self._find_places(said)
        resolution = self._resolve(thing)
        if resolution.how == "more general name":  # marmalade, and a jam is known
            near = resolution.matches[:MOST_CANDIDATES]
            raise Unclear("ambiguous", self._asking.ask_which(near), near, thing)
        where = self._say_places(said, places)
        if past is not None:
            return self._tell_was_at(resolution, past, where, places)
        chance = self._compute_chance(thing, places)
        found = self._calls.where_is(thing, speaker=self._speaker)
        name = self._name(found.thing, found.taken_for)
        if chance < LIKELY:
            best = self._tell_place(found, "is")
            no = f"{self._say('no', where=where, percent=_percent(chance))} {best}"
            return self._make(no, where=(drop_also(found),), probability=chance)
        if self._was_missed(resolution.matches, places):
            gone = self._say("not seen", name, where=where, percent=_percent(chance))
            return self._make(gone, where=(drop_also(found),), probability=chance)
        if self._is_inside(thing, said, places):  # "is the milk on the fridge?"
            inside = self._phrases.say_inside(where)
            told = self._say(
                "in room", name, where=inside.partition(" ")[2], percent=_percent(chance)
            )
            return self._make(told, where=(drop_also(found),), probability=chance)
        several = found.taken_for if len(found.taken_for) > 1 else ()
        chances = {match: self._compute_chance(match, places, exactly=True) for match in several}
        likely = [match for match in several if chances[match] >= LIKELY]
        if not likely:
            likely, chances = [name], {name: chance}
        yes = [
            self._say("yes", match, where=where, percent=_percent(chances[match]))
            for match in likely
        ]
        is_each = is_each or bool(resolution.quantity)
        is_each = is_each or (self._sentence.kind == "is_at" and self._asking.is_plural(thing))
        if is_each and len(resolution.matches) <= MOST_THINGS:
            away = [match for match in resolution.matches if chances.get(match, 0.0) < LIKELY]
            asked = AskedThings(things=tuple(away), is_exact=True)
            others = list_answers(self._calls.tell_asked(asked)) if away else []
            yes += [self._tell_place(other, "is") for other in others]
        return self._make(" ".join(yes), where=(drop_also(found),), probability=chance)

    def _was_missed(self, things: Sequence[str], places: Sequence[int]) -> bool:
        """Tell whether things were seen at places, and the last looks there missed them."""
        seen, _ = self._memory.list_seen(things, None, MOST_THINGS)
        sightings = [at for _, at in seen if at.furniture in places]
        is_shown = any(self._memory.list_named(*things, place=place) for place in places)
        return bool(sightings) and not (is_shown or any(at.is_there for at in sightings))

    def _compute_chance(self, thing: str, places: Sequence[int], *, exactly: bool = False) -> float:
        """Compute the probability that a thing, or one of a kind, is at one of some places.

        With `exactly` a name means what is called so, and no other thing of that kind.
        """
        missing = 1.0
        for place in self._calls.finder.rank(self._memory, thing, exactly=exactly):
            if place.furniture in places:
                missing *= 1 - place.probability
        return 1 - missing

    def _tell_will_be_at(self, phrases: Sequence[Phrase], said: str, ahead: int) -> Answered:
        """Say whether one thing will be at a place."""
        if len(phrases) > 1:
            raise Unclear("ambiguous", self._say("several", names=said), ())
        name = phrases[0].name
        self._resolve_one(name)
        places = self._find_places(phrases[0].where or said)
        asked = AskedThings(things=(name,), span=(ahead, ahead))
        (found,) = list_answers(self._calls.tell_asked(asked))
        chance = sum(at.probability for at in found.places if at.place in places)
        told = self._tell_place(found, "will")
        if chance < LIKELY:
            no = self._say("no", where=said, percent=_percent(chance))
            return self._make(f"{no} {told}", where=(drop_also(found),), probability=chance)
        told = f"{self._say('yes alone')} {told}"
        return self._make(told, where=(drop_also(found),), probability=chance)

    def _tell_together(self) -> Answered:
        """Say whether things are at one place."""
        self._refuse_time()
        names: list[str] = []
        for thing in self._sentence.things:
            found = self._resolve(thing)
            is_all = bool(found.quantity) and found.has_quantity  # "both mugs"
            names += found.matches if is_all else self._resolve_one(thing).matches[:1]
        names = list(dict.fromkeys(names))
        if not 2 <= len(names) <= MOST_THINGS:
            raise Unclear("unknown", self._say("no question"), ())
        asked = AskedThings(things=tuple(names), is_exact=True)
        answers = list_answers(self._calls.tell_asked(asked))
        at = {found.places[0].place if found.places else None for found in answers}
        if self._sentence.where:  # "in the same room?"
            furniture = self._memory.layout.furniture
            at = {None if place is None else furniture[place].room for place in at}
        said = self._say("yes alone" if len(at) == 1 and None not in at else "no alone")
        told = " ".join([said, *(self._tell_place(found, "is") for found in answers)])
        return self._make(told, where=tuple(answers))

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
        was_seen = any(
            event.furniture in places
            for match in resolution.matches
            for event in self._memory.list_known(match, *past)
            if event.time <= past[1]
        )
        if not was and not was_seen:
            raise Unclear("unknown", self._say("not known then", name), ())
        at = self._calls.tell_time(past[1], self._memory.time)
        chance = min(sum(found.probability for found in was if found.furniture in places), 1.0)
        percent = _percent(chance)
        if chance >= LIKELY:
            said = self._say("yes then", name, where=where, percent=percent)
            return self._make(said, probability=chance, at=at)
        said = self._say("no", where=where, percent=percent)
        best = max(was, key=lambda found: found.probability, default=None)
        if best is not None and best.furniture is not None:
            place_name = self._asking.say_the(self._calls.tell_name(best.furniture))
            sure = "was sure" if best.probability >= _SURE else "was likely"
            percent = _percent(best.probability)
            said = f"{said} {self._say(sure, name, where=place_name, percent=percent)}"
        return self._make(said, probability=chance, at=at)

    def _tell_is_there(self) -> Answered:
        """Say whether there is a thing, and where."""
        things = self._sentence.things
        if things and self._phrases.read(things[-1]).where:
            return self._tell_is_at()
        self._refuse_time()
        answered = self._tell_where()
        if answered.status != "ok" or (answered.probability or 0.0) < LIKELY:
            return answered
        places = [place.place for found in answered.where for place in found.places[:1]]
        names = [name for thing in things for name in self._resolve(thing).matches]
        is_gone = bool(places) and self._was_missed(names, places)
        begin = self._say("not in look" if is_gone else "yes alone")
        return replace(answered, said=f"{begin} {answered.said}")

    def _is_inside(self, thing: str, said: str, places: Sequence[int]) -> bool:
        """Tell whether a thing is in what it is asked to be on, as far as is known."""
        if self._phrases.find_relation(said) != "onTop" or self._asking.is_translated:
            return False
        ranked = self._calls.finder.rank(self._memory, thing)
        return all(place.relation == "in" for place in ranked if place.furniture in places)

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
        found = self._calls.where_is(thing, speaker=self._speaker)
        if found.asked_for != "thing":
            return None
        resolution = self._resolve(thing)
        few = 1 < len(resolution.matches) <= MOST_CANDIDATES
        rooms = [
            self._find_room(name, exactly=few) for name in (resolution.matches if few else (thing,))
        ]
        names = resolution.matches if few else (self._name(found.thing, found.taken_for),)
        said = [
            self._say("in room", name, where=self._asking.say_the(room), percent=_percent(chance))
            for name, (room, chance) in zip(names, rooms, strict=True)
        ]
        return " ".join(said), drop_also(found), rooms[0][1]

    def _find_room(self, thing: str, *, exactly: bool) -> tuple[str, float]:
        """Return the likeliest room of a thing, or of what is called just so; and how likely."""
        layout, chances = self._memory.layout, dict[str, float]()
        for place in self._calls.finder.rank(self._memory, thing, exactly=exactly):
            room = str(layout.rooms[layout.furniture[place.furniture].room])
            chances[room] = chances.get(room, 0.0) + place.probability
        room, chance = max(chances.items(), key=lambda pair: pair[1])
        return room, min(chance, 1.0)


def _percent(probability: float) -> str:
    return f"{probability:.0%}"
