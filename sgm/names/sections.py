"""A file of a language in sections: lines of words, of pairs, or of patterns."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator, Sequence
from functools import cache, lru_cache
from importlib import resources

ENGLISH = "en"  # in which the tables of names, of priors and of detectors are written
GRAMMAR = "grammar.txt"
DATA = resources.files("sgm.names").joinpath("data")  # a folder for each language
_HEAD = re.compile(r"\[[^\[\]|]+\]")


class Sections:
    """The sections of a file, "[name]" and the lines below it; "#" begins a remark.

    Attributes:
        path: of the file, for errors.
    """

    def __init__(self, text: str, path: str, needed: Collection[str] | None = None) -> None:
        """Read a text.

        Args:
            text: of the file.
            path: of the file.
            needed: sections that must be there; None for every one that is asked for. One of
                another name is empty where it is missing.

        Raises:
            ValueError: if a needed section is missing, or lines stand before the first one.
        """
        self.path = path
        self._sections = dict(_read_sections(text, path))
        self._is_whole = needed is None
        for name in needed or ():
            self._check(name)
        self.list_words = cache(self._list_words)
        self.read_pairs = cache(self._read_pairs)
        self.read_spellings = cache(self._read_spellings)

    @property
    def section_names(self) -> list[str]:
        """Names of the sections, in order."""
        return list(self._sections)

    def list_lines(self, section: str) -> Sequence[str]:
        """Return the lines of a section; none of one that the file may do without."""
        if self._is_whole:
            self._check(section)
        return self._sections.get(section, ())

    def list_phrases(self, section: str) -> list[str]:
        """Return the phrases of a section, which "|" or lines part."""
        return [phrase.strip() for line in self.list_lines(section) for phrase in _split(line)]

    def list_classes(self, section: str) -> list[frozenset[str]]:
        """Return the phrases of each line of a section."""
        return [frozenset(map(str.strip, line.split("|"))) for line in self.list_lines(section)]

    def _list_words(self, section: str) -> frozenset[str]:
        """Return all words of a section."""
        return frozenset(" ".join(self.list_lines(section)).replace("|", " ").split())

    def _read_pairs(self, section: str) -> dict[str, str]:
        """Return the lines "name = value" of a section."""
        pairs = (line.partition(" = ") for line in self._list_pairs(section))
        return {name.strip(): value.strip() for name, _, value in pairs}

    def _list_pairs(self, section: str) -> Iterator[str]:
        for line in self.list_lines(section):
            if " = " not in f"{line} ":
                raise ValueError(
                    f"a line of [{section}] must be a pair, got {line!r} in {self.path}. Write "
                    "`name = value`."
                )
            yield f"{line} "

    def _read_spellings(self, section: str) -> dict[str, str]:
        """Return what is read for what, of lines "one = two | three"."""
        return {
            other.strip(): word
            for word, others in self.read_pairs(section).items()
            for other in others.split("|")
        }

    def read_groups(self, section: str) -> dict[str, frozenset[str]]:
        """Return the words of each name, of lines "name = word word"."""
        pairs = self.read_pairs(section).items()
        return {name: frozenset(words.split()) for name, words in pairs}

    def _check(self, section: str) -> None:
        if section not in self._sections:
            raise ValueError(
                f"{self.path} must have the section [{section}], got none. "
                "docs/extend/language.md says what it is for."
            )


def _read_sections(text: str, path: str) -> dict[str, list[str]]:
    sections: dict[str, list[str]] = {}
    lines: list[str] | None = None
    for line in map(str.strip, text.splitlines()):
        if _HEAD.fullmatch(line):
            lines = sections.setdefault(line[1:-1], [])
        elif line and not line.startswith("#"):
            if lines is None:
                raise ValueError(
                    f"{path} must begin with a section, got {line!r}. Write [name] before it."
                )
            lines.append(line)
    return sections


def _split(line: str) -> Iterator[str]:
    """Split a line at each "|" that stands in no bracket."""
    depth, start = 0, 0
    for place, letter in enumerate(line):
        depth += (letter in "([") - (letter in ")]")
        if letter == "|" and not depth:
            yield line[start:place]
            start = place + 1
    yield line[start:]


def read_file(code: str, name: str) -> str:
    """Return the text of a file of a language, empty if there is no such file."""
    path = DATA.joinpath(code, name)
    return path.read_text(encoding="utf-8") if path.is_file() else ""


@lru_cache(maxsize=1)
def load_grammar() -> Sections:
    """Return how names are built in the language of the shipped tables (`grammar.txt`)."""
    return Sections(read_file(ENGLISH, GRAMMAR), f"sgm/names/data/{ENGLISH}/{GRAMMAR}")
