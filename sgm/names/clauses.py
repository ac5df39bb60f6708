"""Parts of a sentence between commas and joins: the things, places and times that they name."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from sgm.names.known_words import is_word
from sgm.names.sections import ENGLISH
from sgm.names.sentence import make_sentence_reader, pad_words
from sgm.names.spelling import TypoIndex
from sgm.names.time_words import TimeReader, TimeSaid
from sgm.names.words import POSSESSIVE

Find = Callable[[str], tuple[str, ...]]
_BREAKS = re.compile(r"[?!\u2026]+|\.{2,}|\.(?=\s)")
_LONGEST_NAME = 5  # words
_LEAST_MENDED = 4  # letters of a word that a slip is mended to


class Known(NamedTuple):
    """What of a home is called how.

    Attributes:
        find_thing: returns the things that a name surely means.
        find_place: returns names of the places that a name means.
        owners: people who own things.
        words: of all names.
    """

    find_thing: Find
    find_place: Find
    owners: frozenset[str]
    words: frozenset[str] = frozenset()


class Clause(NamedTuple):
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
        is_aside: whether it says what for, why or when: "to open the wine", "before we go".
        time: when, if that is said.
    """

    text: str
    words: tuple[str, ...]
    things: tuple[str, ...]
    places: tuple[str, ...]
    named: tuple[str, ...]
    left: tuple[str, ...]
    is_broken: bool
    owners: tuple[str, ...]
    is_aside: bool = False
    time: TimeSaid | None = None

    @property
    def is_named(self) -> bool:
        """Whether it names a thing or a place."""
        return bool(self.things or self.places or self.named)


class ClauseReader:
    """Reads the clauses of a sentence by tables of words of a language.

    Each word is of a thing, of a place, of a time, or of a table of words that say nothing of which
    thing is meant (`free words`, and `free around` of those that do beside a name); else it is
    `left`.
    """

    def __init__(self, code: str) -> None:
        """Read by the tables of the language of a code."""
        self._sentences = make_sentence_reader(code)
        language = self._sentences.language
        listed = language.list_words
        self._times = TimeReader(language)
        self._articles = listed("articles")
        self.free = listed("free words") | self._articles | listed("fillers")
        self._phrases = [
            (re.compile(rf"{language.compile(pattern)}(?= |$)"), word and f" {word}")
            for pattern, word in language.read_pairs("free phrases").items()
        ]
        self._after = listed("after a thing")
        self._starters = listed("clause starters")
        self._joins = listed("free joins")
        self._nouns, self._definite = listed("free nouns"), listed("before a noun")
        self._conjunctions, self._whens = listed("conjunctions"), listed("time conjunctions")
        self._and, self._or = listed("and") - {","}, listed("or")
        self._links = listed("free links")
        self._speakers = listed("speaker's") | listed("our")
        self._theirs, self._people = listed("nobody's"), listed("people")
        self._subjects = listed("asking people")
        self._wanting, self._openers = listed("wanting"), listed("yes or no")
        self._pronouns, self._purposes = listed("pronouns"), listed("purposes")
        self._finite = listed("finite")
        self._giving = listed("giving")
        self._narrowing = listed("not").union(
            *map(listed, ("but", "one", "other", "narrowing", "where words", "and"))
        )
        self._relatives = re.compile(rf"^(?:{language.compile_section('clauses')})$")
        where = listed("where words")
        self._where = where
        self._questions = where | listed("question words")
        self.free |= where.union(
            *map(
                listed,
                (
                    "which words",
                    "room words",
                    "all that is there",
                    "yes or no",
                    "tags",
                    "whose words",
                    "free nouns",
                    "who words",
                    "telling",
                    "wanting",
                    "if",
                ),
            )
        )
        self.around = listed("free around") - self.free
        self._plain = self.free - self._articles - self._links - listed("of") - listed("linking")
        self._parted = self._and | where
        self._mended = TypoIndex(word for word in self.free if len(word) >= _LEAST_MENDED)
        self.dates = (
            frozenset().union(
                *(
                    language.list_words(section)
                    for section in ("parts of the day", "days", "units")
                ),
                *(language.list_words(section) for section in ("numbers", "times", "minutes")),
            )
            - self.free
        )
        self._is_told = bool(listed("free words"))

    def read(self, text: str, known: Known) -> list[Clause]:
        """Read the clauses of a sentence; none where the language has no tables for it."""
        if not self._is_told:
            return []
        words = self._sentences.split_words(_BREAKS.sub(" , ", text))
        padded = pad_words([self._mend(word, known) for word in words])
        for pattern, instead in self._phrases:
            padded = pattern.sub(instead, padded)
        named = known.owners.intersection(padded.split())
        person = next(iter(named)) if len(named) == 1 else ""
        return [
            self._read_clause(words, known, person, is_aside)
            for words, is_aside in self._split(padded.split(), known)
        ]

    def _mend(self, word: str, known: Known) -> str:
        """Mend a slip in a word that says nothing: "plese"."""
        if word in self.free or word in self.around or len(word) < _LEAST_MENDED - 1:
            return word
        if (
            word in self._sentences.signals
            or word in self.dates
            or is_word(word)
            or not word.isalpha()
        ):
            return word
        if known.find_thing(word):
            return word
        return next(self._mended.find(word), word)

    def _split(self, words: Sequence[str], known: Known) -> Iterator[tuple[list[str], bool]]:
        """Split words into clauses, and tell which of them are asides.

        They end at commas, joins, an "and" before a new subject, and before what begins an aside.
        """
        clause: list[str] = []
        is_aside = False
        for place, word in enumerate(words):
            after = words[place + 1] if place + 1 < len(words) else ""
            is_and = word in self._and and (after in self._starters or not after)
            is_when = self._begins_when(word, after)
            # "before we go where is it", "match in 5 min where is the shirt"
            is_asked = word in self._questions and is_aside
            is_asked = is_asked or (is_aside and self._begins_wanting(word, after, clause))
            is_asked = is_asked or (word in self._where and self._says_more(clause, known))
            if word == "," or word in self._joins or is_and or is_when or is_asked:
                if clause:
                    yield clause, is_aside
                clause, is_aside = [word] if is_when or is_asked else [], is_when
            elif word in self._conjunctions and not clause:
                continue  # "or is it"
            elif self._begins_purpose(word, after, clause, known):
                if clause:
                    yield clause, is_aside
                clause, is_aside = [word], True
            else:
                clause.append(word)
        if clause:
            yield clause, is_aside

    def _says_more(self, words: Sequence[str], known: Known) -> bool:
        """Tell whether one of some words is of no table, and names nothing by itself."""
        free = self.free | self.around | self._people | known.owners | self._and
        return any(
            word not in free and not (known.find_thing(word) or known.find_place(word))
            for word in words
        )

    def _begins_wanting(self, word: str, after: str, before: Sequence[str]) -> bool:
        """Tell whether "i need" begins here after what for: "to open the wine i need"."""
        is_purpose = bool(before) and before[0] in self._purposes
        return is_purpose and word in self._subjects and after in self._wanting | self._openers

    def _begins_when(self, word: str, after: str) -> bool:
        """Tell whether "before we go", "when i am" begins here."""
        return word in self._whens and (after in self._subjects or after in self._people)

    def _begins_purpose(self, word: str, after: str, before: Sequence[str], known: Known) -> bool:
        """Tell whether "to open the wine", "for opening" begins here; no "to find the wine"."""
        free = self.free if before else self._wanting | self._articles | self._subjects
        is_verb = word in self._purposes and after.isalpha() and after not in free
        is_verb = is_verb and after not in self.around | known.owners | self._people
        is_verb = is_verb and self._giving.isdisjoint(before)
        return is_verb and not (known.find_thing(after) or known.find_place(after))

    def _read_clause(
        self, words: Sequence[str], known: Known, person: str, is_aside: bool
    ) -> Clause:
        text = " ".join(words)
        kept, time = self._times.split(words)
        words = kept or words
        time = time if kept else None
        find_thing, find_place = known.find_thing, known.find_place
        things: list[str] = []
        places: list[str] = []
        named: list[str] = []
        said: list[str] = []
        left: list[str] = []
        is_broken, place, after_thing, end_of_last = False, 0, False, 0
        while place < len(words):
            word = words[place]
            length = self._match_place(words, place, find_place, known.words)
            if length:
                places.append(" ".join(words[place : place + length]))
                place, after_thing = place + length, False
                continue
            length = self._match_name(words, place, find_thing, known.words)
            if length:
                before = words[place - 1] if place else ""
                is_qualified = bool(left) and before == left[-1]
                is_owned = words[place].endswith(POSSESSIVE)
                is_broken = is_broken or after_thing or is_qualified  # "the striped cushion"
                is_broken = is_broken or (before in self.around and not is_owned)
                is_broken = is_broken or self._is_place_of(words[:place])
                is_broken = is_broken or self._is_joined(words[:place], end_of_last)
                between = words[end_of_last:place] if things else ()
                is_broken = is_broken or (bool(things) and not self._parted.intersection(between))
                said = said[:-1] if is_qualified else said
                name = " ".join(words[place : place + length])
                if before in self._speakers:
                    name = f"{before} {name}"
                elif before in self._theirs:
                    owned = f"{person}{POSSESSIVE} {name}"
                    name = owned if person and find_thing(owned) else f"{before} {name}"
                place, after_thing = place + length, True
                end_of_last = place
                if self._tells_of(words[place:], known) and len(find_thing(name)) == 1:
                    place = len(words)  # "the book anna is reading"
                relative = " ".join(words[place:])
                if self._relatives.match(f" {relative}") and not self._asks_after(words[place:]):
                    name, place = f"{name} {relative}", len(words)  # "the camera that i bought"
                things.append(name)
                continue
            length = self._match_name(words, place, find_place, known.words)
            if length:
                named.append(" ".join(words[place : place + length]))
                is_broken = is_broken or after_thing
                place, after_thing = place + length, False
                continue
            if after_thing and word not in self._after and word not in self._and:
                is_broken = is_broken or not self._may_follow(words[place:])
            is_subject = (word in known.owners or word in self._people) and not things
            is_free = word in self.free or word in self.around or is_subject or word in self._and
            if not is_free or self._lacks_noun(words[place : place + 2]):
                left.append(word)
            said.append(word)
            place, after_thing = place + 1, False
        return Clause(
            text=text,
            words=tuple(said),
            things=tuple(things),
            places=tuple(places),
            named=tuple(named),
            left=tuple(left),
            is_broken=is_broken,
            owners=tuple(word for word in left if word.removesuffix(POSSESSIVE) in known.owners),
            is_aside=is_aside,
            time=time,
        )

    def _tells_of(self, words: Sequence[str], known: Known) -> bool:
        """Tell whether "anna is reading" follows a thing, and says nothing of another one."""
        if len(words) < 2 or words[0] not in known.owners | self._people:
            return False
        return words[1] in self._finite and self._narrowing.isdisjoint(words)

    def _asks_after(self, words: Sequence[str]) -> bool:
        """Tell whether words after a thing are a frame, "i am looking for", or may narrow it."""
        return self.free.issuperset(words) or not self._narrowing.isdisjoint(words)

    def _match_written(
        self, words: Sequence[str], place: int, find: Find, known: frozenset[str]
    ) -> int:
        """Return how many words from a place on are a name as it is written."""
        if words[place] not in known:
            return 0
        for end in range(min(place + _LONGEST_NAME, len(words)), place + 1, -1):
            name = " ".join(words[place:end])
            if words[end - 1] in known and _is_written(name, find(name)):
                return end - place
        return 0

    def _match_name(
        self, words: Sequence[str], place: int, find: Find, known: frozenset[str]
    ) -> int:
        """Return how many words from a place on are a name, the most that each say something."""
        if words[place] in self._and or words[place] == ",":
            return 0
        if words[place] in self.free:  # "living room"
            return self._match_written(words, place, find, known)
        for end in range(min(place + _LONGEST_NAME, len(words)), place, -1):
            name = " ".join(words[place:end])
            found = find(name)
            if not found or (words[end - 1] in self.free and not _is_written(name, found)):
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

    def _match_place(
        self, words: Sequence[str], place: int, find_place: Find, known: frozenset[str]
    ) -> int:
        """Return how many words from a place on say where: "in the sink"."""
        if words[place] not in self._links:
            return 0
        start = place + 1
        while start < len(words) and words[start] in self._articles:
            start += 1
        if start >= len(words):
            return 0
        length = self._match_name(words, start, find_place, known)
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
        if words[0] not in self._definite or len(words) < 2:
            return False
        if words[1] not in self.free and words[1] not in self.around:
            return False
        return words[1] not in self._nouns | self._articles

    def _may_follow(self, words: Sequence[str]) -> bool:
        """Tell whether words may follow a thing: "i need those", "resting"; no "charging cable"."""
        if words[0] in self.around:
            return len(words) == 1 or words[1] in self.free or words[1] in self.around
        if words[0] not in self._subjects:
            return False
        after = [word for word in words[1:] if word not in self._openers]  # "i am after"
        is_wanted = bool(after) and after[0] in self._wanting
        return is_wanted and all(word in self._pronouns for word in after[1:])


@lru_cache(maxsize=8)
def make_clause_reader(code: str = ENGLISH) -> ClauseReader:
    """Return the reader of a language."""
    return ClauseReader(code)


def _is_written(name: str, found: Sequence[str]) -> bool:
    """Tell whether a name is the end of one that was found: "watering can"."""
    return any(f" {match}".casefold().endswith(f" {name}") for match in found)


def _is_same(kept: Sequence[str], dropped: Sequence[str], found: Sequence[str], find: Find) -> bool:
    """Tell whether fewer words mean the same, and no name found has one of those dropped."""
    said = {word for match in found for word in match.casefold().split()}
    return said.isdisjoint(dropped) and find(" ".join(kept)) == found
