"""What a name says: the thing, its properties, its owner, and what it holds."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

from sgm.names.aliases import AliasTable
from sgm.names.instances import split_instance, split_spoken, split_written_on
from sgm.names.known_words import is_word
from sgm.names.language import load_language
from sgm.names.modifiers import COLOURS, MATERIALS, PACKAGES, PROPERTIES, narrows, says_how, spell
from sgm.names.sections import load_grammar
from sgm.names.translation import Translation
from sgm.names.words import (
    BREAKS,
    DETERMINERS,
    FOR,
    LINKS,
    MOST_READ,
    OF,
    WITH,
    compute_singular,
    list_plain,
    make_key,
    split_possessives,
    split_words,
)

_GRAMMAR = load_grammar()
# "a pair of scissors" is scissors; "a box of cereal" is cereal, and a box.
_MEASURES, _SORTS = _GRAMMAR.list_words("measures"), _GRAMMAR.list_words("kinds of")
_CONTAINERS = _GRAMMAR.list_words("containers")
# Containers, and what is said after the thing: "banana bunch", "lego set".
_AFTER_THING = _CONTAINERS | _GRAMMAR.list_words("after a thing")
# "men's shoes" are a kind of shoes, and have no owner.
_NOBODY = _GRAMMAR.list_words("nobody")
_NO_REMARK = _GRAMMAR.list_words("remarks")
_VERB_ENDINGS = _GRAMMAR.read_pairs("verb endings")
_WITHOUT = LINKS["without"]
LACKED = "-"  # before a feature that a thing is without

_REMARK = re.compile(r"\(([^()]*)\)")
_OR = re.compile(r"\s*/\s*")
_LONGEST_ENDING = 3
_SHORTEST_VERB = 3  # letters: no "br" of "bring"
_Word = tuple[str, bool]  # and whether it is a possessive

# What is used up from a package, so that the package is the thing: a "cereal box", a "milk carton".
_PACKAGES = _GRAMMAR.list_words("packages")
_ALWAYS_PACKAGES = _GRAMMAR.list_words("always packages")
_CONSUMED_KINDS = frozenset(_GRAMMAR.list_phrases("used up kinds"))
_CONSUMED = _GRAMMAR.list_words("used up")
# "Milk can" and "water can" are vessels, that stand there empty, too.
_VESSELS_OF = _GRAMMAR.read_groups("vessels of")
# What a roll, set or bar is of: a "paper towel roll" is paper towels, an "egg roll" is no egg.
_COUNTED = _GRAMMAR.read_groups("counted")


_NONE: frozenset[str] = frozenset()


class Reading(NamedTuple):
    """One way to read a name.

    Attributes:
        things: numbers in the table of what it may be, none where no name of the table fits.
        words: what comes before "with" and the like, without the owner, in order.
        head: the last of them, the thing itself; one word where no name of the table fits.
        head_words: words of the head, as they are compared.
        properties: words before the head, as they are compared.
        kinds: those of `properties` that say which kind of thing it is, and not how it is, so that
            it may be another thing than its head says: "piano" of "piano bench".
        sorts: those of `properties` that name a sort of it, and not how this one is: "digital" of
            "digital clock", and all `kinds`.
        stem: all words before the last one that do as `kinds`, of a name of the table, too: "trash"
            of "trash can".
        stem_sorts: all words before the last one that do as `sorts`: "wall" of "wall clock".
        key: the head, written together in the singular.
        endings: its last words, three at most, written together in the singular, the longest first.
        owner: whose it is, empty if no owner is named.
        is_sort: whether the head says a sort of the thing that it is an alias of, as "dress shirt"
            of "shirt": other sorts are not meant.
        main_words: words of the names that the table has for the things first.
        is_content: whether it is what the thing holds, or a remark: "cereal" of "cereal box".
        head_before: the head without its last word: "leather" of the head "leather belt".
        features: what is said of it after "with" or "without": "blue stripe"; with `LACKED` before
            it where it is without it.
        said: all words of the name, as they are compared.
        packages: in what it is packed, or how it is shaped, where that is not its name: "soap
            bottle".
        instance: which of several, "2" of "mug_2"; empty if it has no number.
    """

    things: tuple[int, ...]
    words: tuple[str, ...]
    head: tuple[str, ...]
    head_words: frozenset[str]
    properties: frozenset[str]
    kinds: frozenset[str]
    sorts: frozenset[str]
    stem: frozenset[str]
    stem_sorts: frozenset[str]
    key: str
    endings: tuple[str, ...]
    owner: str
    is_sort: bool
    main_words: frozenset[str]
    is_content: bool
    head_before: frozenset[str]
    features: frozenset[str] = _NONE
    said: frozenset[str] = _NONE
    packages: frozenset[str] = _NONE
    instance: str = ""

    def number(self, instance: str) -> Reading:
        """Return the reading of the name with a number; what follows from its words is shared."""
        return self._replace(instance=instance)

    def with_said(self, said: frozenset[str]) -> Reading:
        """Return the reading of a name that says other words, too."""
        if said == self.said:
            return self
        packages = (said & PACKAGES) - (self.head_words & self.main_words) or _NONE
        return self._replace(said=said, packages=packages)


class _Head(NamedTuple):
    """What a thing is called without its properties; attributes as in `Reading`.

    Attributes:
        last: its last word, as it is compared.
        names: what it and the names of its things are compared by.
        before: its words without the last one.
        kinds: what the kinds of its things are compared by: "toy" of "doll".
    """

    words: frozenset[str]
    last: str
    key: str
    names: frozenset[str]
    main_words: frozenset[str]
    is_sort: bool
    before: frozenset[str]
    kinds: frozenset[str]


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
        translation = Translation(load_language(table.language), self.has_name)
        self.translate, self.write = translation.translate, translation.write
        self.read = lru_cache(maxsize=MOST_READ)(self._read)
        self._read_text = lru_cache(maxsize=MOST_READ)(self._read_words_of)
        self.spell = lru_cache(maxsize=20_000)(self._spell_by_table)
        self._read_head = lru_cache(maxsize=20_000)(self._read_head_of)
        # One set for all that are equal: most names say the same few properties.
        self._share: Callable[[frozenset[str]], frozenset[str]] = lru_cache(maxsize=20_000)(
            frozenset
        )

    def _read(self, name: str) -> tuple[Reading, ...]:
        """Return the readings of a name, the main ones first."""
        text, instance = self.split_number(name)
        readings = self._read_text(text)
        if instance:
            readings = tuple(reading.number(instance) for reading in readings)
        return readings

    def read_words(self, text: str) -> tuple[str, ...]:
        """Return the words of the first reading of a name, without the others.

        `text` is the name without its number.
        """
        return self._list_plain_words(text) or self._read_text(text)[0].words

    def find_things(self, text: str) -> tuple[int, ...]:
        """Return the things of the first reading of a name, without the others.

        Of plain words these are the longest name of the table that they end in, found for a tenth
        of the work. `text` is the name without its number.
        """
        plain = self._list_plain_words(text)
        if not plain:
            return self._read_text(text)[0].things
        return self._table.find(plain[self._find_start(plain) :])

    def has_name(self, text: str) -> bool:
        """Tell whether something is called so in the table."""
        return bool(self._table.find(split_words(text)))

    def split_number(self, name: str) -> tuple[str, str]:
        """Split a counter from a name, or else what is written on a thing or spoken for one."""
        base, instance = split_instance(self.translate(name))
        if not instance:
            base, instance = split_written_on(base, self._is_known)
        if instance:
            return base, instance
        text, mark = split_spoken(base, self._is_known)
        is_name = bool(mark) and bool(self._table.find(split_words(base)))  # "vitamin c"
        return (base, "") if is_name else (text, mark)

    def spell_out(self, name: str) -> str:
        """Return a name as the shipped table has it: "red mug" for "die rote Tasse"."""
        words = split_words(self.translate(name))
        start = self._find_start(words)
        things = self._table.find(words[start:])
        if len(things) != 1:
            return " ".join(words)
        return " ".join((*words[:start], self._table.names[things[0]]))

    def _list_plain_words(self, text: str) -> tuple[str, ...]:
        """Return the words of a name of which they are all there is to read; none of any other."""
        if not text.replace(" ", "").isalnum():
            return ()
        plain = split_words(text)
        is_all = BREAKS.isdisjoint(plain) and compute_singular(plain[-1]) not in _AFTER_THING
        return tuple(self._drop_kinds(plain)) if is_all else ()

    def _find_start(self, plain: Sequence[str]) -> int:
        """Return where the longest name of the table begins that words end in."""
        start = max(len(plain) - self._table.longest, 0)
        while start < len(plain) - 1 and not self._table.find(plain[start:]):
            start += 1
        return start

    def _read_words_of(self, text: str) -> tuple[Reading, ...]:
        """Return the readings of a name without its number."""
        remarks, unremarked = _REMARK.findall(text), _REMARK.sub(" ", text)
        if not unremarked.strip(" ?!.,;:/"):
            remarks, unremarked = [], text
        readings: list[Reading] = []
        parts = [(part, False) for part in _OR.split(unremarked)]
        remarks = [remark for remark in remarks if _is_name(remark)]
        for part, is_remark in (*parts, *((remark, True) for remark in remarks)):
            if part.strip():
                readings += self._read_phrase(split_possessives(part), is_remark)
        if all(reading.is_content for reading in readings):  # nothing but remarks, or no words
            readings = self._read_phrase(split_possessives(text), False)
        said = self._share(frozenset().union(*(reading.said for reading in readings)))
        whole = [reading.with_said(said) for reading in _drop_equal(readings)]
        return tuple(sorted(whole, key=lambda reading: reading.is_content))

    def _is_known(self, word: str) -> bool:
        return bool(self._table.find([word])) or is_word(word)

    def _read_phrase(self, words: list[_Word], is_content: bool) -> list[Reading]:
        while len(words) > 1 and words[0][0] in DETERMINERS:
            words = words[1:]
        plain = [word for word, _ in words]
        things = self._table.find(plain) if len(plain) <= self._table.longest else ()
        found = [self._make(words, len(words), things, is_content)] if things else []
        breaks = [place for place, word in enumerate(plain) if word in BREAKS and place > 0]
        if not breaks or breaks[0] == len(plain) - 1:
            found += self._read_compound(words, is_content)
        else:
            first = breaks[0]
            found += self._read_parts(words[:first], plain[first], words[first + 1 :], is_content)
        said = self._share(self._spell_all(list_plain(" ".join(plain))) - BREAKS)
        return _drop_equal([reading.with_said(said) for reading in found])

    def _read_parts(
        self, left: list[_Word], link: str, right: list[_Word], is_content: bool
    ) -> list[Reading]:
        """Read two parts with "of", "with" or the like between them."""
        last = compute_singular(left[-1][0])
        # A measure that is a thing, too: "ball of yarn"; a "set" is none.
        is_thing = bool(self._table.find([word for word, _ in left]))
        if link == OF and last in _SORTS and len(left) > 1:  # "sneaker (type of shoe)"
            remark = [
                reading._replace(is_content=True) for reading in self._read_phrase(right, True)
            ]
            return [*self._read_phrase(left[:-1], is_content), *remark]
        if link == OF and last in _MEASURES and not is_thing:
            return self._read_phrase(right, is_content)
        if link == OF and last in _CONTAINERS | _MEASURES:
            return [*self._read_phrase(right, is_content), *self._read_phrase(left, True)]
        readings = self._read_phrase(left, is_content)
        if link in (OF, FOR):  # "food for the dog" is dog food
            single = compute_singular(right[-1][0]), right[-1][1]
            for before in (right, [*right[:-1], single]):  # "brush for teeth" is a toothbrush
                turned = self._read_phrase([*before, *left], is_content)
                if len(turned[0].head) > len(readings[0].head):
                    return turned
        if link == OF:  # "cream of tartar" is no cream
            after_link = frozenset(map(self.spell, (word for word, _ in right))) - DETERMINERS
            readings = [_add_kinds(reading, after_link) for reading in readings]
        if link in WITH:
            features = frozenset(map(self.spell, (word for word, _ in right))) - DETERMINERS - WITH
            if link == _WITHOUT:
                features = frozenset(f"{LACKED}{word}" for word in features)
            readings = [
                reading._replace(features=reading.features | features) for reading in readings
            ]
        if link in WITH and link != _WITHOUT:
            readings += [
                reading._replace(is_content=True) for reading in self._read_phrase(right, True)
            ]
        return readings

    def _read_compound(self, words: list[_Word], is_content: bool) -> list[Reading]:
        """Read words without "of" and the like: the longest name of the table that they end in."""
        plain = [word for word, _ in words]
        plain = list(self._drop_kinds(plain))
        words = words[: len(plain)]
        start = self._find_start(plain)
        main = self._make(words, len(words) - start, self._table.find(plain[start:]), is_content)
        found = [main]
        if len(words) > 1 and compute_singular(plain[-1]) in _AFTER_THING:
            inner = self._read_phrase(words[:-1], True)[0]
            is_brand = not inner.things and not is_word(plain[-2])  # "pringles can"
            if (inner.things or is_brand) and spell(plain[-2]) not in MATERIALS | COLOURS:
                if not self._is_used_up(inner, compute_singular(plain[-1])):
                    return found
                if len(main.head) == 1 and not words[-2][1]:  # "cereal box" is both
                    found = [inner._replace(is_content=is_content), main]
                elif len(main.head) == len(words):  # a "pill bottle" is a thing, and may hold pills
                    found.append(inner)
        return found

    def _drop_kinds(self, plain: Sequence[str]) -> Sequence[str]:
        """Leave out the name of a kind after a thing of that kind: "ale" of "ale beer"."""
        start = self._find_start(plain)
        kinds = self._table.find(plain[start:]) if start else ()
        if not kinds:
            return plain
        things = self._table.find(plain[self._find_start(plain[:start]) : start])
        below = {thing for kind in kinds for thing in self._table.list_below(kind)}
        is_one = bool(things) and below.issuperset(things)
        return self._drop_kinds(plain[:start]) if is_one else plain

    def _is_used_up(self, inner: Reading, last: str) -> bool:
        """Tell whether a package or number of things is those things: no "guitar case" is."""
        word = spell(inner.head[-1])
        if not inner.things:
            return last in _PACKAGES and word.isalpha()
        if last in _COUNTED:
            return word in _COUNTED[last]
        if last in _AFTER_THING - _CONTAINERS or last in _ALWAYS_PACKAGES:
            return True
        if last not in _PACKAGES or word in _VESSELS_OF.get(last, ()):
            return False
        kinds = {
            self._table.names[n]
            for thing in inner.things
            for n in (thing, *self._table.list_above(thing))
        }
        words = {word, *(spell(name.split()[-1]) for name in kinds)}  # "pringles" are chips
        return not (words.isdisjoint(_CONSUMED) and kinds.isdisjoint(_CONSUMED_KINDS))

    def _make(
        self, words: list[_Word], length: int, things: tuple[int, ...], is_content: bool
    ) -> Reading:
        plain = [word for word, _ in words]
        start = len(words) - length
        owned = max(
            (n + 1 for n in range(start) if words[n][1] and words[n][0] not in _NOBODY), default=0
        )
        thing_words, ending = tuple(plain[owned:]), tuple(plain[start:])
        head = self._read_head(ending, things)
        properties, kinds, sorts = self._split_modifiers(
            plain[owned:start], (head.last, head.key), head.words | head.names | head.kinds
        )
        _, stem, stem_sorts = self._split_modifiers(
            plain[owned:-1], (head.last,), (head.names | head.kinds) - head.words
        )
        known = self._table.find(plain[:owned]) if owned else ()  # "dad" and "father" are one
        owner = self._table.names[known[0]] if known else " ".join(plain[:owned])
        most = min(_LONGEST_ENDING, len(thing_words))
        endings = tuple([make_key(thing_words[-length:]) for length in range(most, 0, -1)])
        return Reading(
            things=things,
            words=thing_words,
            head=ending,
            head_words=head.words,
            properties=properties,
            kinds=kinds,
            sorts=sorts,
            stem=stem,
            stem_sorts=stem_sorts,
            key=head.key,
            endings=endings,
            owner=owner,
            is_sort=head.is_sort,
            main_words=head.main_words,
            is_content=is_content,
            head_before=head.before,
        )

    def _read_head_of(self, ending: tuple[str, ...], things: tuple[int, ...]) -> _Head:
        """Read the words that say what a thing is, and the names of the things that it may be."""
        words, last, key = self._spell_all(ending), spell(ending[-1]), make_key(ending)
        names = [split_words(self._table.names[thing]) for thing in things]
        is_sort = False
        if (
            len(things) == 1 and len(ending) > 1 and BREAKS.isdisjoint(ending)
        ):  # "dress shirt" is a "shirt" by the table
            name = self._table.names[things[0]]
            is_sort = " " not in name and make_key([name]) == make_key(ending[-1:])
        main_words = frozenset(spell(word) for name in names for word in name)
        compared_by = frozenset((key, *map(make_key, names)))
        return _Head(
            words=words,
            last=last,
            key=key,
            names=compared_by,
            main_words=main_words,
            is_sort=is_sort,
            before=words - {last},
            kinds=frozenset(
                make_key(split_words(self._table.names[kind]))
                for thing in things
                for kind in self._table.list_above(thing)
            ),
        )

    def _split_modifiers(
        self, words: list[str], heads: tuple[str, ...], repeated: frozenset[str] | set[str]
    ) -> tuple[frozenset[str], frozenset[str], frozenset[str]]:
        """Return words before a head as they are compared, and which are its kinds and sorts."""
        if not words:
            return _NONE, _NONE, _NONE
        properties, kinds, sorts, start = set(), set(), set(), 0
        while start < len(words):
            length = min(len(words) - start, self._table.longest)
            while length > 1 and len(self._table.find(words[start : start + length])) != 1:
                length -= 1
            phrase = words[start : start + length]
            start += length
            spelled = self._spell_before(phrase[0]) if length == 1 else self._key_phrase(phrase)
            properties.add(spelled)
            if spelled in repeated:
                continue
            word = spell(phrase[0]) if length == 1 else spelled
            if not narrows(word, heads):
                kinds.add(spelled)
            if not says_how(word):
                sorts.add(spelled)
        found = (frozenset(properties), frozenset(kinds), frozenset(kinds | sorts))
        said, makes_other, is_sort = map(self._share, found)
        return said, makes_other, is_sort

    def _key_phrase(self, words: list[str]) -> str:
        return make_key(split_words(self._table.names[self._table.find(words)[0]]))

    def _spell_by_table(self, word: str) -> str:
        """Return a word as it is compared: "telly" and "tv" are one, as the table has them."""
        spelled = spell(word)
        things = () if spelled in PROPERTIES else self._table.find([word])
        return self._key_phrase([word]) if len(things) == 1 else spelled

    def list_spellings(self, word: str) -> tuple[str, ...]:
        """List how a word of a name may stand among those that are compared."""
        return spell(word), self.spell(word), self._spell_before(word)

    def _spell_before(self, word: str) -> str:
        """Return a word before a thing as it is compared: "snorkelling" and "snorkel" are one."""
        spelled = self.spell(word)
        is_free = spelled not in PROPERTIES and not self._table.find([word])
        return _drop_ing(spelled) if is_free else spelled

    def _spell_all(self, words: Sequence[str]) -> frozenset[str]:
        """Return words that end in a thing as they are compared."""
        return frozenset((*map(self._spell_before, words[:-1]), *map(self.spell, words[-1:])))


@lru_cache(maxsize=16)  # most memories have the same table
def make_reader(table: AliasTable) -> NameReader:
    """Return the reader of a table, which remembers what it has read."""
    return NameReader(table)


def is_measure(word: str) -> bool:
    """Tell whether a word before "of" says how much: "pair of scissors", "tin of tuna"."""
    return compute_singular(word) in _MEASURES | _CONTAINERS


def _drop_ing(word: str) -> str:
    """Return the verb of a word, "bake" of "baking"; itself if there is none."""
    for ending, instead in _VERB_ENDINGS.items():
        stem = word.removesuffix(ending)
        if stem != word and len(stem) >= _SHORTEST_VERB:
            verbs = stem, f"{stem}{instead}", stem[:-1] * (stem[-1] == stem[-2])
            return next(filter(is_word, verbs), word)
    return word


def _drop_equal(readings: list[Reading]) -> list[Reading]:
    """Leave each reading once; most names have one, which is compared with none."""
    return list(dict.fromkeys(readings)) if len(readings) > 1 else readings


def _add_kinds(reading: Reading, words: frozenset[str]) -> Reading:
    """Return a reading of a thing of a kind that more words say."""
    return reading._replace(
        kinds=reading.kinds | words,
        sorts=reading.sorts | words,
        stem=reading.stem | words,
        stem_sorts=reading.stem_sorts | words,
    )


def _is_name(remark: str) -> bool:
    """Tell whether a remark in brackets is a name: no "sticky cloth or paper", "for horses"."""
    words = split_words(remark)
    return _NO_REMARK.isdisjoint(words)
