"""What clauses ask: where things are, whether they are somewhere, or what is at a place."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from sgm.names.clause import Clause, Known
from sgm.names.clause_choice import ClauseChooser
from sgm.names.clause_times import ClauseDater
from sgm.names.clause_words import ClauseWords
from sgm.names.cues import CueReader
from sgm.names.language import Language
from sgm.names.sentence import Sentence
from sgm.names.words import POSSESSIVE


@dataclass
class _Asked:
    """What the clauses that ask say together.

    Attributes:
        clauses: that ask.
        loose: the other ones.
        known: what of the home is called how.
        said: words of the clauses that ask, without names.
        things: each in words of its own, one for what means the same.
        places: with their prepositions.
        named: places without one.
        excluded: things that are left out.
        when: the fields of a sentence that say when.
        is_question: whether a word or a mark says that it is one.
    """

    clauses: Sequence[Clause]
    loose: Sequence[Clause]
    known: Known
    said: set[str]
    things: list[str]
    places: list[str]
    named: list[str]
    excluded: list[str]
    when: dict[str, Any]
    is_question: bool

    def is_one(self) -> bool:
        """Tell whether one thing is asked for, whatever is said of it."""
        return len(self.things) == 1 and len(self.known.find_thing(self.things[0])) == 1

    def make(self, kind: str, things: Sequence[str] = (), where: str = "") -> Sentence:
        """Make a sentence of things, or of a place."""
        text = where or " ".join(things)
        return Sentence(kind=kind, things=tuple(things), where=where, text=text, **self.when)


class KindFinder:
    """Says what clauses ask, by tables of words of a language."""

    def __init__(
        self, language: Language, words: ClauseWords, cues: CueReader, chooser: ClauseChooser
    ) -> None:
        """Read by the words of a language."""
        self._words, self._cues, self._chooser = words, cues, chooser
        self._dater = ClauseDater(language, words, chooser)
        listed = language.list_words
        self._who, self._whose = listed("who words"), listed("whose words")
        self._aims, self._aimed = listed("aims"), listed("aimed")
        self._moving, self._having = listed("moving"), listed("having")
        self._lacking, self._being = listed("lacking"), listed("being")
        self._ever, self._absent = listed("ever"), listed("not there")
        self._which, self._rooms = listed("which words"), listed("room words")
        self._all, self._any = listed("all that is there"), listed("no more than all")
        self._tags, self._explicit = listed("tags"), listed("asks yes or no")
        self._telling, self._plural = (
            listed("telling"),
            listed("plural pronouns") | listed("quantities"),
        )
        self._future, self._without = listed("future words"), listed("but")
        self._bare = words.articles | words.and_ | words.pronouns
        self._in = language.list_phrases("at")[0]
        self._but = next(iter(language.list_phrases("but")), "")

    def make(
        self, clauses: Sequence[Clause], loose: Sequence[Clause], is_question: bool, known: Known
    ) -> Sentence | None:
        """Make what the clauses ask; None where nothing says what it is.

        Args:
            clauses: that ask.
            loose: the other ones of the sentence.
            is_question: whether it ends with a question mark.
            known: what of the home is called how.
        """
        people = known.owners | self._words.people
        words = {word for clause in clauses for word in clause.words}
        dated = self._dater.date(clauses, loose)
        if dated is None:
            return None
        free = self._list_free(clauses, people)
        if dated.tense == "future":
            if dated.time is None:
                return None
            free |= self._future
        cue = self._cues.find(clauses, free)
        if cue and self._asks_more(cue, clauses, loose):
            return None
        if cue:
            return self._cues.make(cue, clauses, dated._asdict(), people)
        if not words <= free or any(self._is_aim(c) or self._is_compared(c) for c in clauses):
            return None
        tagged = {word for clause in loose for word in clause.words} & self._tags
        asked = _Asked(
            clauses=clauses,
            loose=loose,
            known=known,
            said=words,
            things=_list_things(clauses, known),
            places=[place for clause in clauses for place in clause.places],
            named=[name for clause in clauses for name in clause.named],
            excluded=[thing for clause in clauses for thing in clause.excluded],
            when=dated._asdict(),
            is_question=is_question or bool(tagged | (words & self._tags)),
        )
        return self._make(asked, people)

    def _list_free(self, clauses: Sequence[Clause], people: frozenset[str]) -> frozenset[str]:
        """List the words that clauses may have that say nothing of which thing is meant."""
        free = self._words.free | self._words.around | self._words.and_ | people
        if any(clause.excluded for clause in clauses):
            free |= self._without
        if any(clause.is_negated for clause in clauses):  # and each says where a thing is
            free |= self._words.negations
        return free

    def _asks_more(self, cue: str, asked: Sequence[Clause], loose: Sequence[Clause]) -> bool:
        """Tell whether clauses say or ask more than what a kind answers."""
        if cue == "count":  # "how many are on the desk, if you leave out the pen?"
            return _name_others(loose)
        if cue not in ("which", "whose"):
            return False
        # "Which of them is not there?", "whose is the mug there, and is anything else?"
        is_denied = any(c.is_negated for c in asked) and cue == "which"
        others = [c for c in asked if not c.things]
        is_denied = is_denied or any(self._words.negations & set(c.words) for c in others)
        return is_denied or any(map(self._chooser.is_opened, others))

    def _make(self, asked: _Asked, people: frozenset[str]) -> Sentence | None:
        if asked.excluded and asked.things:
            return None
        is_whose = bool(asked.said & self._whose)
        if asked.said & self._who and not is_whose:
            return None
        if is_whose:
            matches = [match for thing in asked.things for match in asked.known.find_thing(thing)]
            if not matches or not all(POSSESSIVE in match for match in matches):
                return None
            asked.said -= self._whose
        if not asked.things:
            return self._make_all_at(asked)
        places = asked.places + asked.named
        if len(places) > 1 and len(asked.things) == 1 and asked.said & self._words.or_:
            return asked.make("where", asked.things)  # "kitchen or balcony: where is it?"
        is_chosen = len(asked.things) > 1 and len(places) == 1 and asked.said & self._which
        if is_chosen and not asked.said & self._words.where:
            return asked.make("where", asked.things)  # "which is in the sink, the fork or the saw?"
        return self._make_of_things(asked, is_whose, people)

    def _make_all_at(self, asked: _Asked) -> Sentence | None:
        """Make what asks for all that is at a place."""
        where = [*asked.places, *(f"{self._in} {name}" for name in asked.named)]
        is_all = bool(asked.said & self._all) and not asked.said & (self._rooms | self._words.where)
        # "Does Anna have anything there?", "what is missing?", "I have the pen: what is left?"
        is_some = bool(asked.said & (asked.known.owners | self._absent)) or _name_others(
            asked.loose
        )
        if len(where) != 1 or not is_all or is_some or len(asked.excluded) > 1:
            return None
        told = (where[0], *(f"{self._but} {thing}" for thing in asked.excluded))
        return asked.make("what_at", where=" ".join(told))

    def _make_of_things(
        self, asked: _Asked, is_whose: bool, people: frozenset[str]
    ) -> Sentence | None:
        """Make what asks where things are, or whether they are somewhere."""
        said, clauses = asked.said, asked.clauses
        is_yes = any(
            not self._explicit.isdisjoint(clause.words) for clause in (*clauses, *asked.loose)
        )
        if len(asked.named) == 1 and not asked.places and is_yes:  # "eggs, fridge, yes or no"
            asked.places, asked.named = [f"{self._in} {asked.named[0]}"], []
        is_of_all = len(clauses) > 1 and any(
            clause.places and not self._plural.isdisjoint(clause.words) for clause in clauses
        )
        is_parted = asked.places and len(asked.things) > 1 and len(clauses) > 1
        if asked.named or len(asked.places) > 1 or (is_parted and not (is_of_all or is_yes)):
            return None
        asks_where = bool(said & self._words.where)
        wants = bool(said & self._words.wanting)
        is_opened = any(map(self._chooser.is_opened, clauses))
        is_asked = asks_where or wants or is_opened or asked.is_question
        if not is_asked and (said & self._telling or not said <= self._bare):
            return None
        if said & self._rooms:
            is_room = not asked.places and said & self._which
            return asked.make("room", asked.things) if is_room else None
        is_which = any(
            not (clause.is_named or self._which.isdisjoint(clause.words)) for clause in clauses
        )
        which_words = self._which - self._all
        is_parted_which = any(not (c.things or which_words.isdisjoint(c.words)) for c in clauses)
        if is_parted_which and len(asked.things) == len(asked.places) == 1 and not asked.is_one():
            return None if asks_where else self._make_which(asked)  # "of the mugs, which is there?"
        if said & (self._which | self._all - self._any) and not (asked.places and is_which):
            return None
        if self._is_gone(clauses):
            return asked.make("where", asked.things) if asked.is_one() else None
        if asked.places:
            is_joined = is_of_all or is_yes or self._is_added(clauses, is_opened)
            is_joined = is_joined and asked.is_question and not (asks_where or wants)
            if not (is_joined or any(clause.things and clause.places for clause in clauses)):
                return None  # two questions
            if is_which and len(asked.things) == 1 and not asked.is_one() and not asks_where:
                return self._make_which(asked)  # "clothes on the rack: which?"
            if is_which and asked.is_one():  # "which one?"
                return asked.make("where", asked.things)
            is_at = not (asks_where or is_whose) and (is_opened or asked.is_question)
            return self._make_at(asked, is_at)
        is_plain = is_opened and not (asks_where or wants)
        if is_plain and said & self._having and not said & self._lacking:  # "do we have milk?"
            return asked.make("is_there", asked.things)
        if any(clause.verbs for clause in clauses) and not (asks_where and not said & self._aims):
            return None  # "do you like the cat?", "where can I recycle the paper?"
        # "Did Anna take the keys?", "is the dog hungry?"
        is_else = is_plain and said & (self._moving | people | self._words.around)
        return None if is_else else asked.make("where", asked.things)

    def _make_which(self, asked: _Asked) -> Sentence:
        """Make what asks which things of a kind are at the one place that was said."""
        thing = f"{asked.things[0]} {asked.places[0]}"
        return asked.make("which", (thing,))

    def _make_at(self, asked: _Asked, is_at: bool) -> Sentence | None:
        """Make what asks for things with the one place that was said."""
        if not is_at and len(asked.things) > 1:
            return None
        thing = f"{asked.things[-1]} {asked.places[0]}"
        kind = "is_at" if is_at else "where"
        if is_at and asked.when["time"] is None and asked.said & self._ever:
            kind = "when_at"
        sentence = asked.make(kind, (*asked.things[:-1], thing))
        return sentence._replace(text=thing)

    def _is_gone(self, clauses: Sequence[Clause]) -> bool:
        """Tell whether a place is where a thing was: "the mug on the desk is gone, where is it?"""
        is_told = any(
            c.places
            and self._chooser.questions.isdisjoint(c.words)
            and not self._bare.issuperset(c.words)  # "the mug on the desk, where is it?"
            for c in clauses
        )
        return is_told and any(
            not (clause.things or self._words.where.isdisjoint(clause.words)) for clause in clauses
        )

    def _is_added(self, clauses: Sequence[Clause], is_opened: bool) -> bool:
        """Tell whether a clause says the place of a thing: "mug, in the sink?"."""
        if len(clauses) == 2 and clauses[1].places and not clauses[0].places:
            return True
        alone = [
            clause
            for clause in clauses
            if clause.places and not clause.things and self._words.articles.issuperset(clause.words)
        ]
        return len(alone) == 1 and is_opened  # "in the den, do we have a vase?"

    def _is_aim(self, clause: Clause) -> bool:
        """Tell whether a clause asks where to put a thing, and not where it is."""
        words = list(clause.words)
        where = self._words.where
        start = next((n for n, word in enumerate(words) if word in where), len(words))
        after = set(words[start:])
        is_advice = bool(words) and words[0] in self._aims and self._chooser.is_opened(clause)
        is_advice = is_advice and not self._aimed.isdisjoint(words)  # "should I put it there?"
        return bool(is_advice or (after & self._aims and after & self._aimed))

    def _is_compared(self, clause: Clause) -> bool:
        """Tell whether a clause asks if a thing is where it was: "is it where I left it?"."""
        is_opened = bool(clause.words) and clause.words[0] in self._being
        return is_opened and not self._words.where.isdisjoint(clause.words)


def _name_others(loose: Sequence[Clause]) -> bool:
    """Tell whether clauses that do not ask name things: the others may be asked for."""
    return any(clause.things or clause.excluded for clause in loose)


def _list_things(clauses: Sequence[Clause], known: Known) -> list[str]:
    """List the things of clauses, as the first that mean the same are called."""
    named: dict[tuple[str, ...], str] = {}
    for clause in clauses:
        for thing in clause.things:
            named.setdefault(known.find_thing(thing) or (thing,), thing)
    return list(named.values())
