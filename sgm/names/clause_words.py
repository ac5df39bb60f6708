"""Words of a language by which clauses are read: which say nothing, and which part or join."""

from __future__ import annotations

from functools import lru_cache

from sgm.names.cues import make_cue_reader
from sgm.names.language import Language, load_language
from sgm.names.sections import ENGLISH

# Sections whose words say nothing of which thing is meant, beside `free words`.
_FREE = (
    "articles, fillers, where words, which words, room words, all that is there, yes or no, tags, "
    "whose words, free nouns, who words, telling, wanting, if"
).split(", ")
_DATES = "parts of the day, days, units, numbers, times, minutes".split(", ")


class ClauseWords:
    """Sets of words of a language.

    Attributes:
        is_told: whether the language has such tables.
        free: words that say nothing of which thing is meant.
        around: words that do not where they stand in no name.
        known: both, those of cues and of the future.
        dates: words of times that are in none of them.
        of: articles, and what stands between a quantity and a name: "both of the".
    """

    def __init__(self, language: Language) -> None:
        """Take the words of the tables of a language."""
        listed = language.list_words
        cues = make_cue_reader(language.code)
        self.is_told = bool(listed("free words"))
        self.free = listed("free words").union(*map(listed, _FREE))
        self.around = (listed("free around") | listed("chat words")) - self.free
        self.known = self.free | self.around | cues.words | listed("future words")
        self.dates = frozenset().union(*map(listed, _DATES)) - self.free
        self.articles, self.links = listed("articles"), listed("free links")
        self.of = listed("of") | self.articles
        self.and_, self.or_ = listed("and") - {","}, listed("or")
        self.where = listed("where words")
        self.people, self.subjects = listed("people"), listed("asking people")
        self.pronouns = listed("pronouns")
        self.wanting, self.openers = listed("wanting"), listed("yes or no")
        self.finite = listed("finite")
        self.negations = listed("not")


@lru_cache(maxsize=8)
def make_clause_words(code: str = ENGLISH) -> ClauseWords:
    """Return the words of a language."""
    return ClauseWords(load_language(code))
