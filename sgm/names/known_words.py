"""English words that name things, which are therefore no typing errors for other ones."""

from __future__ import annotations

from functools import lru_cache

from sgm.names.aliases import AliasTable
from sgm.names.modifiers import PROPERTIES, spell
from sgm.names.sections import ENGLISH, read_file
from sgm.text.vectors import load_text


@lru_cache(maxsize=1)
def load_known_words() -> frozenset[str]:
    """Load what the shipped tables and text vectors know, each as `spell` gives it."""
    words = set(read_file(ENGLISH, "words.txt").split())
    words.update(word for text in load_text().words for word in text.split())
    return frozenset(map(spell, words | AliasTable.household().words)) | PROPERTIES


def is_word(word: str) -> bool:
    """Tell whether a word, in any spelling, is one that names a thing or says how it is."""
    return spell(word) in load_known_words()
