"""The labels of a memory's nodes, and the type that a description names."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

from sgm.arrays.table import clone
from sgm.names.aliases import AliasTable
from sgm.names.name import Name
from sgm.names.name_grammar import make_reader
from sgm.names.words import BREAKS, MOST_NAMES, read_words
from sgm.prior.prior_graph import PriorGraph


class Vocabulary:
    """Labels by index; a label that the prior knows is spelled as in the prior.

    Attributes:
        labels: text of every label index, in the order in which they came up.
    """

    def __init__(
        self, prior: PriorGraph, labels: Sequence[str], table: AliasTable | None = None
    ) -> None:
        """Start from the labels that came up so far.

        By the table of aliases a "skillet" is of the prior's type "frying pan"; without one the
        last words decide.
        """
        self._types = _make_type_names(prior, table)
        self._index = {label: index for index, label in enumerate(labels)}
        self.labels = list(self._index)

    def copy(self) -> Vocabulary:
        """Return the same vocabulary, which can grow alone."""
        return self.with_labels(self.labels)

    def with_labels(self, labels: Sequence[str]) -> Vocabulary:
        """Return the vocabulary of the same prior after other labels came up."""
        other = clone(self)
        other._index = {label: index for index, label in enumerate(labels)}
        other.labels = list(other._index)
        return other

    def number(self, label: str) -> int:
        """Return the index of a label, giving it one if it is new."""
        return self._number(self._types.spell(label))

    def get_text(self, label: str) -> str:
        """Return a label as the prior spells it, its words if the prior does not know it."""
        return self.labels[self.number(label)]

    def find_type(self, description: str) -> tuple[int, int]:
        """Return the label index and the prior's object type (-1: none) of a description.

        Its label is the longest known type that the name of the thing ends with, else what the
        thing is called besides, else a kind above it, else its last word.
        """
        label = self._types.find(Name.read(description))
        return self._number(label), self._types.number_of.get(label, -1)

    def _number(self, label: str) -> int:
        index = self._index.get(label)
        if index is None:
            index = self._index[label] = len(self.labels)
            self.labels.append(label)
        return index


class _TypeNames:
    """The labels of a prior, and which one a description has; the same for all its memories.

    Attributes:
        number_of: number of each object type by its label.
    """

    def __init__(self, prior: PriorGraph, table: AliasTable | None) -> None:
        self._table = table
        names = [*prior.rooms, *(furniture_type.label for furniture_type in prior.furniture)]
        objects = {
            read_words("label", object_type.label): object_type.label
            for object_type in prior.objects
        }
        self._known = {read_words("label", name): name for name in names} | objects
        self._objects = frozenset(objects)
        self._last_words = {words.rpartition(" ")[2] for words in objects}
        self.number_of = {
            object_type.label: index for index, object_type in enumerate(prior.objects)
        }
        # Of things that are called alike but for their numbers, one is read.
        self._find_by_table = lru_cache(maxsize=MOST_NAMES)(self._read)

    def spell(self, label: str) -> str:
        """Return a label as the prior spells it, its words if the prior does not know it."""
        words = read_words("label", label)
        return self._known.get(words, words)

    def find(self, name: Name) -> str:
        """Return the label of a description; see `Vocabulary.find_type`."""
        if name.words == name.text and name.instance and self._table is not None:
            last = name.text.rpartition(" ")[2]
            if last not in self._last_words:  # the number, for most names
                return self._find_by_table(name.base, self._table)
        words = name.words.split()
        start = self._find_start(words)
        # A type of several words says more than its parts: a "large bottle of soap" is no soap.
        is_named = len(words) - start > 1 and BREAKS.isdisjoint(words[:start])
        if self._table is None or is_named or name.words in self._objects:
            return self.spell(" ".join(words[start:]))
        reader = make_reader(self._table)
        return self._find_by_table(reader.split_number(name.words)[0], self._table)

    def _find_start(self, words: list[str]) -> int:
        """Return where the longest type begins that words end in, else the last word."""
        last = len(words) - 1
        if words[-1] not in self._last_words:
            return last
        starts = (n for n in range(last) if " ".join(words[n:]) in self._objects)
        return next(starts, last)

    def _read(self, text: str, table: AliasTable) -> str:
        """Find a label by the grammar of names and the table of aliases."""
        words = make_reader(table).read_words(text)
        for start in range(len(words)):
            ending = " ".join(words[start:])
            if ending in self._objects:
                return self._known[ending]
        names: list[str] = []
        for thing in make_reader(table).find_things(text):
            kinds = [table.names[kind] for kind in table.list_above(thing)]
            names += [*table.list_names(thing), *kinds]
        known = (name for name in names if name in self._objects)
        return self.spell(next(known, words[-1]))


@lru_cache(maxsize=8)  # all memories of one prior have the same
def _make_type_names(prior: PriorGraph, table: AliasTable | None) -> _TypeNames:
    return _TypeNames(prior, table)
