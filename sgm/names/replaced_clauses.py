"""What a sentence takes back, or says again: "the green cup - no, the yellow one"."""

from __future__ import annotations

from collections.abc import Sequence

from sgm.names.clause import Clause, Known
from sgm.names.clause_words import ClauseWords
from sgm.names.language import Language
from sgm.names.modifiers import says_how, spell


class Replacer:
    """Leaves out what was taken back, by tables of words of a language."""

    def __init__(self, language: Language, words: ClauseWords) -> None:
        """Read by the words of a language."""
        self._corrected, self._ones = language.list_words("corrected"), language.list_words("one")
        self._bare = words.articles | self._ones | words.where

    def replace(self, clauses: Sequence[Clause], known: Known) -> list[Clause]:
        """Return the clauses that are meant; see `_correct` and `_refine`."""
        return self._refine(self._correct(clauses), known)

    def _correct(self, clauses: Sequence[Clause]) -> list[Clause]:
        """Leave out what was taken back: "the stapler, no wait, I mean the notebook"."""
        marks = [
            number
            for number, clause in enumerate(clauses)
            if clause.words and not clause.is_named and self._corrected.issuperset(clause.words)
        ]
        last = max(marks, default=0)
        is_instead = any(clause.things for clause in clauses[last:])
        return [
            clause
            for number, clause in enumerate(clauses)
            if number not in marks and not (number < last and is_instead and clause.things)
        ]

    def _refine(self, clauses: Sequence[Clause], known: Known) -> list[Clause]:
        """Write "yellow cup" of "the green cup? No, the yellow one", in place of what was said.

        So of "the apron, red", and of "not the tin mug, the blue one".
        """
        kept: list[Clause] = []
        for clause in clauses:
            named = [number for number, other in enumerate(kept) if other.things]
            said = [word for word in clause.left if word not in self._ones]
            if not (named and said and self._says_how(clause)):
                kept.append(clause)
                continue
            before = kept[named[-1]]
            name = " ".join((*said, before.things[-1].split()[-1]))
            if len(before.things) != 1 or len(known.find_thing(name)) != 1:
                return list(clauses)
            kept[named[-1]] = before._replace(things=(name,))
        return kept

    def _says_how(self, clause: Clause) -> bool:
        """Tell whether a clause says how a thing is, and nothing else: "the yellow one"."""
        is_alone = not (clause.is_named or clause.is_aside)
        is_bare = self._bare.issuperset(set(clause.words) - set(clause.left))
        left = (spell(word) for word in clause.left if word not in self._ones)
        return is_alone and is_bare and all(map(says_how, left))
