"""Names in another language, in the words of the shipped table: "die rote Kaffeetasse"."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from sgm.names.language import Language
from sgm.names.modifiers import ROOMS
from sgm.names.spelling import is_typo
from sgm.names.words import MOST_NAMES, POSSESSIVE, normalize

_LEAST_MENDED = 5  # letters
_LEAST_PART = 3  # letters of each word of a compound
IsName = Callable[[str], bool]


class Translation:
    """Says names in the words of the shipped table, by `names.csv` and `sentences.txt`.

    Words that the table has for the language stay, since it knows them; the others are read as
    properties, owners ("Annas"), words with a typing error, or compounds ("Kaffeetasse", which the
    shipped table has as "coffee cup", and "Wohnzimmerlampe").
    """

    def __init__(self, language: Language, is_name: IsName) -> None:
        """Translate from a language; `is_name` tells what the shipped table has a name for."""
        self._is_name = is_name
        self._articles = language.list_words("articles")
        self._properties = language.read_pairs("properties")
        self._endings = language.list_phrases("endings")
        self._owner_endings = tuple(language.list_phrases("owner endings"))
        self._links = ("", *language.list_phrases("compound links"))
        self._spelled_out = language.spelled_out
        self._english: dict[str, str] = {}
        self._written: dict[str, str] = {}
        self._kept: set[str] = set()
        for name, _, words in language.names:
            for word in words:
                key = normalize(word)
                self._english.setdefault(key, name)
                self._written.setdefault(key, word)
                self._kept.update(key.split())
                self._written.setdefault(self._spell_out(word), word)
        self._by_first: dict[str, list[str]] = {}
        for word in sorted(self._written):
            self._by_first.setdefault(word[0], []).append(word)
        self.translate = lru_cache(maxsize=MOST_NAMES)(self._translate)

    def _translate(self, name: str) -> str:
        """Return a name with its words in those of the shipped table: "red tasse".

        Articles are left out, and the ending of a property makes no difference.
        """
        if not self._english:
            return name
        words, told = normalize(name).split(), list[str]()
        for place, word in enumerate(words):
            is_last = place == len(words) - 1
            if word not in self._articles or is_last:
                told.append(self._translate_word(word, is_last))
        return " ".join(told)

    def write(self, name: str) -> str:
        """Return a name as the language writes it: "Schlüssel" for "schlussel"."""
        return self._written.get(normalize(name), name)

    def _translate_word(self, word: str, is_last: bool) -> str:
        found = self._find_property(word)
        if found or word in self._kept or not word.isalpha():
            return found or word
        if word in self._written:  # "schluessel"
            return normalize(self._written[word])
        if not is_last and word.endswith(self._owner_endings):  # "Annas Handy"
            return f"{word[:-1]}{POSSESSIVE}"
        return self._split_compound(word) or self._mend(word) or word

    def _find_property(self, word: str) -> str:
        """Return a property in the words of the shipped table; empty if it is none."""
        if word in self._properties:
            return self._properties[word]
        for ending in self._endings:
            if word.endswith(ending) and word[: -len(ending)] in self._properties:
                return self._properties[word[: -len(ending)]]
        return ""

    def _split_compound(self, word: str) -> str:
        """Return a compound in words of the shipped table, the longest last part first.

        It is what that table has a name for, or a thing of a room: no "butter can" is in the table,
        and so a "Butterdose" is not the butter.
        """
        for start in range(_LEAST_PART, len(word) - _LEAST_PART + 1):
            last = self._find(word[start:])
            for link in self._links if last else ():
                if not word[:start].endswith(link):
                    continue
                first = self._find(word[: start - len(link)])
                room = first.replace(" ", "")
                if first and self._is_name(f"{first} {last}"):
                    return f"{first} {last}"
                if room in ROOMS:
                    return f"{room} {last}"
        return ""

    def _find(self, part: str) -> str:
        """Return a part of a compound in the words of the shipped table; empty if it is none."""
        if len(part) < _LEAST_PART:
            return ""
        return self._english.get(part) or self._english.get(self._mend(part), "")

    def _mend(self, word: str) -> str:
        """Return the word that this one is a typing error of; empty for none, or several."""
        if len(word) < _LEAST_MENDED:
            return ""
        near = {
            normalize(self._written[other])
            for other in self._by_first.get(word[0], ())
            if is_typo(word, other)
        }
        return near.pop() if len(near) == 1 else ""

    def _spell_out(self, word: str) -> str:
        """Return a word without letters that a keyboard may lack: "schluessel"."""
        word = word.casefold()
        for letter, letters in self._spelled_out.items():
            word = word.replace(letter, letters)
        return normalize(word)
