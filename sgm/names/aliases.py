"""What things are called besides, and what they are kinds of: a table that a user extends."""

from __future__ import annotations

import csv
import io
from collections.abc import Collection, Iterable, Iterator, Mapping, MutableMapping, Sequence
from functools import lru_cache
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any, NamedTuple

from sgm.messages import shorten
from sgm.names.language import load_language
from sgm.names.sections import ENGLISH, read_file
from sgm.names.words import OWN_PLURALS, compute_singular, make_key, read_words, split_words

# Rows of one's own: a CSV file, or {name: its aliases, or {"kind": ..., "aliases": ...}}.
Aliases = str | Path | Mapping[str, Collection[str]]
Row = tuple[str, tuple[str, ...], tuple[str, ...]]  # name, kinds, aliases

COLUMNS = ("name", "kind", "aliases")
MAX_ROWS = 20_000
# Before a broad kind: a question for "food" is about all food, and who asks for an apple is not
# offered what is called "food".
_BROAD = "~"
MAX_NAMES = 100  # aliases or kinds of one thing
MAX_BYTES = 5_000_000
_EXAMPLE = 'Write {"thermos": ["vacuum flask"]} or {"thermos": {"kind": "bottle", "aliases": []}}.'


class AliasTable:
    """Things, their names, and the kinds that they belong to.

    A row is a thing: its name, the kinds above it ("iphone" is a "cell phone"), and what it is
    called besides. One name may be of several things: "glasses" are eyeglasses, and drinking
    glasses. Plural, hyphens and words written apart make no difference.

    The shipped table is `sgm/names/data/en/aliases.csv`, with columns `name`, `kind` and
    `aliases`; several kinds or aliases are separated by ";". Rows of one's own are added to it: a
    row whose name is there adds to its kinds and aliases.

    Attributes:
        rows: as they were given.
        declared: those of one's own, which a person has stated to be so.
        names: of the things, in the order of their numbers.
        longest: most words of a name.
        words: of all names, singular.
    """

    language = ENGLISH

    def __init__(self, rows: Iterable[Row] = ()) -> None:
        """Take over rows.

        Raises:
            ValueError: if a name is none (`read_words`), or a thing is a kind of itself.
        """
        self.rows = tuple(rows)
        self.declared: tuple[Row, ...] = ()
        self.names: list[str] = []
        self.longest = 1
        self.words: set[str] = set()
        self._things: dict[str, tuple[int, ...]] = {}  # by a name as it is written
        self._singular: dict[str, tuple[int, ...]] = {}
        self._names_of: dict[int, tuple[str, ...]] = {}
        self._above: dict[int, tuple[int, ...]] = {}
        self._below: dict[int, tuple[int, ...]] = {}
        self._broad: set[int] = set()
        self._number_of: dict[str, int] = {}  # by a thing's name as it is written
        self._add(self.rows)

    @classmethod
    def household(cls, extra: Aliases | None = None, language: str = ENGLISH) -> AliasTable:
        """Return the shipped table in a language, with rows of one's own added.

        Raises:
            TypeError: if the rows are neither a mapping nor a path.
            ValueError: if they are malformed, a thing is a kind of itself, or there is no such
                language.
            FileNotFoundError: if there is no such file.
        """
        shipped = _load_household() if language == ENGLISH else _load_translated(language)
        if extra is None:
            return shipped
        declared = tuple(read_rows(extra))
        return shipped._extend(declared, declared=declared)

    def with_names(self, names: Iterable[str]) -> AliasTable:
        """Return a table in which names that nothing is called are things of their own."""
        new = [(name, (), ()) for name in names if not self.find(split_words(name))]
        if not new:
            return self
        return self._extend(new, self.declared)

    def find(self, words: Sequence[str]) -> tuple[int, ...]:
        """Return the numbers of the things of this name.

        A plural is looked up as it is and in the singular: "glasses" are more than a "glass", and
        a "glass" is not a pair of glasses.
        """
        key = make_key(words)
        written = self._things.get("".join(words))
        singular = self._things.get(key) or self._singular.get(key)
        if not written or not singular:  # mostly neither
            return tuple(written or singular or ())
        return tuple(dict.fromkeys((*written, *singular)))

    def list_names(self, thing: int) -> list[str]:
        """List what a thing is called, its own name first."""
        return list(self._names_of[thing])

    def list_above(self, thing: int) -> list[int]:
        """List the kinds that a thing belongs to, the nearest first."""
        return _walk(thing, self._above)

    def list_below(self, thing: int) -> list[int]:
        """List the things that belong to a kind, the nearest first."""
        return _walk(thing, self._below)

    def is_broad(self, thing: int) -> bool:
        """Tell whether a kind is a broad one, "toy", of which the table may not know all things."""
        return thing in self._broad

    def list_sorted(self) -> frozenset[int]:
        """List the broad kinds, and all things that belong to one."""
        below = (thing for kind in self._broad for thing in self.list_below(kind))
        return frozenset(self._broad).union(below)

    def list_siblings(self, thing: int, most: int) -> list[int]:
        """List the other things of its direct kinds, of those that have at most `most` things."""
        families = [self._below[kind] for kind in self._above.get(thing, ())]
        return [
            sibling
            for family in families
            if len(family) <= most
            for sibling in family
            if sibling != thing
        ]

    def _extend(self, rows: Sequence[Row], declared: tuple[Row, ...]) -> AliasTable:
        """Return a table with more rows; what the present ones say is copied, not read again."""
        table = AliasTable()
        table.language = self.language
        table.rows = (*self.rows, *rows)
        table.declared = declared
        table.names, table.longest, table.words = [*self.names], self.longest, {*self.words}
        table._things, table._singular = {**self._things}, {**self._singular}
        table._names_of = {**self._names_of}
        table._above, table._below = {**self._above}, {**self._below}
        table._broad, table._number_of = {*self._broad}, {**self._number_of}
        table._add(rows)
        return table

    def _add(self, rows: Iterable[Row]) -> None:
        """Enter rows; raises ValueError as the constructor does."""
        entered = _Entered(
            things=_Groups(self._things),
            singular=_Groups(self._singular),
            names_of=_Groups(self._names_of),
            above=_Groups(self._above),
            below=_Groups(self._below),
        )
        for name, kinds, aliases in rows:
            thing = self._ensure(name, entered)
            for alias in aliases:
                self._call(thing, alias, entered)
            for kind in kinds:
                above = self._ensure(kind.removeprefix(_BROAD), entered)
                entered.below.add(above, thing)
                if kind.startswith(_BROAD):
                    self._broad.add(above)
                else:
                    entered.above.add(thing, above)
        for groups in entered:
            groups.finish()
        if entered.above.is_changed:
            self._check_cycles()

    def _ensure(self, name: str, entered: _Entered) -> int:
        words = split_words(read_words("name", name))
        key = "".join(words)
        if key not in self._number_of:
            self._number_of[key] = len(self.names)
            self.names.append(read_words("name", name))
            self._call(self._number_of[key], name, entered)
        return self._number_of[key]

    def _call(self, thing: int, name: str, entered: _Entered) -> None:
        entered.names_of.add(thing, read_words("name", name))
        words = split_words(name)
        self.longest = max(self.longest, len(words))
        entered.things.add("".join(words), thing)
        if words[-1] not in OWN_PLURALS:  # a "boxer" is no boxers
            entered.singular.add(make_key(words), thing)
        self.words.update(map(compute_singular, words))

    def _check_cycles(self) -> None:
        """Raise ValueError for a thing that is a kind of itself."""
        above = {thing: self._above.get(thing, ()) for thing in range(len(self.names))}
        try:
            TopologicalSorter(above).prepare()
        except CycleError as error:
            names = [self.names[thing] for thing in sorted(set(error.args[1]))]
            raise ValueError(
                f"kind must not lead back to the thing, got a circle of {shorten(names)} in the "
                "aliases. Take one of these kinds out, or make the names aliases of one thing."
            ) from None


class _Groups:
    """Adds to the groups of a table, each of which other tables may have, too."""

    def __init__(self, table: MutableMapping[Any, tuple[Any, ...]]) -> None:
        self._table = table
        self._changed: dict[Any, dict[Any, None]] = {}

    @property
    def is_changed(self) -> bool:
        """Whether anything was added."""
        return bool(self._changed)

    def add(self, key: object, member: object) -> None:
        """Add to a group what is not in it."""
        if key not in self._changed:
            self._changed[key] = dict.fromkeys(self._table.get(key, ()))
        self._changed[key][member] = None

    def finish(self) -> None:
        """Let the table have what was added."""
        self._table.update((key, tuple(group)) for key, group in self._changed.items())


class _Entered(NamedTuple):
    """What rows add to each group of a table of aliases."""

    things: _Groups
    singular: _Groups
    names_of: _Groups
    above: _Groups
    below: _Groups


def read_rows(extra: Aliases) -> Iterator[Row]:
    """Read rows of one's own; raises errors as `AliasTable.household` says."""
    if isinstance(extra, (str, Path)):
        return _read_file(Path(extra))
    if not isinstance(extra, Mapping):
        raise TypeError(
            f"aliases must be a mapping or the path of a CSV file, got {shorten(extra)}. {_EXAMPLE}"
        )
    _check_length("rows", len(extra), MAX_ROWS, "of the aliases")
    return (_read_entry(name, entry) for name, entry in extra.items())


def _read_entry(name: str, entry: Any) -> Row:
    where = f"for {shorten(name)} in the aliases"
    kinds: Any = ()
    if isinstance(entry, Mapping):
        unknown = sorted(map(str, entry.keys() - {"kind", "aliases"}))
        if unknown:
            raise ValueError(
                f"an entry must have the fields kind and aliases alone, got {shorten(unknown)} "
                f"{where}. Take the others out."
            )
        kinds, entry = entry.get("kind", ()), entry.get("aliases", ())
    kinds = (kinds,) if isinstance(kinds, str) else kinds
    for field, names in (("kind", kinds), ("aliases", entry)):
        is_list = isinstance(names, Sequence) and not isinstance(names, str)
        if not is_list or not all(isinstance(name, str) for name in names):
            raise ValueError(
                f"{field} must be a list of names, got {shorten(names)} {where}. {_EXAMPLE}"
            )
    return _make_row(name, kinds, entry, where)


def _make_row(name: str, kinds: Sequence[str], aliases: Sequence[str], where: str) -> Row:
    _check_length("kind", len(kinds), MAX_NAMES, where)
    _check_length("aliases", len(aliases), MAX_NAMES, where)
    try:
        for text in (name, *kinds, *aliases):
            read_words("name", text)
    except ValueError as error:
        raise ValueError(f"{error} It stands {where}.") from None
    return name, tuple(kinds), tuple(aliases)


def _read_file(path: Path) -> Iterator[Row]:
    if not path.is_file():
        raise FileNotFoundError(
            f"aliases must be a CSV file that exists, got {shorten(str(path))}. Check the path."
        )
    _check_length("bytes", path.stat().st_size, MAX_BYTES, f"of {path}")
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as error:
        raise ValueError(
            f"aliases must be text in UTF-8, got {shorten(error.reason)} in {path}. Save it as "
            "UTF-8."
        ) from None
    return _parse(text, str(path))


def _parse(text: str, where: str) -> Iterator[Row]:
    lines = csv.reader(io.StringIO(text, newline=""), strict=True)
    try:
        head = next(lines, [])
        if "name" not in head or not set(head) <= set(COLUMNS) or len(set(head)) < len(head):
            raise ValueError(
                f"columns must be among {', '.join(COLUMNS)}, name being one of them, got "
                f"{shorten(head)} in {where}. Write a first line `name,kind,aliases`."
            )
        for number, cells in enumerate(lines, 2):
            _check_length("rows", number - 1, MAX_ROWS, f"of {where}")
            line_place = f"in line {lines.line_num} of {where}"
            if not any(cells):
                continue
            if len(cells) != len(head):
                raise ValueError(
                    f"a row must have {len(head)} cells, got {len(cells)} {line_place}. Separate "
                    'several aliases by ";".'
                )
            fields = dict(zip(head, cells, strict=True))
            kinds, aliases = (
                [name.strip() for name in fields.get(column, "").split(";") if name.strip()]
                for column in ("kind", "aliases")
            )
            yield _make_row(fields["name"], kinds, aliases, line_place)
    except csv.Error as error:
        raise ValueError(
            f"aliases must be a CSV file, got {shorten(str(error))} in line {lines.line_num} of "
            f"{where}. Write a first line `name,kind,aliases`, and a row for each thing."
        ) from None


def _check_length(field: str, number: int, most: int, where: str) -> None:
    if number > most:
        raise ValueError(
            f"{field} must be at most {most}, got {number} {where}. Leave out what is not needed."
        )


def _walk(thing: int, edges: Mapping[int, Sequence[int]]) -> list[int]:
    """List what can be reached, the nearest first; the thing itself only by a circle."""
    found = dict.fromkeys(edges.get(thing, ()))
    order = list(found)
    for reached in order:
        new = [other for other in edges.get(reached, ()) if other not in found]
        found |= dict.fromkeys(new)
        order += new
    return order


@lru_cache(maxsize=1)
def _load_household() -> AliasTable:
    rows = [*_parse(read_file(ENGLISH, "aliases.csv"), "the shipped aliases")]
    return AliasTable([*rows, *_list_broad_kinds(read_file(ENGLISH, "kinds.csv"))])


@lru_cache(maxsize=8)
def _load_translated(code: str) -> AliasTable:
    """Return the shipped table with what a language calls its things."""
    rows = [(name, (), words) for name, _, words in load_language(code).names]
    table = _load_household()._extend(rows, ())
    table.language = code
    return table


def _list_broad_kinds(text: str) -> Iterator[Row]:
    """List the rows of a table of broad kinds, with columns `kind`, `aliases` and `things`."""
    for row in csv.DictReader(io.StringIO(text, newline="")):
        names = {column: tuple(filter(None, row[column].split(";"))) for column in row}
        yield row["kind"], (), names["aliases"]
        for thing in names["things"]:
            yield thing, (f"{_BROAD}{row['kind']}",), ()
