"""Which clauses of a sentence ask, and which say nothing of what is asked."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

from sgm.names.clause import Clause
from sgm.names.clause_words import ClauseWords
from sgm.names.context import ContextReader
from sgm.names.cues import CueReader
from sgm.names.known_words import is_word
from sgm.names.language import Language
from sgm.names.modifiers import COLOURS, FAULTS, is_property, spell
from sgm.names.words import POSSESSIVE

_ASKING_CUES = ("count", "when", "whose", "together")  # kinds that only a question has words of
_SHORTEST_CLAUSE = 3  # words of one that says more after the question


class ClauseChooser:
    """Chooses the clauses that ask, by tables of words of a language.

    Another clause, "the taxi is here", is left out, unless it may say which thing is meant: by
    "not", a colour, "one", "other", or a question of its own.
    """

    def __init__(
        self, language: Language, words: ClauseWords, cues: CueReader, contexts: ContextReader
    ) -> None:
        """Choose by the words of a language."""
        self._words, self._cues, self._contexts = words, cues, contexts
        listed = language.list_words
        self._naming = listed("naming")
        self._endings = (POSSESSIVE, *language.list_phrases("verb endings"))
        self._past, self._whens = listed("past words"), listed("time conjunctions")
        self._ahead = listed("future words") | listed("usual")
        self._ones = listed("one") | listed("other")
        self._narrowing = self._ones | listed("narrowing")
        self._linking = listed("from") | listed("of") | listed("linking")
        self._plain = words.free | words.around
        self._selves, self._plural = listed("asker's own"), listed("plural pronouns")
        self._if = listed("if")
        self.questions = listed("who words") | listed("question words") | words.where
        self._asks_any = (
            words.where
            | words.wanting
            | cues.questions.union(
                *map(listed, ("which words", "whose words", "all that is there"))
            )
        )

    def choose(self, clauses: Sequence[Clause]) -> list[Clause]:
        """Choose the clauses that ask; none where another one may say which thing is meant."""
        asked = [clause for clause in clauses if self._is_asking(clause)]
        if not asked:
            return []
        is_open = not any(clause.is_named for clause in asked)
        for clause in asked:
            if not self._if.isdisjoint(clause.words) and (clause.things or clause.places):
                return []  # "if I had left the laptop on the sofa"
        last = max(number for number, clause in enumerate(clauses) if clause in asked)
        if self.dates_by_aside(clauses):
            return []
        for number, clause in enumerate(clauses):
            if clause in asked:
                continue
            if clause.is_named and self.is_opened(clause) and not is_open:
                return []  # "did the hat move, the blue hat?"
            if clause.is_aside and not is_open and self.is_left_out(clause, number > last):
                continue  # "to hang the picture"
            is_named = clause.is_named
            asks = not clause.is_aside or any(map(self.asks, asked))
            is_plural = any(not self._plural.isdisjoint(other.words) for other in asked)
            if is_named and is_open and asks and self._may_be_it(clause, is_plural):
                said = tuple(word for word in clause.words if word not in clause.left)
                asked.insert(0, clause._replace(words=said, left=()))
                continue
            if self._tells_again(clause, asked) and self.is_left_out(clause, number > last):
                continue  # "I would die for a beer, where is the beer?"
            again = any(set(clause.things) & set(other.things) for other in asked)
            if is_named and (is_open or number > last or again or self.asks(clause)):
                return []
            if clause.places and clause.things:
                return []
            if is_open and not self._if.isdisjoint(clause.words):
                return []
            if not self.is_left_out(clause, number > last) or self._is_listed(number, clauses):
                return []
        return asked

    def _tells_again(self, clause: Clause, asked: Sequence[Clause]) -> bool:
        """Tell whether a clause with a verb names what is asked for, and nothing else of it."""
        is_more = clause.where or clause.excluded or clause.time or clause.is_negated
        things = {thing for other in asked for thing in other.things}
        is_told = not self._words.finite.isdisjoint(clause.words) and not self.asks(clause)
        return is_told and not is_more and bool(clause.things) and set(clause.things) <= things

    def _is_listed(self, number: int, clauses: Sequence[Clause]) -> bool:
        """Tell whether a clause is a thing that is not known, among others: "soap, zorb, cup?"."""
        clause, bare = clauses[number], self._words.articles | self._words.and_
        beside = clauses[max(number - 1, 0) : number]
        if len(clause.words) == 1:
            beside = (*beside, *clauses[number + 1 : number + 2])
        is_list = any(other.things and bare.issuperset(other.words) for other in beside)
        is_noun = bool(clause.left) and bare.union(clause.left).issuperset(clause.words)
        return is_list and is_noun and any(map(is_word, clause.left))

    def dates_by_aside(self, clauses: Sequence[Clause]) -> bool:
        """Tell whether what was, is asked of a time that no clock says: "before I was born"."""
        if any(not clause.is_aside and clause.time is not None for clause in clauses):
            return False  # "at noon on Sunday, when the kids came, was it there?"
        is_past = any(
            not (clause.is_aside or self._past.isdisjoint(clause.text.split()))
            for clause in clauses
        )
        is_ahead = any(not self._ahead.isdisjoint(clause.words) for clause in clauses)
        if not is_ahead and any(c.is_aside and c.time is not None for c in clauses):
            return True  # "when I sleep at ten, where is it?"
        said = (self._whens, self._words.dates)  # what was read as a time is no word of a clause
        return is_past and any(
            not (said[0].isdisjoint(clause.words) and said[1].isdisjoint(clause.left))
            for clause in clauses
            if self._cues.match(clause) != "when"
        )

    def may_date(self, clause: Clause, clauses: Sequence[Clause]) -> bool:
        """Tell whether another clause may say when one asks: "two hours ago, where was it?"."""
        is_timed = any(other.time is not None for other in clauses if other is not clause)
        said = (*clause.words, *clause.text.split())
        tense = self._past | self._ahead
        is_bare = any(c.time is not None and not c.words for c in clauses if c is not clause)
        return clause.time is None and is_timed and (is_bare or not tense.isdisjoint(said))

    def _may_be_it(self, clause: Clause, is_plural: bool) -> bool:
        """Tell whether a clause names the one thing that "it" is: "we are lighting the candle".

        With `is_plural` "they" are several.
        """
        number = len(clause.things) + len(clause.named)
        if not (number == 1 or (is_plural and clause.things)) or clause.places or clause.is_broken:
            return False
        if clause.is_negated:  # "I do not want the kettle, where is it?"
            return False
        if clause.named and not self._words.finite.isdisjoint(clause.words):
            return True  # "the piano is dusty, what is on it?"
        if clause.left and not (self._words.and_ | self._words.or_).isdisjoint(clause.words):
            return False  # "sourdough and peanut butter": two things, one of them not known
        return self.is_left_out(clause, False)

    def is_opened(self, clause: Clause) -> bool:
        """Tell whether a clause begins as a question: "is the mug"."""
        return bool(clause.words) and clause.words[0] in self._words.openers

    def asks(self, clause: Clause) -> bool:
        """Tell whether a clause has a word that only questions have: "where", "how many"."""
        is_cue = not clause.is_aside and self._cues.match(clause) in _ASKING_CUES
        return is_cue or not self.questions.isdisjoint(clause.words)

    def _is_asking(self, clause: Clause) -> bool:
        """Tell whether a clause is read whole, and names something or asks."""
        if clause.left or clause.is_broken or clause.is_aside:
            return False
        if clause.is_negated and not (clause.things and clause.places):
            return False
        is_asked = clause.is_named or not self._asks_any.isdisjoint(clause.words)
        return is_asked or self._cues.match(clause) == "together"

    def is_left_out(self, clause: Clause, is_after: bool) -> bool:
        """Tell whether a clause says nothing of which thing is meant."""
        words = clause.words
        if any(" " in word for word in clause.left):  # two times, and they are not one
            return False
        if self._words.finite.isdisjoint(words) and self._words.negations & set(words[:-1]):
            return False  # "the van, not the house keys, where?"
        if not clause.left and not clause.is_broken:
            return not (self.asks(clause) or self._says_whose(words))
        has_verb = clause.is_aside or not self._words.finite.isdisjoint(words)
        # "taxi's here", "the battery died"
        has_verb = has_verb or any(word.endswith(self._endings) for word in words)
        if self.asks(clause) or self._contexts.is_denied(words):
            return False
        told = words[2:] if clause.is_aside else words  # "to clean the tank"
        told = told[:-1] if told and told[-1] in self._naming else told  # "my boss called"
        if not self._narrowing.isdisjoint(told) or (clause.is_broken and not has_verb):
            return False
        is_own = len(words) > 1 and words[0] in self._selves and words[1] in self._words.finite
        if not is_own and any(spell(word) in COLOURS | FAULTS for word in words):
            return False
        is_short = len(words) < _SHORTEST_CLAUSE
        if is_short and not has_verb and any(is_property(spell(word)) for word in words):
            return False
        if not has_verb and (words[0] in self._words.articles | self._words.links):
            return False
        if clause.owners:
            return False
        return has_verb or not (is_after and is_short)

    def _says_whose(self, words: Sequence[str]) -> bool:
        """Tell whether words without a verb say which one: "from grandma", "the other one"."""
        if not self._words.finite.isdisjoint(words):
            return False
        bare = [word for word in words if word not in self._words.articles]
        whose = any(
            before in self._linking and (word in self._words.people or word not in self._plain)
            for before, word in pairwise(bare)
        )
        return whose or (not self._ones.isdisjoint(words) and self._words.openers.isdisjoint(words))
