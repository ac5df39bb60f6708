"""What a language says in its own words: a folder of tables, read into sections and patterns."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from functools import cache, cached_property, lru_cache

from sgm.messages import shorten
from sgm.names import sections
from sgm.names.sections import ENGLISH, Sections, read_file

_SENTENCES, _ANSWERS = "sentences.txt", "answers.txt"
# Section of answers: how names stand in a sentence; what a language with genders says.
_FORMS = "names"
_FORM_NAMES = "the|no article|or|and|is|was|has|adjective|adjectives|place|called".split("|")
NEEDED = ("questions", "articles", "at")
_PART = re.compile(r"[()\[\]|]|<\w+>|\$[\w']+|[^\s()\[\]|<>$]+")
_MARKS = {"(": "(?:", "[": "(?:", "]": ")?", ")": ")", "|": "|"}
_WORD = r" [^\s,]+"
_SLOTS = {"word": _WORD, "rest": rf"(?:{_WORD}| ,)+"}


class Language(Sections):
    """The tables of one language: `sgm/names/data/CODE/`; its sections are of `sentences.txt`.

    A section that the language does without is empty, but for those of `NEEDED`.

    Attributes:
        code: "en", "de".
    """

    def __init__(self, code: str) -> None:
        """Read the folder of a language.

        Raises:
            ValueError: if there is none, or a section is missing.
        """
        self.code = code
        if code not in list_languages():
            raise ValueError(
                f"language must be one of {', '.join(list_languages())}, got {shorten(code)}. "
                "docs/extend/language.md says how to add one."
            )
        text, path = read_file(code, _SENTENCES), f"sgm/names/data/{code}/{_SENTENCES}"
        super().__init__(_compare_form(text), path, NEEDED)
        # Letters that a keyboard may lack, and what is written instead: "ae".
        self.spelled_out = Sections(text, path, ()).read_pairs("spelled out")
        self.compile_section = cache(self._compile_section)

    @cached_property
    def names(self) -> list[tuple[str, str, tuple[str, ...]]]:
        """What things are called (`names.csv`): name in the shipped table, gender, words."""
        rows = csv.DictReader(io.StringIO(read_file(self.code, "names.csv"), newline=""))
        return [(row["name"], row["gender"], tuple(row["words"].split(";"))) for row in rows]

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
    return tuple(sorted(folder.name for folder in sections.DATA.iterdir() if folder.is_dir()))


@lru_cache(maxsize=8)
def load_language(code: str = ENGLISH) -> Language:
    """Return a language, read once; raises ValueError if there is none of that code."""
    return Language(code)


@lru_cache(maxsize=8)
def load_answers(code: str = ENGLISH) -> dict[str, dict[str, str]]:
    """Return what is answered in a language: by section, sentences by name (`answers.txt`).

    Raises:
        ValueError: if there is no such language, or a sentence that English has is missing.
    """
    path = f"sgm/names/data/{load_language(code).code}/{_ANSWERS}"
    told = Sections(read_file(code, _ANSWERS), path, ())
    answers = {name: told.read_pairs(name) for name in told.section_names}
    needed = answers if code == ENGLISH else {**load_answers(), _FORMS: _FORM_NAMES}
    for section, sentences in needed.items():
        for name in sentences:
            if name not in answers.get(section, ()):
                raise ValueError(
                    f"{path} must have the sentence {name!r} in [{section}], got none. Translate "
                    "that of sgm/names/data/de/answers.txt."
                )
    return answers


def _compare_form(text: str) -> str:
    """Return a text in lower case without accents of Latin letters, as names are compared."""
    if text.isascii():
        return text.lower()
    letters = unicodedata.normalize("NFD", text.casefold())
    kept = (letter for letter in letters if not "\u0300" <= letter <= "\u036f")
    return unicodedata.normalize("NFC", "".join(kept))
