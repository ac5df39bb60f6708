"""How many things of a type homes have, and how many of them are called the same."""

from __future__ import annotations

from functools import lru_cache

from sgm.files import read_table

_OTHER = (3, 2)  # of a type that the table does not name


@lru_cache(maxsize=1)
def load_copies() -> dict[str, tuple[int, int]]:
    """Read `data/copies.csv`: the most things of a type, and of different descriptions of it.

    By label. All numbers are assumptions, in round figures: there are many mugs, and one kettle.
    """
    entries = read_table("sgm.prior", "copies.csv")
    return {entry["label"]: (int(entry["things"]), int(entry["descriptions"])) for entry in entries}


@lru_cache(maxsize=10_000)
def get_copies(label: str) -> tuple[int, int]:
    """Return the row of a label, or of what its last words name, or that of any other."""
    table, words = load_copies(), label.split()
    ends = (" ".join(words[first:]) for first in range(len(words)))
    return next((table[end] for end in ends if end in table), _OTHER)
