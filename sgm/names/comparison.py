"""How much of what a question asks for a name says."""

from __future__ import annotations

from sgm.names.known_words import is_word
from sgm.names.modifiers import (
    COLOURS,
    MATERIALS,
    contradict,
    is_elsewhere,
    is_property,
    is_sort_of,
    picks,
    says_how,
)
from sgm.names.name_grammar import LACKED, Reading
from sgm.names.spelling import count_mistakes

ALL_SAID, LESS_SAID, OTHER_SAID, DOUBTFUL = 1, 2, 3, 4


def compare(asked: Reading, said: Reading) -> int | None:
    """Tell how much of a question about a thing of this head a name says; None: another thing."""
    if not is_possible(asked, said):
        return None
    asked_kinds, said_kinds = (asked.kinds, said.kinds) if asked.things else (asked.stem, said.stem)
    missing, extra = asked_kinds - said.said, said_kinds - asked.said
    is_written = asked.key in said.endings
    if extra and not missing and _asks_for_any(asked, said) and is_sort_of(extra, asked.key):
        extra = frozenset()
    if missing or extra:
        is_part = (not missing or not extra) and asked.endings[-1] == said.endings[-1]
        return DOUBTFUL if is_part else None
    is_same_thing = not set(asked.things).isdisjoint(said.things)
    is_alike = is_written or is_same_thing
    if asked.is_sort and not is_same_thing and not is_written:
        return None
    if (asked.kinds or said.kinds) and not is_alike:
        return None  # a "garlic bread" and a "garlic bagel"
    if _is_other_sort(asked, said, is_written, is_same_thing):
        return None
    if _says_other_make(asked, said) or (asked.instance and not said.instance):
        return DOUBTFUL
    is_owned = not asked.owner or said.owner or asked.owner in said.said
    missing_features = asked.features - said.features - said.said
    if missing_features and said.features - asked.features:
        return OTHER_SAID  # a mug "with dots", and one "with stripes"
    missing_properties = asked.properties - said.said
    if not (missing_properties or missing_features) and is_owned:
        return ALL_SAID
    if any(map(picks, missing_properties)):
        return DOUBTFUL  # a "left slipper" and a "slipper"
    return OTHER_SAID if _has_other_property(missing_properties, asked, said) else LESS_SAID


def _asks_for_any(asked: Reading, said: Reading) -> bool:
    """Tell whether a name says all that is asked for, before that word: no "cream of tartar"."""
    return asked.key in said.endings[1:] and asked.properties <= said.said


def _has_other_property(missing: frozenset[str], asked: Reading, said: Reading) -> bool:
    """Tell whether a name that lacks properties has others that say how it is, or an owner."""
    misspelled = [word for word in missing if not is_word(word)]
    for word in said.properties - asked.said:
        is_slip = any(count_mistakes(word, other, 1) == 1 for other in misspelled)
        if says_how(word) and not is_slip:  # "larg" is no other size than "large"
            return True
    return bool(said.owner and not asked.owner)


def _is_other_sort(asked: Reading, said: Reading, is_written: bool, is_same_thing: bool) -> bool:
    """Tell whether both say a sort of a thing, and not the same: a "wall" and a "digital clock"."""
    if asked.sorts - said.said:
        return bool(said.stem_sorts - asked.said) or asked.endings[-1] not in said.endings
    if is_written:
        return False
    if asked.properties & MATERIALS - said.said and not is_same_thing:
        return True  # a "silk hat" and a "baseball cap"
    # A "digital camera" is a camera by the table, and a "television camera" another one.
    is_own_sort = bool(asked.stem_sorts - said.said)
    return is_own_sort and is_same_thing and not all(map(is_property, said.sorts - asked.said))


def _says_other_make(asked: Reading, said: Reading) -> bool:
    """Tell whether one says a material, the other a sort: a "silk hat" and a "cowboy hat"."""
    return bool(asked.properties & MATERIALS - said.said and said.stem_sorts - asked.said)


def is_possible(asked: Reading, said: Reading) -> bool:
    """Tell whether nothing speaks against it: another owner, number, colour, size or side."""
    if asked.owner and said.owner not in ("", asked.owner):
        return False
    if asked.instance and said.instance not in ("", asked.instance):
        return False
    if asked.packages and said.packages and not asked.packages & said.packages:
        return False
    if is_elsewhere(asked.said, said.said) and not _is_called_otherwise(asked, said):
        return False
    if not asked.features.isdisjoint(f"{LACKED}{word}" for word in said.features):
        return False
    if not said.features.isdisjoint(f"{LACKED}{word}" for word in asked.features):
        return False
    if not asked.features.isdisjoint(f"{LACKED}{word}" for word in said.head_words):
        return False  # a "drink without milk" is no milk
    asked_before, said_before = asked.said - asked.head_words, said.said - said.head_words
    # No "canvas belt" is a "leather belt", but a green bottle may be one of white wine.
    return not (
        contradict(asked_before, said_before)
        or contradict(asked.properties - COLOURS, said.head_before)
        or contradict(asked.head_before, said.properties - COLOURS)
    )


def _is_called_otherwise(asked: Reading, said: Reading) -> bool:
    """Tell whether both are names of one thing, and what stands before these is of one room."""
    is_same = not set(asked.things).isdisjoint(said.things)
    before = asked.said - asked.head_words, said.said - said.head_words
    return is_same and not is_elsewhere(*before)  # an "espresso machine" is a "coffee maker"


def is_doubtful(asked: Reading, said: Reading) -> bool:
    """Tell whether a name of the same last word may be meant: one of both says more of its kind."""
    missing, extra = asked.stem - said.said, said.stem - asked.said
    return is_possible(asked, said) and bool(missing) != bool(extra)


def is_written(asked: Reading, said: Reading) -> bool:
    """Tell whether a name is written as it is asked for: a "glass" is not written "glasses"."""
    is_same = asked.head[-1] == said.head[-1] or set(asked.things) == set(said.things)
    return is_same and asked.key in said.endings


def rank(asked: Reading, said: Reading) -> tuple[bool, bool, int]:
    """Return what decides between names, the highest first: owner, head words and remarks."""
    is_owner = bool(asked.owner) and said.owner == asked.owner
    has_head = len(asked.head) > 1 and asked.head_words <= said.said
    return is_owner, has_head, len((asked.said - asked.head_words - asked.properties) & said.said)
