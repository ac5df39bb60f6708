"""Tokens of a label, by the rules of a spaCy tokenizer."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import NamedTuple


class Token(NamedTuple):
    """A part of a text.

    Attributes:
        text: as it stands in the text.
        norm: normalised form: of "n't" it is "not".
        has_space: whether a space follows.
    """

    text: str
    norm: str
    has_space: bool = False


class Tokenizer:
    """Splits text in lower case into tokens.

    A word is a special case, or loses prefixes and suffixes until a special case, a web address or
    something to be split at infixes is left. What affixes took apart and a special case joins,
    such as ":)", is joined last.

    Args:
        prefix: regular expression of what is cut from the start of a word.
        suffix: of what is cut from the end.
        infix: of what splits the rest.
        url: of what is not split at infixes.
        special_cases: token texts and norms by word; a norm of None is that of the text.
        norms: normalised forms that are not the text in lower case.

    Source: spaCy's usage guide, "How spaCy's tokenizer works"; the rules come from a pipeline.
    """

    def __init__(
        self,
        *,
        prefix: str,
        suffix: str,
        infix: str,
        url: str,
        special_cases: Mapping[str, list[tuple[str, str | None]]],
        norms: Mapping[str, str],
    ) -> None:
        self._sources = {"prefix": prefix, "suffix": suffix, "infix": infix, "url": url}
        self._norms = dict(norms)
        self._special_cases = {
            word: [self._make_token(text, norm) for text, norm in parts]
            for word, parts in special_cases.items()
        }

    def split(self, text: str) -> list[Token]:
        """Split a text whose words are separated by single spaces."""
        tokens: list[Token] = []
        for word in text.split(" "):
            tokens += self._split_word(word, self._special_cases)
            tokens[-1] = tokens[-1]._replace(has_space=True)
        return self._join_special_cases(tokens)

    @cached_property
    def _patterns(self) -> dict[str, re.Pattern[str]]:
        """Compiled when a text is first split, which takes longer than all the rest."""
        return {name: re.compile(source) for name, source in self._sources.items()}

    @cached_property
    def _taken_apart(self) -> dict[str, list[tuple[str, ...]]]:
        """Texts of the tokens into which affixes take special cases apart, by the first of them."""
        found: dict[str, list[tuple[str, ...]]] = {}
        for word in self._special_cases:
            if any(self._patterns[name].search(word) for name in ("prefix", "suffix", "infix")):
                parts = tuple(token.text for token in self._split_word(word, {}))
                found.setdefault(parts[0], []).append(parts)
        return found

    def _make_token(self, text: str, norm: str | None = None) -> Token:
        return Token(text=text, norm=norm or self._norms.get(text) or text.lower())

    def _split_word(self, word: str, special_cases: Mapping[str, list[Token]]) -> Iterator[Token]:
        suffixes: list[str] = []
        last_length = None
        while word and word not in special_cases and len(word) != last_length:
            last_length = len(word)
            prefix = self._measure("prefix", word)
            if prefix and word[prefix:] in special_cases:
                yield self._make_token(word[:prefix])
                word = word[prefix:]
                break
            suffix = self._measure("suffix", word[prefix:])
            end = len(word) - suffix
            if suffix and word[:end] in special_cases:
                suffixes.append(word[end:])
                word = word[:end]
                break
            if prefix:
                yield self._make_token(word[:prefix])
            if suffix:
                suffixes.append(word[end:])
            word = word[prefix:end]
        if word in special_cases:
            yield from special_cases[word]
        elif word and self._patterns["url"].match(word):
            yield self._make_token(word)
        else:
            yield from map(self._make_token, self._split_infixes(word))
        yield from map(self._make_token, reversed(suffixes))

    def _measure(self, affix: str, word: str) -> int:
        match = self._patterns[affix].search(word)
        return 0 if match is None else match.end() - match.start()

    def _split_infixes(self, word: str) -> Iterator[str]:
        start = 0
        for match in self._patterns["infix"].finditer(word):
            if match.start() > 0:  # what stands first is no infix
                yield from filter(None, (word[start : match.start()], match.group()))
                start = match.end()
        yield from filter(None, [word[start:]])

    def _join_special_cases(self, tokens: list[Token]) -> list[Token]:
        """Put special cases in place of the tokens they were taken apart into.

        Of two that overlap the longer wins, then the first.
        """
        texts = tuple(token.text for token in tokens)
        spans = [
            (start, start + len(parts))
            for start, text in enumerate(texts)
            for parts in self._taken_apart.get(text, ())
            if texts[start : start + len(parts)] == parts
        ]
        if not spans:
            return tokens
        end_and_new: dict[int, tuple[int, list[Token]]] = {}  # by start
        is_taken = [False] * len(tokens)
        for start, end in sorted(spans, key=lambda span: (span[0] - span[1], span[0])):
            parts = (token.text + " " * token.has_space for token in tokens[start:end])
            new = self._special_cases.get("".join(parts).strip())
            if new and not is_taken[start] and not is_taken[end - 1]:
                end_and_new[start] = end, new
            is_taken[start:end] = [True] * (end - start)  # also where a space keeps it apart
        joined: list[Token] = []
        number = 0
        while number < len(tokens):
            number, new = end_and_new.get(number, (number + 1, [tokens[number]]))
            joined += new
        return joined
