"""Which labels of a detector are of furniture, and which of them mean the same."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from sgm.files import read_table
from sgm.messages import shorten
from sgm.names.aliases import AliasTable
from sgm.names.words import make_key, read_words, split_words

_MOST_KEPT = 10_000
# What is no piece of furniture by itself, though things lie there.
_SURFACES = frozenset(("balcony", "floor", "wall"))


class FurnitureLabels:
    """Labels of furniture with their aliases: those of the household prior, and one's own.

    Case, plural, hyphens and a number behind the name make no difference: "Couches", "sofa 2".
    """

    def __init__(self, labels: Iterable[str] | Mapping[str, Iterable[str]] = ()) -> None:
        """Take the household's labels and add some.

        Args:
            labels: further ones, or their aliases by label.

        Raises:
            TypeError: if they are one text.
            ValueError: if a label or an alias is no name.
        """
        if isinstance(labels, str):
            raise TypeError(
                f"labels of furniture must be a list, got {shorten(labels)}. Write ['workbench']."
            )
        self._meanings: dict[str, dict[str, None]] = {}
        # What was found and compared, for every frame asks.
        self._found: dict[str, tuple[str, ...]] = {}
        self._same: dict[tuple[str, str], bool] = {}
        table = AliasTable.household()
        for record in read_table("sgm.prior", "household_furniture.csv"):
            label = record["label"]
            aliases = [*filter(None, record["also"].split("|"))]
            for name in (label, *aliases):
                for thing in table.find(split_words(name)):
                    aliases += table.list_names(thing)
            self._add(label, aliases)
        aliases_by_label: Mapping[str, Iterable[str]]
        aliases_by_label = (
            labels if isinstance(labels, Mapping) else {label: () for label in labels}
        )
        for label, names in aliases_by_label.items():
            self._add(label, names)
        for label in [*self._labels]:  # a label means itself before all else
            key = _make_key(label)
            self._meanings[key] = {label: None} | self._meanings[key]

    @classmethod
    def from_values(cls, data: Any, where: str = "names of furniture") -> FurnitureLabels:
        """Read what a file of names holds: aliases by label, or labels alone.

        Raises:
            ValueError: if it is neither; names the label.
        """
        aliases_by_label = {} if data is None else data
        if isinstance(aliases_by_label, list):
            aliases_by_label = {str(label): [] for label in aliases_by_label}
        if isinstance(aliases_by_label, Mapping):
            aliases_by_label = {
                str(label): [names] if isinstance(names, str) else [] if names is None else names
                for label, names in aliases_by_label.items()
            }
        if not isinstance(aliases_by_label, Mapping) or not all(
            isinstance(names, list) and all(isinstance(name, str) for name in names)
            for names in aliases_by_label.values()
        ):
            raise ValueError(
                f"names of furniture must be aliases by label, got {shorten(data)} in {where}. "
                "Write fridge: [Kühlschrank]."
            )
        try:
            return cls(aliases_by_label)
        except ValueError as error:
            raise ValueError(f"{error} In {where}.") from None

    def _add(self, label: str, aliases: Iterable[str]) -> None:
        label = read_words("label of furniture", label)
        for name in (label, *aliases):
            key = _make_key(read_words("alias of furniture", name))
            self._meanings.setdefault(key, {})[label] = None

    @property
    def _labels(self) -> dict[str, None]:
        return {label: None for labels in self._meanings.values() for label in labels}

    def find(self, name: str) -> tuple[str, ...]:
        """Return the labels that a name may mean, the likeliest first; none for a thing."""
        found = self._found.get(name)
        if found is None:
            if len(self._found) >= _MOST_KEPT:
                self._found.clear()
            found = self._found[name] = tuple(self._meanings.get(_make_key(name), ()))
        return found

    def find_label(self, name: str) -> str | None:
        """Return the label of a piece of furniture that may be found; None for anything else."""
        found = self.find(name)
        return None if not found or set(found) <= _SURFACES else found[0]

    def are_same(self, name: str, other: str) -> bool:
        """Tell whether two names may be of one piece of furniture.

        They have a meaning in common, or are furniture of one last word: a "coffee table" may be
        called a "table", or a "dining table" by a detector that knows no other.
        """
        pair = name, other
        found = self._same.get(pair)
        if found is None:
            if len(self._same) >= _MOST_KEPT:
                self._same.clear()
            found = self._same[pair] = self._compare(name, other)
        return found

    def _compare(self, name: str, other: str) -> bool:
        found, others = self.find(name), self.find(other)
        if set(found) & set(others) or _make_key(name) == _make_key(other):
            return True
        return bool(found and others) and _get_head(name) == _get_head(other)


def _make_key(name: str) -> str:
    return make_key(_list_words(name))


def _get_head(name: str) -> str:
    return make_key(_list_words(name)[-1:])


def _list_words(name: str) -> tuple[str, ...]:
    """Return the words of a name without a number behind them."""
    words = split_words(name)
    while len(words) > 1 and words[-1].isdecimal():
        words = words[:-1]
    return words
