"""English words that name things, which are therefore no typing errors for other ones."""

from __future__ import annotations

from functools import lru_cache

from sgm.names.aliases import AliasTable
from sgm.names.modifiers import NEGATIONS, PROPERTIES, PROPERTY_ENDINGS, is_property, spell
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


@lru_cache(maxsize=10_000)
def is_formed(word: str) -> bool:
    """Tell whether a word says how a thing is by its form: "dented" and "unzipped".

    What it is formed of is a word, too: "frobnicated" is none.
    """
    if not is_property(word):
        return False
    ending = next((e for e in PROPERTY_ENDINGS if word.endswith(e)), "")
    stem = word.removesuffix(ending)
    stems = [stem, f"{stem}{ending[:1]}", f"{stem[:-1]}y" if stem.endswith("i") else stem]
    stems += [stem[:-1]] if stem[-2:] == 2 * stem[-1:] else []
    stems += [form.removeprefix(prefix) for prefix in NEGATIONS for form in stems]
    return word in PROPERTIES or any(map(is_word, filter(None, stems)))
