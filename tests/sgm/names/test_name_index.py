"""An index of names that follows the names of a memory."""

import numpy as np

from sgm.names.aliases import AliasTable
from sgm.names.name_matching import NameIndex

WORDS = "red blue mug cup box of soap bottle piano bench dad's phone glasses keys zorb 1 2".split()
TABLES = ("_descriptions", "_readings", "_written", "_words", "_things", "_contents", "_endings",
          "_same", "_spelled")  # fmt: skip


def sample_names(rng, number):
    found = {}
    while len(found) < number:
        found[" ".join(rng.choice(WORDS, rng.integers(1, 5)))] = None
    return list(found)


def test_names_that_change_one_by_one_are_as_if_read_anew():
    """After a rename all names of the memory were read again."""
    rng = np.random.default_rng(0)
    table = AliasTable.household(None)
    for _ in range(20):
        names = sample_names(rng, 60)
        index = NameIndex((), table)
        index.update(names[:30])
        for fresh in names[40:50]:
            names[int(rng.integers(30))] = fresh
        index.update(names[:40])  # some were renamed, and some are new
        whole = NameIndex((), table)
        whole.update(names[:40])
        for part in TABLES:
            assert getattr(index, part) == getattr(whole, part), part
        for question in sample_names(rng, 20):
            assert index.resolve(question) == whole.resolve(question), question


def test_names_that_were_removed_are_not_found():
    index = NameIndex((), AliasTable.household(None))
    index.update(["red mug", "keys"])
    index.update(["keys"])
    assert index.resolve("red mug").matches == ()
    assert index.resolve("keys").matches == ("keys",)
