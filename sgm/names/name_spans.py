"""How many words of a clause are the name of a thing, or of a place."""

from __future__ import annotations

from collections.abc import Sequence

from sgm.names.clause import Find, Known
from sgm.names.clause_words import ClauseWords
from sgm.names.language import Language

_LONGEST_NAME = 5  # words


class NameSpans:
    """Counts the words that are a name, from a place in a clause on."""

    def __init__(self, language: Language, words: ClauseWords) -> None:
        """Count by the words of a language."""
        listed = language.list_words
        self._words = words
        self._definite = listed("before a noun")
        inner = words.articles | words.links | listed("of") | listed("linking")
        self._plain = words.free - inner

    def count_thing(self, words: Sequence[str], place: int, known: Known) -> int:
        """Count the words of a thing; 0 where they are less than a longer name of a place."""
        length = self.count_name(words, place, known.find_thing, known)
        if not length and words[place] in self._words.free and words[place] in known.words:
            before = words[place - 1 : place]  # "the honey"
            is_written = _is_written(words[place], known.find_thing(words[place]))
            return int(is_written and not self._definite.isdisjoint(before))
        is_shorter = length and length < self.count_name(words, place, known.find_place, known)
        return 0 if is_shorter else length

    def count_place(self, words: Sequence[str], place: int, known: Known) -> int:
        """Count the words that say where: "in the sink"."""
        if words[place] not in self._words.links:
            return 0
        start = place + 1
        while start < len(words) and words[start] in self._words.articles:
            start += 1
        if start >= len(words):
            return 0
        length = self.count_name(words, start, known.find_place, known)
        return start + length - place if length else 0

    def count_name(self, words: Sequence[str], place: int, find: Find, known: Known) -> int:
        """Count the words of a name, the most that each say something."""
        if words[place] in self._words.and_ or words[place] == ",":
            return 0
        if words[place] in self._words.free:  # "living room"
            return self._count_written(words, place, find, known)
        for end in range(min(place + _LONGEST_NAME, len(words)), place, -1):
            name = " ".join(words[place:end])
            found = find(name)
            is_free = words[end - 1] in self._words.free
            if not found or (is_free and not _is_written(name, found)):
                continue
            inner = words[place:end]
            if self._plain.intersection(inner) and not _is_written(name, found):
                continue  # "he wants a game"
            shorter = range(1, len(inner))
            if any(_is_same(inner[n:], inner[:n], found, find) for n in shorter):
                return 0  # "surely the dog"
            if any(_is_same(inner[:n], inner[n:], found, find) for n in shorter):
                continue  # "paracetamol plus"
            return end - place
        return 0

    def _count_written(self, words: Sequence[str], place: int, find: Find, known: Known) -> int:
        """Count the words that are a name as it is written."""
        if words[place] not in known.words:
            return 0
        for end in range(min(place + _LONGEST_NAME, len(words)), place + 1, -1):
            name = " ".join(words[place:end])
            if words[end - 1] in known.words and _is_written(name, find(name)):
                return end - place
        return 0


def _is_written(name: str, found: Sequence[str]) -> bool:
    """Tell whether a name is the end of one that was found: "watering can"."""
    return any(f" {match}".casefold().endswith(f" {name}") for match in found)


def _is_same(kept: Sequence[str], dropped: Sequence[str], found: Sequence[str], find: Find) -> bool:
    """Tell whether fewer words mean the same, and no name found has one of those dropped."""
    said = {word for match in found for word in match.casefold().split()}
    return said.isdisjoint(dropped) and find(" ".join(kept)) == found
