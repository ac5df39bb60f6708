"""Names of rooms, furniture and objects, compared by their words: which are one name."""

from __future__ import annotations

import re
import unicodedata
from functools import lru_cache

from sgm.messages import shorten

MAX_LENGTH = 200
_SKIPPED = frozenset(
    "a an the my your his her its our their this that these those some any where is are".split()
)
_APOSTROPHE = "['\u2019]"
_WORD = re.compile(rf"[^\W_]+(?:{_APOSTROPHE}[^\W_]+)*")
_POSSESSIVE = re.compile(rf"{_APOSTROPHE}s?$")


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
    text = name.casefold().replace("_", " ")
    words = [_POSSESSIVE.sub("", word) for word in _WORD.findall(text)]
    said = [word for word in words if word not in _SKIPPED]
    *properties, kind = said or words or [text.strip()]
    return (*sorted(properties), kind)
