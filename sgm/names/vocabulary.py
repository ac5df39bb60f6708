"""The labels of a memory's nodes, and the type that a description names."""

from __future__ import annotations

from collections.abc import Sequence

from sgm.arrays.table import clone
from sgm.names.aliases import AliasTable
from sgm.names.name_grammar import make_reader
from sgm.names.words import read_words
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
        self._table = table
        names = [*prior.rooms, *(row.label for row in prior.furniture)]
        objects = {read_words("label", row.label): row.label for row in prior.objects}
        self._known = {read_words("label", name): name for name in names} | objects
        self._known_objects = objects
        self._type_of = {row.label: index for index, row in enumerate(prior.objects)}
        self._index = {label: index for index, label in enumerate(labels)}
        self.labels = list(self._index)

    def with_labels(self, labels: Sequence[str]) -> Vocabulary:
        """Return the vocabulary of the same prior after other labels came up."""
        other = clone(self)
        other._index = {label: index for index, label in enumerate(labels)}
        other.labels = list(other._index)
        return other

    def number(self, label: str) -> int:
        """Return the index of a label, giving it one if it is new."""
        words = read_words("label", label)
        label = self._known.get(words, words)
        if label not in self._index:
            self._index[label] = len(self.labels)
            self.labels.append(label)
        return self._index[label]

    def get_text(self, label: str) -> str:
        """Return a label as the prior spells it, its words if the prior does not know it."""
        return self.labels[self.number(label)]

    def find_type(self, description: str) -> tuple[int, int]:
        """Return the label index and the prior's object type (-1: none) of a description.

        Its label is the longest known type that the name of the thing ends with, else what the
        thing is called besides, else a kind above it, else its last word.
        """
        words = read_words("description", description).split()
        starts = range(len(words))
        own = (start for start in starts if " ".join(words[start:]) in self._known_objects)
        start = next(own, len(words) - 1)
        # A type of several words says more than its parts: a "large bottle of soap" is no soap.
        is_named = len(words) - start > 1 and not {"of", "with", "in"} & set(words[:start])
        is_exact = " ".join(words) in self._known_objects
        if self._table is not None and not is_exact and not is_named:
            return self._read_type(" ".join(words), self._table)
        return self._number_type(" ".join(words[start:]))

    def _number_type(self, name: str) -> tuple[int, int]:
        label = self.number(name)
        return label, self._type_of.get(self.labels[label], -1)

    def _read_type(self, description: str, table: AliasTable) -> tuple[int, int]:
        """Find the type by the grammar of names and the table of aliases."""
        words, things = make_reader(table).read_things(description)
        names = [" ".join(words[start:]) for start in range(len(words))]
        for thing in things:
            kinds = [table.names[kind] for kind in table.list_above(thing)]
            names += [*table.list_names(thing), *kinds]
        known = next((name for name in names if name in self._known_objects), words[-1])
        return self._number_type(known)
