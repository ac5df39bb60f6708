"""What a sentence takes back, or says again: "the green cup - no, the yellow one"."""

from __future__ import annotations

from collections.abc import Sequence

from sgm.names.clause import Clause, Known
from sgm.names.clause_words import ClauseWords
from sgm.names.language import Language
from sgm.names.modifiers import says_how, spell
from sgm.names.words import POSSESSIVE


class Replacer:
    """Leaves out what was taken back, by tables of words of a language."""

    def __init__(self, language: Language, words: ClauseWords) -> None:
        """Read by the words of a language."""
        self._corrected, self._ones = language.list_words("corrected"), language.list_words("one")
        self._owned = language.list_words("owned") - self._ones
        self._where = words.where
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

        So of "the apron, red", and of "not the tin mug, the blue one". Of "the mug, the one on the
        desk" the place is that of the mug, and "the mug, which belongs to Anna" is Anna's.
        """
        kept: list[Clause] = []
        for clause in clauses:
            named = [number for number, other in enumerate(kept) if other.things]
            told = self._tell_more(clause, kept[-1:], known)
            if told is not None:
                kept[-1] = told
                continue
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

    def _tell_more(self, clause: Clause, last: Sequence[Clause], known: Known) -> Clause | None:
        """Add to the last clause whose its thing is, or where, "the one on the desk"; else None."""
        if not last or len(last[0].things) != 1 or last[0].places or clause.things:
            return None
        (before,), owners = last, known.owners.intersection(clause.words)
        if clause.left or clause.named or clause.excluded or clause.time is not None:
            return None
        if clause.places and len(clause.places) == 1 and not self._ones.isdisjoint(clause.words):
            is_place = (self._bare - self._where).issuperset(clause.words)
            return before._replace(places=clause.places) if is_place else None
        is_else = self._owned.isdisjoint(clause.words) or len(owners) != 1
        if is_else or not (self._bare | self._owned | owners).issuperset(clause.words):
            return None
        (owner,) = owners
        name = f"{owner}{POSSESSIVE} {before.things[0]}"
        return before._replace(things=(name,)) if len(known.find_thing(name)) == 1 else None

    def _says_how(self, clause: Clause) -> bool:
        """Tell whether a clause says how a thing is, and nothing else: "the yellow one"."""
        is_alone = not (clause.is_named or clause.is_aside)
        is_bare = self._bare.issuperset(set(clause.words) - set(clause.left))
        left = (spell(word) for word in clause.left if word not in self._ones)
        return is_alone and is_bare and all(map(says_how, left))
