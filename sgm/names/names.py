"""What a question names: articles, plurals, word order, typos, fewer words, other words."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from sgm.names.words import read_words

# How alike two labels are, -1 to 1: cosine of their text vectors.
Similarity = Callable[[str, Sequence[str]], Sequence[float]]

SYNONYM = 0.9  # mug and cup .96, phone and telephone .93; plate and bowl .87 stay apart
_RELATED = 0.8  # worth a "did you mean"
_MOST_ALTERNATIVES = 3
_SKIPPED = frozenset(
    "a an the my your his her its our their this that these those some any where is are".split()
)
_APOSTROPHE = "['\u2019]"
_WORD = re.compile(rf"[^\W_]+(?:{_APOSTROPHE}[^\W_]+)*")
_POSSESSIVE = re.compile(rf"{_APOSTROPHE}s?$")


@dataclass(frozen=True, slots=True)
class Resolution:
    """What a question was taken for.

    Attributes:
        question: as it was asked.
        matches: descriptions of the memory that it may mean, in the order in which they came up; a
            thing is found when one of them is. Empty where the memory has nothing of that name.
        how: "exact", "same words" (but for articles, case, order, plural), "any of the kind" (the
            question says less than the descriptions), "part of the name", "typo", "synonym", or
            "unknown".
        alternatives: other descriptions that may have been meant, the nearest first.
    """

    question: str
    matches: tuple[str, ...]
    how: str
    alternatives: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Say it in one line."""
        line = self.question
        if self.how == "exact":
            return line
        if self.how != "unknown":
            line += f" (taken for {_list(self.matches)}: {self.how})"
        if self.alternatives:
            line += f" (did you mean {_list(self.alternatives)}?)"
        return line


class NameIndex:
    """Finds the descriptions that a question names, without looking through all of them.

    The rules, tried one after the other until one finds something:

    1. The last words name the kind, the longest type of the prior that fits or the last word; all
       words before are properties. Every description of the same kind with at least the properties
       asked for is meant, so that "mug" is any mug and "red mug" any that is red.
    2. The question is a part of a name: "remote" for "remote control".
    3. A word that nothing is called, of five letters or more, with one letter wrong, missing, too
       many or two in the wrong order (two mistakes from nine letters on), is read as that.
    4. Kinds that mean nearly the same by their text vectors, where the policy has some.

    Before that, articles and the like, case, order, punctuation and plural are taken off.
    """

    def __init__(self, types: Iterable[str] = ()) -> None:
        """Start without descriptions.

        Args:
            types: labels of object types that the prior knows.
        """
        self._types = {read_keys(label) for label in types}
        self._longest = max(map(len, self._types), default=1)
        self._descriptions: list[str] = []
        self._keys: list[tuple[str, ...]] = []
        self._with_word: dict[str, list[int]] = {}

    def update(self, descriptions: Sequence[str]) -> None:
        """Take over the descriptions of a memory; only those that are new cost anything."""
        known = len(self._descriptions)
        if list(descriptions[:known]) != self._descriptions:  # some were removed
            self._descriptions, self._keys, self._with_word, known = [], [], {}, 0
        for description in descriptions[known:]:
            keys = read_keys(description)
            for word in dict.fromkeys(keys):
                self._with_word.setdefault(word, []).append(len(self._keys))
            self._descriptions.append(description)
            self._keys.append(keys)

    def resolve(self, question: str, similarity: Similarity | None = None) -> Resolution:
        """Say what a question means.

        Args:
            question: such as "the red mugs".
            similarity: how alike a label is to others; None for a policy without text vectors.

        Raises:
            ValueError: if the question is no name (`read_words`).
        """
        words = read_words("description", question)
        keys = read_keys(words)
        how, found = self._match(keys)
        if not found:
            mended = tuple(self._mend(word) for word in keys)
            if mended != keys:
                _, found = self._match(mended)
                how = "typo"
        if not found and similarity is not None:
            how, found = "synonym", self._find_synonyms(keys, similarity, SYNONYM)
        if not found:
            return Resolution(question, (), "unknown", self._suggest(keys, similarity, ()))
        if len(found) == 1 and self._descriptions[found[0]].casefold() == words:
            how = "exact"
        matches = tuple(self._descriptions[number] for number in found)
        return Resolution(question, matches, how, self._suggest(keys, None, found))

    def _match(self, keys: tuple[str, ...]) -> tuple[str, list[int]]:
        """Apply rules 1 and 2: how it was found, and the numbers of the descriptions."""
        holding = [set(self._with_word.get(word, ())) for word in keys]
        with_all = sorted(set.intersection(*holding))
        kind = self._find_kind(keys)
        same = [number for number in with_all if self._find_kind(self._keys[number]) == kind]
        if not same:
            return "part of the name", with_all
        is_whole = all(len(self._keys[number]) == len(keys) for number in same)
        return "same words" if is_whole else "any of the kind", same

    def _find_kind(self, keys: tuple[str, ...]) -> tuple[str, ...]:
        for start in range(max(len(keys) - self._longest, 0), len(keys)):
            if keys[start:] in self._types:
                return keys[start:]
        return keys[-1:]

    def _mend(self, word: str) -> str:
        """Return the word that something is called and that this one may be a typo of."""
        most = 0 if len(word) < 5 else 1 if len(word) < 9 else 2
        if most == 0 or word in self._with_word:
            return word
        letters = set(word)
        near = [
            (distance, other)
            for other in self._with_word
            if abs(len(other) - len(word)) <= most
            and len(letters.difference(other)) <= most  # a mistake takes one away at most
            and (distance := count_mistakes(word, other)) <= most
        ]
        return min(near)[1] if near else word

    def _find_synonyms(
        self, keys: tuple[str, ...], similarity: Similarity, least: float
    ) -> list[int]:
        """Apply rule 4: descriptions whose kind means the same, with the properties asked for."""
        kind = self._find_kind(keys)
        properties = set(keys[: len(keys) - len(kind)])
        numbers: dict[tuple[str, ...], list[int]] = {}
        for number, other in enumerate(self._keys):
            if properties <= set(other):
                numbers.setdefault(self._find_kind(other), []).append(number)
        if not numbers:
            return []
        values = similarity(" ".join(kind), [" ".join(other) for other in numbers])
        best = sorted(zip(values, numbers.values(), strict=True), key=lambda pair: -pair[0])
        return sorted(number for value, own in best if value >= least for number in own)

    def _suggest(
        self, keys: tuple[str, ...], similarity: Similarity | None, found: Sequence[int]
    ) -> tuple[str, ...]:
        """Return what else may have been meant: the same kind with other properties first."""
        kind = self._find_kind(keys)
        close = [
            number
            for number in self._with_word.get(kind[-1], ())
            if self._find_kind(self._keys[number]) == kind
        ]
        if similarity is not None:
            close += self._find_synonyms(kind, similarity, _RELATED)
        rest = [number for number in dict.fromkeys(close) if number not in found]
        return tuple(self._descriptions[number] for number in rest[:_MOST_ALTERNATIVES])


def read_keys(name: str) -> tuple[str, ...]:
    """Return what the words of a question are compared by: as `read_name`, in order, singular."""
    return tuple(compute_singular(word) for word in _list_words(name))


def read_name(description: str) -> tuple[str, ...]:
    """Return what tells one thing from another: its words without articles, in any order.

    The last word, which says what it is, stays the last: a "table lamp" is no "lamp table". A
    plural is another thing: a detector that says "plates" means a stack of them.

    Raises:
        ValueError: if the description is no name (`read_words`).
    """
    *properties, kind = _list_words(read_words("description", description))
    return (*sorted(properties), kind)


def _list_words(name: str) -> list[str]:
    """List the words of a name in lower case, without articles and the like."""
    text = name.casefold().replace("_", " ")
    words = [_POSSESSIVE.sub("", word) for word in _WORD.findall(text)]
    return [word for word in words if word not in _SKIPPED] or words or [text.strip()]


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
