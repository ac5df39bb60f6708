"""What a language says in its own words: a folder of tables, read into sections and patterns."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Iterator, Sequence
from functools import cache, cached_property, lru_cache
from importlib import resources

from sgm.messages import shorten

ENGLISH = "en"  # in which the tables of names, of priors and of detectors are written
_PART = re.compile(r"[()\[\]|]|<\w+>|\$[\w']+|[^\s()\[\]|<>$]+")
_HEAD = re.compile(r"\[[^\[\]|]+\]")
_MARKS = {"(": "(?:", "[": "(?:", "]": ")?", ")": ")", "|": "|"}
_WORD = r" [^\s,]+"
_SLOTS = {"word": _WORD, "rest": rf"(?:{_WORD}| ,)+"}


class Language:
    """The tables of one language: `sgm/names/data/CODE/`.

    Attributes:
        code: "en", "de".
    """

    def __init__(self, code: str) -> None:
        """Read the folder of a language.

        Raises:
            ValueError: if there is none.
        """
        self.code = code
        if code not in list_languages():
            raise ValueError(
                f"language must be one of {', '.join(list_languages())}, got {shorten(code)}. "
                "docs/extend/language.md says how to add one."
            )
        self._sections = _read_sections(_compare_form(self.read("sentences.txt")))
        self.list_words = cache(self._list_words)
        self.read_pairs = cache(self._read_pairs)
        self.compile_section = cache(self._compile_section)

    def read(self, name: str) -> str:
        """Return the text of a file of the folder, empty if there is no such file."""
        path = resources.files("sgm.names").joinpath("data", self.code, name)
        return path.read_text(encoding="utf-8") if path.is_file() else ""

    def list_lines(self, section: str) -> Sequence[str]:
        """Return the lines of a section; none of one that the language does without."""
        return self._sections.get(section, ())

    def list_phrases(self, section: str) -> list[str]:
        """Return the phrases of a section, which "|" or lines part."""
        lines = self.list_lines(section)
        return [phrase.strip() for line in lines for phrase in _split_alternatives(line)]

    def _list_words(self, section: str) -> frozenset[str]:
        """Return all words of a section."""
        return frozenset(" ".join(self.list_lines(section)).replace("|", " ").split())

    def _read_pairs(self, section: str) -> dict[str, str]:
        """Return the lines "name = value" of a section."""
        pairs = (line.partition(" = ") for line in self.list_lines(section))
        return {name.strip(): value.strip() for name, _, value in pairs}

    @cached_property
    def names(self) -> list[tuple[str, str, tuple[str, ...]]]:
        """What things are called (`names.csv`): name in the shipped table, gender, words."""
        rows = csv.DictReader(io.StringIO(self.read("names.csv"), newline=""))
        return [(row["name"], row["gender"], tuple(row["words"].split(";"))) for row in rows]

    def translate(self, name: str) -> str:
        """Return a name with its properties in the words of the shipped table: "red tasse".

        Articles are left out, and the ending of a property makes no difference.
        """
        properties = self.read_pairs("properties")
        if not properties:
            return name
        words = _compare_form(name).split()
        articles, told = self.list_words("articles"), list[str]()
        for place, word in enumerate(words):
            is_last = place == len(words) - 1
            if word in articles and not is_last:
                continue
            told.append(self._find_property(word, properties) or word)
        return " ".join(told)

    def _find_property(self, word: str, properties: dict[str, str]) -> str:
        """Return a property in the words of the shipped table; empty if it is none."""
        if word in properties:
            return properties[word]
        for ending in self.list_phrases("endings"):
            if word.endswith(ending) and word[: -len(ending)] in properties:
                return properties[word[: -len(ending)]]
        return ""

    @cached_property
    def questions(self) -> list[tuple[str, re.Pattern[str]]]:
        """Kinds of question and the patterns of whole sentences, in order."""
        split = (line.partition(": ") for line in self.list_lines("questions"))
        return [(kind, re.compile(f"^{self.compile(pattern)}$")) for kind, _, pattern in split]

    def compile(self, pattern: str) -> str:
        """Return the regular expression of a pattern, for words with a space before each."""
        found: list[str] = []
        for part in _PART.findall(pattern):
            if part in _MARKS:
                found.append(_MARKS[part])
            elif part.startswith("<"):
                found.append(self._compile_slot(part[1:-1]))
            elif part.startswith("$"):
                found.append(self.compile_section(part[1:]))
            else:
                found.append(re.escape(f" {part}"))
        return "".join(found)

    def _compile_slot(self, name: str) -> str:
        """Return the regular expression of a slot; that of a place begins with "in" or the like."""
        if name == "where":
            links = "|".join(map(self.compile_section, ("at", "near", "from")))
            return rf"(?P<where>(?:{links})(?:{_WORD})+)"
        if name == "the_thing":  # no "hand mirror"
            return rf"(?P<thing>(?={self.compile_section('articles')} )(?:{_WORD}| ,)+?)"
        return _SLOTS.get(name) or rf"(?P<{name}>(?:{_WORD}| ,)+?)"

    def _compile_section(self, section: str) -> str:
        """Return the regular expression of any phrase of a section, the longest first."""
        phrases = sorted(self.list_phrases(section), key=len, reverse=True)
        return f"(?:{'|'.join(map(self.compile, phrases))})" if phrases else r"(?!)"


@lru_cache(maxsize=1)
def list_languages() -> tuple[str, ...]:
    """Return the codes of the languages that there are."""
    folders = resources.files("sgm.names").joinpath("data").iterdir()
    return tuple(sorted(folder.name for folder in folders if folder.is_dir()))


@lru_cache(maxsize=8)
def load_language(code: str = ENGLISH) -> Language:
    """Return a language, read once; raises ValueError if there is none of that code."""
    return Language(code)


@lru_cache(maxsize=8)
def load_answers(code: str = ENGLISH) -> dict[str, dict[str, str]]:
    """Return what is answered in a language: by section, sentences by name (`answers.txt`)."""
    sections = _read_sections(load_language(code).read("answers.txt"))
    pairs = {name: [line.partition(" = ") for line in lines] for name, lines in sections.items()}
    return {
        name: {key.strip(): value.strip() for key, _, value in lines}
        for name, lines in pairs.items()
    }


def _compare_form(text: str) -> str:
    """Return a text in lower case without accents of Latin letters, as names are compared."""
    if text.isascii():
        return text.lower()
    letters = unicodedata.normalize("NFD", text.casefold())
    kept = (letter for letter in letters if not "\u0300" <= letter <= "\u036f")
    return unicodedata.normalize("NFC", "".join(kept))


def _read_sections(text: str) -> dict[str, list[str]]:
    sections: dict[str, list[str]] = {}
    name = ""
    for line in map(str.strip, text.splitlines()):
        if _HEAD.fullmatch(line):
            name = line[1:-1]
            sections[name] = []
        elif line and not line.startswith("#"):
            sections[name].append(line)
    return sections


def _split_alternatives(line: str) -> Iterator[str]:
    """Split a line at each "|" that stands in no bracket."""
    depth, start = 0, 0
    for place, letter in enumerate(line):
        depth += (letter in "([") - (letter in ")]")
        if letter == "|" and not depth:
            yield line[start:place]
            start = place + 1
    yield line[start:]
