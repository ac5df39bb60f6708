"""What a memory of one home holds, and how looks, questions and changes of the layout enter."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace

import numpy as np

from sgm.layout.furniture_names import FurnitureNames
from sgm.layout.layout import Layout
from sgm.memory.clock import Clock, make_clock_rows
from sgm.memory.columns import NEVER
from sgm.memory.coverage import Coverage
from sgm.memory.frame_watch import MOST_LOOKS
from sgm.memory.home_view import list_places
from sgm.memory.look_weights import SURE
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_content import HOME_LABELS, MemoryContent
from sgm.memory.queries import Queries
from sgm.memory.same_things import find_roots, fuse
from sgm.memory.score_calibration import ScoreCalibration
from sgm.memory.sighting import RELATIONS, SeenAt, Sighting
from sgm.memory.statement import Statement
from sgm.memory.step_log import StepLog, StepLook
from sgm.memory.table_content import fill_tables, view_tables
from sgm.memory.thing import Thing
from sgm.names.aliases import AliasTable
from sgm.names.names import read_name
from sgm.names.vocabulary import Vocabulary
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph

_HOME = np.zeros(1, dtype=np.int64)  # the number of the only home of the batch


class MemoryState:
    """The state of a `SceneGraphMemory`: one home as a batch, and what it is called.

    Attributes:
        prior: where things tend to be.
        clock: what time it is at every time step; None if it is unknown.
        layout: rooms and furniture.
        things: the objects, what is not in their table, (O,).
        step: looks of the present time step.
        sought, score_calibration: as in `MemoryContent`.
        asked: row of the object whose hypothetical edges are open.
        version: another object after each change of the batch.
    """

    clock: Clock | None
    layout: Layout
    step: StepLog
    sought: dict[tuple[str, int], tuple[float, int]]
    score_calibration: ScoreCalibration | None
    asked: int | None
    version: object
    _batch: MemoryBatch
    _is_layout_new: bool  # whether the batch has yet to take it over
    _has_merged: bool  # whether any object was merged with another
    _furniture: FurnitureNames | None
    _snapshot: dict[object, MemoryBatch]  # of one version at most

    def __init__(self, prior: PriorGraph, clock: Clock | None, table: AliasTable) -> None:
        """Start with an empty home; `table` says which names are of which type of the prior."""
        self.prior = prior
        self._table = table
        self._snapshot = {}
        self.set_content(MemoryContent.empty(prior.checksum, clock))

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home, which policies read, in the order of `furniture_ids`.

        It takes over rooms and furniture that were added when it is read, all at once.
        """
        if self._is_layout_new:
            self.update_layout()
        return self._batch

    @property
    def time(self) -> int:
        """Steps since the start; known without taking over a new layout."""
        return self._batch.time

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of the objects, (O,)."""
        if len(self._descriptions) < len(self.things):
            new = self.things[len(self._descriptions) :]
            self._descriptions += tuple(thing.description for thing in new)
        return self._descriptions

    @property
    def names(self) -> tuple[str, ...]:
        """What the objects are called, each name once."""
        return tuple(self._names.values())

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of the batch, (F,)."""
        return self.furniture.ids

    @property
    def furniture(self) -> FurnitureNames:
        """What is said of the furniture, in the order of the batch."""
        if self._furniture is None:
            self._furniture = FurnitureNames.of(self.layout)
        return self._furniture

    def look(
        self,
        furniture: int,
        seen: Sequence[Sighting],
        coverage: Coverage,
        hidden: Sequence[str] = (),
    ) -> None:
        """Fold one look at a furniture node in; see `SceneGraphMemory.observe`.

        From the `MOST_LOOKS`-th look of a time step on, those that show nothing new are left out:
        frames of a video are no looks.
        """
        own = StepLook(furniture, tuple(seen), coverage, tuple(hidden))
        if self.step.count_looks(furniture) >= MOST_LOOKS and self.step.shows_nothing_new(own):
            return
        if self.step.before is None:
            self.step.begin(self._get_snapshot(), self.version, self.asked)
        self.version = object()
        rows = [self.ensure_object(sighting.description, sighting.id or "") for sighting in seen]
        for row, sighting in zip(rows, seen, strict=True):
            if sighting.embedding and sighting.confidence >= SURE:
                self.things[row] = replace(self.things[row], embedding=sighting.embedding)
        self.batch.observe(
            _HOME,
            np.array([self.furniture.position[furniture]]),
            np.array(rows, dtype=np.int64),
            np.array([RELATIONS.index(sighting.relation) for sighting in seen], dtype=np.int64),
            np.array([coverage], dtype=float),
            np.array([sighting.confidence for sighting in seen], dtype=float),
            np.array([row for name in hidden for row in self.find_rows(name)], dtype=np.int64),
        )
        self.step.add(own, Counter(rows))
        at_once = self.batch.objects["num_at_once"]
        for row in set(rows):
            at_once[row] = max(at_once[row], self.step.count_at_once(row))
            if self.sought:
                words = read_words("description", self.things[row].description)
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
        self.step = StepLog()
        self.version = object()
        if snapshot is not None:  # only the time is another one
            snapshot = snapshot.share()
            snapshot.time = self.batch.time
            self._snapshot = {self.version: snapshot}

    def _get_snapshot(self) -> MemoryBatch:
        """Return a copy of the batch as it is, made once for all who only read it."""
        batch = self.batch
        if self.version not in self._snapshot:
            self._snapshot = {self.version: batch.copy()}
        return self._snapshot[self.version]

    def share(self, snapshot: MemoryBatch) -> MemoryBatch:
        """Return what a snapshot holds, of which questions may be asked; what was merged is one."""
        if self._has_merged:
            copied = snapshot.copy()
            fuse(copied)
            return copied
        return snapshot.share()

    def share_snapshot(self) -> MemoryBatch:
        """Return what the memory holds now, of which questions may be asked."""
        return self.share(self._get_snapshot())

    def has_several_names(self, row: int) -> bool:
        """Whether an object has an id, or was merged with another."""
        return bool(self.things[row].id) or len(self.list_members(row)) > 1

    def list_names(self, rows: Sequence[int]) -> Iterator[str]:
        """List the words of the descriptions of objects, and of their ids."""
        for thing in (self.things[row] for row in rows):
            yield read_words("description", thing.description)
            if thing.id:
                yield read_words("id", thing.id)

    def ensure_object(self, description: str, id: str = "") -> int:
        """Return the row of an object node, adding the node if it is new.

        Args:
            description: by whose words it is known, where it has no id.
            id: by which it is known, whatever it is called; empty without one.
        """
        known = self._rows.get(id) if id else self._rows_as_written.get(description)
        if known is not None:  # most things are called the same every time
            return known
        name = read_name(description)
        row = self._rows.setdefault(id or name, len(self.things))
        if row == len(self.things):
            self.things.append(Thing(description, id))
            self._names.setdefault(name, description)
            if id:
                self._rows_with_id.setdefault(name, []).append(row)
        description = self.things[row].description
        label, object_type = self.vocabulary.find_type(description)
        rows = self.batch.ensure_objects(
            _HOME, np.array([row]), np.array([label]), np.array([object_type])
        )
        assert rows[0] == row
        if not id:
            self._rows_as_written[description] = row
        return row

    def get_row(self, description: str, id: str = "") -> int:
        """Return the row of an object node by its id or, without one, its name; -1 for none."""
        return self._rows.get(id or read_name(description), -1)

    def has_id(self, name: str) -> bool:
        """Whether a name is the id of a thing."""
        return name in self._rows

    def list_members(self, row: int) -> list[int]:
        """Return the rows of all nodes that were merged with one, itself first."""
        if row < 0 or not self._has_merged:
            return [row]
        members = np.flatnonzero(find_roots(self.batch.objects["same_as"]) == row).tolist()
        return [row, *(member for member in members if member != row)]

    def find_rows(self, name: str) -> list[int]:
        """Return the rows of all things of a name, or of the one of that id, each once.

        Of nodes that were merged, that is the one that stands for all.
        """
        rows = self.find_nodes(name)
        if rows and self._has_merged:
            roots = find_roots(self._batch.objects["same_as"])
            rows = list(dict.fromkeys(roots[rows].tolist()))
        return rows

    def find_nodes(self, name: str) -> list[int]:
        """Return the rows of all object nodes of a name, or of the one of that id."""
        by_id = self._rows.get(name, -1)
        if by_id >= 0:
            return [by_id]
        own = self._rows.get(read_name(name), -1)
        return ([own] if own >= 0 else []) + self._rows_with_id.get(read_name(name), [])

    def list_carried(self) -> list[int]:
        """Return the rows of what the robot carries."""
        return np.flatnonzero(self.batch.objects["carried_since"] >= 0).tolist()

    def fuse_batch(self) -> MemoryBatch:
        """Return the memory with what was merged as one; a copy, where anything was."""
        batch = self.batch
        if self._has_merged:
            batch = batch.copy()
            fuse(batch)
        return batch

    def list_places(
        self, row: int, fused: MemoryBatch | None = None, edges: np.ndarray | None = None
    ) -> list[SeenAt]:
        """List every place where the object of a row was ever seen, the latest first.

        Of one time step, the place of which was spoken last comes first, after one that a look has
        shown since.

        Args:
            row: of the object.
            fused: from `fuse_batch`, if that was called before.
            edges: rows of edges among which its own are; None for all.
        """
        batch = self.fuse_batch() if fused is None else fused
        places = list_places(batch, self.furniture_ids, row, edges)
        told = self.get_statements(row).order_places()
        if not told:
            return places
        last = int(batch.objects["last_furniture"][row])
        if last != NEVER and self.get_last_said(row) is None:
            seen = int(batch.objects["last_observed"][row])
            told[seen, self.furniture_ids[last]] = len(told)
        places.sort(key=lambda at: (-at.time, -told.get((at.time, at.furniture), -1)))
        said_by = self.list_said_by(row, batch)
        return [replace(at, by=said_by.get((at.time, at.furniture), "")) for at in places]

    def list_said_by(self, row: int, fused: MemoryBatch) -> dict[tuple[int, int | None], str]:
        """Return who said that an object is somewhere, by time step and furniture.

        Where a look has shown it there in the same time step, it was seen.

        Args:
            row: of the object.
            fused: from `fuse_batch`.
        """
        statements = self.get_statements(row).statements
        if not statements:
            return {}
        last = self.get_last_said(row)
        said_by: dict[tuple[int, int | None], str] = {}
        if last is not None and last.furniture is not None:
            said_by[last.time, last.furniture] = last.by
        edges, ids = fused.edges, self.furniture_ids
        own = np.flatnonzero((edges["object"] == row) & (edges["num_true"] > 0))
        columns = (edges[name][own].tolist() for name in ("last_true", "furniture", "confidence"))
        known = {(time, ids[place]): sure for time, place, sure in zip(*columns, strict=True)}
        for one in statements:  # a sighting of that step would have left its own confidence
            place = one.time, one.furniture
            if place[1] is not None and known.get(place) == np.float32(one.confidence):
                said_by.setdefault(place, one.by)
        return said_by

    def list_spoken_of(self) -> list[int]:
        """Return the rows of the objects of which something was said, or of what they are now."""
        rows = [row for row, thing in enumerate(self.things) if thing.statements]
        if rows and self._has_merged:
            return sorted(set(find_roots(self.batch.objects["same_as"])[rows].tolist()))
        return rows

    def get_last_said(self, row: int) -> Statement | None:
        """Return what was said last of an object; None if a look has shown it since."""
        members = self.list_members(row) if row >= 0 else []
        spoken_of = [number for number in members if self.things[number].statements]
        if not spoken_of:
            return None
        own = max(spoken_of, key=lambda number: self.things[number].statements[-1].time)
        said, objects = self.things[own].statements[-1], self.batch.objects
        others = [number for number in members if number != own]
        is_last = objects["num_observed"][own] == said.num_observed
        return said if is_last and (objects["last_observed"][others] <= said.time).all() else None

    def get_statements(self, row: int) -> Thing:
        """Return an object with all that was said of it, and of what was merged with it."""
        members = self.list_members(row)
        if len(members) == 1:
            return self.things[row]
        # What was said since the merge is of the first, and so the last of a time step.
        said = (one for number in members[::-1] for one in self.things[number].statements)
        return replace(self.things[row], statements=tuple(sorted(said, key=lambda one: one.time)))

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
            labels = HOME_LABELS + tuple(
                text for text in content.labels[len(HOME_LABELS) :] if text not in gone
            )
            self.set_content(replace(content, labels=labels))

    def query_row(self, row: int) -> Queries:
        """Open the hypothetical edges of an object node by its row."""
        objects = self.batch.objects
        return self.batch.query(
            _HOME, np.array([row]), objects["label"][[row]], objects["type"][[row]]
        )

    def note_new(self, label: str | None = None) -> None:
        """Note that the layout has changed, perhaps by something with a label."""
        if label is not None:
            self.vocabulary.number(label)  # now: labels are numbered in the order they come up
        self._is_layout_new = True
        self._furniture = None
        self.asked = None
        self._begin_anew()  # what was looked at in another home says nothing of this one

    def _begin_anew(self) -> None:
        """Let what the memory holds now be what the further looks of this step are held against."""
        self.version = object()
        self.step = StepLog()

    def state(
        self, description: str, id: str, statement: Statement, was_at: int | None = None
    ) -> None:
        """Take over what was said of a thing, or what the robot did with it.

        Args:
            description: of the thing; a new one if there is none.
            id: of the thing; empty if it has none.
            statement: what, without the places where it was held to be.
            was_at: the one of several places that it is no longer at; None for all, where it is the
                only one of its description.
        """
        row = self.ensure_object(description, id)
        batch, ids = self.batch, self.furniture_ids
        edges = batch.edges
        is_left = np.isin(edges["object"], self.list_members(row)) & edges["is_true"]
        if was_at is not None:
            is_left &= edges["furniture"] == ids.index(was_at)
        elif batch.objects["num_at_once"][row] > 1:
            is_left[:] = False
        place = relation = -1
        if statement.furniture is not None and statement.relation is not None:
            place = ids.index(statement.furniture)
            relation = RELATIONS.index(statement.relation)
            is_left &= (edges["furniture"] != place) | (edges["relation"] != relation)
        left = np.flatnonzero(is_left)
        places = sorted({ids[index] for index in edges["furniture"][left] if index != place})
        batch.note_left(left, statement.confidence)
        if place < 0:
            batch.note_carried(row)
        else:
            batch.note_place(row, place, relation, statement.confidence)
        num_observed = int(batch.objects["num_observed"][row])
        statement = replace(statement, was_at=tuple(places), num_observed=num_observed)
        self.things[row] = self.things[row].add(statement)
        if self.sought and statement.furniture is not None:
            words = read_words("description", self.things[row].description)
            self.sought.pop((words, statement.furniture), None)
        self._begin_anew()

    def rename(self, row: int, name: str) -> None:
        """Call an object otherwise."""
        content = self.get_content()
        before = read_words("description", self.things[row].description)
        things = list(content.things)
        things[row] = replace(things[row], description=name)
        words = read_words("description", name)
        sought = {
            (words if own == before and not things[row].id else own, furniture): value
            for (own, furniture), value in content.sought.items()
        }
        self.set_content(replace(content, things=tuple(things), sought=sought, asked=None))

    def merge(self, row: int, other: int) -> None:
        """Let an object and what was merged with it be one with another."""
        self.batch.objects["same_as"][other] = row
        self._has_merged = True
        self._begin_anew()

    def split(self, rows: Collection[int]) -> None:
        """Let objects be things of their own again."""
        same_as = self.batch.objects["same_as"]
        same_as[list(rows)] = -1
        self._has_merged = bool((same_as >= 0).any())
        self._begin_anew()

    def split_off(self, row: int, furniture: int, name: str) -> None:
        """Let what was seen of an object at a place be another thing, of a new name."""
        other = self.ensure_object(name)
        batch, place = self.batch, self.furniture_ids.index(furniture)
        edges, objects = batch.edges, batch.objects
        moved = (edges["object"] == row) & (edges["furniture"] == place)
        edges["object"][moved] = other
        for number in (row, other):
            own = np.flatnonzero((edges["object"] == number) & (edges["num_true"] > 0))
            seen = own[np.argsort(edges["last_true"][own], kind="stable")]
            objects["num_observed"][number] = max(int(edges["num_true"][own].sum()), 1)
            objects["last_observed"][number] = edges["last_true"][seen[-1]]
            objects["last_furniture"][number] = edges["furniture"][seen[-1]]
        objects["first_observed"][other] = objects["first_observed"][row]
        objects["num_at_once"][other] = 1
        objects["num_at_once"][row] = max(int(objects["num_at_once"][row]) - 1, 1)
        said = self.things[row].statements
        self.things[other] = replace(
            self.things[other], statements=tuple(one for one in said if one.furniture == furniture)
        )
        self.things[row] = replace(
            self.things[row], statements=tuple(one for one in said if one.furniture != furniture)
        )
        batch.look_up_prior()  # of the new thing
        self._begin_anew()

    def remove(
        self,
        rooms: Collection[int] = (),
        furniture: Collection[int] = (),
        objects: Collection[int] = (),
    ) -> None:
        """Forget rooms and furniture by id and objects by row, with all their edges."""
        self.set_content(self.get_content().remove(rooms, furniture, objects))

    def query(self, description: str) -> Queries:
        """Open the hypothetical edges of an object until the next step."""
        self.step.note_query(description)
        self.version = object()
        row = self.asked = self.ensure_object(description)
        return self.query_row(row)

    def update_layout(self) -> None:
        """Let the batch take over rooms and furniture, and look up the prior again."""
        self._batch.set_layout(self.layout.make_arrays(self.vocabulary, self.prior))
        self._is_layout_new = False

    def get_content(self, batch: MemoryBatch | None = None) -> MemoryContent:
        """Return what the memory holds, or held when a copy of its batch was made."""
        batch = self.batch if batch is None else batch
        return MemoryContent(
            time=batch.time,
            prior=self.prior.checksum,
            labels=tuple(batch.labels),
            layout=self.layout,
            things=tuple(self.things[: len(batch.objects)]),
            tables=view_tables(batch.tables),
            history=batch.history,
            asked=self.asked,
            clock=self.clock,
            sought=dict(self.sought),
            score_calibration=self.score_calibration,
        )

    def get_content_to_save(self) -> MemoryContent:
        """Return the content before the looks of this step, and these looks."""
        if self.step.before is None:
            return self.get_content()
        step = self.step
        return replace(
            self.get_content(step.before),
            asked=step.asked, looks=tuple(step.looks), queries=tuple(step.queries),
        )  # fmt: skip

    def set_content(self, content: MemoryContent) -> None:
        """Become a memory of that content; prior weights are looked up again."""
        self.vocabulary = Vocabulary(self.prior, content.labels, self._table)
        self.layout = content.layout
        self._furniture = None
        self.things: list[Thing] = []
        self._descriptions: tuple[str, ...] = ()
        # By `read_name` of the description, a tuple, or by id, a text.
        self._rows: dict[tuple[str, ...] | str, int] = {}
        self._rows_with_id: dict[tuple[str, ...], list[int]] = {}
        self._names: dict[tuple[str, ...], str] = {}  # each as first written
        self._rows_as_written: dict[str, int] = {}
        arrays = self.layout.make_arrays(self.vocabulary, self.prior)
        self.clock = content.clock
        self.score_calibration = content.score_calibration
        clock = make_clock_rows([content.clock])
        batch = self._batch = MemoryBatch([], arrays, clock=clock)
        self._is_layout_new = False
        batch.labels = self.vocabulary.labels  # one list: grows with the vocabulary
        batch.time = content.time
        for thing in content.things:
            self.ensure_object(thing.description, thing.id)
        self.things = list(content.things)
        batch.edges.append(len(content.tables["edges"]["object"]))
        fill_tables(batch.tables, content.tables)
        self._has_merged = bool((batch.objects["same_as"] >= 0).any())
        self.update_layout()  # the batch looks up the prior of every edge
        self.asked = content.asked
        if content.asked is not None:
            self.query_row(content.asked)
        batch.count_history(content.history)  # now: to ask again is no new question
        self.sought = {}
        self.step = StepLog()
        self.version = object()
        queries = deque(content.queries)
        for number, look in enumerate(content.looks):
            self.look(look.furniture, look.seen, look.coverage, look.hidden)
            while queries and queries[0][0] == number + 1:
                self.query(queries.popleft()[1])
        self.sought = dict(content.sought)  # as it is after these looks
