"""Words that a home uses and the prior does not know: synonyms, and names of other things."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources
from itertools import chain


@dataclass(frozen=True, slots=True)
class Words:
    """Words of one split.

    Attributes:
        synonyms: other words for a label of the shipped prior, by label.
        strangers: names of things that are in no table of ours.
    """

    synonyms: Mapping[str, tuple[str, ...]]
    strangers: tuple[str, ...]


@lru_cache(maxsize=2)
def load_words(split: str) -> Words:
    """Read `words.csv`; "train" and "val" share their words, and have none of those of "test"."""
    text = resources.files(__package__).joinpath("words.csv").read_text(encoding="utf-8")
    part = "test" if split == "test" else "train"
    synonyms, strangers = {}, ()
    for row in csv.DictReader(text.splitlines()):
        if row["split"] != part:
            continue
        words = tuple(row["words"].split("|"))
        if row["label"]:
            synonyms[row["label"]] = words
        else:
            strangers = words
    return Words(synonyms, strangers)


def list_words() -> list[str]:
    """List every word of both splits, in the order of the file."""
    found: list[str] = []
    for words in map(load_words, ("train", "test")):
        found += [*chain.from_iterable(words.synonyms.values()), *words.strangers]
    return list(dict.fromkeys(found))
