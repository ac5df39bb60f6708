"""What a name says: the thing, its properties, its owner, and what it holds."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

from sgm.names.aliases import AliasTable
from sgm.names.words import (
    DETERMINERS,
    compute_singular,
    make_key,
    split_possessives,
    split_words,
)

# "a pair of scissors" is scissors; "a box of cereal" is cereal, and a box.
_MEASURES = frozenset(
    "pair piece slice stack loaf bar ball bunch set pile sheet clove head stick bit lump cube kind "
    "type sort handful couple lot number amount deck spool skein strip block rasher portion load "
    "roll row heap group collection selection".split()
)
_CONTAINERS = frozenset(
    "glass box bottle can tin jar bag carton pack packet package tube cup mug bowl pot basket jug "
    "pitcher bucket tray crate case sack pouch bin tub canister container dispenser sachet plate "
    "dish vase pan kettle carafe thermos flask barrel keg punnet".split()
)
# Containers, and what is said after the thing: "banana bunch", "lego set".
_AFTER_THING = _CONTAINERS | frozenset(("set", "bunch", "pile", "stack", "pair", "roll", "bar"))
# "men's shoes" are a kind of shoes, and have no owner.
_NOBODY = frozenset(
    "man men woman women lady ladies gentleman kid kids child children boy boys girl girls".split()
)
_WITH = frozenset(("with", "without", "containing", "having", "w"))
_MADE = frozenset(("in", "from", "made", "like", "by"))
_AT = frozenset("on under near beside behind next at inside above below off".split())  # a place
_FOR = frozenset(("for",))
_BREAKS = frozenset(("of",)) | _WITH | _MADE | _AT | _FOR

_LONGEST_ENDING = 3
_Word = tuple[str, bool]  # and whether it is a possessive

_SPELLINGS = {
    "grey": "gray", "striped": "stripe", "stripy": "stripe", "stripey": "stripe", "wooden": "wood",
    "woollen": "wool", "woolen": "wool", "dotted": "dot", "spotted": "dot", "spotty": "dot",
    "checked": "check", "checkered": "check", "chequered": "check", "golden": "gold",
    "tiny": "small", "little": "small", "mini": "small", "big": "large", "huge": "large",
    "flowery": "flower",
    "floral": "flower", "flowered": "flower", "coloured": "color", "colored": "color",
    "colour": "color", "tall": "large", "steel": "metal", "colorful": "color", "colourful": "color",
}  # fmt: skip
# Properties that shut one another out: what is red is not blue, unless it is said to be both.
_COLOURS = frozenset(
    "red blue green yellow black white brown gray orange purple pink beige turquoise violet navy "
    "silver gold cream transparent clear teal maroon".split()
)
_MATERIALS = frozenset(
    "wood plastic glass metal leather paper ceramic cotton wool stone rubber cardboard porcelain "
    "denim canvas marble bamboo stainless silicone silk linen iron wicker".split()
)
_SIZES = frozenset(("small", "large"))
_CLASSES = (_COLOURS, _MATERIALS, _SIZES)
_PROPERTIES = frozenset().union(*_CLASSES) | {
    "stripe", "dot", "check", "color", "flower", "new", "old", "clean", "dirty", "favorite",
    "favourite", "good", "nice", "round", "square", "long", "short", "empty", "full", "open",
    "closed", "used", "second", "first", "other", "spare", "broken", "dark", "light", "bright",
    "cast", "heavy", "soft", "fluffy", "cute", "beautiful", "bloody", "stupid", "damn", "lovely",
}  # fmt: skip


@dataclass(frozen=True)
class Reading:
    """One way to read a name.

    Attributes:
        things: numbers in the table of what it may be, none where no name of the table fits.
        words: what comes before "with" and the like, without the owner, in order.
        head: the last of them, the thing itself; one word where no name of the table fits.
        head_words: words of the head, as they are compared.
        properties: words before the head, as they are compared.
        said: all words of the name, as they are compared.
        owner: whose it is, empty if no owner is named.
        is_content: whether it is what the thing holds, or a remark: "cereal" of "cereal box".
    """

    things: tuple[int, ...]
    words: tuple[str, ...]
    head: tuple[str, ...]
    head_words: frozenset[str]
    properties: frozenset[str]
    said: frozenset[str]
    owner: str = ""
    is_content: bool = False

    @cached_property
    def key(self) -> str:
        """The head, written together in the singular."""
        return make_key(self.head)

    @cached_property
    def endings(self) -> tuple[str, ...]:
        """Its last words, three at most, written together in the singular, the longest first."""
        most = min(_LONGEST_ENDING, len(self.words))
        return tuple(make_key(self.words[-length:]) for length in range(most, 0, -1))


class NameReader:
    """Reads names by a grammar of what detectors and people say.

    - "coffee mug with blue stripes": the head comes before "with", "in", "from" and "on".
    - "pair of scissors", "box of cereal": after "of", if a measure or a container comes before it.
    - "dog food", "food for the dog": the longest name of the table that the words end in.
    - "dad's phone": the owner, unless the table has the whole name ("children's book").
    - "cereal box", "crisp (potato chip)": what is held, and remarks, are further readings.
    """

    def __init__(self, table: AliasTable) -> None:
        """Read by the names of a table."""
        self._table = table
        self.read = lru_cache(maxsize=20_000)(self._read)
        self._spell = lru_cache(maxsize=20_000)(self._spell_by_table)

    def _read(self, name: str) -> tuple[Reading, ...]:
        """Return the readings of a name, the main ones first."""
        text = name.replace("_", " ")
        remarks = re.findall(r"\(([^()]*)\)", text)
        rest = re.sub(r"\([^()]*\)", " ", text)
        if not rest.strip(" ?!.,;:/"):
            remarks, rest = [], text
        readings: dict[Reading, None] = {}
        parts = [(part, False) for part in re.split(r"\s*/\s*", rest)]
        for part, is_remark in (*parts, *((remark, True) for remark in remarks)):
            if part.strip():
                readings |= dict.fromkeys(self._read_phrase(split_possessives(part), is_remark))
        if all(reading.is_content for reading in readings):  # nothing but remarks, or no words
            readings = dict.fromkeys(self._read_phrase(split_possessives(text), False))
        said = frozenset(word for reading in readings for word in reading.said)
        whole = [replace(reading, said=said) for reading in readings]
        return tuple(sorted(whole, key=lambda reading: reading.is_content))

    def _read_phrase(self, words: list[_Word], is_content: bool) -> list[Reading]:
        while len(words) > 1 and words[0][0] in DETERMINERS:
            words = words[1:]
        plain = [word for word, _ in words]
        things = self._table.find(plain) if len(plain) <= self._table.longest else ()
        found = [self._make(words, len(words), things, is_content)] if things else []
        breaks = [place for place, word in enumerate(plain) if word in _BREAKS and place > 0]
        if not breaks or breaks[0] == len(plain) - 1:
            found += self._read_compound(words, is_content)
        else:
            first = breaks[0]
            found += self._read_parts(words[:first], plain[first], words[first + 1 :], is_content)
        said = frozenset(map(self._spell, plain)) - _BREAKS - DETERMINERS
        return list(dict.fromkeys(replace(reading, said=said) for reading in found))

    def _read_parts(
        self, left: list[_Word], link: str, right: list[_Word], is_content: bool
    ) -> list[Reading]:
        """Read two parts with "of", "with" or the like between them."""
        last = compute_singular(left[-1][0])
        # A measure that is a thing, too: "ball of yarn"; a "set" is none.
        is_thing = bool(self._table.find([word for word, _ in left]))
        if link == "of" and last in _MEASURES and not is_thing:
            return self._read_phrase(right, is_content)
        if link == "of" and last in _CONTAINERS | _MEASURES:
            return [*self._read_phrase(right, is_content), *self._read_phrase(left, True)]
        own = self._read_phrase(left, is_content)
        if link == "of" or link in _FOR:  # "food for the dog" is dog food
            turned = self._read_phrase([*right, *left], is_content)
            if len(turned[0].head) > len(own[0].head):
                return turned
        if link in _WITH and link != "without":
            own += [replace(one, is_content=True) for one in self._read_phrase(right, True)]
        return own

    def _read_compound(self, words: list[_Word], is_content: bool) -> list[Reading]:
        """Read words without "of" and the like: the longest name of the table that they end in."""
        plain = [word for word, _ in words]
        start = max(len(words) - self._table.longest, 0)
        while start < len(words) - 1 and not self._table.find(plain[start:]):
            start += 1
        main = self._make(words, len(words) - start, self._table.find(plain[start:]), is_content)
        found = [main]
        if len(words) > 1 and compute_singular(plain[-1]) in _AFTER_THING:
            inner = self._read_phrase(words[:-1], True)[0]
            if inner.things and plain[-2] not in _MATERIALS | _COLOURS:
                if len(main.head) == 1 and not words[-2][1]:  # "cereal box" is both
                    found = [replace(inner, is_content=is_content), main]
                elif len(main.head) == len(words):  # a "lunch box" is no lunch, but may hold it
                    found.append(inner)
        return found

    def _make(
        self, words: list[_Word], length: int, things: tuple[int, ...], is_content: bool
    ) -> Reading:
        plain = [word for word, _ in words]
        start = len(words) - length
        owned = max(
            (n + 1 for n in range(start) if words[n][1] and words[n][0] not in _NOBODY), default=0
        )
        head = frozenset(map(self._spell, plain[start:]))
        properties = frozenset(map(self._spell, plain[owned:start])) - DETERMINERS - _NOBODY
        own, ending = tuple(plain[owned:]), tuple(plain[start:])
        known = self._table.find(plain[:owned]) if owned else ()  # "dad" and "father" are one
        owner = self._table.names[known[0]] if known else " ".join(plain[:owned])
        return Reading(things, own, ending, head, properties, frozenset(), owner, is_content)

    def _spell_by_table(self, word: str) -> str:
        """Return a word as it is compared: "telly" and "tv" are one, as the table has them."""
        spelled = spell(word)
        things = () if spelled in _PROPERTIES else self._table.find([word])
        return make_key(split_words(self._table.names[things[0]])) if len(things) == 1 else spelled


@lru_cache(maxsize=16)  # most memories have the same table
def make_reader(table: AliasTable) -> NameReader:
    """Return the reader of a table, which remembers what it has read."""
    return NameReader(table)


def spell(word: str) -> str:
    """Return a word as it is compared: singular, and properties in one spelling."""
    word = _SPELLINGS.get(word, word)
    word = compute_singular(word)
    return _SPELLINGS.get(word, word)


def is_property(word: str) -> bool:
    """Tell whether a word, as it is compared, says how a thing is, and not which kind it is."""
    return word in _PROPERTIES or word.endswith(("ed", "ly", "ful", "less", "ish"))


def contradict(asked: frozenset[str], said: frozenset[str]) -> bool:
    """Tell whether properties that are asked for shut out those of a name: red, and blue."""
    return any(asked & group and said & group and not asked & said & group for group in _CLASSES)
