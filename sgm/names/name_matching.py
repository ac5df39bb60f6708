"""Finds what a name may mean among descriptions: other words, more or fewer of them, and typos."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache, partial

from sgm.names.aliases import AliasTable
from sgm.names.comparison import (
    ALL_SAID,
    DOUBTFUL,
    LESS_SAID,
    OTHER_SAID,
    compare,
    is_doubtful,
    is_possible,
    is_written,
    rank,
)
from sgm.names.description_tables import DescriptionTables, Entry
from sgm.names.known_words import is_word
from sgm.names.modifiers import MATERIALS, PROPERTIES, is_sort_of, spell
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_grammar import NameReader, Reading
from sgm.names.resolution import MOST_ALTERNATIVES
from sgm.names.spelling import TypoIndex, find_slip, is_near, is_typo
from sgm.names.words import unify

# How alike two labels are, -1 to 1: cosine of their text vectors.
Similarity = Callable[[str, Sequence[str]], Sequence[float]]

SYNONYM = 0.9  # mug and cup .96, phone and telephone .93; plate and bowl .87 stay apart
RELATED = 0.8  # enough for a "did you mean"
_NOTHING: frozenset[str] = frozenset()
_LEAST_MENDED = 5  # letters
_MOST_SIBLINGS = 12  # of a kind, whose things are offered for one another


class NameMatcher:
    """Finds descriptions by rules, without looking through all of them.

    A name is read by `NameReader`: a thing, its properties, its owner and its number. The rules,
    tried one after the other until one finds something:

    1. The thing by any name of the table of aliases, and all kinds of it, with all properties that
       are asked for: "mug" is any mug, "red mug" any that is red, "mug 2" that one. What has the
       asked words in its name comes before what is only called so besides.
    2. The same with fewer words: "mug" for "the red mug", where no other colour is said. Else what
       has the name in its own: "scrubbing brush" for "brush", which the table has for the hair.
    3. A more general name: "phone" for "iphone".
    4. What has another property, and none that contradicts: "tall mug" for "teal mug".
    5. A part of the name that is no English word: "zorb" for "zorb charger".
    6. What it holds, or a remark in brackets: "cookies" for "cookie jar".
    7. A word that is no English one, of five letters or more, is read as an English one of the
       memory, if it is that with one slip (`is_typo`). What that is a synonym or kind of is not
       meant. Four letters do where the other words are those of a name (`find_slip`).
    8. Things that mean nearly the same by their text vectors, where one of the two is not in the
       table: with an encoder of one's own, or if the policy has vectors.

    A description of another owner or number is not meant, nor one of another colour, size, side or
    material. One that has no number or side, where the question has, is `doubtful`. A word that
    makes it another thing (`narrows`) is said by both or by none: a "soda can" is no "trash can".
    Where one of the two does not say it, the other is `doubtful`.
    """

    def __init__(
        self,
        tables: DescriptionTables,
        reader: NameReader,
        aliases: AliasTable,
        encoder: NameEncoder | None,
        nobodys: frozenset[str],
    ) -> None:
        """Find descriptions of tables, which are read by a reader of a table of aliases.

        `nobodys` are owners that name no person: "their". Without an encoder the similarity
        that `find_similar` is given is used.
        """
        self._tables, self._reader, self._aliases = tables, reader, aliases
        self._encoder, self._nobodys = encoder, nobodys

    def read_main(self, text: str) -> list[Reading]:
        """Return the readings of a name that say what it is, and not what it holds."""
        return [reading for reading in self._reader.read(text) if not reading.is_content]

    def match(self, readings: Sequence[Reading], text: str) -> tuple[str, list[list[int]]]:
        """Apply rules 1 to 6: how it was found, and the numbers of the descriptions by reading."""
        for how, rule in (
            ("", partial(self._choose, fit=ALL_SAID)),
            ("same words", partial(self._find_joined, text)),
            ("fewer words", partial(self._choose, fit=LESS_SAID)),
            ("any of the kind", self._find_compounds),
            ("more general name", self._find_above),
            ("another property", partial(self._choose, fit=OTHER_SAID)),
            ("part of the name", self._find_part),
            ("what it holds", self._find_contents),
        ):
            found = [group for reading in readings for group in rule(reading)]
            groups = _drop_repeated(found)
            if groups:
                return how or self._tell_how(readings, groups), groups
        return "", []

    def match_owned(self, readings: Sequence[Reading], text: str) -> list[int]:
        """Find what is a person's of the things of a name that does not say whose: "her phone"."""
        found = {n for group in self.match(_disown(readings), text)[1] for n in group}
        return [number for number in sorted(found) if self._tables.readings[number][0].owner]

    def match_written(self, readings: Sequence[Reading]) -> list[list[int]]:
        """Apply rules 1 and 2 to what has the asked words in its name."""
        for fit in (ALL_SAID, LESS_SAID):
            found = [
                [
                    number
                    for number in group
                    if any(reading.key in other.endings for other in self._tables.readings[number])
                ]
                for reading in readings
                for group in self._choose(reading, fit)
            ]
            groups = _drop_repeated(found)
            if groups:
                return groups
        return []

    def _tell_how(self, readings: Sequence[Reading], groups: Sequence[Sequence[int]]) -> str:
        """Say how rule 1 found descriptions."""
        numbers = [number for group in groups for number in group]
        main = [self._tables.readings[number][0] for number in numbers]
        if all(
            (reading.said, reading.instance) == (other.said, other.instance)
            for other in main
            for reading in readings
        ):
            return "same words"
        things = {thing for reading in readings for thing in reading.things}
        below = self._list_kinds(things)
        for number in numbers:
            others = self._tables.readings[number]
            has_words = any(
                reading.key in other.endings or reading.head_words <= other.said
                for reading in readings
                for other in others
            )
            if not has_words and not any(below & set(other.things) for other in others):
                return "synonym"
        return "any of the kind"

    def _choose(self, reading: Reading, fit: int) -> list[list[int]]:
        """Choose what says as much of the properties, for each thing that the name may be."""
        groups = [
            [
                entry
                for entry in self._list_entries(reading, thing)
                if compare(reading, entry[1]) == fit
            ]
            for thing in reading.things or (None,)
        ]
        # What is written so comes before what is only called so: a "purse" before a wallet.
        written = [[entry for entry in group if is_written(reading, entry[1])] for group in groups]
        is_exact = any(said.said == reading.said for group in written for _, said in group)
        if any(written) and (is_exact or len(reading.things) > 1):
            for place, exact in enumerate(written):
                kinds = self._list_kinds({thing for _, said in exact for thing in said.things})
                groups[place] = [
                    entry
                    for entry in groups[place]
                    if entry in exact or kinds & set(entry[1].things)
                ]
        most = max((rank(reading, said) for group in groups for _, said in group), default=None)
        groups = [[entry for entry in group if rank(reading, entry[1]) == most] for group in groups]
        return [sorted({number for number, _ in group}) for group in groups if group]

    def _list_kinds(self, things: Iterable[int]) -> set[int]:
        """List all kinds of things."""
        return {kind for thing in things for kind in self._aliases.list_below(thing)}

    def _list_entries(self, reading: Reading, thing: int | None) -> list[Entry]:
        """List what is called a thing or a kind of it; None: what ends in the same words."""
        if thing is None:
            ending = next((key for key in reading.endings if key in self._tables.endings), "")
            return self._tables.endings.get(ending, [])
        below = self._aliases.list_below(thing)
        found = [
            entry
            for kind in below
            for entry in self._tables.things.get(kind, ())
            if not self._is_named_after(entry[1], {thing, *below})
        ]
        called = self._tables.things.get(thing, ())
        is_sure = any(is_written(reading, said) or len(said.things) < 2 for _, said in called)
        if len(reading.things) == 1 and is_sure:
            # A "notebook" may be a laptop, and is none beside what is called so, or is one surely.
            called = [
                entry
                for entry in called
                if is_written(reading, entry[1]) or len(entry[1].things) < 2
            ]
        return [*called, *found]

    def _is_named_after(self, said: Reading, kinds: set[int]) -> bool:
        """Tell whether a description has the name of a thing that is none of some kinds.

        A tablet may be a pill, but is no medicine: it has the name of a computer.
        """
        head = " ".join(said.head)
        named = {thing for thing in said.things if self._aliases.names[thing] == head}
        return bool(named) and named.isdisjoint(kinds)

    def _find_joined(self, text: str, reading: Reading) -> list[list[int]]:
        """Find what is called the same, written apart or together: "fire lighters", "PS5"."""
        name = Name.read(text)
        whole = name.joined
        numbers = {number for key in name.keys for number in self._tables.same.find(key)}
        numbers |= {
            number
            for number, said in self._tables.endings.get(whole, ())
            if said.endings[0] == whole
            and is_possible(reading, said)
            and (said.instance or not reading.instance)
            and said.stem <= set(map(spell, said.words))  # no "cream of tartar"
        }
        return [sorted(numbers)] if numbers else []

    def _find_compounds(self, reading: Reading) -> list[list[int]]:
        """Find what has the name of a thing in its own, where none is so called by the table.

        That is of names that the table has for another thing: a "brush" for the hair, and a
        "scrubbing brush".
        """
        if not reading.things or len(reading.head) > 1 or not is_sort_of(_NOTHING, reading.key):
            return []
        return self._choose(reading._replace(things=()), ALL_SAID)

    def _find_above(self, reading: Reading) -> list[list[int]]:
        """Apply rule 3, to all that the name may be: no "medicine" for a tablet."""
        nearest = [
            next(filter(None, (self._find_kind(reading, kind) for kind in kinds)), None)
            for kinds in map(self._aliases.list_above, reading.things)
        ]
        return [] if None in nearest else [numbers for numbers in nearest if numbers]

    def _find_kind(self, reading: Reading, kind: int) -> list[int]:
        """Find what is called a kind, and is no sort of it."""
        found = [
            (number, said)
            for number, said in self._tables.things.get(kind, ())
            if compare(reading, said) in (ALL_SAID, LESS_SAID) and not self._is_sort_of(kind, said)
        ]
        sure = [number for number, said in found if len(said.things) < 2]  # no "notebook"
        return sure or [number for number, _ in found]

    def _is_sort_of(self, kind: int, said: Reading) -> bool:
        """Tell whether a description says a sort of a kind: "wool coat", "necktie" of "tie"."""
        name = self._aliases.names[kind].removesuffix("s")
        word = said.head[-1].removesuffix("s")
        is_longer = word != name and word.endswith(name)
        return is_longer or bool(said.sorts or said.properties & MATERIALS)

    def _find_part(self, reading: Reading) -> list[list[int]]:
        """Apply rule 5: names that have its words, where these name nothing that is known."""
        if reading.things or is_word(reading.head[-1]):
            return []
        numbers = self._find_holding(reading)
        return [numbers] if numbers else []

    def _find_holding(self, reading: Reading) -> list[int]:
        """Find the names that have all words of a reading, and no property against it."""
        holding = [set(self._tables.words.get(word, ())) for word in reading.said]
        found = set.intersection(*holding) if holding else set()
        return [
            number
            for number in sorted(found)
            if not reading.said <= set(self._tables.readings[number][0].owner.split())
            and any(is_possible(reading, other) for other in self._tables.readings[number])
        ]

    def _find_contents(self, reading: Reading) -> list[list[int]]:
        numbers = {
            number
            for thing in reading.things
            for meant in (thing, *self._aliases.list_below(thing))
            for number, other in self._tables.contents.get(meant, ())
            if compare(reading, other) == ALL_SAID
        }
        return [sorted(numbers)] if numbers else []

    def list_doubtful(self, readings: Sequence[Reading], text: str) -> list[int]:
        """List what may be meant, and may be another thing, the likeliest first."""
        found: list[int] = []
        for reading in readings:
            for thing in reading.things or (None,):
                entries = self._list_entries(reading, thing)
                found += [n for n, said in entries if compare(reading, said) == DOUBTFUL]
            for ending in reading.endings[-1:]:
                entries = self._tables.endings.get(ending, [])
                found += [n for n, said in entries if is_doubtful(reading, said)]
            if not reading.things:
                found += self._find_holding(reading)
        if readings[0].owner in self._nobodys:  # "their phone"
            found += [n for group in self.match(_disown(readings), text)[1] for n in group]
        if not is_word(readings[0].head[-1]):
            found += self.find_spelled(Name.read(text))
        return list(dict.fromkeys(found))

    def list_unsorted(self, readings: Sequence[Reading]) -> list[int]:
        """List what may be of the broad kind asked for, as it is of no kind of the table."""
        asked = (thing for reading in readings for thing in reading.things)
        if not any(map(self._aliases.is_broad, asked)):
            return []
        known = self._aliases.list_sorted()
        return [
            number
            for number, said in enumerate(self._tables.readings)
            if all(known.isdisjoint(reading.things) for reading in said)
        ]

    def find_spelled(self, asked: Name) -> list[int]:
        """Find what is spelled nearly alike; names that differ in a number are compared once."""
        alike = [numbers for name, numbers in self._tables.spelled.items() if is_near(asked, *name)]
        return sorted(number for numbers in alike for number in numbers)

    def mend(self, text: str) -> str:
        """Return a text with its typing errors mended; itself without any."""
        mended = " ".join(self._mend(word) for word in text.split())
        return self._mend_compound(text) if mended == text else mended

    def _mend_compound(self, text: str) -> str:
        """Mend a short word, too, where the others are those of one name: "frying pann"."""
        asked = Name.read(text)
        slips = {
            pair
            for ordered, _ in self._tables.spelled
            if (pair := find_slip(asked.ordered, ordered)) and self._is_unknown(pair[0])
        }
        if len(slips) != 1:
            return text
        ((slip, meant),) = slips
        return " ".join(meant if unify(word) == slip else word for word in text.split())

    def _is_unknown(self, word: str) -> bool:
        """Tell whether a word is none of the memory, of the table or of English."""
        spelled = spell(word)
        is_known = spelled in self._tables.words or spelled in self._aliases.words
        return word.isalpha() and not is_known and not is_word(word)

    def _mend(self, word: str) -> str:
        """Return the word of the memory that this one may be a typo of; itself if it is a word.

        Where it is none of the memory it may be one of a property, or of the table of names.
        """
        spelled = spell(word)
        if len(word) < _LEAST_MENDED or not self._is_unknown(word):
            return word
        said = (other for other in self._tables.words if other and is_typo(spelled, other))
        for found in (
            said,
            _index_typos(PROPERTIES).find(spelled),
            _index_table(self._aliases).find(spelled),
        ):
            near = [other for other in found if other.isalpha() and is_word(other)]
            if near:
                return near[0] if len(near) == 1 else word
        return word

    def find_similar(
        self, readings: Sequence[Reading], similarity: Similarity | None
    ) -> tuple[list[list[int]], list[list[int]]]:
        """Apply rule 8: groups of descriptions by their heads, the most similar first.

        Returns:
            Those that mean the same, and those that are related, these among them.
        """
        same, related = SYNONYM, RELATED
        if self._encoder is not None:
            similarity = self._encoder.compare
            same, related = self._encoder.thresholds
        if similarity is None:
            return [], []
        groups: dict[float, dict[int, None]] = {}
        for reading in readings:
            by_head = self._list_heads(reading)
            if by_head:
                values = similarity(" ".join(reading.head), list(by_head))
                for value, numbers in zip(values, by_head.values(), strict=True):
                    groups.setdefault(float(value), {}).update(dict.fromkeys(numbers))
        synonyms, others = [
            _drop_repeated(
                list(groups[value]) for value in sorted(groups, reverse=True) if value >= least
            )
            for least in (same, related)
        ]
        return synonyms, others

    def _list_heads(self, reading: Reading) -> dict[str, list[int]]:
        """List the descriptions that say all of a name but for its head, by their heads.

        One of the two is not in the table. Names that differ in their number are compared once.
        """
        by_head: dict[str, list[int]] = {}
        for numbers in self._tables.texts.values():
            said = self._tables.readings[numbers[0]][0]
            if reading.things and said.things:
                continue
            if reading.instance:
                firsts = ((number, self._tables.readings[number][0]) for number in numbers)
                numbers = [n for n, other in firsts if compare(reading, other) == ALL_SAID]
            elif compare(reading, said) != ALL_SAID:
                continue
            if numbers:
                by_head.setdefault(" ".join(said.head), []).extend(numbers)
        for numbers in by_head.values():
            numbers.sort()
        return dict(sorted(by_head.items(), key=lambda item: item[1][0]))

    def suggest(
        self, readings: Sequence[Reading], found: Sequence[int], related: Sequence[Sequence[int]]
    ) -> list[int]:
        """List what else may have been meant, the nearest first.

        The same with other properties, other things of its kinds, what has its name, and what means
        nearly the same.
        """
        close: list[int] = []
        for reading in readings:
            for thing in reading.things or (None,):
                close += [number for number, _ in self._list_entries(reading, thing)]
                if thing is not None:
                    near = self._aliases.list_siblings(thing, _MOST_SIBLINGS)
                    close += [
                        number
                        for akin in (*near, *self._aliases.list_above(thing))
                        for number, other in self._tables.things.get(akin, ())
                        if not found and not other.kinds - reading.said
                    ]
            if not found and len(reading.key) > 2:
                close += self._tables.words.get(spell(reading.head[-1]), ())
        for group in related:
            close += group
        others = [number for number in dict.fromkeys(close) if number not in found]
        return others[:MOST_ALTERNATIVES]


@lru_cache(maxsize=8)
def _index_typos(words: frozenset[str]) -> TypoIndex:
    """Return the index of words that do not change."""
    return TypoIndex(words)


@lru_cache(maxsize=8)
def _index_table(table: AliasTable) -> TypoIndex:
    """Return the index of the words of a table, which is never changed."""
    return TypoIndex(table.words)


def _drop_repeated(groups: Iterable[Iterable[int]]) -> list[list[int]]:
    """Leave every number in the first group that has it, and drop empty groups."""
    known: set[int] = set()
    kept = []
    for group in groups:
        new = [number for number in dict.fromkeys(group) if number not in known]
        known.update(new)
        kept += [new] if new else []
    return kept


def _disown(readings: Sequence[Reading]) -> list[Reading]:
    """Return readings of a name that does not say whose it is."""
    return [reading._replace(owner="") for reading in readings]
