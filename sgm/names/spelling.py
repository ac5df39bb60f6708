"""How nearly alike two words or names are spelled."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sgm.names.name import Name

_LEAST_COMPOUNDED = 3  # letters of a word that is mended where the other words are right
_LONG_NAME = 8  # letters from which on two of them may be wrong


def is_near(asked: Name, ordered: tuple[str, ...], joined: str) -> bool:
    """Tell whether a name is spelled nearly alike: one word of it differs, by a letter or two."""
    most = 1 if len(asked.joined) < _LONG_NAME else 2
    if count_mistakes(asked.joined, joined, most) <= most:
        return True
    if len(asked.ordered) != len(ordered) or len(ordered) < 2:
        return False
    differing = [pair for pair in zip(asked.ordered, ordered, strict=True) if pair[0] != pair[1]]
    return len(differing) == 1 and count_mistakes(*differing[0], most) <= most


def find_slip(asked: tuple[str, ...], ordered: tuple[str, ...]) -> tuple[str, str] | None:
    """Find the one word that differs between two names of two words or more, by one letter.

    Returns:
        That word, and the one that is meant; None for names that differ in more. Both have three
        letters or more, the first of which is right.
    """
    if len(asked) != len(ordered) or len(asked) < 2:
        return None
    differing = [pair for pair in zip(asked, ordered, strict=True) if pair[0] != pair[1]]
    if len(differing) != 1:
        return None
    word, meant = differing[0]
    is_long = min(len(word), len(meant)) >= _LEAST_COMPOUNDED
    is_slip = is_long and word[0] == meant[0] and count_mistakes(word, meant, 1) == 1
    return (word, meant) if is_slip else None


def is_typo(word: str, meant: str) -> bool:
    """Tell whether a word is another one with one slip of the fingers.

    Two letters in the wrong order, or a letter missing or too many; from eight letters on a wrong
    one, too. The first letter is right, and so is the last one but for their order.
    """
    if word[0] != meant[0] or abs(len(word) - len(meant)) > 1:
        return False
    is_long = len(word) != len(meant) or len(word) >= _LONG_NAME
    may_be = (is_long and word[-1] == meant[-1]) or sorted(word) == sorted(meant)
    return may_be and count_mistakes(word, meant, 1) == 1


class TypoIndex:
    """Words by their first letter and length, to find what a word may be a typo of."""

    def __init__(self, words: Iterable[str]) -> None:
        """Hold words."""
        self._words: dict[tuple[str, int], list[str]] = {}
        for word in words:
            self._words.setdefault((word[:1], len(word)), []).append(word)

    def find(self, word: str) -> Iterator[str]:
        """Find the words that a word may be a typo of (`is_typo`)."""
        for length in range(len(word) - 1, len(word) + 2):
            for other in self._words.get((word[:1], length), ()):
                if is_typo(word, other):
                    yield other


def count_mistakes(word: str, other: str, most: int | None = None) -> int:
    """Count letters wrong, missing, too many, or two in the wrong order (edit distance).

    Where there are more than `most`, any number above that is returned, as soon as it is plain.
    """
    if most is None:
        most = len(word) + len(other)
    # A letter more or less changes the set of letters by one, and a wrong one by two.
    if abs(len(word) - len(other)) > most or len(set(word) ^ set(other)) > 2 * most:
        return most + 1
    before: list[int] = []
    costs = list(range(len(other) + 1))
    for i, letter in enumerate(word, start=1):
        last, costs = costs, [i]
        for j, expected in enumerate(other, start=1):
            cost = min(last[j] + 1, costs[j - 1] + 1, last[j - 1] + (letter != expected))
            if i > 1 and j > 1 and letter == other[j - 2] and word[i - 2] == expected:
                cost = min(cost, before[j - 2] + 1)
            costs.append(cost)
        if min(costs) > most:
            break
        before = last
    return costs[-1]
