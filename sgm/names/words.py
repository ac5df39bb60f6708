"""The words of a name: which names are one, what people say around it, and its singular."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from functools import lru_cache
from typing import TypeGuard

from sgm.messages import shorten
from sgm.names.sections import load_grammar

MOST_NAMES = 10_000  # whose words are kept as they were read: 15 MB
MOST_READ = 2000  # whose sentences, phrases and readings are kept: 15 MB
MAX_LENGTH = 200
# Characters that show nothing, besides those of Unicode's category Cf.
_INVISIBLE = frozenset(
    "\u034f\u115f\u1160\u17b4\u17b5\u180b\u180c\u180d\u180f\u2800\u3164\uffa0"
) | frozenset(map(chr, (*range(0xFE00, 0xFE10), *range(0xE0100, 0xE01F0))))  # and selectors
# Latin letters whose accent is a part of them, for Unicode.
_BARRED = str.maketrans("øłđħŧı", "oldhti")
_FIRST_ACCENT, _LAST_ACCENT = "\u0300", "\u036f"
# Where a word ends in "SoapBottle" and "TVStand"; pieces have two letters ("iPhone" is one word).
_CAMEL = re.compile(r"(?<=[a-z]{2})(?=[A-Z][a-z])|(?<=[A-Z]{2})(?=[A-Z][a-z])")
# Most names as detectors write them; nothing in them is to be changed before they are compared.
_PLAIN = re.compile(r"[a-z0-9]+(?: [a-z0-9]+)*")
_APOSTROPHES = "'\u2019"
_WORD = re.compile(rf"[^\W_]+(?:[{_APOSTROPHES}][^\W_]+)*[{_APOSTROPHES}]?")
_GRAMMAR = load_grammar()
(POSSESSIVE,) = _GRAMMAR.list_lines("possessive")  # as names of owners are written: "anna's"
_MARK, _ENDING = POSSESSIVE[0], POSSESSIVE[1:]
_POSSESSIVE = re.compile(rf"(?:[{_APOSTROPHES}]{_ENDING}|(?<={_ENDING})[{_APOSTROPHES}])$")
_ARTICLES = _GRAMMAR.list_words("articles")
# Whose it is, as "dad's" says it: "his pillow" is not "her pillow". Who says "my" is not known.
_OWNERS = _GRAMMAR.list_words("owners")
DETERMINERS = _ARTICLES | _GRAMMAR.list_words("determiners")
SKIPPED = _ARTICLES | _GRAMMAR.list_words("asked before")  # at the beginning
LINKS = _GRAMMAR.read_pairs("links")
OF, FOR = LINKS["of"], LINKS["for"]
WITH = _GRAMMAR.list_words("with")
# Words between two parts of a name: "bottle of milk", "key with red tag".
BREAKS = WITH | _GRAMMAR.list_words("breaks")
_VARIANTS = _GRAMMAR.read_spellings("spellings")  # each as a singular
_IRREGULAR = _GRAMMAR.read_spellings("irregular plurals")
# Plurals that name another thing than their singular.
OWN_PLURALS = _GRAMMAR.list_words("own plurals")
_PLURALS = tuple(
    (ending, singular, int(least))
    for ending, value in _GRAMMAR.read_pairs("plural endings").items()
    for singular, least in [map(str.strip, value.split(","))]
)
_NO_PLURALS = tuple(_GRAMMAR.list_words("no plural endings"))


def read_words(field: str, text: str) -> str:
    """Return the words of a name, by which two names are the same or not.

    Case, accents of Latin letters, the number of spaces, "_" for a space, characters that show
    nothing, and words written together as "SaltShaker" make no difference: "Salt_Shaker" and "salt
    shaker" are one name. Any language will do.

    Args:
        field: what is named, for the error.
        text: the name.

    Returns:
        Words in lower case with one space between them, in Unicode's composed form.

    Raises:
        ValueError: if it is no text, shows nothing, is longer than `MAX_LENGTH` characters or than
            a line, or holds control characters or half a character.
    """
    if not isinstance(text, str):
        raise ValueError(
            f"{field} must be a non-empty text, got {shorten(text)}. Name it in words."
        )
    words, fault = _read_words(text)
    if fault:
        raise ValueError(f"{field} must {fault}")
    return words


def is_name(text: object) -> TypeGuard[str]:
    """Tell whether a value that a file may hold is a name, as `read_words` takes it."""
    return isinstance(text, str) and not _read_words(text)[1]


@lru_cache(maxsize=MOST_NAMES)
def _read_words(text: str) -> tuple[str, str]:
    """Return the words of a name, and what is wrong with it, empty if nothing is."""
    words = normalize(text) if len(text) <= MAX_LENGTH else ""
    fault = ""
    if len(text) > MAX_LENGTH:
        fault = (
            f"have at most {MAX_LENGTH} characters, got {len(text)} in {shorten(text[:40])}... "
            "Shorten it."
        )
    elif len(text.splitlines()) > 1:
        fault = f"be one line, got {shorten(text)}. Leave line breaks out."
    elif not words:
        fault = f"be a non-empty text, got {shorten(text)}. Name it in words."
    elif not (words.isascii() and words.isprintable()) and any(  # as most names are
        unicodedata.category(letter) in ("Cc", "Cs") for letter in words
    ):
        fault = (
            f"not hold control characters or half a character, got {shorten(text)}. Decode it as "
            "UTF-8 and leave them out."
        )
    return words, fault


@lru_cache(maxsize=MOST_NAMES)
def normalize(text: str) -> str:
    """Return a text as names are compared: lower case, without what makes no difference.

    Full-width letters and ligatures are plain ones (as by NFKC), what shows nothing and accents of
    Latin letters are left out, "_" is a space, and "SoapBottle" is two words.
    """
    if _PLAIN.fullmatch(text):
        return text
    shown = text
    if not text.isascii():
        shown = "".join(
            letter
            for letter in text
            if unicodedata.category(letter) != "Cf" and letter not in _INVISIBLE
        )
    words = _compare_form(shown, is_full=True)
    # Two hundred ligatures, or words written together, would be longer than a name may be.
    return words if len(words) <= MAX_LENGTH else _compare_form(shown, is_full=False)


def _compare_form(text: str, is_full: bool) -> str:
    """Return a text as it is compared; in full, one character may become several."""
    if not text.isascii():
        most = 4 if is_full else 1
        text = "".join(_simplify(letter, most) for letter in text)
    text = text.replace("_", " ")
    if is_full:
        text = _CAMEL.sub(" ", text).casefold()
    else:
        text = "".join(letter.lower() if len(letter.lower()) == 1 else letter for letter in text)
    if not text.isascii():
        text = unicodedata.normalize("NFC", _strip_accents(text)).translate(_BARRED)
    return " ".join(text.split())


def _simplify(letter: str, most: int) -> str:
    """Return a letter without its form: of a full-width letter or of a ligature, not "½"."""
    simple = unicodedata.normalize("NFKC", letter)
    is_letters = len(simple) <= most and simple.isalnum()
    return simple if len(simple) == 1 or is_letters else letter


def _strip_accents(text: str) -> str:
    """Leave out accents of Latin letters; elsewhere such a mark makes another letter."""
    kept, base = [], ""
    for letter in unicodedata.normalize("NFD", text):
        if _FIRST_ACCENT <= letter <= _LAST_ACCENT:
            if base.isascii() and base.isalpha():
                continue
        else:
            base = letter
        kept.append(letter)
    return "".join(kept)


def read_name(description: str) -> tuple[str, ...]:
    """Return what tells one thing from another: its words without articles, in any order.

    The last word, which says what it is, stays the last: a "table lamp" is no "lamp table". So do
    those of each part: a "knife with red handle" is no "red knife with handle". A plural is another
    thing: a detector that says "plates" means a stack of them.

    Raises:
        ValueError: if the description is no name (`read_words`).
    """
    return _read_name(read_words("description", description))


@lru_cache(maxsize=MOST_NAMES)
def _read_name(name: str) -> tuple[str, ...]:
    return order_words(list_plain(name))


@lru_cache(maxsize=10_000)
def unify(word: str) -> str:
    """Return the one spelling of a word, singular where the plural names the same thing."""
    if word not in OWN_PLURALS:
        word = compute_singular(word)
    return _VARIANTS.get(word, word)


def list_plain(name: str) -> list[str]:
    """List the words of a name without possessive endings, and without articles before a part."""
    words = [
        word if word.isalnum() else _POSSESSIVE.sub("", word.rstrip(_APOSTROPHES))
        for word in _find_words(name)
    ]
    if words and SKIPPED.isdisjoint(words):  # most names
        return words
    kept: list[str] = []
    for word in words:
        skipped = _ARTICLES if kept else SKIPPED
        if word not in skipped or (kept and kept[-1] not in BREAKS):
            kept.append(word)
    return kept or words or [normalize(name)]


def order_words(words: Sequence[str]) -> tuple[str, ...]:
    """Order the words of each part of a name but for its last one."""
    if BREAKS.isdisjoint(words):  # most names
        return (*sorted(words[:-1]), *words[-1:])
    ordered: list[str] = []
    part: list[str] = []
    for word in words:
        if word in BREAKS:
            ordered += [*sorted(part[:-1]), *part[-1:], word]
            part = []
        else:
            part.append(word)
    return (*ordered, *sorted(part[:-1]), *part[-1:])


def _find_words(name: str) -> list[str]:
    text = normalize(name)
    is_plain = text.isascii() and text.replace(" ", "").isalnum()  # as most names are
    return text.split() if is_plain else _WORD.findall(text)


def split_words(name: str) -> tuple[str, ...]:
    """Return the words of a name in lower case, possessives without their ending.

    Determiners at its beginning are left out, and hyphens part words.
    """
    return tuple([word for word, _ in split_possessives(name)])


def split_possessives(name: str) -> list[tuple[str, bool]]:
    """Return the words as `split_words` does, and whether each of them is a possessive."""
    words = [
        (word, word in _OWNERS)
        if word.isalnum()  # most of them
        else (_POSSESSIVE.sub("", word), bool(_POSSESSIVE.search(word)))
        for word in _find_words(name)
    ]
    start = 0
    while start < len(words) - 1 and words[start][0] in DETERMINERS:
        start += 1
    return words[start:] or [(normalize(name), False)]


def make_key(words: Sequence[str]) -> str:
    """Return what names are compared by: words written together, the last one in the singular."""
    last = compute_singular(words[-1])
    last = _VARIANTS.get(last, last)
    if len(words) == 1:
        return last
    return "".join([_VARIANTS.get(word, word) for word in words[:-1]]) + last


@lru_cache(maxsize=10_000)
def compute_singular(word: str) -> str:
    """Return a word without the ending of its plural; both sides are compared by it.

    Words that end in "ie" and in "y" are compared as one, since their plurals are spelled alike.
    """
    if word in _IRREGULAR:
        return _IRREGULAR[word]
    for ending, singular, least in _PLURALS:
        if len(word) >= least and word.endswith(ending):
            is_plural = singular or not word.endswith(_NO_PLURALS)
            return word[: -len(ending)] + singular if is_plural else word
    return word
