"""A sentence that no pattern fits, read by its words: things, places, and words of tables."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from sgm.names.context import ContextReader, make_context_reader
from sgm.names.known_words import is_word
from sgm.names.modifiers import COLOURS, FAULTS, is_property, spell
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence, make_sentence_reader, pad_words
from sgm.names.spelling import is_typo
from sgm.names.words import POSSESSIVE

Find = Callable[[str], tuple[str, ...]]
_BREAKS = re.compile(r"[?!\u2026]+|\.{2,}|\.(?=\s)")
_LONGEST_NAME = 5  # words
_LEAST_MENDED = 4  # letters of a word that a slip is mended to
_SHORTEST_CLAUSE = 3  # words of one that says more after the question


class _Clause(NamedTuple):
    """A part of a sentence between commas or joins.

    Attributes:
        text: as it stands.
        words: without names of things and places, and what stands before a thing.
        things: what is asked for, each in words of its own.
        places: with their prepositions, "in the sink".
        named: names of places without a preposition.
        left: words that no table has.
        is_broken: whether a word beside a thing may make it another one: "laptop stand".
        owners: words that say whose something is, "leo's", without it.
    """

    text: str
    words: tuple[str, ...]
    things: tuple[str, ...]
    places: tuple[str, ...]
    named: tuple[str, ...]
    left: tuple[str, ...]
    is_broken: bool
    owners: tuple[str, ...]


class FreeReader:
    """Reads sentences that no pattern of questions fits, by tables of words of a language.

    A sentence is parted into clauses. In those that name a thing or ask, each word is of a thing,
    of a place, or of a table of words that say nothing of which thing is meant (`free words`): else
    the sentence is not read. Another clause, "the taxi is here", is left out, unless it may say
    which thing is meant: by "not", a colour, "one", "other", or a question of its own.
    """

    def __init__(self, contexts: ContextReader, code: str) -> None:
        """Read by the tables of the language of a code."""
        self._sentences = make_sentence_reader(code)
        self._contexts = contexts
        language = self._sentences.language
        listed = language.list_words
        self._free = listed("free words") | listed("articles") | listed("fillers")
        self._phrases = [
            (re.compile(rf"{language.compile(pattern)}(?= |$)"), word and f" {word}")
            for pattern, word in language.read_pairs("free phrases").items()
        ]
        self._after = listed("after a thing")
        self._starters = listed("clause starters")
        self._joins = listed("free joins")
        self._nouns, self._definite = listed("free nouns"), listed("before a noun")
        self._who = listed("who words")
        self._aims, self._aimed = listed("aims"), listed("aimed")
        self._conjunctions = listed("conjunctions")
        self._and = listed("and") - {","}
        self._or, self._any = listed("or"), listed("no more than all")
        self._endings = (POSSESSIVE, *language.list_phrases("verb endings"))
        self._links = listed("free links")
        self._articles = listed("articles")
        self._speakers = listed("speaker's") | listed("our")
        self._theirs = listed("nobody's")
        self._people = listed("people")
        self._subjects = listed("asking people")
        self._wanting, self._where = listed("wanting"), listed("where words")
        self._which, self._rooms = listed("which words"), listed("room words")
        self._all = listed("all that is there")
        self._openers = listed("yes or no")
        self._tags = listed("tags")
        self._if = listed("if")
        self._whose = listed("whose words")
        self._telling = listed("telling")
        self._pronouns = listed("pronouns")
        self._finite = listed("finite")
        self._questions = self._who | listed("question words") | self._where
        self._free |= self._where | self._which | self._rooms | self._all | self._openers
        self._free |= (
            self._tags
            | self._whose
            | self._nouns
            | self._who
            | self._telling
            | self._wanting
            | self._if
        )
        self._plain = self._free - self._articles - self._links - listed("of") - listed("linking")
        self._parted = self._and | self._where
        self._narrowing = listed("one") | listed("other") | listed("narrowing")
        self._in = language.list_phrases("at")[0]
        self._mended = sorted(word for word in self._free if len(word) >= _LEAST_MENDED)
        self._is_told = bool(listed("free words"))

    def read(
        self, text: str, find_thing: Find, find_place: Find, owners: frozenset[str]
    ) -> Sentence | None:
        """Read a sentence; None where a word may say more than was understood.

        Args:
            text: "taxi is here, passports?".
            find_thing: returns the things that a name surely means.
            find_place: returns names of the places that a name means.
            owners: people who own things.
        """
        clauses = self._read_clauses(text, find_thing, find_place, owners)
        asked = self._choose(clauses)
        if not asked:
            return None
        is_question = text.rstrip().endswith("?")
        return self._make(asked, is_question, find_thing, owners | self._people)

    def find_only(
        self, text: str, find_thing: Find, find_place: Find, owners: frozenset[str]
    ) -> Iterator[str]:
        """Find the one clause that may be a question of its own, each that may be, in words.

        "Who moved the scooter? I almost fell over it": all others are left out. Arguments
        are those of `read`.
        """
        clauses = self._read_clauses(text, find_thing, find_place, owners)
        for number, clause in enumerate(clauses):
            others = [
                self._is_left_out(other, place > number)
                and not (other.things or other.places or other.named)
                for place, other in enumerate(clauses)
                if place != number
            ]
            if all(others):
                yield clause.text

    def _read_clauses(
        self, text: str, find_thing: Find, find_place: Find, owners: frozenset[str]
    ) -> list[_Clause]:
        if not self._is_told:
            return []
        words = self._sentences.split_words(_BREAKS.sub(" , ", text))
        padded = pad_words([self._mend(word, find_thing) for word in words])
        for pattern, instead in self._phrases:
            padded = pattern.sub(instead, padded)
        named = owners.intersection(padded.split())
        person = next(iter(named)) if len(named) == 1 else ""
        return [
            self._read_clause(clause, find_thing, find_place, owners, person)
            for clause in self._split(padded.split())
        ]

    def _mend(self, word: str, find_thing: Find) -> str:
        """Mend a slip in a word that says nothing: "plese"."""
        if word in self._free or len(word) < _LEAST_MENDED - 1 or is_word(word):
            return word
        if find_thing(word):
            return word
        near = [meant for meant in self._mended if is_typo(word, meant)]
        return near[0] if near else word

    def _split(self, words: Sequence[str]) -> list[list[str]]:
        """Split words into clauses at commas, joins, and an "and" before a new subject."""
        clauses: list[list[str]] = [[]]
        for place, word in enumerate(words):
            after = words[place + 1] if place + 1 < len(words) else ""
            is_and = word in self._and and (after in self._starters or not after)
            if word == "," or word in self._joins or is_and:
                clauses.append([])
            elif word in self._conjunctions and not clauses[-1]:
                continue  # "before we go"
            else:
                clauses[-1].append(word)
        return [clause for clause in clauses if clause]

    def _read_clause(
        self,
        words: Sequence[str],
        find_thing: Find,
        find_place: Find,
        owners: frozenset[str],
        person: str,
    ) -> _Clause:
        things: list[str] = []
        places: list[str] = []
        named: list[str] = []
        said: list[str] = []
        left: list[str] = []
        is_broken, place, after_thing, end_of_last = False, 0, False, 0
        while place < len(words):
            word = words[place]
            length = self._match_place(words, place, find_place)
            if length:
                places.append(" ".join(words[place : place + length]))
                place, after_thing = place + length, False
                continue
            length = self._match_name(words, place, find_thing)
            if length:
                is_qualified = bool(left) and place > 0 and words[place - 1] == left[-1]
                is_broken = is_broken or after_thing or is_qualified  # "the striped cushion"
                is_broken = is_broken or self._is_place_of(words[:place])
                is_broken = is_broken or self._is_joined(words[:place], end_of_last)
                between = words[end_of_last:place] if things else ()
                is_broken = is_broken or (bool(things) and not self._parted.intersection(between))
                said = said[:-1] if is_qualified else said
                name = " ".join(words[place : place + length])
                before = words[place - 1] if place else ""
                if before in self._speakers:
                    name = f"{before} {name}"
                elif before in self._theirs:
                    name = f"{person}{POSSESSIVE} {name}" if person else f"{before} {name}"
                things.append(name)
                place, after_thing = place + length, True
                end_of_last = place
                continue
            length = self._match_name(words, place, find_place)
            if length:
                named.append(" ".join(words[place : place + length]))
                is_broken = is_broken or after_thing
                place, after_thing = place + length, False
                continue
            if after_thing and word not in self._after and word not in self._and:
                is_broken = is_broken or not self._is_wanted_after(words[place:])
            is_subject = (word in owners or word in self._people) and not things
            is_free = word in self._free or is_subject or word in self._and
            if not is_free or self._lacks_noun(words[place : place + 2]):
                left.append(word)
            said.append(word)
            place, after_thing = place + 1, False
        return _Clause(
            text=" ".join(words),
            words=tuple(said),
            things=tuple(things),
            places=tuple(places),
            named=tuple(named),
            left=tuple(left),
            is_broken=is_broken,
            owners=tuple(word for word in left if word.removesuffix(POSSESSIVE) in owners),
        )

    def _match_name(self, words: Sequence[str], place: int, find: Find) -> int:
        """Return how many words from a place on are a name, the most that each say something."""
        if words[place] in self._free or words[place] in self._and or words[place] == ",":
            return 0
        for end in range(min(place + _LONGEST_NAME, len(words)), place, -1):
            name = " ".join(words[place:end])
            found = find(name)
            if not found or (words[end - 1] in self._free and not _is_written(name, found)):
                continue
            inner = words[place:end]
            if self._plain.intersection(inner) and not _is_written(name, found):
                continue  # "he wants a game"
            shorter = range(1, len(inner))
            if any(_is_same(inner[n:], inner[:n], found, find) for n in shorter):
                return 0  # "surely the dog"
            if any(_is_same(inner[:n], inner[n:], found, find) for n in shorter):
                continue  # "paracetamol plus"
            return end - place
        return 0

    def _match_place(self, words: Sequence[str], place: int, find_place: Find) -> int:
        """Return how many words from a place on say where: "in the sink"."""
        if words[place] not in self._links:
            return 0
        start = place + 1
        while start < len(words) and words[start] in self._articles:
            start += 1
        if start >= len(words):
            return 0
        length = self._match_name(words, start, find_place)
        return start + length - place if length else 0

    def _is_place_of(self, words: Sequence[str]) -> bool:
        """Tell whether words end in "in the", so that what follows is no thing but a place."""
        before = [word for word in words if word not in self._articles]
        return bool(before) and before[-1] in self._links

    def _is_joined(self, words: Sequence[str], end_of_last: int) -> bool:
        """Tell whether "saw and" stands before a thing, and what comes before "and" is none."""
        end = len(words)
        while end and words[end - 1] in self._articles | self._speakers | self._theirs:
            end -= 1
        is_and = end > 1 and words[end - 1] in self._and | self._or
        return is_and and end_of_last != end - 1

    def _lacks_noun(self, words: Sequence[str]) -> bool:
        """Tell whether an article stands before a word that names nothing here: "the saw"."""
        if words[0] not in self._definite or len(words) < 2 or words[1] not in self._free:
            return False
        return words[1] not in self._nouns | self._articles

    def _is_wanted_after(self, words: Sequence[str]) -> bool:
        """Tell whether "i need those" follows a thing; no "i need to start the car"."""
        if words[0] not in self._subjects:
            return False
        after = [word for word in words[1:] if word not in self._openers]  # "i am after"
        is_wanted = bool(after) and after[0] in self._wanting
        return is_wanted and all(word in self._pronouns for word in after[1:])

    def _choose(self, clauses: Sequence[_Clause]) -> list[_Clause]:
        """Choose the clauses that ask; none where another one may say which thing is meant."""
        asked = [clause for clause in clauses if self._is_asking(clause)]
        if not asked:
            return []
        is_open = not any(clause.things or clause.places or clause.named for clause in asked)
        for clause in asked:
            if not self._if.isdisjoint(clause.words) and (clause.things or clause.places):
                return []  # "if I had left the laptop on the sofa"
        last = max(number for number, clause in enumerate(clauses) if clause in asked)
        for number, clause in enumerate(clauses):
            if clause in asked:
                continue
            is_named = bool(clause.things or clause.places or clause.named)
            if is_named and is_open and self._may_be_it(clause):
                asked.insert(0, clause._replace(left=()))
                continue
            again = any(set(clause.things) & set(other.things) for other in asked)
            if is_named and (is_open or number > last or again or self._asks(clause)):
                return []
            if clause.places and clause.things:
                return []
            if is_open and not self._if.isdisjoint(clause.words):
                return []
            if not self._is_left_out(clause, number > last):
                return []
        return asked

    def _may_be_it(self, clause: _Clause) -> bool:
        """Tell whether a clause names the one thing that "it" is: "we are lighting the candle"."""
        if len(clause.things) + len(clause.named) != 1 or clause.places or clause.is_broken:
            return False
        if clause.left and not (self._and | self._or).isdisjoint(clause.words):
            return False  # "sourdough and peanut butter": two things, one of them not known
        return self._is_left_out(clause, False)

    def _is_aim(self, clause: _Clause) -> bool:
        """Tell whether a clause asks where to put a thing, and not where it is."""
        words = list(clause.words)
        start = next((n for n, word in enumerate(words) if word in self._where), len(words))
        after = set(words[start:])
        return bool(after & self._aims and after & self._aimed)

    def _asks(self, clause: _Clause) -> bool:
        return not self._questions.isdisjoint(clause.words)

    def _is_asking(self, clause: _Clause) -> bool:
        """Tell whether a clause is read whole, and names something or asks."""
        if clause.left or clause.is_broken:
            return False
        is_named = bool(clause.things or clause.places or clause.named)
        asks = self._where | self._which | self._wanting | self._whose | self._all
        return is_named or not asks.isdisjoint(clause.words)

    def _is_left_out(self, clause: _Clause, is_after: bool) -> bool:
        """Tell whether a clause says nothing of which thing is meant."""
        words = clause.words
        if not clause.left and not clause.is_broken:
            return not self._asks(clause)
        has_verb = not self._finite.isdisjoint(words)
        # "taxi's here", "the battery died"
        has_verb = has_verb or any(word.endswith(self._endings) for word in words)
        if self._asks(clause) or self._contexts.is_denied(words):
            return False
        if not self._narrowing.isdisjoint(words) or (clause.is_broken and not has_verb):
            return False
        if any(spell(word) in COLOURS | FAULTS for word in words):
            return False
        is_short = len(words) < _SHORTEST_CLAUSE
        if is_short and not has_verb and any(is_property(spell(word)) for word in words):
            return False
        if not has_verb and (words[0] in self._articles | self._links):
            return False
        if clause.owners:
            return False
        return has_verb or not (is_after and is_short)

    def _make(
        self,
        asked: Sequence[_Clause],
        is_question: bool,
        find_thing: Find,
        people: frozenset[str],
    ) -> Sentence | None:
        """Make what the clauses ask; None where nothing says what it is."""
        words = [word for clause in asked for word in clause.words]
        said = set(words)
        things = list(dict.fromkeys(thing for clause in asked for thing in clause.things))
        places = [place for clause in asked for place in clause.places]
        named = [name for clause in asked for name in clause.named]
        is_whose = bool(said & self._whose)
        if (said & self._who and not is_whose) or any(map(self._is_aim, asked)):
            return None
        if is_whose:
            matches = [match for thing in things for match in find_thing(thing)]
            if not matches or not all(POSSESSIVE in match for match in matches):
                return None
            said -= self._whose
        if not things:
            where = [*places, *(f"{self._in} {name}" for name in named)]
            is_all = bool(said & self._all) and not said & self._rooms
            is_persons = not said.isdisjoint(people) and not said.isdisjoint(self._telling)
            if len(where) != 1 or not is_all or said & self._where or is_persons:
                return None
            return Sentence(kind="what_at", things=(), where=where[0], text=where[0])
        is_either = len(places) + len(named) > 1 and not self._or.isdisjoint(said)
        if is_either and len(things) == 1:  # "kitchen or balcony: where is it?"
            return Sentence(kind="where", things=tuple(things), text=things[0])
        if named or len(places) > 1 or (places and len(things) > 1):
            return None
        asks_where = bool(said & self._where)
        is_opened = any(clause.words[:1] and clause.words[0] in self._openers for clause in asked)
        is_tagged = is_question or bool(said & self._tags)
        is_bare = all(word in self._articles | self._and | self._pronouns for word in said)
        wants = bool(said & self._wanting)
        is_told = bool(said & self._telling) and not (asks_where or is_opened or is_tagged or wants)
        if is_told or not (asks_where or wants or is_opened or is_tagged or is_bare):
            return None
        if said & self._rooms:
            if places or not said & self._which:
                return None
            return Sentence(kind="room", things=tuple(things), text=" ".join(things))
        if said & (self._which | self._all - self._any):
            return None
        # "The mug on the desk is gone, where is it?" does not say where it is sought.
        is_gone = any(
            clause.places and self._questions.isdisjoint(clause.words) for clause in asked
        ) and any(self._where & set(clause.words) and not clause.things for clause in asked)
        if is_gone:
            return None
        is_one = any(clause.things and clause.places for clause in asked)
        if places and not is_one:  # two questions
            return None
        if places:
            thing = f"{things[0]} {places[0]}"
            is_at = not (asks_where or is_whose) and (is_opened or is_tagged)
            return Sentence(kind="is_at" if is_at else "where", things=(thing,), text=thing)
        return Sentence(kind="where", things=tuple(things), text=" ".join(things))


@lru_cache(maxsize=8)
def make_free_reader(code: str = ENGLISH) -> FreeReader:
    """Return the reader of a language."""
    return FreeReader(make_context_reader(code), code)


def _is_written(name: str, found: Sequence[str]) -> bool:
    """Tell whether a name is the end of one that was found: "watering can"."""
    return any(f" {match}".casefold().endswith(f" {name}") for match in found)


def _is_same(kept: Sequence[str], dropped: Sequence[str], found: Sequence[str], find: Find) -> bool:
    """Tell whether fewer words mean the same, and no name found has one of those dropped."""
    said = {word for match in found for word in match.casefold().split()}
    return said.isdisjoint(dropped) and find(" ".join(kept)) == found
