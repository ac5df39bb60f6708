"""Questions that two clauses ask together: "it was on the desk, is it still?", "is it Anna's?"."""

from __future__ import annotations

from collections.abc import Sequence

from sgm.names.clause import Clause, Known
from sgm.names.clause_choice import ClauseChooser
from sgm.names.clause_words import ClauseWords
from sgm.names.language import Language
from sgm.names.sentence import Sentence
from sgm.names.words import POSSESSIVE


class PairReader:
    """Reads questions of two clauses, by tables of words of a language."""

    def __init__(self, language: Language, words: ClauseWords, chooser: ClauseChooser) -> None:
        """Read by the words of a language."""
        self._words, self._chooser = words, chooser
        listed = language.list_words
        self._endings = (POSSESSIVE, *language.list_phrases("verb endings"))
        self._there, self._owned = listed("still there"), listed("owned alone")
        self._asking = words.openers | listed("tags") | listed("which words")
        self._elsewhere = words.where | listed("moving")

    def read(self, clauses: Sequence[Clause], known: Known) -> Sentence | None:
        """Read whose a thing is, or whether it still is there; None for anything else."""
        return self._read_owned(clauses, known) or self._read_still(clauses)

    def _read_owned(self, clauses: Sequence[Clause], known: Known) -> Sentence | None:
        """Read "is the black phone Anna's?" and "the towel is his, no?"."""
        owned = [clause for clause in clauses if self._find_owner(clause)]
        named = [clause for clause in clauses if clause.things]
        others = [clause for clause in clauses if clause not in (*owned, *named)]
        if len(owned) != 1 or len(named) != 1 or len(named[0].things) != 1:
            return None
        is_asked = any(not self._asking.isdisjoint(clause.words) for clause in clauses)
        is_else = any(
            clause.where or not self._elsewhere.isdisjoint(clause.words) for clause in clauses
        )
        is_plain = all(
            set(clause.left) <= set(clause.owners) and clause.time is None
            for clause in (*owned, *named)
        )
        is_negated = any(clause.is_negated for clause in (*owned, *named))
        if not is_asked or is_else or not is_plain or is_negated:
            return None
        if not all(self._chooser.is_left_out(clause, False) for clause in others):
            return None
        thing, owner = named[0].things[0], self._find_owner(owned[0])
        people = known.owners.intersection(owned[0].words)  # "Anna says it is hers"
        owner = owner if owner in known.owners else "".join(people) * (len(people) == 1)
        return Sentence(kind="whose", things=(thing,), where=owner, text=thing)

    def _find_owner(self, clause: Clause) -> str:
        """Find whose a clause says that something is, "anna" of "is it anna's"; or "his"."""
        last = clause.text.split()[-1]
        if clause.owners:
            return last.removesuffix(POSSESSIVE) if last in clause.owners else ""
        is_last = len(clause.words) > 1 and clause.words[-1] == last
        return last if is_last and last in self._owned else ""

    def _read_still(self, clauses: Sequence[Clause]) -> Sentence | None:
        """Read "I left the bag on the bench, is it still there?"."""
        asks = self._chooser.asks
        named = [clause for clause in clauses if clause.is_named]
        others = [clause for clause in clauses if not clause.is_named]
        asked = [clause for clause in others if not self._there.isdisjoint(clause.words)]
        if len(named) != 1 or len(asked) != 1 or asks(named[0]):
            return None
        (told,), (ask,) = named, asked
        is_one = len(told.things) == len(told.places) == 1 and not told.is_broken
        is_told = is_one and all(word.endswith(self._endings) for word in told.left)
        is_asked = not (ask.left or self._words.pronouns.isdisjoint(ask.words) or asks(ask))
        remaining = [clause for clause in others if clause is not ask]
        is_all = all(self._chooser.is_left_out(clause, False) for clause in remaining)
        if not (is_told and is_asked and is_all):
            return None
        thing = f"{told.things[0]} {told.places[0]}"
        return Sentence(kind="is_at", things=(thing,), text=thing)
