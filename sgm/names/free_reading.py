"""A sentence that no pattern fits, read by its words: things, places, and words of tables."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

from sgm.names.asked_kind import KindFinder
from sgm.names.clause import Clause, Known
from sgm.names.clause_choice import ClauseChooser
from sgm.names.clause_words import make_clause_words
from sgm.names.clauses import make_clause_reader
from sgm.names.context import make_context_reader
from sgm.names.cues import make_cue_reader
from sgm.names.language import load_language
from sgm.names.paired_clauses import PairReader
from sgm.names.replaced_clauses import Replacer
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence


class FreeReader:
    """Reads sentences that no pattern of questions fits, by tables of words of a language.

    A sentence is parted into clauses. In those that name a thing or ask, each word is of a thing,
    of a place, or of a table of words that say nothing of which thing is meant (`free words`): else
    the sentence is not read. Other clauses are left out, if they say nothing of that
    (`ClauseChooser`).
    """

    def __init__(self, code: str) -> None:
        """Read by the tables of the language of a code."""
        language, cues = load_language(code), make_cue_reader(code)
        self._clauses, self._words = make_clause_reader(code), make_clause_words(code)
        contexts = make_context_reader(code)
        self._chooser = ClauseChooser(language, self._words, cues, contexts)
        self._replacer = Replacer(language, self._words)
        self._pairs = PairReader(language, self._words, self._chooser)
        self._kinds = KindFinder(language, self._words, cues, self._chooser)
        self._all = language.list_words("all that is there")
        self._asking = (
            self._chooser.questions | self._words.openers | language.list_words("asking verbs")
        )

    def read(self, text: str, known: Known) -> Sentence | None:
        """Read a sentence; None where a word may say more than was understood.

        Args:
            text: "taxi is here, passports?".
            known: what of the home is called how.
        """
        clauses = self._replacer.replace(self._clauses.read(text, known), known)
        paired = self._pairs.read(clauses, known)
        if paired is not None:
            return paired
        asked = self._chooser.choose(clauses)
        if not asked:
            return None
        loose = [clause for clause in clauses if clause not in asked]
        return self._kinds.make(asked, loose, "?" in text, known)

    def find_only(self, text: str, known: Known) -> Iterator[str]:
        """Find the one clause that may be a question of its own, each that may be, in words.

        "Who moved the scooter? I almost fell over it": all others are left out. What begins a
        clause and says nothing, "I wonder if you know when", is, too. Arguments are those of
        `read`.
        """
        clauses = self._clauses.read(text, known)
        if self._chooser.dates_by_aside(clauses):
            return
        for number, clause in enumerate(clauses):
            others = [
                self._chooser.is_left_out(other, place > number)
                and not (other.is_named or self._asks_all(other))
                for place, other in enumerate(clauses)
                if place != number
            ]
            is_dated = self._chooser.may_date(clause, clauses)
            if all(others) and not clause.is_aside and not is_dated:
                yield clause.text
                words = clause.text.split()
                for place in range(1, len(words)):
                    if words[place - 1] not in self._words.free - self._chooser.questions:
                        break
                    if words[place] in self._asking:
                        yield " ".join(words[place:])

    def find_joined(self, text: str, known: Known) -> Iterator[str]:
        """Find a sentence without what is said in the middle: "does the box, of all places, hold".

        Arguments are those of `read`.
        """
        clauses = self._clauses.read(text, known)
        if self._chooser.dates_by_aside(clauses):
            return
        kept = [
            clause
            for number, clause in enumerate(clauses)
            if clause.is_named
            or clause.left
            or clause.verbs
            or clause.time is not None
            or self._asks_all(clause)
            or not self._chooser.is_left_out(clause, number == len(clauses) - 1)
        ]
        if 1 < len(kept) < len(clauses):
            yield " ".join(clause.text for clause in kept)
            yield ", ".join(clause.text for clause in kept)

    def _asks_all(self, clause: Clause) -> bool:
        """Tell whether a clause is a question of its own: "and is anything else there?"."""
        return self._chooser.is_opened(clause) and not self._all.isdisjoint(clause.words)


@lru_cache(maxsize=8)
def make_free_reader(code: str = ENGLISH) -> FreeReader:
    """Return the reader of a language."""
    return FreeReader(code)
