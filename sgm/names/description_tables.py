"""The descriptions of things, by all that a question may name them by."""

from __future__ import annotations

from bisect import insort
from collections.abc import Iterator, Sequence
from typing import Any

from sgm.arrays.table import clone
from sgm.names.aliases import Row
from sgm.names.modifiers import spell
from sgm.names.name import Name
from sgm.names.name_grammar import NameReader, Reading
from sgm.names.numbers_by_key import NumbersByKey
from sgm.names.words import split_words

Entry = tuple[int, Reading]  # number of a description, and one way to read it
_MOST_RENAMED = 20  # descriptions that are replaced one by one; of more, all are read again


class DescriptionTables:
    """Descriptions by number, in the order in which they came, and tables to find them by.

    Attributes:
        descriptions: as they were given.
        readings: of each.
        written: words of all.
        words: numbers by each word that a description says.
        things: entries by each thing that a description may be, without what it holds.
        contents: entries by each thing that it holds.
        endings: entries by the last words of a reading.
        same: numbers by what descriptions are exactly the same by (`list_keys`).
        spelled: numbers by the words without numbers.
        texts: numbers by the names without numbers.
        owners: whose things there are.
    """

    def __init__(self, reader: NameReader, declared: Sequence[Row]) -> None:
        """Start without descriptions; `declared` are rows of names that are of one thing each."""
        self._reader = reader
        self._declared = _DeclaredNames(declared)
        self._clear()

    def _clear(self) -> None:
        self.descriptions: list[str] = []
        self.readings: list[tuple[Reading, ...]] = []
        self.written: set[str] = set()
        self.words: dict[str, list[int]] = {}
        self.things: dict[int, list[Entry]] = {}
        self.contents: dict[int, list[Entry]] = {}
        self.endings: dict[str, list[Entry]] = {}
        self.same = NumbersByKey()
        self.spelled: dict[tuple[tuple[str, ...], str], list[int]] = {}
        self.texts: dict[str, list[int]] = {}
        self.owners: set[str] = set()

    def copy(self) -> DescriptionTables:
        """Return the same tables, which can be changed alone; nothing is read again."""
        copied = clone(self)
        copied.descriptions, copied.readings = list(self.descriptions), list(self.readings)
        copied.written, copied.owners = set(self.written), set(self.owners)
        copied.same = self.same.copy()
        for name in ("words", "things", "contents", "endings", "spelled", "texts"):
            table = getattr(self, name)
            setattr(copied, name, {key: list(entries) for key, entries in table.items()})
        return copied

    def update(self, descriptions: Sequence[str]) -> None:
        """Take over the descriptions of a memory; only those that are new are read."""
        known = len(self.descriptions)
        if list(descriptions[:known]) != self.descriptions:
            pairs = zip(self.descriptions, descriptions, strict=False)
            changed = [number for number, (old, new) in enumerate(pairs) if old != new]
            if len(descriptions) < known or len(changed) > _MOST_RENAMED:  # some were removed
                self._clear()
                known = 0
            else:
                for number in changed:
                    self._replace(number, descriptions[number])
        for description in descriptions[known:]:
            self._add(description)

    def _add(self, description: str) -> None:
        number = len(self.descriptions)
        self.descriptions.append(description)
        self.readings.append(self._reader.read(description))
        name = Name.read(description)
        self.owners |= {reading.owner for reading in self.readings[number] if reading.owner}
        self.written.add(name.words)
        for same in self.list_keys(name):
            self.same.add(same, number)
        for table, key, entry in self._list_places(number, name):
            entries = table.get(key)
            if entries is None:
                table[key] = [entry]
            else:
                entries.append(entry)

    def _replace(self, number: int, description: str) -> None:
        """Take over a description instead of another one, as if it had always been there."""
        before, after = Name.read(self.descriptions[number]), Name.read(description)
        for same in self.list_keys(before):
            self.same.discard(same, number)
        for table, key, _ in self._list_places(number, before):
            left = [entry for entry in table.pop(key, ()) if _get_number(entry) != number]
            if left:
                table[key] = left
        self.written.discard(before.words)
        self.descriptions[number] = description
        self.readings[number] = self._reader.read(description)
        self.owners |= {reading.owner for reading in self.readings[number] if reading.owner}
        self.written.add(after.words)
        for same in self.list_keys(after):
            self.same.add(same, number)
        for table, key, entry in self._list_places(number, after):
            insort(table.setdefault(key, []), entry, key=_get_number)

    def _list_places(
        self, number: int, name: Name
    ) -> Iterator[tuple[dict[Any, list[Any]], object, object]]:
        """List where a description stands: each table, the key in it, and what it has there."""
        readings = self.readings[number]
        yield self.spelled, (name.ordered, name.joined), number
        yield self.texts, self._reader.split_number(name.text)[0], number
        for word in readings[0].said.union(map(spell, split_words(name.text))):
            yield self.words, word, number
        for reading in readings:
            entry = number, reading
            for thing in reading.things:
                yield self.contents if reading.is_content else self.things, thing, entry
            if not reading.is_content:
                for ending in reading.endings:
                    yield self.endings, ending, entry

    def has_name(self, text: str) -> bool:
        """Tell whether something is called so, here or in the table of aliases."""
        return text in self.written or self._reader.has_name(text)

    def list_keys(self, name: Name) -> list[tuple[object, str]]:
        """List by what names are exactly the same: one of these is."""
        aliases = self._declared.list_things(name)
        return [*name.keys, *((number, name.instance) for number in aliases)]


class _DeclaredNames:
    """Names that a person declared to be of one thing."""

    def __init__(self, rows: Sequence[Row]) -> None:
        self._things: dict[object, list[int]] = {}
        for number, (name, _, aliases) in enumerate(rows):
            for declared in map(Name.read, (name, *aliases)):
                for key in (declared.ordered, declared.joined):
                    self._things.setdefault(key, []).append(number)

    def list_things(self, name: Name) -> list[int]:
        """List the numbers of the things of a name."""
        if not self._things:
            return []
        found = (*self._things.get(name.ordered, ()), *self._things.get(name.joined, ()))
        return list(dict.fromkeys(found))


def _get_number(entry: int | Entry) -> int:
    """Return the number of the description of what stands in a table."""
    return entry if isinstance(entry, int) else entry[0]
