"""Splits a sentence into clauses: at commas, joins, and before what says what for, when or why."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from sgm.names.clause import Known
from sgm.names.clause_words import ClauseWords
from sgm.names.cues import make_cue_reader
from sgm.names.known_words import is_word
from sgm.names.sentence import SentenceReader, pad_words
from sgm.names.spelling import TypoIndex
from sgm.names.words import POSSESSIVE

_BREAKS = re.compile(r"[?!\u2026()\[\]]+|\.{2,}|\.(?=\s)")
_LEAST_MENDED = 4  # letters of a word that a slip is mended to


class ClauseSplitter:
    """Splits sentences into clauses, by tables of words of a language."""

    def __init__(self, sentences: SentenceReader, words: ClauseWords) -> None:
        """Split by the tables of the language of a reader of sentences."""
        self._sentences, self._words = sentences, words
        language = sentences.language
        listed = language.list_words
        self._phrases = [
            (re.compile(rf"{language.compile(pattern)}(?= |$)"), word and f" {word}")
            for pattern, word in language.read_pairs("free phrases").items()
        ]
        self._asked = words.where | make_cue_reader(language.code).questions
        self._starters, self._joins = listed("clause starters"), listed("free joins")
        self._conjunctions, self._whens = listed("conjunctions"), listed("time conjunctions")
        self._dating = listed("dating conjunctions")
        self._questions = words.where | listed("question words")
        self._purposes, self._giving = listed("purposes"), listed("giving")
        self._mended = TypoIndex(word for word in words.free if len(word) >= _LEAST_MENDED)

    def split(self, text: str, known: Known) -> list[tuple[list[str], bool]]:
        """Split a text into the words of its clauses, and tell which of them are asides.

        What stands around a question, "I can't seem to find", is written as one word.
        """
        words = self._sentences.split_words(_BREAKS.sub(" , ", text))
        words = [  # "the bag's owner"
            word.removesuffix(POSSESSIVE) if after in self._asked else word
            for word, after in zip(words, [*words[1:], ""], strict=True)
        ]
        padded = pad_words([self._mend(word, known) for word in words])
        for pattern, instead in self._phrases:
            padded = pattern.sub(instead, padded)
        return list(self._split(padded.split(), known))

    def _mend(self, word: str, known: Known) -> str:
        """Mend a slip in a word that says nothing: "plese"."""
        said = self._words
        if word in said.free or word in said.around or len(word) < _LEAST_MENDED - 1:
            return word
        is_known = word in self._sentences.signals or word in said.dates or is_word(word)
        if is_known or not word.isalpha() or known.find_thing(word):
            return word
        return next(self._mended.find(word), word)

    def _split(self, words: Sequence[str], known: Known) -> Iterator[tuple[list[str], bool]]:
        """Split words at commas, joins, an "and" before a new subject, and before an aside."""
        clause: list[str] = []
        is_aside = False
        for place, word in enumerate(words):
            after = words[place + 1] if place + 1 < len(words) else ""
            is_and = word in self._words.and_ and (after in self._starters or not after)
            said = self._words
            is_when = word in self._whens and after in said.subjects | said.people
            is_when |= word in self._dating and after in said.pronouns | said.articles
            # "before we go where is it", "match in 5 min where is the shirt"
            is_asked = word in self._questions and is_aside
            is_asked = is_asked or (is_aside and self._begins_wanting(word, after, clause))
            is_asked = is_asked or (word in self._words.where and self._says_more(clause, known))
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
        said = self._words
        free = said.free | said.around | said.people | known.owners | said.and_
        return any(
            word not in free and not (known.find_thing(word) or known.find_place(word))
            for word in words
        )

    def _begins_wanting(self, word: str, after: str, before: Sequence[str]) -> bool:
        """Tell whether "i need" begins here after an aside: "to open the wine i need"."""
        is_purpose = len(before) > 1 and before[0] in self._purposes | self._whens
        wanting = self._words.wanting | self._words.openers
        return is_purpose and word in self._words.subjects and after in wanting

    def _begins_purpose(self, word: str, after: str, before: Sequence[str], known: Known) -> bool:
        """Tell whether "to open the wine", "for opening" begins here; no "to find the wine"."""
        said = self._words
        free = said.free if before else said.wanting | said.articles | said.subjects
        is_verb = word in self._purposes and after.isalpha() and after not in free | said.dates
        is_verb = is_verb and after not in said.around | known.owners | said.people
        is_verb = is_verb and self._giving.isdisjoint(before)
        return is_verb and not (known.find_thing(after) or known.find_place(after))
