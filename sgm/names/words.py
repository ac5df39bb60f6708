"""The words of a name: which names are one, what people say around it, and its singular."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache

from sgm.messages import shorten

MAX_LENGTH = 200
_APOSTROPHES = "'\u2019"
_WORD = re.compile(rf"[^\W_]+(?:[{_APOSTROPHES}][^\W_]+)*[{_APOSTROPHES}]?")
_POSSESSIVE = re.compile(rf"(?:[{_APOSTROPHES}]s|(?<=s)[{_APOSTROPHES}])$")
_ARTICLES = frozenset(
    "a an the my your his her its our their this that these those some any".split()
)
_SKIPPED = _ARTICLES | {"where", "is", "are"}
DETERMINERS = _ARTICLES | {"one", "another", "all", "both", "of"}

_WHO = r"(?:i|we|you|he|she|they|it|someone|somebody|anyone|anybody|my \w+|[^\W\d_]+)"
_DID = r"(?:put|place|leave|left|keep|kept|see|seen|saw|store|drop|lay|lose|lost|have|go|gone|been)"
_BEFORE = re.compile(
    r"^(?:"
    r"(?:hey|hi|hello|ok|okay|please|sorry|excuse me|well|so|and|um|robot|now)\b"
    r"|(?:can|could|would|will) (?:you|u|we|i|somebody|someone|anybody|anyone)\b(?: (?:please|just|"
    r"maybe|kindly|quickly))?"
    r"|(?:do|does|did) (?:you|we|anyone|anybody|someone) (?:happen to )?"
    r"(?:know|remember|see|have)\b"
    r"|(?:have|has) (?:you|we|anyone|anybody|someone|somebody) (?:seen|got|found|taken|moved)\b"
    r"|(?:any|have you an|no) idea\b|i wonder\b|(?:tell|show) (?:me|us)\b"
    r"|(?:i am|i[\u2019']m|im|we are|we[\u2019']re) (?:looking|searching|hunting) for\b"
    r"|(?:i am|i[\u2019']m|im|we are|we[\u2019']re) missing\b|(?:looking|searching) for\b"
    r"|(?:i|we) (?:really )?(?:need|want|lost|have lost|misplaced|miss|can[\u2019']?t find|cannot "
    r"find|would like|[\u2019']?d like|have to find|must find)\b|i[\u2019']d like\b"
    r"|help (?:me|us)\b(?: to)?|(?:go (?:and )?)?(?:find|fetch|get|bring|grab|pass|hand|give|"
    r"look for|search for|search|locate)\b(?: me\b| us\b| him\b| her\b)?"
    r"|in which (?:room|drawer|place)\b|which (?:room|drawer|place)\b"
    r"|(?:where|wher)(?: (?:did|do|does|have|has|had|could|might|can|should)"
    rf" {_WHO} (?:last )?{_DID}\b)(?: (?:put|seen|left))?"
    r"|where(?: (?:on earth|the hell|exactly|again))?(?:[\u2019']?s| is| are| was| were|[\u2019']re"
    r"| did| do| does| have| has| had| can| could| might| would| should)\b"
    r"(?: (?:i|we) (?:find|get)\b)?"
    r"|where\b|what happened to\b|who (?:has|took|moved|used)\b|is|are|there"
    r")[\s,:!]+"
)
_AFTER = re.compile(
    r"[\s,]+(?:please|pls|thanks|thank you|thx|cheers|robot|now|again|today|right now|gone|at|be|"
    r"is|are|was|were|located|kept|stored|hiding|hidden|go|gone to|went|got to|anywhere|somewhere|"
    r"here|around|for me|for us|to me|last|then|currently|anymore|any more|i wonder|usually|left|"
    r"at home|in the house|in here)$"
)
# What follows says what was done with it: "the mug that I used", "the book I am reading".
_CLAUSE = re.compile(
    r"\s(?:that|which|who|(?:i|we|you|he|she|they)(?:[\u2019'](?:m|ve|re|d|s|ll))?)\s(?=\S).*$"
)


def read_words(what: str, text: str) -> str:
    """Return the words of a name, by which two names are the same or not.

    Case, the number of spaces and "_" for a space make no difference: "Salt_Shaker" and
    "salt shaker" are one name. Any language will do.

    Args:
        what: what is named, for the error.
        text: the name.

    Returns:
        Words in lower case with one space between them, in Unicode's composed form.

    Raises:
        ValueError: if it is no text, has no word, is longer than `MAX_LENGTH` characters or than
            a line, or holds control characters or half a character.
    """
    if not isinstance(text, str):
        raise ValueError(f"{what} must be a non-empty text, got {shorten(text)}. Name it in words.")
    return _read_words(what, text)


@lru_cache(maxsize=10_000)
def _read_words(what: str, text: str) -> str:
    if len(text) > MAX_LENGTH:
        raise ValueError(
            f"{what} must have at most {MAX_LENGTH} characters, got {len(text)} in "
            f"{shorten(text[:40])}... Shorten it."
        )
    if len(text.splitlines()) > 1:
        raise ValueError(f"{what} must be one line, got {shorten(text)}. Leave line breaks out.")
    words = " ".join(unicodedata.normalize("NFC", text.casefold()).replace("_", " ").split())
    if not words:
        raise ValueError(f"{what} must be a non-empty text, got {shorten(text)}. Name it in words.")
    if any(unicodedata.category(letter) in ("Cc", "Cs") for letter in words):
        raise ValueError(
            f"{what} must not hold control characters or half a character, got {shorten(text)}. "
            "Decode it as UTF-8 and leave them out."
        )
    return words


def read_name(description: str) -> tuple[str, ...]:
    """Return what tells one thing from another: its words without articles, in any order.

    The last word, which says what it is, stays the last: a "table lamp" is no "lamp table". A
    plural is another thing: a detector that says "plates" means a stack of them.

    Raises:
        ValueError: if the description is no name (`read_words`).
    """
    return _read_name(read_words("description", description))


@lru_cache(maxsize=10_000)
def _read_name(name: str) -> tuple[str, ...]:
    words = [_POSSESSIVE.sub("", word.rstrip(_APOSTROPHES)) for word in _find_words(name)]
    said = [word for word in words if word not in _SKIPPED]
    *properties, kind = said or words or [name.casefold().replace("_", " ").strip()]
    return (*sorted(properties), kind)


def strip_question(question: str) -> str:
    """Return what a question is about: "could you find my keys, please?" is about "my keys"."""
    text = " ".join(question.casefold().replace("_", " ").split()).strip(" ?!.,;:")
    before = None
    while before != text:
        before = text
        for shorter in (_BEFORE.sub("", text, count=1), _AFTER.sub("", text)):
            text = shorter.strip(" ?!.,;:") if len(shorter) < len(text) and shorter else text
    return _CLAUSE.sub("", text).strip() or text


def _find_words(name: str) -> list[str]:
    return _WORD.findall(name.casefold().replace("_", " "))


def split_words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case, possessives without their ending.

    Determiners at its beginning are left out, and hyphens part words.
    """
    return tuple(word for word, _ in split_possessives(name))


def split_possessives(name: str) -> list[tuple[str, bool]]:
    """Return the words as `split_words` does, and whether each of them is a possessive."""
    found = _find_words(name)
    words = [(_POSSESSIVE.sub("", word), bool(_POSSESSIVE.search(word))) for word in found]
    start = 0
    while start < len(words) - 1 and words[start][0] in DETERMINERS:
        start += 1
    return words[start:] or [(name.casefold().strip(), False)]


def make_key(words: Sequence[str]) -> str:
    """Return what names are compared by: words written together, the last one in the singular."""
    return "".join([*words[:-1], compute_singular(words[-1])])


@lru_cache(maxsize=10_000)
def compute_singular(word: str) -> str:
    """Return an English word without the ending of its plural; both sides are compared by it."""
    for ending, instead in (("ies", "y"), ("ves", "f"), ("sses", "ss"), ("xes", "x")):
        if word.endswith(ending) and len(word) > len(ending) + 1:
            return word[: -len(ending)] + instead
    if word.endswith("fe") and len(word) > 3:  # knife and knives
        return word[:-1]
    if word.endswith(("ches", "shes")):
        return word[:-2]
    if word.endswith("s") and not word.endswith(("ss", "us", "is")) and len(word) > 3:
        return word[:-1]
    return word
