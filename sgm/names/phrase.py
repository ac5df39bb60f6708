"""What is said of one thing: its name, what it is not, whose it is, and where it is."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

from sgm.names.language import load_language
from sgm.names.modifiers import is_property, spell
from sgm.names.name_grammar import is_measure
from sgm.names.sections import ENGLISH
from sgm.names.sentence import SentenceReader, make_sentence_reader
from sgm.names.words import MOST_READ, POSSESSIVE

IsName = Callable[[str], bool]
BEYOND = "beyond"  # how a thing lies, where a memory has no such relation
INSIDE_SECTION = "inside"
# Of sections of a language, which relation of the schema their words say.
RELATION_SECTIONS = {INSIDE_SECTION: "in", "upon": "onTop", "beyond": BEYOND}


class Phrase(NamedTuple):
    """One thing, as it was asked for.

    Attributes:
        name: what it is called, "red mug"; empty if nothing is said but what it is not.
        excluded: what it is not: "blue", or "blue mug".
        where: words of a place: "on the dinner table".
        is_not_there: whether it is elsewhere: "the mug that is not on the table".
        is_speakers: whether it is of who speaks, "my", "our".
        quantity: "both", "every", or how many: "3" of "all three mugs"; else empty.
        clause: what was done with it, "that I used": it tells nothing of one thing from another.
        pronoun: "it" and the like, where that is all that is said.
    """

    name: str
    excluded: tuple[str, ...] = ()
    where: str = ""
    is_not_there: bool = False
    is_speakers: bool = False
    quantity: str = ""
    clause: str = ""
    pronoun: str = ""


class PhraseReader:
    """Reads what is said of one thing by the tables of a language.

    - "not the red mug", "non-red mug", "the mug that is not red", "anything but the red mug";
    - "the mug in the sink", "the mug from the desk", "the mug that is on the desk", "the mug that
      Anna left on the desk";
    - "the phone belonging to Anna", "the phone of Anna", "my phone", "a phone that does not belong
      to Anna";
    - "both mugs", "all mugs"; "the mug that I used"; "it".
    """

    def __init__(self, sentences: SentenceReader) -> None:
        """Read by the tables of the language of a reader of sentences."""
        language = sentences.language
        self._split_words = sentences.split_words
        self._articles = language.list_words("articles")
        self._speakers = language.list_words("speaker's")
        self._ours = self._speakers | language.list_words("our")
        self._pronouns = language.list_words("pronouns")
        self._any, self._one = language.list_words("any"), language.list_words("one")
        self._other = language.list_words("other")
        self._theirs = language.list_words("nobody's")
        self._belongings = language.list_words("belongings")
        self._people = language.list_words("people")
        self._unnamed = self._pronouns | self._ours | self._theirs
        self._function_words = language.list_words("function words")
        sections = ("of", "at", "near", "from", "linking", "free links", "and", "but")
        self._linking = frozenset().union(*map(language.list_words, sections))
        self._with = language.list_words("beside a place")
        self._when = language.list_words("asks a time")
        self._yes = language.list_words("asks yes or no")
        self._signals = sentences.signals | language.list_words("of") | self._one
        compiled = language.compile_section
        self._quantities = [
            (name, re.compile(f"^{compiled(name)}(?= )")) for name in ("both", "every")
        ]
        self._numbers = language.read_pairs("numbers")
        self._negations = language.list_words("not")
        that_is, negation, but = compiled("that is"), compiled("not"), compiled("but")
        articles = compiled("articles")
        x, y = "(?P<x>(?: [^ ]+)+?)", "(?P<y>(?: [^ ]+)+)"
        self._exclusions = [
            re.compile(pattern)
            for pattern in (
                rf"^{x}(?: ,)?(?:{that_is})(?:{negation}){y}$",
                rf"^(?:{negation})(?P<y>(?: [^ ,]+)+) ,(?:{but})?(?P<x>(?: [^ ,]+)+)$",
                rf"^(?P<x>(?:{articles})*)(?:{but})?(?:{negation}){y}$",
                rf"^{x}(?: ,)?(?:{but})(?:{negation}){y}$",
                rf"^{x}(?: ,)?(?:{articles})?(?:{negation}){y}$",
                rf"^{x}(?: ,)?(?:{but}){y}$",
            )
        ]
        self._that_is = re.compile(rf"^{x}(?:{that_is}){y}$")
        self._left_there = re.compile(rf"^{x}(?:{compiled('left there')}){y}$")
        verbs = compiled("verb last")  # "der Becher, der rot ist"
        self._verb_last = re.compile(rf"^(?P<x>.+ ,(?: [^ ]+)+?)(?:{verbs})$")
        self._not_owned = re.compile(rf"^{x}(?:{compiled('not owned')}){y}$")
        self._owned = re.compile(rf"^{x}(?:{compiled('owned')}){y}$")
        self._of = re.compile(rf"^{x}(?:{compiled('of')}){y}$")
        links = "|".join(f"(?P<{link}>{compiled(link)})" for link in ("at", "near", "from"))
        self._places = re.compile(rf"^{x}(?:{links}){y}$")
        self._where = re.compile(rf"^(?:{links}){y}$")
        self._clause = re.compile(rf"(?:{compiled('clauses')})$")
        self._relations = [
            (relation, re.compile(rf"^(?: [^ ]+)??(?:{compiled(section)})(?= )"))
            for section, relation in RELATION_SECTIONS.items()
        ]
        self._inside = next(iter(language.list_phrases(INSIDE_SECTION)), "")
        self._joins = language.list_words("and") | {"/", ","}
        self.read = lru_cache(maxsize=MOST_READ)(self._read)

    def _read(self, text: str) -> Phrase:
        words = self._split_words(text)
        if self._signals.isdisjoint(words):
            return Phrase(name=text)
        padded = "".join(f" {word}" for word in words)
        quantity = ""
        for name, pattern in self._quantities:
            shorter = pattern.sub("", padded)
            if shorter != padded:
                quantity, padded = name, shorter
                break
        number, _, after = padded.strip().partition(" ")
        number = self._numbers.get(number, number)
        if quantity == "every" and number.isdecimal() and after:  # "all three mugs"
            quantity, padded = number, f" {after}"
        phrase = self._read_words(padded)
        return phrase._replace(quantity=quantity) if quantity else phrase

    def _read_words(self, padded: str) -> Phrase:
        padded = self._verb_last.sub(r"\g<x>", padded)
        found = self._not_owned.match(padded)
        if found:
            owner = self._make_owner(found["y"])
            return self._read_words(found["x"])._replace(excluded=(owner,))
        for pattern in self._exclusions:
            found = pattern.match(padded)
            if found and self._other.isdisjoint(found["x"].split()):
                return self._exclude(found["x"], found["y"])
        found = self._owned.match(padded)
        if found:
            padded = f" {self._make_owner(found['y'])}{self._drop_articles(found['x'])}"
        found = self._that_is.match(padded)
        if found:
            place = self._where.match(found["y"])
            if place is None:  # "the mug that is red"
                x = self._drop_articles(found["x"])
                padded = f"{self._drop_articles(found['y'])}{x}"
            else:
                padded = f"{found['x']}{found['y']}"
        found = self._left_there.match(padded)
        if found and self._where.match(found["y"]):
            padded = f"{found['x']}{found['y']}"
        clause = self._clause.search(
            padded, padded.find(" ", 1) if " " in padded[1:] else len(padded)
        )
        told = ""
        if clause is not None:
            told, padded = clause[0].strip(), padded[: clause.start()]
        found = self._places.match(padded)
        where = ""
        if found:
            padded, where = found["x"], padded[found.end("x") :].strip()
        return self._finish(padded, where, told)

    def split_where(self, where: str) -> tuple[str, str]:
        """Split "on the dinner table": how a thing lies there ("at", "near", "from"), and what."""
        found = self._where.match(f" {where}")
        if found is None:
            return "at", where
        link = next(name for name in ("at", "near", "from") if found[name])
        return link, self._drop_articles(found["y"]).strip()

    def find_relation(self, where: str) -> str:
        """Find how a thing lies at a place by words of it: "in" of "inside the fridge".

        Returns:
            The relation; `BEYOND` for what no memory knows, "under the sofa"; else empty.
        """
        for relation, pattern in self._relations:
            if pattern.match(f" {where}"):
                return relation
        return ""

    def say_inside(self, where: str) -> str:
        """Return "in the fridge" of "on the fridge"."""
        words = where.split()
        while len(words) > 1 and words[0] not in self._articles:
            words = words[1:]
        name = words if words[0] in self._articles else self.split_where(where)[1].split()
        return " ".join((self._inside, *name))

    def _finish(self, padded: str, where: str, clause: str) -> Phrase:
        words = padded.split()
        is_speakers = not self._ours.isdisjoint(words[:1])
        bare = self._drop_articles(padded).split()
        pronoun = bare[0] if len(bare) == 1 and bare[0] in self._pronouns | self._ours else ""
        name = "" if pronoun else " ".join(words)
        return Phrase(
            name=name,
            excluded=(),
            where=where,
            is_not_there=False,
            is_speakers=is_speakers,
            quantity="",
            clause=clause,
            pronoun=pronoun,
        )

    def _exclude(self, x: str, y: str) -> Phrase:
        """Read what is one thing, and not another."""
        x = "" if self._articles.issuperset(x.split()) else x  # "the non-red mug"
        phrase = self._read_words(x) if x else Phrase(name="")
        place = self._where.match(y)
        bare = self._drop_articles(y).split()
        if bare[0] in self._one and len(bare) > 1:  # "except the one on the desk"
            said = self._that_is.match(y)
            after_one = said["y"] if said else "".join(f" {word}" for word in bare[1:])
            place, y = (
                (self._where.match(after_one), after_one)
                if self._where.match(after_one)
                else (place, y)
            )
        owned = self._owned.match(y)
        if owned is not None:  # "except the one that belongs to anna"
            y = f" {self._make_owner(owned['y'])}{self._drop_articles(owned['x'])}"
        if place is not None:  # "the mug that is not on the desk"
            name = f"{phrase.name} {phrase.where}".strip()  # two places are no name
            return phrase._replace(name=name, where=y.strip(), is_not_there=True)
        head = phrase.name
        others = tuple(self._list_excluded(y))
        is_any = phrase.pronoun in self._any and not phrase.where
        if not head and (is_any or not x):  # "not the red mug", "non-red mug"
            words = [word for word in others[0].split() if word not in self._one]
            head = " ".join(words[1:]) if len(words) > 1 else ""
        if head:
            phrase = phrase._replace(pronoun="")
        return phrase._replace(name=head, excluded=others)

    def _list_excluded(self, y: str) -> list[str]:
        """List what something is not, "red" of "the red one"."""
        parts: list[list[str]] = [[]]
        for word in y.split():
            if word in self._joins:
                parts.append([])
            elif word not in self._articles and word not in self._one:
                parts[-1].append(word)
        said = [part for part in parts if not self._other.issuperset(part)]
        return [" ".join(part) for part in said] or [y.strip()]

    def _drop_articles(self, padded: str) -> str:
        words = padded.split()
        start = 0
        while start < len(words) - 1 and words[start] in self._articles:
            start += 1
        return "".join(f" {word}" for word in words[start:])

    def _make_owner(self, padded: str) -> str:
        """Return "anna's" of " anna", and "my" of " me"."""
        owner = self._drop_articles(padded).strip().removesuffix(POSSESSIVE)
        return f"{owner}{POSSESSIVE}"

    def turn_owner(self, text: str, is_person: IsName) -> str:
        """Return "anna's phone" of "the phone of anna", the text itself without such an owner."""
        padded = "".join(f" {word}" for word in self._split_words(text))
        found = self._of.match(padded)
        if found is None:
            return text
        owner = self._drop_articles(found["y"]).strip()
        if is_measure(found["x"].split()[-1]):  # "bag of jerky"
            return text
        is_owner = is_person(owner) or not self._people.isdisjoint(owner.split()[-1:])
        if not is_owner:
            return text
        return f"{self._make_owner(found['y'])}{self._drop_articles(found['x'])}".strip()

    def is_speakers(self, name: str) -> bool:
        """Tell whether a name says that it is of who speaks: "my phone"."""
        return not self._ours.isdisjoint(name.split()[:1])

    def name_speaker(self, thing: str, speaker: str) -> str:
        """Return "anna's phone" of "my phone" said by Anna, "not anna's" of "not mine"."""
        words = self._split_words(thing)
        if not speaker or not words:
            return thing
        owner = f"{speaker}{POSSESSIVE}"
        if words[0] in self._speakers:
            words[0] = owner
        if len(words) > 1 and words[-1] in self._speakers - self._articles:  # "that are not mine"
            words[-1] = owner
        return " ".join(words) if owner in words else thing

    def name_person(self, thing: str, person: str) -> str:
        """Return "anna's glasses" of "her glasses", where a sentence names Anna alone."""
        first, _, after = thing.partition(" ")
        return (
            f"{person}{POSSESSIVE} {after}" if person and after and first in self._theirs else thing
        )

    def split_belongings(self, name: str) -> str:
        """Return "anna" of "anna's things", all that is hers; empty for any other name."""
        words = name.split()
        is_all = len(words) == 2 and words[1] in self._belongings
        return words[0].removesuffix(POSSESSIVE) if is_all else ""

    def list_unused(self, name: str) -> tuple[str, ...]:
        """List the words of a name that no name has, "and", "is", "eat" of "eat the yogurt"."""
        words = self._split_words(name)
        inner = next((n for n in range(1, len(words)) if words[n] in self._articles), 0)
        before = words[:inner] if self._articles.isdisjoint(words[:1]) else []
        is_linked = bool(before) and before[-1] in self._linking
        verbs = [] if is_linked else before
        named = words[len(verbs) :]
        return (*verbs, *(word for word in named if word in self._function_words))

    def find_negations(self, where: str) -> tuple[str, ...]:
        """Find the words of a place that say that something is not there."""
        return tuple(word for word in where.split() if word in self._negations)

    def find_links(self, where: str) -> tuple[str, ...]:
        """Find words of a place that add a thing to it: "with" of "on the desk with the pen"."""
        return tuple(word for word in where.split() if word in self._with)

    def asks_no_time(self, text: str) -> bool:
        """Tell whether a sentence has none of the words that ask when."""
        return self._when.isdisjoint(self._split_words(text))

    def asks_yes(self, text: str) -> bool:
        """Tell whether a sentence asks for a yes or a no in words: "mug, desk, yes or no?"."""
        return not self._yes.isdisjoint(self._split_words(text))

    def split_any(self, name: str) -> list[str]:
        """Return what "anything red" says of a thing that it does not name; else nothing."""
        words = self._drop_articles(f" {name}").split()
        said = [word for word in words if word not in self._any]
        return said if 0 < len(said) < len(words) else []

    def find_any(self, name: str) -> tuple[str, ...]:
        """Return "anything" of "anything red", which is no name of one thing; else nothing."""
        words = self._drop_articles(f" {name}").split()
        return tuple(words[:1]) if len(words) > 1 and words[0] in self._any else ()

    def names_nothing(self, text: str) -> bool:
        """Tell whether words only link others: "in"."""
        return (self._linking | self._function_words).issuperset(text.split())

    def is_unnamed(self, text: str) -> bool:
        """Tell whether words name nothing without what was said before: "mine", "that"."""
        return self._unnamed.issuperset(text.split())

    def is_one(self, name: str) -> bool:
        """Tell whether a name says "one" for the thing: "the red one"."""
        words = name.split()
        return len(words) > 1 and words[-1] in self._one and is_property(spell(words[-2]))


@lru_cache(maxsize=8)
def make_phrase_reader(code: str = ENGLISH) -> PhraseReader:
    """Return the reader of a language, which remembers what it has read."""
    load_language(code)
    return PhraseReader(make_sentence_reader(code))


def strip_question(question: str, code: str = ENGLISH) -> str:
    """Return what a question is about: "could you find my keys, please?" is about "my keys"."""
    text = make_sentence_reader(code).read(question).text or question
    return make_phrase_reader(code).read(text).name or text
