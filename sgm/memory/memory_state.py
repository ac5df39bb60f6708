"""The state that all parts of a memory share, and how it takes looks, statements and questions."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock, RLock
from typing import Any

import numpy as np

from sgm.arrays.table import clone
from sgm.layout.called import CalledFurniture
from sgm.layout.layout import FurnitureNames
from sgm.memory.clock import make_clock_rows
from sgm.memory.given_names import GivenNames
from sgm.memory.home_rows import (
    find_keys,
    list_said_rows,
    list_seen_rows,
    write_home_file,
)
from sgm.memory.lone_looks import SoughtLooks, add_sought, note_lone_look
from sgm.memory.look import StepLog, StepLook, average_coverage
from sgm.memory.look_weights import SURE
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_content import MemoryContent
from sgm.memory.merged_things import find_roots
from sgm.memory.queries import Queries
from sgm.memory.seen_positions import forget_positions, note_positions
from sgm.memory.sighting import SeenAt, Sighting
from sgm.memory.thing import Pictured, Said, SaidOf, Thing, ThingName, ThingRows
from sgm.memory.written_tables import fill_tables, view_tables
from sgm.messages import warn_caller
from sgm.names.aliases import AliasTable
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_index import NameIndex
from sgm.names.name_matching import Similarity
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import NEVER, RELATIONS
from sgm.store.home_file import HomeFile
from sgm.store.past import Past

_HOME = np.zeros(1, dtype=np.int64)  # the number of the only home of the batch
_MOST_INDEXES = 16  # of names to choose from that are kept
MOST_NEW = 1000  # events until all that the memory holds is written, too
# What an event says only where there is any.
_LEFT_OUT = ("by", "box", "open_cost", "hidden", "viewpoint", "is_named")


@dataclass(frozen=True, slots=True)
class BeforeLooks:
    """What a memory was before the looks of a time step, from which Bayes' rule starts.

    Attributes:
        batch: a copy of it.
        origin: stands for its state, as in `Asked`.
        asked: row of the object whose hypothetical edges were open then.
        sought: looks for what it does not know, as `MemoryState.sought`.
    """

    batch: MemoryBatch
    origin: object
    asked: int | None
    sought: dict[tuple[str, int], SoughtLooks]


def write_file(content: MemoryContent, path: Path) -> None:
    """Write a new file of a content; see `write_home_file`."""
    about = content.prior, content.clock, content.layout, content.things, content.tables
    write_home_file(path, *about, content.to_snapshot(0))


def add_snapshot(content: MemoryContent, file: HomeFile, number: int) -> None:
    """Write a content as it was after the event of that number into its file."""
    seconds = None if content.clock is None else content.clock.step_seconds
    file.add_snapshot(content.to_snapshot(number), seconds)


class MemoryState:
    """The state of a `SceneGraphMemory`, which is given to each of its parts.

    That is one home as a batch and what it is called, the lock before it, and its file. It is made
    of a `MemoryContent`, and `get_content` is a view of it: what a file, a copy or the memory
    without some of its nodes is made of.

    A part holds the lock while it reads or changes anything, and writes a change into the file
    before it makes it.

    Attributes:
        lock: held by every call, from its first word on the state to its last.
        file: where changes are written; None for nowhere.
        reader: of the file that another process writes, where this memory is read along.
        prior: where things tend to be.
        vocabulary: labels by index.
        clock: what time it is at every time step; None if it is unknown.
        layout: rooms and furniture.
        things: the objects, what is not in their table, (O,).
        has_merged: whether any of them was merged with another.
        step: looks of the present time step.
        before: the memory before the first of them; None without any.
        sought, score_calibration, renamed: as in `MemoryContent`.
        asked: row of the object whose hypothetical edges are open.
        language: code of the language in which is asked and answered.
        version: another object after each change of the batch.
    """

    lock: RLock
    file: HomeFile | None
    reader: Past | None
    step: StepLog
    before: BeforeLooks | None
    sought: dict[tuple[str, int], SoughtLooks]
    renamed: GivenNames
    version: object
    _is_layout_new: bool  # whether the batch has yet to take it over
    _furniture: FurnitureNames | None
    _called: CalledFurniture | None

    def __init__(
        self,
        content: MemoryContent,
        prior: PriorGraph,
        table: AliasTable,
        encoder: NameEncoder | None = None,
    ) -> None:
        """Begin with a content.

        `table` says what things are called besides, and which names are of which type of the prior;
        `encoder` gives vectors of names that are not in it.
        """
        self.lock, self.file, self.reader = RLock(), None, None
        self._naming = Lock()  # never waited for while the lock is held
        self._table, self._encoder = table, encoder
        self.language = table.language
        self.begin(content, prior)

    def begin(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content and prior."""
        self.prior = prior
        labels = (object_type.label for object_type in prior.objects)
        self._names = NameIndex(labels, self._table, self._encoder)
        self._indexes: dict[tuple[tuple[str, ...], bool], NameIndex] = {}  # of names to choose from
        self._snapshot: dict[object, MemoryBatch] = {}  # of one version at most
        self.take(content)

    def copy(self) -> MemoryState:
        """Return a state of the same content that goes its own way; it has no file.

        Nothing is counted again, no name is read again, and what policies believed of it holds
        (`version`).
        """
        with self.lock:
            called = self.things.names
        with self._naming:
            self._names.update(called)  # once for all copies
            names = self._names.copy()
        with self.lock:
            copied, batch = clone(self), self.batch.copy()
            copied.lock, copied._naming, copied._names = RLock(), Lock(), names
            copied._indexes = {}
            copied.file = copied.reader = None
            copied.layout, copied._furniture, copied._called = self.layout.copy(), None, None
            copied.things, copied.step = self.things.copy(), self.step.copy()
            copied.vocabulary, copied._batch = self.vocabulary.copy(), batch
            batch.labels = copied.vocabulary.labels
            copied.sought, copied.renamed = dict(self.sought), dict(self.renamed)
            copied._snapshot = dict(self._snapshot)
            if self.before is not None:
                copied.before = replace(self.before, sought=dict(self.before.sought))
            if self.asked is not None:
                copied.query_row(self.asked)
                batch.count_history(self.batch.history.copy())  # to ask again is no new question
        return copied

    def write(
        self,
        kind: str,
        time: int | None = None,
        look: StepLook | None = None,
        **values: Any,
    ) -> None:
        """Write a change (`MemoryEvent`) into the file, if there is one, before it is made.

        A file that was moved or removed is begun anew. Now and then all that the memory holds is
        written, too, so that the next start has few events to make again.

        Args:
            kind: what was called.
            time: time step after it; None for the present one.
            look: with probabilities as confidences, of a look.
            values: arguments.

        Raises:
            ValueError: if another memory or process has the file.
            OSError: if another file lies in its place, or it cannot be written; nothing is written.
        """
        file = self.renew_lost_file()
        if file is None:
            return
        if file.num_new >= MOST_NEW:
            add_snapshot(self.get_content_to_save(), file, file.number)
        said = {
            name: value
            for name, value in values.items()
            if name not in _LEFT_OUT or value not in (None, ())
        }
        if look is not None:
            rows = list_seen_rows(look.furniture, look.seen)
        else:
            rows = list_said_rows(kind, said)
        file.append(kind, self.time if time is None else time, said, find_keys(kind, values), rows)

    def renew_lost_file(self) -> HomeFile | None:
        """Begin the file anew if it was moved or removed, and warn who called the memory.

        An open transaction ends in the file in which it began.
        """
        file = self.file
        if file is not None and file.is_held and not file.is_writing and file.is_lost():
            warn_caller(f"the memory file was moved or removed: it is begun anew at {file.path}")
            file.close()
            write_file(self.get_content_to_save(), file.path)
            self.file = HomeFile(file.path)
            self.file.kept_bytes, self.file.kept_days = file.kept_bytes, file.kept_days
        return self.file

    def resolve(
        self,
        question: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which things a question means; see `SceneGraphMemory.resolve`."""
        if among is not None:
            with self._naming:
                return self._index(among, self._encoder).resolve(question, similarity)
        with self.lock:
            names, is_id = self.things.names, self.things.has_id(question)
        if is_id:
            return Resolution(question, (question,), "exact")
        with self._naming:  # no other call waits for text vectors
            self._names.update(names)
            return self._names.resolve(question, similarity)

    def read_sentence(self, question: str, speaker: str) -> Sentence:
        """Read what a sentence asks for; see `SceneGraphMemory.read_sentence`."""
        with self.lock:
            names, is_id = self.things.names, self.things.has_id(question)
        if is_id:
            return Sentence(kind="thing", things=(question,), text=question)
        with self._naming:
            self._names.update(names)
            return self._names.read_sentence(question, speaker)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which things are exactly of a name; see `SceneGraphMemory.resolve_exact`."""
        if among is not None:
            with self._naming:
                return self._index(among).resolve_exact(name)
        with self.lock:
            names, is_id = self.things.names, self.things.has_id(name)
        if is_id:
            return Resolution(name, (name,), "exact")
        with self._naming:
            self._names.update(names)
            return self._names.resolve_exact(name)

    def match(self, thing: str | ThingName) -> Resolution:
        """Say which descriptions are exactly of a name, and what else may be meant."""
        if isinstance(thing, ThingName):
            return Resolution(str(thing), (), "unknown")
        read_words("thing", thing)
        return self.resolve_exact(thing)

    def _index(self, names: Sequence[str], encoder: NameEncoder | None = None) -> NameIndex:
        """Return the index of names to choose from, which is kept: rooms and places are few."""
        key = tuple(names), encoder is not None
        index = self._indexes.get(key)
        if index is None:
            index = NameIndex((), self._table, encoder)
            index.update(key[0])
            if len(self._indexes) >= _MOST_INDEXES:
                self._indexes.clear()
            self._indexes[key] = index
        return index

    def take(self, content: MemoryContent) -> None:
        """Become a memory of that content; prior weights are looked up again."""
        self.sought = {}
        self.vocabulary = Vocabulary(self.prior, content.labels, self._table)
        self.layout, self._furniture, self._called = content.layout, None, None
        self.clock, self.score_calibration = content.clock, content.score_calibration
        arrays = self.layout.make_arrays(self.vocabulary, self.prior)
        batch = self._batch = MemoryBatch([], arrays, clock=make_clock_rows([content.clock]))
        self._is_layout_new = False
        batch.labels = self.vocabulary.labels  # one list: grows with the vocabulary
        batch.time = content.time
        self.things = ThingRows(content.things)
        self._ensure_rows(0)
        batch.edges.append(len(content.tables["edges"]["object"]))
        batch.positions.append(len(content.tables["positions"]["object"]))
        batch.lone_looks.append(len(content.tables["lone_looks"]["object"]))
        fill_tables(batch.tables, content.tables)
        self.has_merged = bool((batch.objects["same_as"] >= 0).any())
        batch.look_up_prior()  # of every edge
        self.asked = content.asked
        if content.asked is not None:
            self.query_row(content.asked)
        batch.count_history(content.history)  # now: to ask again is no new question
        self.sought, self.renamed = dict(content.sought), dict(content.renamed)
        self.begin_anew()
        between = deque(content.between)
        for number in range(len(content.looks) + 1):
            if number:
                self.look(content.looks[number - 1])
            while between and between[0][0] == number:
                _, event = between.popleft()
                if isinstance(event, str):
                    self.query(event)
                else:
                    self.say(event)

    def get_content(self, batch: MemoryBatch | None = None) -> MemoryContent:
        """Return a view of what the memory holds, or held when a copy of its batch was made."""
        batch = self.batch if batch is None else batch
        return MemoryContent(
            time=batch.time,
            prior=self.prior.checksum,
            labels=tuple(batch.labels),
            layout=self.layout,
            things=tuple(self.things)[: batch.objects.num_rows],
            tables=view_tables(batch.tables),
            history=batch.history,
            asked=self.asked,
            clock=self.clock,
            sought=dict(self.sought),
            renamed=dict(self.renamed),
            score_calibration=self.score_calibration,
        )

    def get_content_to_save(self) -> MemoryContent:
        """Return the content before the looks of this step, and these looks."""
        content, step, before = self.get_content(), self.step, self.before
        if before is None:  # now that a new layout was taken over
            return content
        content = self.get_content(before.batch)
        things, said = list(content.things), Counter[int]()
        for _, event in step.between:
            if isinstance(event, SaidOf) and event.statement is not None:
                said[self.things.get_row(Name.read(event.name.description), event.name.id)] += 1
        for object_row, number in said.items():
            if object_row < len(things):  # it was not said yet
                statements = things[object_row].statements[:-number]
                things[object_row] = replace(things[object_row], statements=statements)
        return replace(
            content,
            things=tuple(things),
            asked=before.asked,
            sought=before.sought,
            looks=tuple(step.looks),
            between=tuple(step.between),
        )

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home; see `SceneGraphMemory.batch`."""
        if self._is_layout_new:
            self.update_layout()
        return self._batch

    @property
    def time(self) -> int:
        """Steps since the start; known without taking over a new layout."""
        return self._batch.time

    @property
    def furniture(self) -> FurnitureNames:
        """What is said of the furniture, in the order of the batch."""
        if self._furniture is None:
            self._furniture = FurnitureNames.of(self.layout)
        return self._furniture

    @property
    def called(self) -> CalledFurniture:
        """Finds the furniture by its names."""
        if self._called is None:
            self._called = CalledFurniture(self.layout)
        return self._called

    def find_place(self, furniture: int) -> int:
        """Return where in the batch a furniture node is; raises KeyError for no such id."""
        place = self.furniture.position.get(furniture) if type(furniture) is int else None
        if place is None:
            self.layout.check_furniture(furniture)
            place = self.furniture.position[int(furniture)]
        return place

    def look(self, look: StepLook) -> None:
        """Fold one look at a furniture node in; see `SceneGraphMemory.observe`.

        From the `MOST_LOOKS`-th look of a time step on that shows the same, further ones are left
        out: frames of a video are no looks. That is whatever they show, and as long as nothing of
        it was seen elsewhere meanwhile.
        """
        if look.sought:
            self._look_for(look)
            return
        furniture, seen, batch = look.furniture, look.seen, self.batch
        place, step = self.furniture.position[furniture], self.step
        if step.is_repeated(look) and not self._has_come_back(furniture, seen):
            return
        step = self._begin_look(furniture)
        things, rows, relations, confidences = self.things, [], [], []
        num_known, has_position = batch.objects.num_rows, False
        for sighting in seen:
            object_row = things.add(sighting.name, sighting.id or "")
            rows.append(object_row)
            relations.append(RELATIONS.index(sighting.relation))
            confidences.append(sighting.confidence)
            has_position |= sighting.position is not None
            if sighting.embedding and sighting.confidence >= SURE:
                things[object_row] = replace(things[object_row], embedding=sighting.embedding)
            if sighting.picture is not None and sighting.confidence >= SURE:
                things[object_row] = things[object_row].note_picture(
                    Pictured(batch.time, furniture, sighting.relation, sighting.picture)
                )
        if rows and max(rows) >= num_known:
            self._ensure_rows(num_known)
        hidden = self.find_rows(*look.hidden) if look.hidden else []
        twins = self._list_twins(rows, place) if rows else []
        batch.observe(
            _HOME,
            np.array([place]),
            np.array(rows, dtype=np.int64),
            np.array(relations, dtype=np.int64),
            np.array([look.coverage], dtype=float),
            np.array(confidences, dtype=float),
            np.array(hidden, dtype=np.int64),
            is_again=step.is_again(look),
        )
        if has_position:
            note_positions(batch.positions, place, rows, seen, batch.time)
        before = step.shown.get(furniture, {})
        for object_row in rows:
            if object_row not in step.at_once:
                step.at_once[object_row] = int(batch.objects["num_at_once"][object_row])
        step.at_once.update(dict.fromkeys(twins, 2))
        step.add(look, Counter(rows))
        at_once = batch.objects["num_at_once"]
        for object_row in {*rows, *before}:
            at_once[object_row] = self._count_at_once(object_row)

    def _begin_look(self, furniture: int | None = None) -> StepLog:
        """Keep the memory before the first look of a step, and return what to note a look in."""
        if furniture is not None and self.step.is_full(furniture):
            self.begin_anew()
        if self.before is None:
            sought = dict(self.sought)
            snapshot = self.get_snapshot()
            self.before = BeforeLooks(snapshot, self.version, self.asked, sought)
        self.version = object()
        return self.step

    def _has_come_back(self, furniture: int, seen: Sequence[Sighting]) -> bool:
        """Tell whether a look shows a thing that another place has shown since this one."""
        rows = (self.things.get_row(sighting.name, sighting.id or "") for sighting in seen)
        at_once, shown = self.batch.objects["num_at_once"], self.step.last_shown
        return any(
            at_once[object_row] < 2 and shown.get(object_row, (0, None))[1] != furniture
            for object_row in rows
        )

    def _count_at_once(self, object_row: int) -> int:
        """Return how many things of an object are known at once.

        Those of one look; where several are known, all that the latest looks of a step show. What
        one look after another shows at two places is one thing that was moved meanwhile.
        """
        number = self.step.at_once[object_row]
        if number > 1 and not self._is_single(object_row):
            return max(number, self.step.count_shown(object_row))
        return number

    def _list_twins(self, rows: Sequence[int], place: int) -> list[int]:
        """Return the things (n,) that are seen at a place, and so show that there are two of them.

        So does one that was seen there before, and never missed, and was seen elsewhere in between,
        if two of the three sightings were in one time step: else it went and came back so soon.
        """
        edges, others = self.batch.edges, self.batch.objects["last_furniture"]
        is_held = (edges["furniture"] == place) & edges["is_true"]
        held = set(edges["object"][is_held].tolist()).intersection(rows)
        away = [object_row for object_row in held if others[object_row] not in (NEVER, place)]
        return [object_row for object_row in away if self._has_twin(object_row, place)]

    def _has_twin(self, object_row: int, place: int) -> bool:
        """Tell whether a thing that was seen at a place, and elsewhere since, is two now."""
        objects, edges = self.batch.objects, self.batch.edges
        if self._is_single(object_row):
            return False
        other, last = (objects[name][object_row] for name in ("last_furniture", "last_observed"))
        seen = (edges["object"] == object_row) & edges["is_true"]
        seen_here = edges["last_true"][seen & (edges["furniture"] == place)]
        is_soon = (seen_here == last) | (last == self.batch.time)
        return bool(is_soon.any() and (edges["furniture"][seen] == other).any())

    def _is_single(self, object_row: int) -> bool:
        """Tell whether a thing is one alone; see `ThingRows.is_single`."""
        label = self.vocabulary.labels[self.batch.objects["label"][object_row]]
        return self.things.is_single(object_row, label)

    def _look_for(self, look: StepLook) -> None:
        """Fold in a look for one thing alone, by its name or id, which did not find it.

        It counts for all things of that name. Of a name that no thing has, it is kept by its words
        (`sought`) until a thing has it.
        """
        rows, found = self.find_rows(look.sought), self.step.num_until_seen
        since = [
            found.get(member, {}).get(look.furniture, 0)
            for object_row in rows
            for member in self.list_members(object_row)
        ]
        if self.step.is_repeated(look, max(since, default=0)):
            return
        step, coverage = self._begin_look(), average_coverage(look.coverage)
        place, batch = self.furniture.position[look.furniture], self.batch
        for object_row in rows:
            members, is_again = self.list_members(object_row), step.is_again(look)
            batch.note_absent(members, place, coverage, is_again=is_again)
        if not rows:
            words = read_words("description", look.sought)
            looks = self.sought.get((words, look.furniture), ())
            self.sought[words, look.furniture] = add_sought(looks, batch.time, coverage)
        step.add(look, {})

    def say(self, said: SaidOf) -> None:
        """Take over what was said of a thing, or what the robot did with it.

        Of several things of one description, it is no longer at `was_at`; None for all its places.
        """
        statement, ids = said.statement, self.furniture.ids
        if self.before is not None:
            self.step.between.append((len(self.step.looks), said))
        self.version = object()
        object_row = self.ensure_object(Name.read(said.name.description), said.name.id)
        batch, members = self.batch, self.list_members(object_row)
        if statement is None:
            self._lose(members)
            return
        edges = batch.edges
        is_left = np.isin(edges["object"], members) & edges["is_true"]
        if said.was_at is not None:
            is_left &= edges["furniture"] == ids.index(said.was_at)
        elif batch.objects["num_at_once"][object_row] > 1:
            is_left[:] = False
        place = relation = NEVER
        if statement.furniture is not None and statement.relation is not None:
            place = ids.index(statement.furniture)
            relation = RELATIONS.index(statement.relation)
            is_left &= (edges["furniture"] != place) | (edges["relation"] != relation)
        left = np.flatnonzero(is_left)
        if said.was_at is not None and len(left):
            self._note_several(object_row, np.isin(edges["object"], members) & ~is_left)
        places = sorted({ids[index] for index in edges["furniture"][left] if index != place})
        batch.note_left(left, statement.confidence)
        forget_positions(batch.positions, members, {place, *edges["furniture"][left].tolist()})
        if place < 0:
            batch.note_carried(object_row)
        else:
            batch.note_place(object_row, place, relation, statement.confidence)
        num_observed = int(batch.objects["num_observed"][object_row])
        statement = replace(statement, was_at=tuple(places), num_observed=num_observed)
        self.things[object_row] = self.things[object_row].add(statement)
        if self.before is None:
            self.begin_anew()
        else:
            for member in members:
                said_at = statement.furniture if member == object_row else None
                self.step.say(member, said_at, places)

    def _lose(self, members: Sequence[int]) -> None:
        """Let a thing, by its rows, be where it was seen last: at furniture that was removed."""
        objects, step = self.batch.objects, self.step
        if objects["num_at_once"][members[0]] > 1:
            return
        objects["last_furniture"][list(members)] = NEVER
        if self.before is not None:
            for member in members:
                step.left.setdefault(member, set()).update(step.num_until_seen.get(member, ()))
                step.last_shown.pop(member, None)

    def _note_several(self, object_row: int, is_other: np.ndarray) -> None:
        """Note that one of several was taken, where others of the edges (E,) are true."""
        places = np.unique(self.batch.edges["furniture"][is_other & self.batch.edges["is_true"]])
        if len(places) and not self._is_single(object_row):
            number = max(len(places) + 1, int(self.batch.objects["num_at_once"][object_row]))
            self.batch.objects["num_at_once"][object_row] = number
            self.step.at_once[object_row] = number

    def get_snapshot(self) -> MemoryBatch:
        """Return a copy of the batch as it is, made once for all who only read it."""
        batch = self.batch
        if self.version not in self._snapshot:
            self._snapshot = {self.version: batch.copy()}
        return self._snapshot[self.version]

    def ensure_object(self, name: Name, id: str = "") -> int:
        """Return the row of an object node, adding the node if it is new; see `ThingRows.add`."""
        object_row = self.things.add(name, id)
        if object_row == self.batch.objects.num_rows:
            self._ensure_rows(object_row)
        return object_row

    def _ensure_rows(self, first: int) -> None:
        """Let the batch have the nodes of all things from a row on."""
        rows = np.arange(first, len(self.things))
        self.batch.ensure_objects(np.zeros_like(rows), rows, *self.find_kinds(rows.tolist()))
        if self.sought:
            self.take_sought(rows.tolist())

    def find_kinds(self, rows: Sequence[int]) -> np.ndarray:
        """Return the labels and types of objects, int64 (2, n)."""
        kinds = [self.vocabulary.find_type(self.things[row].description) for row in rows]
        return np.array(kinds, dtype=np.int64).reshape(-1, 2).T

    def take_sought(self, rows: Sequence[int]) -> None:
        """Let objects that are new have the looks for what had their names."""
        self.move_sought(self.sought, self.batch, rows)

    def move_sought(
        self, sought: dict[tuple[str, int], SoughtLooks], batch: MemoryBatch, rows: Sequence[int]
    ) -> None:
        """Let objects of a batch have the looks for their names, taken out of `sought`."""
        for object_row in rows:
            words = set(self.things.list_words([object_row]))
            for key in [key for key in sought if key[0] in words]:
                place = self.furniture.position[key[1]]
                for time, coverage in sought.pop(key):
                    note_lone_look(batch.lone_looks, object_row, place, time, coverage)

    def list_members(self, object_row: int) -> list[int]:
        """Return the rows of all nodes that were merged with one, itself first."""
        if object_row < 0 or not self.has_merged:
            return [object_row]
        members = np.flatnonzero(find_roots(self.batch.objects["same_as"]) == object_row).tolist()
        return [object_row, *(member for member in members if member != object_row)]

    def find_rows(self, *names: str | Name) -> list[int]:
        """Return the rows of all things of some names, or of the ones of those ids, each once.

        Of nodes that were merged, that is the one that stands for all.
        """
        rows = [object_row for name in names for object_row in self.things.find_rows(name)]
        if rows and self.has_merged:
            rows = find_roots(self._batch.objects["same_as"])[rows].tolist()
        return list(dict.fromkeys(rows))

    def number_looks(
        self, members: Sequence[int], places: Sequence[SeenAt]
    ) -> list[tuple[SeenAt, int]]:
        """Return places of a thing by its rows, with how many looks of this step led to it there.

        That is 0 for what was seen before.
        """
        found = [self.step.num_until_seen.get(member, {}) for member in members]
        return [
            (
                seen,
                max(looks.get(seen.furniture, 0) for looks in found)
                if seen.furniture is not None and seen.steps_ago == 0
                else 0,
            )
            for seen in places
        ]

    def get_said(self, object_row: int) -> Said:
        """Return what was said of an object, and of what was merged with it."""
        things, members = self.things, self.list_members(object_row)
        spoken_of = [number for number in members if things[number].statements]
        if not spoken_of:
            return Said(things.join(members), members)
        spoken_last = max(spoken_of, key=lambda number: things[number].statements[-1].time)
        last, objects = things[spoken_last].statements[-1], self.batch.objects
        others = [number for number in members if number != spoken_last]
        is_last = objects["num_observed"][spoken_last] == last.num_observed
        is_last = is_last and (objects["last_observed"][others] <= last.time).all()
        return Said(things.join(members), members, last if is_last else None)

    def get_thing(self, object_row: int) -> Thing:
        """Return an object with all that was said of it, and of what was merged with it."""
        return self.things.join(self.list_members(object_row))

    def list_spoken_of(self) -> list[int]:
        """Return the rows of the objects of which something was said, or of what they are now."""
        rows = [object_row for object_row, thing in enumerate(self.things) if thing.statements]
        if rows and self.has_merged:
            return sorted(set(find_roots(self.batch.objects["same_as"])[rows].tolist()))
        return rows

    def fuse_batch(self) -> MemoryBatch:
        """Return the memory with what was merged as one; a copy, where anything was."""
        return self.fuse(self.batch) if self.has_merged else self.batch

    def fuse(self, batch: MemoryBatch) -> MemoryBatch:
        """Return a copy in which what was merged is one, and is where this step has shown it last.

        It is of this step; of what the robot carries that says nothing.
        """
        fused, shown = batch.fuse(), self.step.last_shown
        roots = find_roots(batch.objects["same_as"])
        for object_row in sorted(shown, key=shown.__getitem__):
            position = self.furniture.position[shown[object_row][1]]
            if fused.objects["last_furniture"][roots[object_row]] != NEVER:
                fused.objects["last_furniture"][roots[object_row]] = position
        return fused

    def query(self, description: str) -> Queries:
        """Open the hypothetical edges of an object until the next step."""
        if self.before is not None:  # what it opens is a part of what later looks do
            self.step.between.append((len(self.step.looks), description))
        self.version = object()
        object_row = self.asked = self.ensure_object(Name.read(description))
        return self.query_row(object_row)

    def query_row(self, object_row: int) -> Queries:
        """Open the hypothetical edges of an object node by its row."""
        objects = self.batch.objects
        return self.batch.query(
            _HOME,
            np.array([object_row]),
            objects["label"][[object_row]],
            objects["type"][[object_row]],
        )

    def begin_anew(self) -> None:
        """Let what the memory holds now be what the further looks of this step are held against."""
        self.version = object()
        self.step, self.before = StepLog(), None

    def update_layout(self) -> None:
        """Let the batch take over rooms and furniture, and look up the prior again."""
        arrays = self.layout.make_arrays(self.vocabulary, self.prior)
        self._batch.set_layout(arrays)
        if self.before is not None:
            self.copy_before().set_layout(arrays)
        self._is_layout_new = False

    def note_new(self, label: str | None = None) -> None:
        """Note that the layout has changed, perhaps by something with a label."""
        if label is not None:
            self.vocabulary.number(label)  # now: labels are numbered in the order they come up
        self._is_layout_new = True
        self._furniture = self._called = None
        self.keep_looks()

    def keep_looks(self) -> bool:
        """Tell whether there are looks of this step that stay apart from a change; see above."""
        before, is_asked = self.before, self.asked is not None
        is_asked |= any(isinstance(event, str) for _, event in self.step.between)
        self.version, self.asked = object(), None
        if before is not None and (is_asked or before.asked is not None):
            self.begin_anew()
        return self.before is not None

    def copy_before(self) -> MemoryBatch:
        """Return the memory before the looks of this step, to be changed."""
        assert self.before is not None
        batch = self.before.batch.copy()
        batch.labels = list(self.vocabulary.labels)
        self.before = replace(self.before, batch=batch, origin=object())
        return batch

    def let_pass(self, num_steps: int) -> None:
        """Let time steps pass; what was asked for is open no longer."""
        snapshot = self._snapshot.get(self.version)
        self.batch.step()
        self.batch.time += num_steps - 1
        self.asked = None
        self.begin_anew()
        if snapshot is not None:  # only the time is another one
            snapshot = snapshot.share()
            snapshot.time = self.batch.time
            self._snapshot = {self.version: snapshot}

    def open_looks(self, *, knows_all: bool = False) -> MemoryBatch:
        """Return the batch in which to make a change before `close_looks` sees these looks again.

        That is the memory before the looks of this step, which `knows_all` objects of these, if so
        said; or the memory itself, where there are none, or as `list_changed` says.
        """
        present = self.batch  # takes over the layout, which makes another memory before the looks
        if not self.keep_looks():
            return present
        before = self.copy_before()
        if knows_all:
            self.add_to(before)
        return before

    def close_looks(
        self,
        change: Callable[[StepLook], StepLook | Sequence[StepLook | SaidOf]],
        change_content: Callable[[MemoryContent], MemoryContent] | None = None,
        change_said: Callable[[SaidOf], SaidOf | None] = lambda said: said,
    ) -> None:
        """Look again, after what was known before was changed, with changed looks of this step.

        So are statements between them; a statement that becomes None is left out. A look may become
        none, several, or what is known instead.
        """
        if self.before is None and change_content is None:
            return
        saved = self.get_content_to_save()
        looks: list[StepLook] = []
        between: list[tuple[int, str | SaidOf]] = []
        events = deque(saved.between)
        for number in range(len(saved.looks) + 1):
            changed = change(saved.looks[number - 1]) if number else ()
            for known in [changed] if isinstance(changed, StepLook) else changed:
                if isinstance(known, StepLook):
                    looks.append(known)
                else:
                    between.append((len(looks), known))
            while events and events[0][0] == number:
                _, event = events.popleft()
                kept = event if isinstance(event, str) else change_said(event)
                if kept is not None:
                    between.append((len(looks), kept))
        content = replace(saved, looks=(), between=())
        if change_content is not None:
            content = change_content(content)
        self.take(replace(content, looks=tuple(looks), between=tuple(between)))

    def remove(
        self,
        rooms: Collection[int] = (),
        furniture: Collection[int] = (),
        objects: Collection[int] = (),
    ) -> None:
        """Leave out rooms and furniture by id and objects by row, with all their edges.

        Looks of this step show the others as before. What was seen at furniture that goes is known.
        """
        nodes = self.layout.furniture
        gone = {*furniture, *(number for number, node in nodes.items() if node.room in rooms)}
        names = {self.things[row].description for row in objects if not self.things[row].id}
        forgotten = {self.things[row].name for row in objects}
        rows_of = {look: self.list_called(look) for look in self.step.looks}
        seen_there = {row for look in rows_of if look.furniture in gone for row in rows_of[look][0]}
        batch = self.open_looks(knows_all=bool(seen_there))
        if batch is not self.batch:
            for column, values in batch.objects.items():
                if column not in ("home", "key", "label", "type"):
                    values[[*seen_there]] = self.batch.objects[column][[*seen_there]]

        def leave_out(look: StepLook) -> list[StepLook | SaidOf]:
            seen_rows, named = rows_of[look]
            if look.sought and named[-1] and {*named[-1]} <= {*objects}:
                return []
            pairs = zip(look.seen, seen_rows, strict=True)
            kept = tuple(seen for seen, row in pairs if row not in objects)
            if look.furniture in gone:
                return [
                    SaidOf(ThingName(seen.description, seen.id or ""), None)
                    for seen in kept
                    if seen.confidence >= SURE
                ]
            return [replace(look, seen=kept)]

        def change(content: MemoryContent) -> MemoryContent:
            known = [row for row in objects if row < len(content.things)]
            content = content.remove(rooms, furniture, known)
            renamed = {key: name for key, name in content.renamed.items() if name not in names}
            return replace(content, renamed=renamed)

        def leave_out_said(said: SaidOf) -> SaidOf | None:
            if said.name in forgotten:
                return None
            statement = None if said.statement is None else said.statement.leave_out(gone)
            was_at = None if said.was_at in gone else said.was_at
            return replace(said, statement=statement, was_at=was_at)

        self.close_looks(leave_out, change, leave_out_said)

    def list_called(self, look: StepLook) -> tuple[list[int], list[list[int]]]:
        """Return the rows of what a look shows, and of each that it had hidden, or was for."""
        seen = (self.things.get_row(seen.name, seen.id or "") for seen in look.seen)
        names: list[str | Name] = [*look.hidden, look.sought] if look.sought else [*look.hidden]
        return list(seen), [self.things.find_rows(name) for name in names]

    def add_to(self, before: MemoryBatch) -> None:
        """Let the memory before the looks of this step know all objects; it has not seen them."""
        assert self.before is not None
        rows = np.arange(before.objects.num_rows, len(self.things))
        if not len(rows):
            return
        before.ensure_objects(np.zeros_like(rows), rows, *self.find_kinds(rows.tolist()))
        sought = dict(self.before.sought)
        self.move_sought(sought, before, rows.tolist())
        self.before = replace(self.before, sought=sought)
