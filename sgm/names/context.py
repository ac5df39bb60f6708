"""What is said before a question: it says nothing of what is asked, or which thing "it" is."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import NamedTuple

from sgm.names.modifiers import COLOURS, FAULTS, spell
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence, SentenceReader, make_sentence_reader, pad_words
from sgm.names.time_words import TimeReader

_LONGEST_NAME = 4  # words
_PLACED = frozenset(("where", "past", "room"))  # kinds that "where is it?" may be of


class PartedQuestion(NamedTuple):
    """A question, and what was said before it.

    Attributes:
        question: of the last clause, as a sentence of its own.
        names: words before it that may name things, the longest first from each word on.
        is_open: whether the question says "it" for the thing, or nothing.
        words: all that was said, with a space before each word.
    """

    question: Sentence
    names: tuple[tuple[str, ...], ...]
    is_open: bool
    words: str


class ContextReader:
    """Parts a question from what is said before it, by the tables of a language.

    "I am ill, where is the aspirin?" asks for the aspirin, and "I need the kettle. Where is it?"
    for the kettle. What is said has a verb (`finite`), and the question begins as those of `asked`
    do. It is all read as one sentence where what was said may say which one is meant: by a "not"
    that is not of a verb ("I can not see"), a colour, "one", or the name of the thing.
    """

    def __init__(self, sentences: SentenceReader) -> None:
        """Read by the tables of the language of a reader of sentences."""
        self._sentences = sentences
        language = sentences.language
        self._times = TimeReader(language)
        self._joins = language.list_words("and") | language.list_words("clause joins") | {","}
        self._parts = language.list_words("and") - {","}
        self._finite = language.list_words("finite")
        self._asked = re.compile(rf"^{language.compile_section('asked')}(?= |$)")
        without = {phrase for phrase in language.list_phrases("but") if " " not in phrase}
        self._negations = language.list_words("not") | without - self._joins
        self._denied = language.list_words("denied")
        self._verbs = language.list_words("negated")
        self._pronouns = language.list_words("pronouns")
        self._narrowing = language.list_words("one") | language.list_words("other")
        self._function_words = language.list_words("function words") | self._finite
        self._questions = language.list_words("question words")
        self._where = language.list_words("where words")
        self._relative = re.compile(language.compile_section("that is"))
        links = "|".join(map(language.compile_section, ("at", "near", "from")))
        self._links = re.compile(rf"(?:{links})(?= )")
        self._articles = language.list_words("articles")
        self.read = lru_cache(maxsize=2000)(self._read)

    def _read(self, text: str) -> PartedQuestion | None:
        words = self._sentences.split_words(text)
        if self._finite.isdisjoint(words):
            return None
        for place in range(len(words) - 1, 0, -1):
            if words[place - 1] not in self._joins:
                continue
            asked = self._sentences.strip_chat(pad_words(words[place:]))
            said = words[: place - 1]
            if not self._asked.match(asked) or self._finite.isdisjoint(said):
                continue
            return self._part(said, asked.strip())
        return None

    def _part(self, said: list[str], asked: str) -> PartedQuestion | None:
        """Part a question from what was said; None where that may say which one is meant."""
        question = self._sentences.read(asked)
        if len(asked.split()) == 1:  # "I can not remember where"
            question = Sentence(kind="where", things=())
        thing = [word for word in question.text.split() if word not in self._articles]
        is_open = question.kind in _PLACED and self._pronouns.issuperset(thing)
        if question.kind in ("thing", "command") or not (thing or is_open):
            return None
        if is_open and not self._narrowing.isdisjoint(thing[:-1]):
            return None
        if not is_open and not self._narrowing.isdisjoint((*said, *thing)):
            return None
        if not is_open and thing[-1] in said:
            return None
        words = pad_words(said)
        if not self._questions.isdisjoint(said):
            return None
        if question.time is not None and not self._where.isdisjoint(said):
            return None  # "where is it now, and where was it at noon?"
        times = self._times.find(said)[1] if question.time is None and question.tense else []
        if any(time.day != 0 or time.hours for time in times):
            return None  # "six hours ago, where was it?"
        if self.is_denied(said) or self._relative.search(words):
            return None
        if not is_open and self._tells(said):
            return None
        return PartedQuestion(
            question=question, names=tuple(self._list_names(said)), is_open=is_open, words=words
        )

    def is_all(self, said: PartedQuestion, name: str) -> bool:
        """Tell whether a name is all that was said of a thing: no "mug on the desk"."""
        before, _, after = said.words.partition(f" {name}")
        beside = {*before.split()[-1:], *after.split()[:1]}
        if not self._parts.isdisjoint(beside):  # "the pliers and a zorb"
            return False
        return not (self._links.match(after) or self._tells((before + after).split()))

    def _tells(self, words: Sequence[str]) -> bool:
        """Tell whether words may say which of several things is meant."""
        return any(spell(word) in COLOURS | FAULTS for word in words)

    def is_denied(self, said: Sequence[str]) -> bool:
        """Tell whether a "not" may say which one is meant: "I do not want", "it is not"."""
        for place, word in enumerate(said):
            if word not in self._negations:
                continue
            before, after = said[place - 1 : place], said[place + 1 : place + 2]
            if not self._verbs.issuperset(before) or not before:
                return True
            if not self._denied.isdisjoint(after):
                return True
        return False

    def _list_names(self, said: Sequence[str]) -> Iterator[tuple[str, ...]]:
        for start in range(len(said)):
            names = []
            for end in range(min(start + _LONGEST_NAME, len(said)), start, -1):
                words = said[start:end]
                if self._function_words.isdisjoint((words[0], words[-1])) and "," not in words:
                    names.append(" ".join(words))
            yield tuple(names)


@lru_cache(maxsize=8)
def make_context_reader(code: str = ENGLISH) -> ContextReader:
    """Return the reader of a language, which remembers what it has read."""
    return ContextReader(make_sentence_reader(code))
