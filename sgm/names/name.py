"""A name as it is read once: by what it is the same as another one, and which of several it is."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from sgm.names.instances import is_spelled, split_instance
from sgm.names.words import (
    MAX_LENGTH,
    MOST_NAMES,
    SKIPPED,
    list_plain,
    order_words,
    read_words,
    unify,
)


@dataclass(frozen=True, slots=True)
class Name:
    """What is called something.

    Attributes:
        text: as it was written.
        words: as `read_words` gives them.
        key: what tells one thing of a memory from another: the words without articles, in any order
            but for the last one of each part, which says what it is: a "table lamp" is no "lamp
            table". A plural is another thing: a detector that says "plates" means a stack of them.
        base: words without a counter or hash at the end.
        instance: that counter or hash, "2" of "mug_002"; empty without one.
        ordered: words of the base in the order by which names are the same, each as singular and in
            one spelling.
        joined: the same words as they stand, written together.
    """

    text: str
    words: str
    key: tuple[str, ...]
    base: str
    instance: str
    ordered: tuple[str, ...]
    joined: str

    @classmethod
    def read(cls, text: str, field: str = "description") -> Name:
        """Read a name; raises ValueError if it is none (`read_words`)."""
        name = _read_numbered(text) if isinstance(text, str) else None
        return name or _read(read_words(field, text), text)

    @property
    def keys(self) -> tuple[tuple[object, str], ...]:
        """What tables of names are indexed by: two names are the same if they share one key."""
        keys = (self.ordered, self.instance), (self.joined, self.instance)
        number = self.instance if self.joined[-1:].isalpha() else ""
        is_numbered = bool(number) or any(map(str.isdigit, self.joined))
        return (*keys, (self.joined + number, "written together")) if is_numbered else keys

    def is_same(self, other: Name) -> bool:
        """Tell whether two names are one but for case, articles, plural, spelling and accents.

        "Ash-tray" and "the ashtrays" are, "grey mug" and "gray mug", "mug_2" and "Mug 002", and
        "PS5" and "ps 5".
        Another number, letter or word is another name.
        """
        return not set(self.keys).isdisjoint(other.keys)


@lru_cache(maxsize=MOST_NAMES)
def _read_numbered(text: str) -> Name | None:
    """Read a name of plain words and a number, as most are: the words are read once for all."""
    base, _, number = text.rpartition(" ")
    is_number = number.isascii() and number.isdecimal()
    if not is_number or not is_spelled(base) or len(text) > MAX_LENGTH:
        return None
    before, ordered, joined = _order_base(base)
    instance = number.lstrip("0") or "0"
    return Name(text, text, (*before, number), base, instance, ordered, joined)


@lru_cache(maxsize=MOST_NAMES)
def _order_base(base: str) -> tuple[tuple[str, ...], tuple[str, ...], str]:
    """Return what stands before a number in `Name.key`, and the rest of what a base says."""
    plain = list_plain(base)
    unified = list(map(unify, plain))
    before = [] if SKIPPED.issuperset(plain) else plain  # of "the 2" that is all
    return order_words([*before, "1"])[:-1], order_words(unified), "".join(unified)


@lru_cache(maxsize=MOST_NAMES)
def _read(words: str, text: str) -> Name:
    base, instance = split_instance(text)
    _, ordered, joined = _order_base(base)
    return Name(text, words, order_words(list_plain(words)), base, instance, ordered, joined)
