"""The state that all parts of a memory share, and how looks, time and questions change it."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from threading import Lock, RLock
from typing import Any

import numpy as np

from sgm.arrays.table import clone
from sgm.layout.called import CalledFurniture
from sgm.layout.layout import FurnitureNames
from sgm.memory.clock import make_clock_rows
from sgm.memory.look import MOST_LOOKS, StepLog, StepLook
from sgm.memory.look_log import LookLog, read_checksum
from sgm.memory.look_weights import SURE
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_content import HOME_LABELS, MemoryContent, write_start
from sgm.memory.merged_things import find_roots
from sgm.memory.queries import Queries
from sgm.memory.seen_positions import note_positions
from sgm.memory.thing import Pictured, Said, Thing, ThingName, ThingRows
from sgm.memory.written_tables import fill_tables, view_tables
from sgm.messages import warn_caller
from sgm.names.aliases import AliasTable
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_matching import NameIndex, Similarity
from sgm.names.resolution import Resolution
from sgm.names.sentence import Sentence
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import RELATIONS

_HOME = np.zeros(1, dtype=np.int64)  # the number of the only home of the batch


@dataclass(frozen=True, slots=True)
class BeforeLooks:
    """What a memory was before the looks of a time step, from which Bayes' rule starts.

    Attributes:
        batch: a copy of it.
        origin: stands for its state, as in `Asked`.
        asked: row of the object whose hypothetical edges were open then.
    """

    batch: MemoryBatch
    origin: object
    asked: int | None


class MemoryState:
    """The state of a `SceneGraphMemory`, which is given to each of its parts.

    That is one home as a batch and what it is called, the lock before it, and its log. It is made
    of a `MemoryContent`, and `get_content` is a view of it: what a file, a copy or the memory
    without some of its nodes is made of.

    A part holds the lock while it reads or changes anything, and writes a change into the log
    before it makes it.

    Attributes:
        lock: held by every call, from its first word on the state to its last.
        log: where changes are written; None for nowhere.
        kept_file: the memory file that the log lies beside, where the memory is kept in one.
        prior: where things tend to be.
        vocabulary: labels by index.
        clock: what time it is at every time step; None if it is unknown.
        layout: rooms and furniture.
        things: the objects, what is not in their table, (O,).
        has_merged: whether any of them was merged with another.
        step: looks of the present time step.
        before: the memory before the first of them; None without any.
        sought, score_calibration: as in `MemoryContent`.
        asked: row of the object whose hypothetical edges are open.
        language: code of the language in which is asked and answered.
        version: another object after each change of the batch.
    """

    lock: RLock
    log: LookLog | None
    kept_file: Path | None
    step: StepLog
    before: BeforeLooks | None
    sought: dict[tuple[str, int], tuple[float, int]]
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
        self.lock, self.log, self.kept_file = RLock(), None, None
        self._naming = Lock()  # never waited for while the lock is held
        self._table, self._encoder = table, encoder
        self.language = table.language
        self.begin(content, prior)

    def begin(self, content: MemoryContent, prior: PriorGraph) -> None:
        """Become a memory of that content and prior."""
        self.prior = prior
        labels = (object_type.label for object_type in prior.objects)
        self._names = NameIndex(labels, self._table, self._encoder)
        self._snapshot: dict[object, MemoryBatch] = {}  # of one version at most
        self.take(content)

    def write(self, kind: str, time: int | None = None, **values: Any) -> None:
        """Append a change (`LogLine`) to the log, if there is one, before it is made.

        A log that was moved or removed is begun anew.

        Raises:
            OSError: if another file lies in its place, or it cannot be written.
        """
        if self.log is not None:
            self.renew_lost_log()
            self.log.write(kind, self.time if time is None else time, self.clock, values)

    def renew_lost_log(self) -> None:
        """Begin the log anew if it was moved or removed, and warn who called the memory."""
        log = self.log
        if log is not None and log.is_lost():
            warn_caller(f"the log was moved or removed: it is begun anew at {log.path}")
            file = read_checksum(self.kept_file)
            log.start(write_start(self.get_content_to_save(), file=file))

    def resolve(
        self,
        question: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which things a question means; see `SceneGraphMemory.resolve`."""
        if among is not None:
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
            return Sentence("thing", (question,), text=question)
        with self._naming:
            self._names.update(names)
            return self._names.read_sentence(question, speaker)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which things are exactly of a name; see `SceneGraphMemory.resolve_exact`."""
        if among is not None:
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
        index = NameIndex((), self._table, encoder)
        index.update(list(names))
        return index

    def take(self, content: MemoryContent) -> None:
        """Become a memory of that content; prior weights are looked up again."""
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
        fill_tables(batch.tables, content.tables)
        self.has_merged = bool((batch.objects["same_as"] >= 0).any())
        batch.look_up_prior()  # of every edge
        self.asked = content.asked
        if content.asked is not None:
            self.query_row(content.asked)
        batch.count_history(content.history)  # now: to ask again is no new question
        self.sought = {}
        self.begin_anew()
        queries = deque(content.queries)
        for number, look in enumerate(content.looks):
            self.look(look)
            while queries and queries[0][0] == number + 1:
                self.query(queries.popleft()[1])
        self.sought = dict(content.sought)  # as it is after these looks

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
            score_calibration=self.score_calibration,
        )

    def get_content_to_save(self) -> MemoryContent:
        """Return the content before the looks of this step, and these looks."""
        step, before = self.step, self.before
        if before is None:
            return self.get_content()
        return replace(
            self.get_content(before.batch),
            asked=before.asked,
            looks=tuple(step.looks),
            queries=tuple(step.queries),
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

        From the `MOST_LOOKS`-th look of a time step on, those that show nothing new are left out:
        frames of a video are no looks.
        """
        furniture, seen, batch = look.furniture, look.seen, self.batch
        place, step = self.furniture.position[furniture], self.step
        if step.num_looks.get(furniture, 0.0) >= MOST_LOOKS and step.shows_nothing_new(look):
            return
        if self.before is None:
            self.before = BeforeLooks(self.get_snapshot(), self.version, self.asked)
        self.version = object()
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
        batch.observe(
            _HOME,
            np.array([place]),
            np.array(rows, dtype=np.int64),
            np.array(relations, dtype=np.int64),
            np.array([look.coverage], dtype=float),
            np.array(confidences, dtype=float),
            np.array(hidden, dtype=np.int64),
        )
        if has_position:
            note_positions(batch.positions, place, rows, seen, batch.time)
        step.add(look, Counter(rows))
        at_once = batch.objects["num_at_once"]
        for object_row in set(rows):
            num_at_once = 0
            for count in step.counts[object_row].values():
                num_at_once += count
            at_once[object_row] = max(at_once[object_row], num_at_once)
            if self.sought:
                words = read_words("description", things[object_row].description)
                self.sought.pop((words, furniture), None)

    def note_absent(self, furniture: int, words: str, coverage: float) -> None:
        """Note that a look for one thing, by its words, did not find it."""
        count, time = self.sought.get((words, furniture), (0.0, self.batch.time))
        if time < self.batch.time:  # from now on: negative looks before are long ago
            count = 0.0
        self.sought[words, furniture] = (count + coverage, self.batch.time)

    def let_pass(self, num_steps: int) -> None:
        """Let time steps pass; questions end with the first of them."""
        self.forget_questions()
        snapshot = self._snapshot.get(self.version)
        self.batch.step()
        self.batch.time += num_steps - 1
        self.asked = None
        self.begin_anew()
        if snapshot is not None:  # only the time is another one
            snapshot = snapshot.share()
            snapshot.time = self.batch.time
            self._snapshot = {self.version: snapshot}

    def get_snapshot(self) -> MemoryBatch:
        """Return a copy of the batch as it is, made once for all who only read it."""
        batch = self.batch
        if self.version not in self._snapshot:
            self._snapshot = {self.version: batch.copy()}
        return self._snapshot[self.version]

    def share(self, before_looks: bool, later: int) -> tuple[MemoryBatch, MemoryBatch, object]:
        """Return what questions read, some time steps `later`; what was merged is one.

        Returns:
            The memory as it is now. The memory of which policies are asked, if it is to be that
            `before_looks` of this step, and what stands for its state: see `Asked`.
        """
        snapshot, before, origin = self.get_snapshot(), self.before, self.version
        shared = snapshot
        if before_looks and before is not None and not later:
            shared, origin = before.batch, before.origin
        batch = shared.fuse() if self.has_merged else shared.share()
        current = snapshot.fuse() if self.has_merged else clone(snapshot)
        current.time += later
        batch.time += later
        return current, batch, origin

    def ensure_object(self, name: Name, id: str = "") -> int:
        """Return the row of an object node, adding the node if it is new; see `ThingRows.add`."""
        object_row = self.things.add(name, id)
        if object_row == self.batch.objects.num_rows:
            self._ensure_rows(object_row)
        return object_row

    def _ensure_rows(self, first: int) -> None:
        """Let the batch have the nodes of all things from a row on."""
        rows = np.arange(first, len(self.things))
        kinds = [
            self.vocabulary.find_type(self.things[object_row].description)
            for object_row in rows.tolist()
        ]
        labels, types = np.array(kinds, dtype=np.int64).reshape(-1, 2).T
        self.batch.ensure_objects(np.zeros_like(rows), rows, labels, types)

    def rename(self, object_row: int, name: str) -> None:
        """Call an object otherwise; of the others nothing changes."""
        batch, content = self.batch, self.get_content().rename(object_row, name)
        self.things.rename(object_row, name)
        self.sought = dict(content.sought)
        batch.set_type(object_row, *self.vocabulary.find_type(name))
        self.asked = None
        self.begin_anew()

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

    def list_pictured(self) -> dict[int, Thing]:
        """Return by row the things of which there are pictures; what was merged is one."""
        rows = [row for row, thing in enumerate(self.things) if thing.pictures]
        if rows and self.has_merged:
            rows = np.unique(find_roots(self.batch.objects["same_as"])[rows]).tolist()
        return {row: self.get_thing(row) for row in rows}

    def get_thing(self, object_row: int) -> Thing:
        """Return an object with all that was said of it, and of what was merged with it."""
        return self.things.join(self.list_members(object_row))

    def list_carried(self) -> list[int]:
        """Return the rows of what the robot carries."""
        return np.flatnonzero(self.batch.objects["carried_since"] >= 0).tolist()

    def list_spoken_of(self) -> list[int]:
        """Return the rows of the objects of which something was said, or of what they are now."""
        rows = [object_row for object_row, thing in enumerate(self.things) if thing.statements]
        if rows and self.has_merged:
            return sorted(set(find_roots(self.batch.objects["same_as"])[rows].tolist()))
        return rows

    def fuse_batch(self) -> MemoryBatch:
        """Return the memory with what was merged as one; a copy, where anything was."""
        return self.batch.fuse() if self.has_merged else self.batch

    def link(self, rows: Collection[int], root: int) -> None:
        """Let objects be one with another from now on, or, with -1, things of their own."""
        same_as = self.batch.objects["same_as"]
        same_as[list(rows)] = root
        self.has_merged = bool((same_as >= 0).any())
        self.begin_anew()

    def forget_questions(self) -> None:
        """Leave out objects that were asked for in this step and neither seen nor looked for.

        Nothing of them stays, nor of what they are called.
        """
        is_there = self.batch.objects["num_observed"] > 0  # or was said to be
        is_there[self.batch.edges["object"]] = True
        never = np.flatnonzero(~is_there)
        if len(never):
            batch, label = self.batch, self.batch.objects["label"]
            used = np.concatenate([label[is_there], batch.room_label[0], batch.furniture_label[0]])
            gone = {batch.labels[index] for index in np.setdiff1d(label[never], used)}
            content = self.get_content().remove(objects=never.tolist())
            kept = (text for text in content.labels[len(HOME_LABELS) :] if text not in gone)
            self.take(replace(content, labels=(*HOME_LABELS, *kept)))

    def query(self, description: str) -> Queries:
        """Open the hypothetical edges of an object until the next step."""
        if self.before is not None:  # what it opens is a part of what later looks do
            self.step.queries.append((len(self.step.looks), description))
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

    def note_new(self, label: str | None = None) -> None:
        """Note that the layout has changed, perhaps by something with a label."""
        if label is not None:
            self.vocabulary.number(label)  # now: labels are numbered in the order they come up
        self._is_layout_new = True
        self._furniture = self._called = None
        self.asked = None
        self.begin_anew()  # what was looked at in another home says nothing of this one

    def begin_anew(self) -> None:
        """Let what the memory holds now be what the further looks of this step are held against."""
        self.version = object()
        self.step, self.before = StepLog(), None

    def update_layout(self) -> None:
        """Let the batch take over rooms and furniture, and look up the prior again."""
        self._batch.set_layout(self.layout.make_arrays(self.vocabulary, self.prior))
        self._is_layout_new = False
