"""A part of a sentence between commas or joins, and what it names of a home."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from sgm.names.time_words import TimeSaid

Find = Callable[[str], tuple[str, ...]]


class Known(NamedTuple):
    """What of a home is called how.

    Attributes:
        find_thing: returns the things that a name surely means.
        find_place: returns names of the places that a name means.
        owners: people who own things.
        words: of all names.
    """

    find_thing: Find
    find_place: Find
    owners: frozenset[str]
    words: frozenset[str] = frozenset()


class Clause(NamedTuple):
    """A part of a sentence between commas or joins.

    Attributes:
        text: as it stands.
        words: without names of things and places, and what stands before a thing.
        things: what is asked for, each in words of its own.
        places: with their prepositions, "in the sink".
        named: names of places without a preposition.
        left: words that no table has.
        is_broken: whether a word beside a thing may make it another one: "laptop stand".
        owners: words that say whose something is, "leo's".
        is_aside: whether it says what for, why or when: "to open the wine", "before we go".
        time: when, if that is said.
        is_negated: whether its verb is: "is not", "has not".
        excluded: things that are left out: "except the lamp".
        verbs: words of no table that end as verbs do, or stand after who does it.
    """

    text: str
    words: tuple[str, ...]
    things: tuple[str, ...]
    places: tuple[str, ...]
    named: tuple[str, ...]
    left: tuple[str, ...]
    is_broken: bool
    owners: tuple[str, ...]
    is_aside: bool = False
    time: TimeSaid | None = None
    is_negated: bool = False
    excluded: tuple[str, ...] = ()
    verbs: tuple[str, ...] = ()

    @property
    def is_named(self) -> bool:
        """Whether it names a thing or a place."""
        return bool(self.things or self.places or self.named or self.excluded)

    @property
    def where(self) -> tuple[str, ...]:
        """All places that it names."""
        return (*self.places, *self.named)
