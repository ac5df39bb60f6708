"""Words by which a question shows its kind, wherever they stand: "last", "whose", "how many"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from sgm.names.clause import Clause
from sgm.names.language import load_language
from sgm.names.sections import ENGLISH
from sgm.names.sentence import Sentence, pad_words

# Kinds of questions, and the section of their words, the first that is found.
_SECTIONS = {
    "count": "asks how many",
    "when": "asks when",
    "whose": "asks whose",
    "together": "asks whether together",
    "moved": "asks whether moved",
}


class CueReader:
    """Says what kind of question clauses ask by words of the sections of a language.

    A sentence of any word order is read so, if it names what the kind asks for: one thing, and a
    place for some. Words of another kind, or two of them, are no question.

    Attributes:
        words: of all cues, and those that may stand beside them.
        questions: words that only a question has.
    """

    def __init__(self, code: str) -> None:
        """Read by the tables of a language."""
        language = load_language(code)
        listed = language.list_words
        self._cues = {
            kind: (re.compile(rf"{language.compile_section(section)}(?= |$)"), listed(section))
            for kind, section in _SECTIONS.items()
        }
        self._beside = {kind: listed(f"{section} beside") for kind, section in _SECTIONS.items()}
        self.words = frozenset().union(
            *(words for _, words in self._cues.values()), *self._beside.values()
        )
        self.questions = listed("cues of questions")
        self._which = listed("which words") | listed("any")
        self._kinds = listed("kinds of") | listed("articles") | listed("of") | listed("every")
        self._where, self._who = listed("where words"), listed("who words")
        self._moving, self._past = listed("moving"), listed("past words")
        self._seen = self._past | listed("asks when beside")
        self._future = listed("future words")
        self._same, self._quantities = listed("as before"), listed("quantities")
        self._aside = listed("not")
        self._telling, self._rooms = listed("telling"), listed("room words")
        self._in = language.list_phrases("at")[0]

    def find(self, asked: Sequence[Clause], free: frozenset[str]) -> str:
        """Find the kind that clauses ask by their words; empty for none, or for several."""
        words = {word for clause in asked for word in clause.words}
        if not self._where.isdisjoint(words):
            return ""
        num_things = len({thing for clause in asked for thing in clause.things})
        for kind in filter(None, map(self.match, asked)):
            is_several = num_things > 1 or any(map(self._is_of_several, asked))
            kind = "moved" if kind == "together" and not is_several else kind
            known = free | self._cues[kind][1] | self._beside[kind]
            is_plain = kind == "whose" or self._who.isdisjoint(words)
            return kind if is_plain and words <= known else ""
        return "which" if words <= free and self._asks_which(asked) else ""

    def match(self, clause: Clause) -> str:
        """Return the kind whose words a clause has, the first of the table; empty for none."""
        padded = pad_words(clause.words)
        found = (kind for kind, (pattern, _) in self._cues.items() if pattern.search(padded))
        return next(found, "")

    def _is_of_several(self, clause: Clause) -> bool:
        """Tell whether a clause names several things at once: "both mugs"."""
        return any(not self._quantities.isdisjoint(thing.split()[:1]) for thing in clause.things)

    def _asks_which(self, asked: Sequence[Clause]) -> bool:
        """Tell whether "which food" or "what kind of toys" is asked for, and at which place."""
        clauses = [clause for clause in asked if clause.things]
        if len(clauses) != 1 or len(clauses[0].things) != 1 or not clauses[0].places:
            return False
        before = clauses[0].text.split(f"{clauses[0].things[0]}")[0].split()
        while before and before[-1] in self._kinds - self._which:
            before = before[:-1]
        return bool(before) and before[-1] in self._which

    def make(
        self, kind: str, asked: Sequence[Clause], when: dict[str, Any], people: frozenset[str]
    ) -> Sentence | None:
        """Make the sentence of a kind; None where it does not name what that asks for.

        Who of `people` moved or saw a thing is not known.
        """
        things = list(dict.fromkeys(thing for clause in asked for thing in clause.things))
        places = list(dict.fromkeys(place for clause in asked for place in clause.places))
        places += [f"{self._in} {name}" for clause in asked for name in clause.named]
        words = {word for clause in asked for word in clause.words}
        if kind == "together":
            is_both = len(things) > 1 or any(map(self._is_of_several, asked))
            is_both = is_both and not places and when["time"] is None
            text = " ".join(things)
            where = next(iter(self._rooms & words), "")
            made = Sentence(kind=kind, things=tuple(things), where=where, text=text, **when)
            return made if is_both else None
        if len(things) > 1 or len(places) > 1:
            return None
        if kind in ("when", "moved") and not people.isdisjoint(words):
            return None
        where = "".join(places)
        if kind == "count":
            if not (things or where):
                return None
            text = " ".join((*things, *places))
            return Sentence(kind=kind, things=tuple(things), where=where, text=text, **when)
        if not things:
            return None
        (thing,) = things
        if kind == "when":
            kind = self._choose_when(words, where)
        if kind == "moved" and where:
            return None
        if kind == "moved" and not self._same.isdisjoint(words) and when["time"] is not None:
            when = {**when, "time": when["time"]._replace(link="since")}
        if not kind or not (kind == "which" or self._aside.isdisjoint(words - self._same)):
            return None
        text = f"{thing} {where}".strip()
        return Sentence(kind=kind, things=(text,), text=text, **when)

    def _choose_when(self, words: set[str], where: str) -> str:
        """Choose whether it was seen, moved, or seen at a place; empty for what will be."""
        if not self._future.isdisjoint(words) or self._seen.isdisjoint(words):
            return ""
        if not self._moving.isdisjoint(words):
            return "" if where else "when_moved"
        if where:
            return "when_at"
        return "" if not self._telling.isdisjoint(words) else "when"


@lru_cache(maxsize=8)
def make_cue_reader(code: str = ENGLISH) -> CueReader:
    """Return the reader of a language."""
    return CueReader(code)
