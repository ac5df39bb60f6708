"""What a word before the name of a thing does: it says how the thing is, or makes it another one.

"Red", "large", "wooden", "dad's" and "kitchen" say how a thing is or where it belongs: a "red mug"
is a mug. Any other word may make it another thing: a "trash can" is no "soda can", and a "sea lion"
no "lion". So such a word narrows only where a table says so: one of these, or `AliasTable`.
"""

from __future__ import annotations

from functools import lru_cache

from sgm.names.sections import load_grammar
from sgm.names.words import unify

_GRAMMAR = load_grammar()
# Words that are compared as one, as singulars; other spellings of one word are in `words`.
_ALIKE = _GRAMMAR.read_spellings("alike")
# Properties that shut one another out: what is red is not blue, unless it is said to be both.
COLOURS, MATERIALS = _GRAMMAR.list_words("colours"), _GRAMMAR.list_words("materials")
# A material, and the things of which it says nothing new: a "leather belt" is a belt.
_MADE_OF = _GRAMMAR.read_groups("made of")
BRANDS = _GRAMMAR.list_words("brands")
_SIDES = _GRAMMAR.list_classes("picking")
_CLASSES = (COLOURS, MATERIALS, BRANDS, *_SIDES, *_GRAMMAR.list_classes("opposites"))
_SHUT_OUT = (*_CLASSES, _GRAMMAR.list_words("seasons"))
# Words that pick one of two or more that are alike but for where they belong.
_PICKING = _GRAMMAR.list_words("also picking").union(*_SIDES)
_PICKING_ENDINGS = tuple(_GRAMMAR.list_words("picking endings"))
FAULTS = _GRAMMAR.list_words("faults")
_HOW = _GRAMMAR.list_words("qualities").union(FAULTS, *_CLASSES)
PROPERTIES = _HOW.union(*map(_GRAMMAR.list_words, ("participles", "sorts", "belonging")))
PROPERTY_ENDINGS = tuple(_GRAMMAR.list_words("property endings"))
NEGATIONS = _GRAMMAR.list_words("negations")  # before one: "unzipped"
_NO_PROPERTIES = _GRAMMAR.list_words("no properties")  # nouns with such an ending
_SHORTEST_PROPERTY = 5  # letters of a word with such an ending
# Words that say how most things are, and make these things other ones.
_CHANGED = _GRAMMAR.read_groups("changes")
# Things of which other words before them name a kind: a "claw hammer" is a hammer. Of "can",
# "stand" or "machine" they do not.
_PLAIN_HEADS = _GRAMMAR.list_words("plain things")
# The same, where less is asked for: a "bicycle pump" is a pump, and a pump no "bicycle pump".
_BROADER_HEADS = _GRAMMAR.list_words("broader things")
_MAKES_OTHER = _GRAMMAR.list_words("other things")  # even these
# What is of one of these is not of another: a "kitchen cabinet", and a "bathroom cabinet".
ROOMS = _GRAMMAR.list_words("rooms")
_DRINKS, _VESSELS = _GRAMMAR.list_words("drinks"), _GRAMMAR.list_words("vessels")
_USES = (ROOMS, _DRINKS)
# In what a thing is packed, or how it is shaped: a "soap bar" is no "soap bottle".
PACKAGES = _GRAMMAR.list_words("shapes")


@lru_cache(maxsize=10_000)
def spell(word: str) -> str:
    """Return a word as it is compared: singular, and words that say the same as one."""
    word = _ALIKE.get(word, word)
    word = unify(word)
    return _ALIKE.get(word, word)


def is_property(word: str) -> bool:
    """Tell whether a word, as it is compared, says how a thing is, and not which kind it is."""
    if word in PROPERTIES:
        return True
    if word in _NO_PROPERTIES or len(word) < _SHORTEST_PROPERTY:
        return False
    return word.endswith(PROPERTY_ENDINGS)


def says_how(word: str) -> bool:
    """Tell whether a word says how one thing is, now or to look at, and not of which sort it is.

    "Red", "wooden" and "dirty" do; "digital", "kitchen" and "ski" name a sort.
    """
    return word in _HOW


def is_made_otherwise(material: str, head: str) -> bool:
    """Tell whether a material makes a thing another one: a "plastic hammer" is no hammer.

    Both are as they are compared; a "leather belt" is a belt.
    """
    return material in MATERIALS and head not in _MADE_OF.get(material, ())


def picks(word: str) -> bool:
    """Tell whether a word, as it is compared, picks one of several.

    "Left", "upper", "second" and "topmost" do, a letter, and what has a number in it.
    """
    is_mark = len(word) == 1 or any(map(str.isdigit, word))
    return is_mark or word in _PICKING or word.endswith(_PICKING_ENDINGS)


def narrows(word: str, heads: tuple[str, ...]) -> bool:
    """Tell whether a thing with a word before its name is a thing of that name.

    All are as they are compared. Heads are the last word and the name of the thing, written
    together: "red" narrows "mug", and "trash" does not narrow "can".
    """
    if not _CHANGED.get(word, frozenset()).isdisjoint(heads):
        return False
    if is_property(word) or (word in _DRINKS and heads[0] in _VESSELS):
        return True
    return word not in _MAKES_OTHER and not _PLAIN_HEADS.isdisjoint(heads)


def is_sort_of(words: frozenset[str], head: str) -> bool:
    """Tell whether a thing with some words before its name is one of a thing of that name.

    All are as they are compared. Who asks for a "pump" may mean the "bicycle pump".
    """
    return head in _BROADER_HEADS and words.isdisjoint(_MAKES_OTHER)


def is_elsewhere(asked: frozenset[str], said: frozenset[str]) -> bool:
    """Tell whether two names say different rooms, or different drinks."""
    return any(asked & group and said & group and not asked & said & group for group in _USES)


def contradict(asked: frozenset[str], said: frozenset[str]) -> bool:
    """Tell whether properties that are asked for shut out those of a name: red, and blue."""
    return any(asked & group and said & group and not asked & said & group for group in _SHUT_OUT)
