"""Names of plain words and a number: read once for all numbers, to what reading each whole says."""

import re
from contextlib import suppress
from dataclasses import replace

import numpy as np

from sgm.names import instances, words
from sgm.names import name as name_module
from sgm.names.aliases import AliasTable
from sgm.names.vocabulary import Vocabulary
from sgm.prior.prior_graph import PriorGraph

# Plain words; articles, breaks and words that are skipped; what may be a part of a mark; codes of
# six letters; plurals, other spellings and containers.
WORDS = (
    "mug red the a my where is of with from no num number id inst track deadbeef fabaceae nddvba "
    "rhythm table glasses glass colour knives boxes tv ps5 m4x20 3d 2 02 7up and bottle set box "
    "cereal dad's t-shirt Mug SoapBottle crème ﬁsh ½ ١٢ \uff12 杯子1 cup.001 #2 (2) [3] 3f2a1b "
    "0 000 12 b two number-two 6mm 6 mm vitamin"
).split()
NEVER = re.compile(r"(?!)")


def make_names():
    """Names of one to four of the words, with some numbers behind, the same on every run."""
    rng = np.random.default_rng(0)
    names = [f"{word} {number}" for word in WORDS for number in ("1", "007", "0", "12345678")]
    for _ in range(4000):
        chosen = rng.choice(WORDS, rng.integers(1, 5)).tolist()
        end = rng.choice(["", " 1", " 002", " 10", "_3", " no 4"])
        names.append(rng.choice([" ", " ", " ", "_", "  "]).join(chosen) + str(end))
    return [*names, f"{'a' * 150} 2", f"{'ab ' * 66}12", f"{'ab ' * 66}123"]


def read_all(names):
    """What is read of each name; what is wrong with it, where it is none."""
    for cached in (
        words.normalize,
        words._read_words,
        words._read_name,
        instances.split_instance,
        instances.is_spelled,
        name_module._read,
        name_module._read_numbered,
        name_module._order_base,
    ):
        cached.cache_clear()
    found = []
    for text in names:
        try:
            name = name_module.Name.read(text)
        except ValueError as error:
            found.append(str(error))
        else:
            assert words.read_name(text) == name.key, text
            found.append((name, instances.split_instance(text), words.split_words(text)))
    return found


def test_reads_plain_names_as_any_others(monkeypatch):
    names = make_names()
    quick = read_all(names)
    assert any(name_module._read_numbered(text) for text in names)
    monkeypatch.setattr(words, "_PLAIN", NEVER)
    monkeypatch.setattr(instances, "_SPELLED", NEVER)
    monkeypatch.setattr(words, "BREAKS", _NeverDisjoint(words.BREAKS))
    monkeypatch.setattr(words, "SKIPPED", _NeverDisjoint(words.SKIPPED))
    for text, one, other in zip(names, quick, read_all(names), strict=True):
        assert one == other, text


class _NeverDisjoint(frozenset):
    """The same words, of which a name always seems to have some."""

    def isdisjoint(self, other):
        return False


def test_types_of_numbered_names_are_those_of_any_others():
    types = Vocabulary(PriorGraph.household(), (), AliasTable.household())._types
    labels = [row.label for row in PriorGraph.household().objects]
    for text in [*make_names(), *(f"red {label} 3" for label in labels)]:
        with suppress(ValueError):
            name = name_module.Name.read(text)
            assert types.find(name) == types.find(replace(name, text="")), text
