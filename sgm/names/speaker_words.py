"""Who speaks, where a sentence says it: "where is my watch? This is Grace."."""

from __future__ import annotations

import re
from collections.abc import Collection
from functools import lru_cache

from sgm.names.language import load_language
from sgm.names.sections import ENGLISH
from sgm.names.sentence import make_sentence_reader, pad_words

_PARTS = re.compile(r"([.?!;,:]+(?=\s|$)|\s[-\u2013\u2014]+\s|[()\[\]])")


class SpeakerReader:
    """Takes who speaks out of a sentence, by the tables of a language."""

    def __init__(self, code: str) -> None:
        """Read by the tables of the language of a code."""
        self._sentences = make_sentence_reader(code)
        language = load_language(code)
        lines = language.list_lines("who speaks")
        self._told = [re.compile(f"^{language.compile(line)}$") for line in lines]

    def take(self, text: str, people: Collection[str]) -> tuple[str, str]:
        """Return a sentence without who speaks, and who that is; empty if it does not say so.

        Args:
            text: "Where is my watch? This is Grace."
            people: who may speak, of whom something is known.
        """
        if not people:
            return text, ""
        parts = _PARTS.split(text)
        for place in range(0, len(parts), 2):
            speaker = self._find(parts, place, people)
            if speaker and "".join(parts[:place] + parts[place + 1 :]).strip(" .?!;,:()[]-"):
                kept = [part if n != place else " " for n, part in enumerate(parts)]
                return "".join(kept).strip(), speaker
        return text, ""

    def _find(self, parts: list[str], place: int, people: Collection[str]) -> str:
        """Find who speaks in a part of a sentence: "this is grace", and "(grace)"."""
        words = self._sentences.split_words(parts[place])
        is_between = parts[place - 1 : place] + parts[place + 1 : place + 2] == ["(", ")"]
        if is_between and len(words) == 1 and words[0] in people:
            return words[0]
        found = [pattern.match(pad_words(words)) for pattern in self._told]
        speakers = [told["speaker"].strip() for told in found if told is not None]
        return next((speaker for speaker in speakers if speaker in people), "")


@lru_cache(maxsize=8)
def make_speaker_reader(code: str = ENGLISH) -> SpeakerReader:
    """Return the reader of a language."""
    return SpeakerReader(code)
