"""Reads clauses: the things, places and times that they name, and which words are left."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache

from sgm.names.clause import Clause, Known
from sgm.names.clause_split import ClauseSplitter
from sgm.names.clause_words import make_clause_words
from sgm.names.known_words import is_word
from sgm.names.name_spans import NameSpans
from sgm.names.sections import ENGLISH
from sgm.names.sentence import make_sentence_reader
from sgm.names.time_words import TimeReader, TimeSaid
from sgm.names.words import POSSESSIVE

_LEAST_VERB = 4  # letters


@dataclass
class _Parts:
    """What was read of a clause so far."""

    words: Sequence[str]
    known: Known
    person: str
    things: list[str] = field(default_factory=list)
    excluded: list[str] = field(default_factory=list)
    places: list[str] = field(default_factory=list)
    named: list[str] = field(default_factory=list)
    said: list[str] = field(default_factory=list)
    left: list[str] = field(default_factory=list)
    verbs: list[str] = field(default_factory=list)
    is_broken: bool = False
    is_negated: bool = False
    after_thing: bool = False  # whether the last words were a thing
    end_of_last: int = 0  # the place after the last thing


class ClauseReader:
    """Reads the clauses of a sentence by tables of words of a language.

    Each word is of a thing, of a place, of a time, or of a table of words that say nothing of which
    thing is meant (`free words`, and `free around` of those that do beside a name); else it is
    `left`.
    """

    def __init__(self, code: str) -> None:
        """Read by the tables of the language of a code."""
        sentences, self._words = make_sentence_reader(code), make_clause_words(code)
        language = sentences.language
        listed = language.list_words
        self._splitter = ClauseSplitter(sentences, self._words)
        self._spans, self._times = NameSpans(language, self._words), TimeReader(language)
        self._after = listed("after a thing")
        self._nouns, self._definite = listed("free nouns"), listed("before a noun")
        self._speakers = listed("speaker's") | listed("our")
        self._theirs = listed("nobody's")
        self._same, self._belongings = listed("same"), listed("belongings")
        self._but = {phrase for phrase in language.list_phrases("but") if " " not in phrase}
        self._other_verbs = listed("other verbs")
        self._endings = (*language.list_phrases("verb endings"), *listed("adverb endings"))
        self._noun_signs = self._words.of | self._words.links | listed("and") | self._words.where
        self._quantities = listed("quantities")
        self._auxiliaries = listed("verbs before not")
        self._narrowing = listed("not").union(
            *map(listed, ("but", "one", "other", "narrowing", "where words", "and"))
        )
        self._things_said = self._words.pronouns - self._words.subjects - listed("that is")
        self._relatives = re.compile(rf"^(?:{language.compile_section('clauses')})$")
        self._parted = self._words.and_ | self._words.where

    def read(self, text: str, known: Known) -> list[Clause]:
        """Read the clauses of a sentence; none where the language has no tables for it."""
        if not self._words.is_told:
            return []
        clauses = self._splitter.split(text, known)
        named = known.owners.intersection(word for words, _ in clauses for word in words)
        person = next(iter(named)) if len(named) == 1 else ""
        return [self._read(words, known, person, is_aside) for words, is_aside in clauses]

    def _read(self, words: Sequence[str], known: Known, person: str, is_aside: bool) -> Clause:
        text = " ".join(words)
        words, time, clashing = self._take_times(words, known)
        parts = _Parts(words=words, known=known, person=person, left=list(clashing))
        place = 0
        while place < len(words):
            place = self._read_at(place, parts)
        owners = (word for word in parts.left if word.removesuffix(POSSESSIVE) in known.owners)
        return Clause(
            text=text,
            words=tuple(parts.said),
            things=tuple(parts.things),
            places=tuple(parts.places),
            named=tuple(parts.named),
            left=tuple(parts.left),
            is_broken=parts.is_broken,
            owners=tuple(owners),
            is_aside=is_aside,
            time=time,
            is_negated=parts.is_negated,
            excluded=tuple(parts.excluded),
            verbs=tuple(parts.verbs),
        )

    def _take_times(
        self, words: Sequence[str], known: Known
    ) -> tuple[list[str], TimeSaid | None, tuple[str, ...]]:
        """Take the time out of words; also the words of times that are not one."""
        kept, times = self._times.find(words, known.words)
        time = times[0] if times else None
        for other in times[1:]:
            joined = time.join(other) if time is not None else None
            if joined is None:
                return kept, time, (other.words,)
            time = joined
        return kept, time, ()

    def _read_at(self, place: int, parts: _Parts) -> int:
        """Read what begins at a word; return where the next one begins."""
        words, known = parts.words, parts.known
        length = self._spans.count_place(words, place, known)
        if length:
            parts.places.append(" ".join(words[place : place + length]))
            parts.after_thing = False
            return place + length
        owned = self._find_belongings(words[place : place + 2], known)
        if owned:
            parts.things.append(owned)
            parts.after_thing, parts.end_of_last = True, place + 2
            return place + 2
        length = self._spans.count_thing(words, place, known)
        if length:
            return self._read_thing(place, length, parts)
        length = self._spans.count_name(words, place, known.find_place, known)
        if length and self._same.isdisjoint(words[:place][-1:]):
            parts.named.append(" ".join(words[place : place + length]))
            parts.is_broken = parts.is_broken or parts.after_thing
            parts.after_thing = False
            return place + length
        if not length:  # else "the same drawer"
            self._read_word(place, parts)
        return place + 1

    def _read_thing(self, place: int, length: int, parts: _Parts) -> int:
        """Read the name of a thing; return where the next word begins."""
        words, known = parts.words, parts.known
        before = words[place - 1] if place else ""
        is_qualified = before in (*parts.left[-1:], *parts.verbs[-1:])
        is_owned = words[place].endswith(POSSESSIVE)
        between = words[parts.end_of_last : place] if parts.things else ()
        parts.is_broken = (
            parts.is_broken
            or parts.after_thing
            or is_qualified  # "the striped cushion"
            or (before in self._words.around and not is_owned)
            or self._is_place_of(words[:place])
            or self._is_joined(words[:place], parts.end_of_last)
            or (bool(parts.things) and not self._parted.intersection(between))
        )
        parts.said = parts.said[:-1] if is_qualified and before in parts.left else parts.said
        name = self._add_owner(" ".join(words[place : place + length]), before, parts)
        name = f"{self._find_quantity(words[:place])}{name}"
        end = place + length
        parts.after_thing, parts.end_of_last = True, end
        if self._tells_of(words[end:], known) and len(known.find_thing(name)) == 1:
            end = len(words)  # "the book anna is reading"
        relative = " ".join(words[end:])
        is_said = end < len(words) and words[end] in self._things_said  # "it was there"
        is_relative = not is_said and self._relatives.match(f" {relative}") is not None
        if is_relative and not self._asks_after(words[end:]):
            name, end = f"{name} {relative}", len(words)  # "the camera that i bought"
        (parts.excluded if self._is_excluded(words[:place]) else parts.things).append(name)
        return end

    def _add_owner(self, name: str, before: str, parts: _Parts) -> str:
        """Say whose a thing is: "my phone", or "anna's phone" of "her phone"."""
        if before in self._speakers:
            return f"{before} {name}"
        if before not in self._theirs:
            return name
        owned = f"{parts.person}{POSSESSIVE} {name}"
        return owned if parts.person and parts.known.find_thing(owned) else f"{before} {name}"

    def _read_word(self, place: int, parts: _Parts) -> None:
        """Read a word that names nothing."""
        words, word, known = parts.words, parts.words[place], parts.known
        if parts.after_thing and word not in self._after and word not in self._words.and_:
            parts.is_broken = parts.is_broken or not self._may_follow(words[place:])
        if place and word in self._words.negations and words[place - 1] in self._auxiliaries:
            parts.is_negated = True
            parts.said.append(word)
            return
        parts.after_thing = False
        if self._is_verb(words[: place + 1], known):
            parts.verbs.append(word)
            return
        is_free = word in self._words.known or word in self._words.and_
        is_subject = (word in known.owners or word in self._words.people) and not parts.things
        is_but = word in self._but and self._is_excluding(words[place:], known)
        after = place + 1 < len(words) and self._spans.count_thing(words, place + 1, known)
        is_article = self._lacks_noun(words[place : place + 2]) and not after
        if not (is_free or is_subject or is_but) or is_article:
            parts.left.append(word)
        parts.said.append(word)

    def _find_belongings(self, words: Sequence[str], known: Known) -> str:
        """Return "anna's things", where something is known to be hers; empty for other words."""
        if len(words) < 2 or words[1] not in self._belongings:
            return ""
        return " ".join(words) if words[0].removesuffix(POSSESSIVE) in known.owners else ""

    def _is_verb(self, words: Sequence[str], known: Known) -> bool:
        """Tell whether the last word is a verb that names nothing: "what is cluttering the desk".

        It ends as one, or stands after who does it; none is one of `other verbs`, "bought", which
        ask something else, and none that an article stands before.
        """
        word, before = words[-1], words[-2] if len(words) > 1 else ""
        if word in self._words.known or word in self._other_verbs or is_word(word) or not before:
            return False
        if not word.isalpha() or len(word) < _LEAST_VERB or before in self._noun_signs:
            return False
        is_done = before in self._words.subjects | self._words.people | known.owners
        return word.endswith(self._endings) or is_done

    def _is_excluding(self, words: Sequence[str], known: Known) -> bool:
        """Tell whether words begin with "except the lamp"."""
        place = next((n for n in range(1, len(words)) if words[n] not in self._words.of), 0)
        return bool(place and self._spans.count_thing(words, place, known))

    def _is_excluded(self, words: Sequence[str]) -> bool:
        """Tell whether "except" stands before a thing."""
        before = [word for word in words if word not in self._words.of]
        return bool(before) and before[-1] in self._but

    def _find_quantity(self, words: Sequence[str]) -> str:
        """Return "both" that stands before a name, "both of the mugs"; empty without one."""
        before = [word for word in words if word not in self._definite | self._words.of]
        return f"{before[-1]} " if before and before[-1] in self._quantities else ""

    def _tells_of(self, words: Sequence[str], known: Known) -> bool:
        """Tell whether "anna is reading" follows a thing, and says nothing of another one."""
        if len(words) < 2 or words[0] not in known.owners | self._words.people:
            return False
        return words[1] in self._words.finite and self._narrowing.isdisjoint(words)

    def _asks_after(self, words: Sequence[str]) -> bool:
        """Tell whether words after a thing are a frame, "i am looking for", or may narrow it."""
        return self._words.free.issuperset(words) or not self._narrowing.isdisjoint(words)

    def _is_place_of(self, words: Sequence[str]) -> bool:
        """Tell whether words end in "in the", so that what follows is no thing but a place."""
        before = [word for word in words if word not in self._words.articles]
        return bool(before) and before[-1] in self._words.links

    def _is_joined(self, words: Sequence[str], end_of_last: int) -> bool:
        """Tell whether "saw and" stands before a thing, and what comes before "and" is none."""
        end = len(words)
        while end and words[end - 1] in self._words.articles | self._speakers | self._theirs:
            end -= 1
        is_and = end > 1 and words[end - 1] in self._words.and_ | self._words.or_
        if not is_and or end_of_last == end - 1:
            return False
        before = words[end - 2]  # of "it is raining and the mug", no noun
        return before not in self._words.known or is_word(before)

    def _lacks_noun(self, words: Sequence[str]) -> bool:
        """Tell whether an article stands before a word that names nothing here: "the saw"."""
        if words[0] not in self._definite or len(words) < 2:
            return False
        if words[1] not in self._words.free and words[1] not in self._words.around:
            return False
        return words[1] not in self._nouns | self._words.articles | self._words.people

    def _may_follow(self, words: Sequence[str]) -> bool:
        """Tell whether words may follow a thing: "i need those", "resting"; no "charging cable"."""
        if words[0] in self._words.subjects:
            return self._is_wanted(words)
        if words[0] in self._words.links and not self._same.isdisjoint(words[1:3]):
            return True  # "in the same room"
        return words[0] in self._words.known and not is_word(words[0])

    def _is_wanted(self, words: Sequence[str]) -> bool:
        """Tell whether words say that a person wants what was named: "i need those"."""
        after = [word for word in words[1:] if word not in self._words.openers]  # "i am after"
        is_wanted = bool(after) and after[0] in self._words.wanting
        return is_wanted and all(word in self._words.pronouns for word in after[1:])


@lru_cache(maxsize=8)
def make_clause_reader(code: str = ENGLISH) -> ClauseReader:
    """Return the reader of a language."""
    return ClauseReader(code)
