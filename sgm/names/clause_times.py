"""The time that a question is asked of, by the clauses that say one."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from sgm.names.clause import Clause
from sgm.names.clause_choice import ClauseChooser
from sgm.names.clause_words import ClauseWords
from sgm.names.language import Language
from sgm.names.time_words import TimeSaid


class Dated(NamedTuple):
    """When something is asked for.

    Attributes:
        time: as it was said; None without one.
        tense: "past" or "future", where a word says so.
    """

    time: TimeSaid | None
    tense: str


class ClauseDater:
    """Finds the time that clauses ask for, by tables of words of a language."""

    def __init__(self, language: Language, words: ClauseWords, chooser: ClauseChooser) -> None:
        """Read by the words of a language."""
        self._words, self._chooser = words, chooser
        listed = language.list_words
        self._telling, self._past = listed("telling"), listed("past words")
        self._future, self._usual = listed("future words"), listed("usual")
        self._selves = listed("asker's own")

    def date(self, asked: Sequence[Clause], loose: Sequence[Clause]) -> Dated | None:
        """Return the time that clauses ask for, and the tense; None where it may be another one.

        "I need the laptop at five" asks where it is now. Of other clauses, `loose`, those without a
        verb say when: "yesterday, noon: where was it?"
        """
        core = self._find_core(asked)
        if core is None:
            return None
        said = {word for clause in core for word in clause.words}
        is_timed = any(clause.time is not None for clause in (*core, *loose))
        tense = "" if self._past.isdisjoint(said) else "past"
        if not self._future.isdisjoint(said) or (is_timed and not self._usual.isdisjoint(said)):
            tense = "future"
        times = {clause.time for clause in core if clause.time is not None}
        if tense and not times and any(c.time for c in asked if c not in core):
            return None  # "thirty hours ago I looked there, what was in it?"
        for clause in loose:
            if clause.time is None:
                continue
            if self._is_date(clause) or (clause.is_aside and tense == "future"):
                times.add(clause.time)  # "when I go to bed at ten, where will it be?"
            elif tense and not times and not clause.is_aside:
                return None  # "I was at the gym yesterday, where was my mug?"
        return self._join([c for c in (*asked, *loose) if c.time in times], loose, tense)

    def _find_core(self, asked: Sequence[Clause]) -> list[Clause] | None:
        """Find the clauses whose time and tense are asked for; None where that is not clear."""
        chooser, wanting = self._chooser, self._words.wanting
        core = [clause for clause in asked if chooser.asks(clause) or chooser.is_opened(clause)]
        if any(c.time is not None and not wanting.isdisjoint(c.words) for c in core):
            return None
        if any(not self._words.finite.isdisjoint(clause.words) for clause in core):
            return [*core, *(clause for clause in asked if self._says_when(clause, core))]
        # "on Tuesday the tin was where?"
        core = [c for c in asked if wanting.isdisjoint(c.words) or c in core]
        is_told = any(not self._telling.isdisjoint(clause.words) for clause in asked)
        if is_told and any(clause.time is not None for clause in core):
            return None  # "I left it there last night": is it still?
        return core

    def _says_when(self, clause: Clause, core: Sequence[Clause]) -> bool:
        """Tell whether a clause without a verb adds a time: "on the desk at noon, what was"."""
        has_verb = not (self._words.finite | self._words.wanting).isdisjoint(clause.words)
        is_added = clause.time is not None and not (has_verb or clause.is_aside or clause.verbs)
        return is_added and clause not in core

    def _is_date(self, clause: Clause) -> bool:
        """Tell whether a clause says when, and tells of no person."""
        is_free = (self._words.free | self._words.around).issuperset(clause.words)
        return is_free and not clause.is_aside and self._selves.isdisjoint(clause.words)

    def _join(self, dated: Sequence[Clause], loose: Sequence[Clause], tense: str) -> Dated | None:
        """Join the times of clauses, "yesterday" and "noon"; None where they are not one."""
        time: TimeSaid | None = None
        for clause in dated:
            joined = clause.time
            if time is not None and clause.time is not None:
                joined = time.join(clause.time)
                if joined is None:
                    return None
            time = joined
        is_hour_alone = time is not None and time.is_hour_alone
        if is_hour_alone and any(clause.time == time and not clause.words for clause in loose):
            return None  # "seven, where is it?"
        return Dated(time=time, tense=tense)
