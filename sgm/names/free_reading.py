"""A sentence that no pattern fits, read by its words: things, places, and words of tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

from sgm.names.clauses import Clause, Known, make_clause_reader
from sgm.names.context import ContextReader, make_context_reader
from sgm.names.language import load_language
from sgm.names.modifiers import COLOURS, FAULTS, is_property, spell
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence
from sgm.names.words import POSSESSIVE

_SHORTEST_CLAUSE = 3  # words of one that says more after the question


class FreeReader:
    """Reads sentences that no pattern of questions fits, by tables of words of a language.

    A sentence is parted into clauses. In those that name a thing or ask, each word is of a thing,
    of a place, or of a table of words that say nothing of which thing is meant (`free words`): else
    the sentence is not read. Another clause, "the taxi is here", is left out, unless it may say
    which thing is meant: by "not", a colour, "one", "other", or a question of its own.
    """

    def __init__(self, contexts: ContextReader, code: str) -> None:
        """Read by the tables of the language of a code."""
        self._clauses, self._contexts = make_clause_reader(code), contexts
        language = load_language(code)
        listed = language.list_words
        self._who = listed("who words")
        self._aims, self._aimed = listed("aims"), listed("aimed")
        self._and, self._or = listed("and") - {","}, listed("or")
        self._moving = listed("moving")
        self._there = listed("still there")
        self._naming = listed("naming")
        self._any = listed("no more than all")
        self._endings = (POSSESSIVE, *language.list_phrases("verb endings"))
        self._links = listed("free links")
        self._articles = listed("articles")
        self._people = listed("people")
        self._wanting, self._where = listed("wanting"), listed("where words")
        self._which, self._rooms = listed("which words"), listed("room words")
        self._all = listed("all that is there")
        self._openers = listed("yes or no")
        self._tags = listed("tags")
        self._if = listed("if")
        self._whose = listed("whose words")
        self._telling = listed("telling")
        self._pronouns = listed("pronouns")
        self._finite = listed("finite")
        self._past, self._whens = listed("past words"), listed("time conjunctions")
        self._questions = self._who | listed("question words") | self._where
        self._asking = self._questions | self._openers | listed("asking verbs")
        self._narrowing = listed("one") | listed("other") | listed("narrowing")
        self._in = language.list_phrases("at")[0]

    def read(self, text: str, known: Known) -> Sentence | None:
        """Read a sentence; None where a word may say more than was understood.

        Args:
            text: "taxi is here, passports?".
            known: what of the home is called how.
        """
        clauses = self._clauses.read(text, known)
        still = self._ask_still(clauses)
        if still is not None:
            return still
        asked = self._choose(clauses)
        if not asked:
            return None
        is_question = text.rstrip().endswith("?")
        return self._make(asked, is_question, known)

    def _ask_still(self, clauses: Sequence[Clause]) -> Sentence | None:
        """Read "I left the bag on the bench, is it still there?"; None for anything else."""
        named = [clause for clause in clauses if clause.is_named]
        others = [clause for clause in clauses if not clause.is_named]
        asks = [clause for clause in others if not self._there.isdisjoint(clause.words)]
        if len(named) != 1 or len(asks) != 1 or self._asks(named[0]):
            return None
        (told,), (ask,) = named, asks
        is_one = len(told.things) == len(told.places) == 1 and not told.is_broken
        is_told = is_one and all(word.endswith(self._endings) for word in told.left)
        is_asked = not (ask.left or self._pronouns.isdisjoint(ask.words) or self._asks(ask))
        remaining = [clause for clause in others if clause is not ask]
        if not (is_told and is_asked and all(self._is_left_out(c, False) for c in remaining)):
            return None
        thing = f"{told.things[0]} {told.places[0]}"
        return Sentence(kind="is_at", things=(thing,), text=thing)

    def find_only(self, text: str, known: Known) -> Iterator[str]:
        """Find the one clause that may be a question of its own, each that may be, in words.

        "Who moved the scooter? I almost fell over it": all others are left out. What begins a
        clause and says nothing, "I wonder if you know when", is, too. Arguments are those of
        `read`.
        """
        clauses = self._clauses.read(text, known)
        if self._dates_by_aside(clauses):
            return
        for number, clause in enumerate(clauses):
            others = [
                self._is_left_out(other, place > number) and not other.is_named
                for place, other in enumerate(clauses)
                if place != number
            ]
            if all(others) and not clause.is_aside:
                yield clause.text
                words = clause.text.split()
                for place in range(1, len(words)):
                    if words[place - 1] not in self._clauses.free - self._questions:
                        break
                    if words[place] in self._asking:
                        yield " ".join(words[place:])

    def _choose(self, clauses: Sequence[Clause]) -> list[Clause]:
        """Choose the clauses that ask; none where another one may say which thing is meant."""
        asked = [clause for clause in clauses if self._is_asking(clause)]
        if not asked:
            return []
        is_open = not any(clause.is_named for clause in asked)
        for clause in asked:
            if not self._if.isdisjoint(clause.words) and (clause.things or clause.places):
                return []  # "if I had left the laptop on the sofa"
        last = max(number for number, clause in enumerate(clauses) if clause in asked)
        if self._dates_by_aside(clauses):
            return []
        for number, clause in enumerate(clauses):
            if clause in asked:
                continue
            if clause.is_named and self._is_opened(clause) and not is_open:
                return []  # "did the hat move, the blue hat?"
            if clause.is_aside and not is_open and self._is_left_out(clause, number > last):
                continue  # "to hang the picture"
            is_named = clause.is_named
            asks = not clause.is_aside or any(map(self._asks, asked))
            if is_named and is_open and asks and self._may_be_it(clause):
                asked.insert(0, clause._replace(left=()))
                continue
            again = any(set(clause.things) & set(other.things) for other in asked)
            if is_named and (is_open or number > last or again or self._asks(clause)):
                return []
            if clause.places and clause.things:
                return []
            if is_open and not self._if.isdisjoint(clause.words):
                return []
            if not self._is_left_out(clause, number > last):
                return []
        return asked

    def _dates_by_aside(self, clauses: Sequence[Clause]) -> bool:
        """Tell whether what was, is asked of a time that no clock says: "before I was born"."""
        is_past = any(
            not (clause.is_aside or self._past.isdisjoint(clause.text.split()))
            for clause in clauses
        )
        if any(clause.is_aside and clause.time is not None for clause in clauses):
            return True  # "when I sleep at ten, where is it?"
        said = (self._whens, self._clauses.dates)  # what was read as a time is no word of a clause
        return is_past and any(
            not (said[0].isdisjoint(clause.words) and said[1].isdisjoint(clause.left))
            for clause in clauses
        )

    def _may_be_it(self, clause: Clause) -> bool:
        """Tell whether a clause names the one thing that "it" is: "we are lighting the candle"."""
        if len(clause.things) + len(clause.named) != 1 or clause.places or clause.is_broken:
            return False
        if clause.left and not (self._and | self._or).isdisjoint(clause.words):
            return False  # "sourdough and peanut butter": two things, one of them not known
        return self._is_left_out(clause, False)

    def _is_aim(self, clause: Clause) -> bool:
        """Tell whether a clause asks where to put a thing, and not where it is."""
        words = list(clause.words)
        start = next((n for n, word in enumerate(words) if word in self._where), len(words))
        after = set(words[start:])
        is_advice = words[:1] and words[0] in self._aims and self._is_opened(clause)
        is_advice = is_advice and not self._aimed.isdisjoint(words)  # "should I put it there?"
        return bool(is_advice or (after & self._aims and after & self._aimed))

    def _is_opened(self, clause: Clause) -> bool:
        """Tell whether a clause begins as a question: "is the mug"."""
        return bool(clause.words) and clause.words[0] in self._openers

    def _asks(self, clause: Clause) -> bool:
        return not self._questions.isdisjoint(clause.words)

    def _is_asking(self, clause: Clause) -> bool:
        """Tell whether a clause is read whole, and names something or asks."""
        if clause.left or clause.is_broken or clause.is_aside:
            return False
        asks = self._where | self._which | self._wanting | self._whose | self._all
        return clause.is_named or not asks.isdisjoint(clause.words)

    def _is_left_out(self, clause: Clause, is_after: bool) -> bool:
        """Tell whether a clause says nothing of which thing is meant."""
        words = clause.words
        if not clause.left and not clause.is_broken:
            return not self._asks(clause)
        has_verb = clause.is_aside or not self._finite.isdisjoint(words)
        # "taxi's here", "the battery died"
        has_verb = has_verb or any(word.endswith(self._endings) for word in words)
        if self._asks(clause) or self._contexts.is_denied(words):
            return False
        told = words[2:] if clause.is_aside else words  # "to clean the tank"
        told = told[:-1] if told and told[-1] in self._naming else told  # "my boss called"
        if not self._narrowing.isdisjoint(told) or (clause.is_broken and not has_verb):
            return False
        if any(spell(word) in COLOURS | FAULTS for word in words):
            return False
        is_short = len(words) < _SHORTEST_CLAUSE
        if is_short and not has_verb and any(is_property(spell(word)) for word in words):
            return False
        if not has_verb and (words[0] in self._articles | self._links):
            return False
        if clause.owners:
            return False
        return has_verb or not (is_after and is_short)

    def _make(self, asked: Sequence[Clause], is_question: bool, known: Known) -> Sentence | None:
        """Make what the clauses ask; None where nothing says what it is."""
        people = known.owners | self._people
        words = [word for clause in asked for word in clause.words]
        said = set(words)
        when = self._date(asked, words)
        if when is None:
            return None
        things = list(dict.fromkeys(thing for clause in asked for thing in clause.things))
        places = [place for clause in asked for place in clause.places]
        named = [name for clause in asked for name in clause.named]
        is_whose = bool(said & self._whose)
        if (said & self._who and not is_whose) or any(map(self._is_aim, asked)):
            return None
        if is_whose:
            matches = [match for thing in things for match in known.find_thing(thing)]
            if not matches or not all(POSSESSIVE in match for match in matches):
                return None
            said -= self._whose
        if not things:
            where = [*places, *(f"{self._in} {name}" for name in named)]
            is_all = bool(said & self._all) and not said & self._rooms
            is_persons = not said.isdisjoint(people) and not said.isdisjoint(self._telling)
            if len(where) != 1 or not is_all or said & self._where or is_persons:
                return None
            return Sentence(kind="what_at", things=(), where=where[0], text=where[0], **when)
        is_either = len(places) + len(named) > 1 and not self._or.isdisjoint(said)
        if is_either and len(things) == 1:  # "kitchen or balcony: where is it?"
            return Sentence(kind="where", things=tuple(things), text=things[0], **when)
        if named or len(places) > 1 or (places and len(things) > 1 and len(asked) > 1):
            return None
        asks_where = bool(said & self._where)
        is_opened = any(map(self._is_opened, asked))
        is_tagged = is_question or bool(said & self._tags)
        is_bare = all(word in self._articles | self._and | self._pronouns for word in said)
        wants = bool(said & self._wanting)
        is_told = bool(said & self._telling) and not (asks_where or is_opened or is_tagged or wants)
        if is_told or not (asks_where or wants or is_opened or is_tagged or is_bare):
            return None
        if said & self._rooms:
            if places or not said & self._which:
                return None
            return Sentence(kind="room", things=tuple(things), text=" ".join(things), **when)
        if said & (self._which | self._all - self._any):
            return None
        # "The mug on the desk is gone, where is it?" does not say where it is sought.
        is_gone = any(
            clause.places and self._questions.isdisjoint(clause.words) for clause in asked
        ) and any(self._where & set(clause.words) and not clause.things for clause in asked)
        if is_gone:
            return None
        is_one = any(clause.things and clause.places for clause in asked)
        is_added = (
            len(asked) == 2 and asked[1].places and not asked[0].places
        )  # "mug, in the sink?"
        is_added = is_added and not (asks_where or wants)
        if places and not (is_one or (is_added and is_question)):  # two questions
            return None
        if places:
            thing = f"{things[-1]} {places[0]}"
            is_at = not (asks_where or is_whose) and (is_opened or is_tagged)
            kind = "is_at" if is_at else "where"
            if kind == "where" and len(things) > 1:
                return None
            return Sentence(kind=kind, things=(*things[:-1], thing), text=thing, **when)
        if is_opened and not (asks_where or wants or said.isdisjoint(self._moving)):
            return None
        if is_opened and not (asks_where or wants or said.isdisjoint(self._clauses.around)):
            return None  # "is the dog hungry?"
        return Sentence(kind="where", things=tuple(things), text=" ".join(things), **when)

    def _date(self, asked: Sequence[Clause], words: Sequence[str]) -> dict[str, Any] | None:
        """Return the time that clauses ask for, and the tense; None where it may be another one.

        "I need the laptop at five" asks where it is now.
        """
        dated = [clause for clause in asked if clause.time is not None]
        asking = [clause for clause in dated if self._asks(clause) or self._is_opened(clause)]
        if any(not self._wanting.isdisjoint(clause.words) for clause in asking):
            return None
        times = {clause.time for clause in asking}
        if len(asked) == 1 and self._wanting.isdisjoint(words):
            if dated and not asking and not self._telling.isdisjoint(words):
                return None  # "I left it there last night": is it still?
            times = {clause.time for clause in dated}
        if len(times) > 1:
            return None
        return {
            "time": next(iter(times), None),
            "tense": "" if self._past.isdisjoint(words) else "past",
        }


@lru_cache(maxsize=8)
def make_free_reader(code: str = ENGLISH) -> FreeReader:
    """Return the reader of a language."""
    return FreeReader(make_context_reader(code), code)
