"""What a question names: other words, more or fewer of them, and typos."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

from sgm.names.aliases import AliasTable
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_grammar import Reading, contradict, is_property, make_reader, spell
from sgm.names.words import read_words, split_words, strip_question

# How alike two labels are, -1 to 1: cosine of their text vectors.
Similarity = Callable[[str, Sequence[str]], Sequence[float]]

SYNONYM = 0.9  # mug and cup .96, phone and telephone .93; plate and bowl .87 stay apart
RELATED = 0.8  # enough for a "did you mean"
_MOST_ALTERNATIVES = 3
_MOST_RESOLVED = 2000  # questions whose answers are kept
_MOST_SIBLINGS = 12  # of a kind, whose things are offered for one another

_Entry = tuple[int, Reading]  # number of a description, and one way to read it


@dataclass(frozen=True, slots=True)
class Resolution:
    """What a question was taken for.

    Attributes:
        question: as it was asked.
        matches: descriptions of the memory that it may mean, in the order in which they came up; a
            thing is found when one of them is. Empty where the memory has nothing of that name.
        how: "exact"; "same words" (but for articles, case, order, plural); "any of the kind" (the
            question says less than the descriptions); "synonym"; "fewer words" (the descriptions
            say less than the question); "more general name"; "part of the name"; "what it holds";
            "typo"; "similar meaning" (by text vectors); or "unknown".
        alternatives: other descriptions that may have been meant, the nearest first.
        readings: the matches by what the name may mean: eyeglasses, and drinking glasses.
        owner: whose it is, by the question: "dad" of "dad's phone"; empty if it names no owner.
    """

    question: str
    matches: tuple[str, ...]
    how: str
    alternatives: tuple[str, ...] = ()
    readings: tuple[tuple[str, ...], ...] = ()
    owner: str = ""

    @property
    def is_ambiguous(self) -> bool:
        """Whether the name means different things that are about as likely; see `ask_back`."""
        return len(self.readings) > 1

    @property
    def ask_back(self) -> str:
        """What to ask the user, "Do you mean the eyeglasses or the wine glass?"; else empty."""
        if not self.is_ambiguous:
            return ""
        return f"Do you mean {' or '.join(f'the {_list(names)}' for names in self.readings)}?"

    def __str__(self) -> str:
        """Say it in one line."""
        line = self.question
        if self.how == "exact":
            return line
        if self.how != "unknown":
            line += f" (taken for {_list(self.matches)}: {self.how})"
        if self.is_ambiguous:
            line += f" ({self.ask_back})"
        if self.alternatives:
            line += f" (did you mean {_list(self.alternatives)}?)"
        return line


class NameIndex:
    """Finds the descriptions that a question names, without looking through all of them.

    What people say around a name is taken off ("where is my ...?", articles, case, punctuation),
    and it is read by `NameReader`: a thing, its properties and its owner. The rules, tried one
    after the other until one finds something:

    1. The thing by any name of the table of aliases, and all kinds of it, with all properties that
       are asked for: "mug" is any mug, "red mug" any that is red. What has the asked words in its
       name comes before what is only called so besides.
    2. The same with fewer words: "mug" for "the red mug", where no other colour is said.
    3. A more general name: "phone" for "iphone".
    4. A part of the name: "remote" for "remote control".
    5. What it holds, or a remark in brackets: "cookies" for "cookie jar".
    6. A word that nothing is called, of five letters or more, with one letter wrong, missing, too
       many or two in the wrong order (two mistakes from nine letters on), is read as a known one.
    7. Things that mean nearly the same by their text vectors, where one of the two is not in the
       table: with an encoder of one's own, or if the policy has vectors.

    A description of another owner is not meant, nor one of another colour, size or material.
    """

    def __init__(
        self,
        types: Iterable[str] = (),
        table: AliasTable | None = None,
        encoder: NameEncoder | None = None,
    ) -> None:
        """Start without descriptions.

        `types` are labels of object types that the prior knows. Without an encoder the similarity
        that `resolve` is given is used.
        """
        self._table = _add_types(table or AliasTable(), tuple(types))
        self._reader = make_reader(self._table)
        self._encoder = encoder
        self._clear()

    def _clear(self) -> None:
        self._descriptions: list[str] = []
        self._readings: list[tuple[Reading, ...]] = []
        self._written: set[str] = set()
        self._words: dict[str, list[int]] = {}
        self._things: dict[int, list[_Entry]] = {}
        self._contents: dict[int, list[_Entry]] = {}
        self._endings: dict[str, list[_Entry]] = {}
        self._resolved: dict[str, Resolution] = {}

    def update(self, descriptions: Sequence[str]) -> None:
        """Take over the descriptions of a memory; only those that are new cost anything."""
        known = len(self._descriptions)
        if list(descriptions[:known]) != self._descriptions:  # some were removed
            self._clear()
            known = 0
        for description in descriptions[known:]:
            self._add(description)

    def _add(self, description: str) -> None:
        self._resolved.clear()
        number = len(self._descriptions)
        readings = self._reader.read(read_words("description", description))
        self._descriptions.append(description)
        self._readings.append(readings)
        self._written.add(read_words("description", description))
        for word in readings[0].said.union(map(spell, split_words(description))):
            self._words.setdefault(word, []).append(number)
        for reading in readings:
            entry = number, reading
            for thing in reading.things:
                by_thing = self._contents if reading.is_content else self._things
                by_thing.setdefault(thing, []).append(entry)
            if not reading.is_content:
                for ending in reading.endings:
                    self._endings.setdefault(ending, []).append(entry)

    def resolve(self, question: str, similarity: Similarity | None = None) -> Resolution:
        """Say what a question means, such as "the red mugs"; see `SceneGraphMemory.resolve`."""
        if question in self._resolved:
            return self._resolved[question]
        words = read_words("description", question)
        text = words if words in self._written else strip_question(words)
        readings = self._read_main(text)
        how, groups = self._match(readings)
        if not groups:
            mended = " ".join(self._mend(word) for word in text.split())
            if mended != text:
                _, groups = self._match(self._read_main(mended))
                how = "typo"
        is_by_words = bool(groups)
        if not groups:
            how, groups = "similar meaning", self._find_similar(readings, similarity, SYNONYM)
        found = sorted({number for group in groups for number in group})
        others = self._suggest(readings, None if found else similarity, found)
        if not found:
            return Resolution(question, (), "unknown", others, owner=readings[0].owner)
        if len(found) == 1 and self._descriptions[found[0]].casefold() == words:
            how = "exact"
        meanings = tuple(self._name(group) for group in groups)
        names, owner = self._name(found), readings[0].owner
        resolution = Resolution(question, names, how, others, meanings, owner)
        if is_by_words:  # for any way to compare names: it says the same until there are others
            if len(self._resolved) >= _MOST_RESOLVED:
                self._resolved.clear()
            self._resolved[question] = resolution
        return resolution

    def _name(self, numbers: Iterable[int]) -> tuple[str, ...]:
        return tuple(self._descriptions[number] for number in numbers)

    def _read_main(self, text: str) -> list[Reading]:
        return [reading for reading in self._reader.read(text) if not reading.is_content]

    def _match(self, readings: Sequence[Reading]) -> tuple[str, list[list[int]]]:
        """Apply rules 1 to 5: how it was found, and the numbers of the descriptions by reading."""
        for how, rule in (
            ("", partial(self._choose, fit=_ALL_SAID)),
            ("fewer words", partial(self._choose, fit=_LESS_SAID)),
            ("more general name", self._find_above),
            ("part of the name", self._find_part),
            ("what it holds", self._find_contents),
        ):
            found = [group for reading in readings for group in rule(reading)]
            groups = _drop_repeated(found)
            if groups:
                return how or self._tell_how(readings, groups), groups
        return "", []

    def _tell_how(self, readings: Sequence[Reading], groups: Sequence[Sequence[int]]) -> str:
        """Say how rule 1 found descriptions."""
        numbers = [number for group in groups for number in group]
        said = [self._readings[number][0].said for number in numbers]
        if all(reading.said == words for words in said for reading in readings):
            return "same words"
        things = {thing for reading in readings for thing in reading.things}
        heads = [self._readings[number][0].head for number in numbers]
        if not things and all(len(head) > len(readings[0].head) for head in heads):
            return "part of the name"
        below = self._list_kinds(things)
        for number in numbers:
            own = self._readings[number]
            has_words = any(
                reading.key in other.endings or reading.head_words <= other.said
                for reading in readings for other in own
            )  # fmt: skip
            if not has_words and not any(below & set(other.things) for other in own):
                return "synonym"
        return "any of the kind"

    def _choose(self, reading: Reading, fit: int) -> list[list[int]]:
        """Choose what says as much of the properties, for each thing that the name may be."""
        groups = [
            [one for one in self._list_entries(reading, thing) if _compare(reading, one[1]) == fit]
            for thing in reading.things or (None,)
        ]
        # What is written so comes before what is only called so: a "purse" before a wallet.
        written = [[one for one in group if _is_written(reading, one[1])] for group in groups]
        is_exact = any(one.said == reading.said for group in written for _, one in group)
        if any(written) and (is_exact or len(reading.things) > 1):
            for place, own in enumerate(written):
                things = {thing for _, one in own for thing in one.things}
                kinds = self._list_kinds(things)
                groups[place] = [
                    one for one in groups[place] if one in own or kinds & set(one[1].things)
                ]
        most = max((_rank(reading, one) for group in groups for _, one in group), default=None)
        groups = [[one for one in group if _rank(reading, one[1]) == most] for group in groups]
        return [sorted({number for number, _ in group}) for group in groups if group]

    def _list_kinds(self, things: Iterable[int]) -> set[int]:
        """List all kinds of things."""
        return {kind for thing in things for kind in self._table.list_below(thing)}

    def _list_entries(self, reading: Reading, thing: int | None) -> list[_Entry]:
        """List what is called a thing or a kind of it; None: what ends in the same words."""
        if thing is None:
            ending = next((key for key in reading.endings if key in self._endings), "")
            return self._endings.get(ending, [])
        own = (thing, *self._table.list_below(thing))
        return [entry for one in own for entry in self._things.get(one, ())]

    def _find_above(self, reading: Reading) -> list[list[int]]:
        groups = []
        for thing in reading.things:
            for kind in self._table.list_above(thing):
                numbers = {
                    number
                    for number, one in self._things.get(kind, ())
                    if _compare(reading, one) is not None and not _list_more(one, reading)
                }
                if numbers:
                    groups.append(sorted(numbers))
                    break
        return groups

    def _find_part(self, reading: Reading) -> list[list[int]]:
        """Apply rule 4: names that end in it, or have its words where no table knows it."""
        num_whole = len(reading.endings) - len(reading.head) + 1  # no "dog" of hot dog
        whole = reading.endings[:num_whole]
        ending = next((key for key in whole if key in self._endings), "")
        entries = self._endings.get(ending, [])
        numbers = {number for number, one in entries if _compare(reading, one) is not None}
        if not numbers and not reading.things:
            holding = [set(self._words.get(word, ())) for word in reading.said]
            numbers = set.intersection(*holding) if holding else set()
        return [sorted(numbers)] if numbers else []

    def _find_contents(self, reading: Reading) -> list[list[int]]:
        numbers = {
            number
            for thing in reading.things
            for one in (thing, *self._table.list_below(thing))
            for number, other in self._contents.get(one, ())
            if _compare(reading, other) == _ALL_SAID
        }
        return [sorted(numbers)] if numbers else []

    def _mend(self, word: str) -> str:
        """Return the known word that this one may be a typo of: of the memory, else the table."""
        most = 0 if len(word) < 5 else 1 if len(word) < 9 else 2
        spelled = spell(word)
        is_known = spelled in self._words or spelled in self._table.words
        if most == 0 or not word.isalpha() or is_known:
            return word
        letters = set(word)
        for known in (self._words, self._table.words):
            near = [
                (distance, other)
                for other in known
                if abs(len(other) - len(word)) <= most
                and len(letters.difference(other)) <= most  # a mistake takes one away at most
                and (distance := count_mistakes(word, other)) <= most
            ]
            if near:
                return min(near)[1]
        return word

    def _find_similar(
        self, readings: Sequence[Reading], similarity: Similarity | None, least: float
    ) -> list[list[int]]:
        """Apply rule 7: groups of descriptions by their heads, the most similar first."""
        if self._encoder is not None:
            similarity = self._encoder.compare
            same, related = self._encoder.thresholds
            least = same if least == SYNONYM else related
        if similarity is None:
            return []
        groups: dict[float, dict[int, None]] = {}
        for reading in readings:
            by_head: dict[str, list[int]] = {}
            for number, others in enumerate(self._readings):
                one = others[0]
                if not (reading.things and one.things) and _compare(reading, one) == _ALL_SAID:
                    by_head.setdefault(" ".join(one.head), []).append(number)
            if by_head:
                values = similarity(" ".join(reading.head), list(by_head))
                for value, numbers in zip(values, by_head.values(), strict=True):
                    if value >= least:
                        groups.setdefault(-float(value), {}).update(dict.fromkeys(numbers))
        return _drop_repeated([list(groups[value]) for value in sorted(groups)])

    def _suggest(
        self, readings: Sequence[Reading], similarity: Similarity | None, found: Sequence[int]
    ) -> tuple[str, ...]:
        """Return what else may have been meant, the nearest first.

        The same with other properties, other things of its kinds, and what has its name.
        """
        close: list[int] = []
        for reading in readings:
            for thing in reading.things or (None,):
                close += [number for number, _ in self._list_entries(reading, thing)]
                if thing is not None:
                    near = self._table.list_siblings(thing, _MOST_SIBLINGS)
                    close += [
                        number
                        for one in (*near, *self._table.list_above(thing))
                        for number, other in self._things.get(one, ())
                        if not found and not _list_more(other, reading)
                    ]
            if not found and len(reading.key) > 2:
                close += self._words.get(spell(reading.head[-1]), ())
        if not found:
            for group in self._find_similar(readings, similarity, RELATED):
                close += group
        rest = [number for number in dict.fromkeys(close) if number not in found]
        return self._name(rest[:_MOST_ALTERNATIVES])


@lru_cache(maxsize=8)  # all memories of one prior have the same
def _add_types(table: AliasTable, types: tuple[str, ...]) -> AliasTable:
    """Add types that the table does not have; a "soap bottle" is none: it is soap, and a bottle."""
    reader = make_reader(table)
    return table.with_names(label for label in types if len(reader.read(label)) < 2)


_ALL_SAID, _LESS_SAID = 1, 2


def _compare(asked: Reading, said: Reading) -> int | None:
    """Tell whether a name says all properties asked for, or fewer; None if it is another thing."""
    if asked.owner and said.owner not in ("", asked.owner):
        return None
    if contradict(asked.said - asked.head_words, said.said - said.head_words):
        return None
    missing = asked.properties - said.said
    is_owned = not asked.owner or said.owner or asked.owner in said.said
    if _list_more(said, asked) and not all(map(is_property, missing)):
        return None  # another kind of strap
    return _ALL_SAID if not missing and is_owned else _LESS_SAID


def _list_more(one: Reading, other: Reading) -> frozenset[str]:
    """List what a name says of which kind a thing is that another does not say."""
    return frozenset(word for word in one.properties - other.said if not is_property(word))


def _is_written(asked: Reading, said: Reading) -> bool:
    """Tell whether a name is written as it is asked for: a "glass" is not written "glasses"."""
    is_same = asked.head[-1] == said.head[-1] or set(asked.things) == set(said.things)
    return is_same and asked.key in said.endings


def _rank(asked: Reading, said: Reading) -> tuple[bool, bool, int]:
    """Return what decides between names, the highest first: owner, head words and remarks."""
    is_owner = bool(asked.owner) and said.owner == asked.owner
    has_head = len(asked.head) > 1 and asked.head_words <= said.said
    return is_owner, has_head, len((asked.said - asked.head_words - asked.properties) & said.said)


def _drop_repeated(groups: Iterable[Iterable[int]]) -> list[list[int]]:
    """Leave every number in the first group that has it, and drop empty groups."""
    known: set[int] = set()
    kept = []
    for group in groups:
        own = [number for number in dict.fromkeys(group) if number not in known]
        known.update(own)
        kept += [own] if own else []
    return kept


def count_mistakes(one: str, other: str) -> int:
    """Count letters wrong, missing, too many, or two in the wrong order (edit distance)."""
    before: list[int] = []
    row = list(range(len(other) + 1))
    for i, letter in enumerate(one, start=1):
        last, row = row, [i]
        for j, expected in enumerate(other, start=1):
            cost = min(last[j] + 1, row[j - 1] + 1, last[j - 1] + (letter != expected))
            if i > 1 and j > 1 and letter == other[j - 2] and one[i - 2] == expected:
                cost = min(cost, before[j - 2] + 1)
            row.append(cost)
        before = last
    return row[-1]


def _list(names: Sequence[str]) -> str:
    shown = ", ".join(names[:_MOST_ALTERNATIVES])
    more = len(names) - _MOST_ALTERNATIVES
    return f"{shown} and {more} more" if more > 0 else shown
