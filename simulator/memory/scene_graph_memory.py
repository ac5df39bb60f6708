"""The memory of one home, for use with or without the simulator."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any

import numpy as np

from simulator.memory.asking import Asked, Looks, list_looks_before
from simulator.memory.clock import Clock, make_clock_rows
from simulator.memory.home_view import list_home, list_places, list_rows
from simulator.memory.memory_batch import FURNITURE_COUNTERS, MemoryBatch, Queries
from simulator.memory.memory_content import EDGE_COLUMNS, MAX_TIME, OBJECT_COLUMNS, MemoryContent
from simulator.memory.names import NameIndex, Resolution, Similarity, read_name
from simulator.memory.sighting import RELATIONS, SeenAt, Sighting
from simulator.memory.step_log import StepLog, StepLook
from simulator.memory.storage import load_content, save_content
from simulator.memory.vocabulary import Vocabulary
from simulator.memory.words import read_words
from simulator.priors.prior_graph import PriorGraph

if TYPE_CHECKING:  # pandas is an extra; policies read memories; the memory only names their type
    from pandas import DataFrame

    from simulator.policies.policy import Policy

_HOME = np.zeros(1, dtype=np.int64)  # the number of the only home of the batch


class SceneGraphMemory:
    """One graph that holds everything ever observed in a home.

    Object nodes are told apart by the words of their description, and one description may be
    seen at several places at once: one node then has several true edges. Looking at furniture
    updates every remembered edge of it: seen -> true, not seen -> false. Rooms, furniture and
    objects may be added and removed at any time; ids of rooms and furniture never change and are
    never given twice.

    Names are compared as `read_words` says: case, spaces and "_" make no difference. Words that
    the prior does not know are welcome: an object without a prior may be at all furniture.

    Example:
        >>> memory = SceneGraphMemory()
        >>> kitchen = memory.add_room("kitchen")
        >>> fridge = memory.add_furniture("fridge", room=kitchen, description="white fridge")
        >>> memory.observe(fridge, seen=[Sighting("milk", relation="in")])
        >>> memory.step(3)
        >>> memory.last_seen("milk").steps_ago
        3

    Attributes:
        clock: what time it is at every time step; None if it was not given.

    Source: paper section 4.2, appendix B; docs/design.md, rulings 12 and 13.
    """

    clock: Clock | None
    _batch: MemoryBatch
    _is_layout_new: bool  # whether the batch has yet to take it over
    _asked: int | None  # row of the object whose hypothetical edges are open
    _step: StepLog  # looks of the present time step
    _sought: dict[tuple[str, int], tuple[float, int]]  # as in `MemoryContent`

    def __init__(self, prior: PriorGraph | None = None, clock: Clock | None = None) -> None:
        """Start with an empty home.

        Args:
            prior: where things tend to be; None for the shipped default.
            clock: what time it is now, and how long a step is, for networks that were trained with
                `features.clock`; the shipped one reads none.
        """
        self._prior = prior if prior is not None else PriorGraph.default()
        self._lock = RLock()
        self._names = NameIndex(row.label for row in self._prior.objects)
        self._set_content(MemoryContent.empty(self._prior.checksum, clock))

    @classmethod
    def load(
        cls, path: str | Path, prior: PriorGraph | None = None, clock: Clock | None = None
    ) -> SceneGraphMemory:
        """Go on with a memory that was saved: every later answer is what it would have been.

        Args:
            path: written by `save`.
            prior: None for the shipped one, which must then be the one that the memory was saved
                with. A prior that is given is taken, whether it is the same or not; another one
                changes what is said about places, and nothing of what was observed.
            clock: of step 0, for a memory that was saved without one, or to replace its own; None
                to keep what was saved.

        Raises:
            ValueError: if there is no such file, it was altered or cut short, comes from another
                version, or was saved with another prior than the shipped one and none is given.
        """
        content = load_content(path)
        memory = cls(prior)
        if prior is None and content.prior != memory._prior.checksum:
            raise ValueError(
                f"prior must be the one of the memory, {content.prior[:12]}..., got the shipped "
                f"{memory._prior.checksum[:12]}... for {path}. Give its own prior, or "
                "PriorGraph.default() to go on with the shipped one."
            )
        memory._set_content(content if clock is None else replace(content, clock=clock))
        return memory

    def save(self, path: str | Path) -> None:
        """Write the memory to a file, from which `load` goes on; it holds no code.

        Args:
            path: such as "home.sgm".

        Raises:
            OSError: if the folder does not exist, or the disk does not take the file; an older
                file is left as it was.
        """
        with self._lock:
            content = self._get_content()
            if self._step.before is not None:
                content = replace(
                    self._get_content(self._step.before), looks=tuple(self._step.looks)
                )
            save_content(path, content)

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home, which policies read, in the order of `furniture_ids`.

        It takes over rooms and furniture that were added when it is read, all at once.
        """
        if self._is_layout_new:
            self._update_layout()
        return self._batch

    @property
    def time(self) -> int:
        """Steps since the start."""
        return self.batch.time

    @property
    def num_furniture(self) -> int:
        """Number of furniture nodes, F."""
        return len(self._layout.furniture)

    @property
    def furniture_ids(self) -> tuple[int, ...]:
        """Ids of the furniture nodes in the order of `batch`, (F,)."""
        return tuple(self._layout.furniture)

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of all objects seen or asked for, in the order of `batch`, (O,)."""
        return tuple(self._descriptions)

    def add_room(self, label: str) -> int:
        """Add a room such as "kitchen" and return its id.

        Raises:
            ValueError: if the label is no name (`read_words`).
        """
        room = self._layout.add_room(label)
        self._note_new(label)
        return room

    def add_furniture(
        self,
        label: str,
        room: int,
        description: str | None = None,
        position: tuple[float, float] | None = None,
    ) -> int:
        """Add a furniture node and return its id.

        Args:
            label: what it is, such as "fridge".
            room: id from `add_room`.
            description: for people, such as "white fridge"; the label if left out.
            position: where one stands to look at it, in metres; with positions of all furniture,
                searches and plans need no `distance`.

        Raises:
            KeyError: if `room` is not a room of this memory.
            ValueError: if the label or the description is no name (`read_words`), or the position
                no two numbers.
        """
        furniture = self._layout.add_furniture(label, room, description, position)
        self._note_new(label)
        return furniture

    def move_furniture(
        self,
        furniture: int,
        room: int | None = None,
        position: tuple[float, float] | None = None,
    ) -> None:
        """Note that a furniture node was moved; what was seen there moves with it.

        Args:
            furniture: id from `add_furniture`.
            room: where it stands now; None for the same room.
            position: as in `add_furniture`; None if it is as it was, or, in another room, unknown.

        Raises:
            KeyError: if there is no such furniture node or room.
            ValueError: if the position is no two numbers.
        """
        with self._lock:
            self._layout.move_furniture(furniture, room, position)
            self._is_layout_new = True
            self._asked = None
            self._step = StepLog()

    def get_position(self, furniture: int) -> tuple[float, float] | None:
        """Return the position of a furniture node; None if it was not given.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._layout.check_furniture(furniture)
        return self._layout.furniture[furniture].position

    def list_furniture(self, room: int) -> tuple[int, ...]:
        """Return the ids of the furniture of a room, to leave out a closed one, for example.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        self._layout.check_room(room)
        furniture = self._layout.furniture.items()
        return tuple(number for number, node in furniture if node.room == room)

    def remove_room(self, room: int) -> None:
        """Remove a room with all its furniture and what is remembered of it; objects stay.

        Raises:
            KeyError: if `room` is not a room of this memory.
        """
        self._layout.check_room(room)
        self._set_content(self._get_content().remove(rooms=[room]))

    def remove_furniture(self, furniture: int) -> None:
        """Remove a furniture node and all its edges; the objects that were seen there stay.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        self._layout.check_furniture(furniture)
        self._set_content(self._get_content().remove(furniture=[furniture]))

    def remove_object(self, description: str) -> None:
        """Forget an object with all its edges, as if it had never been seen or asked for.

        Raises:
            KeyError: if this memory has no object of that description.
            ValueError: if the description is no name (`read_words`).
        """
        row = self._find_row(description)
        if row < 0:
            raise KeyError(
                f"description must be one that was seen or asked for, got {description!r}; there "
                f"are {len(self._descriptions)} objects. Check its words."
            )
        self._set_content(self._get_content().remove(objects=[row]))

    def describe(self, furniture: int) -> str:
        """Return the description and room of a furniture node, "white fridge in kitchen".

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
        """
        return self._layout.describe(furniture)

    def observe(self, furniture: int, seen: Sequence[Sighting], coverage: float = 1.0) -> None:
        """Fold one look at a furniture node into the memory.

        Every remembered edge of `furniture` is updated: seen ones become true, the others false.
        What was not in view is not counted as absent: the parts of looks that do not show an object
        are added up until they make most of a look (`MemoryBatch`).
        A look at another furniture node leaves them alone: an object that was seen at two places
        is believed at both until one of them is looked at again.

        Args:
            furniture: id from `add_furniture`.
            seen: what was detected there; detection may have missed objects. Sightings of the
                same description are several things of a kind.
            coverage: share of the furniture that was in view, above 0 and at most 1; the detector
                may have missed what was in view.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            TypeError: if `seen` holds something else than sightings.
            ValueError: if the coverage is out of range.

        Source: paper section 4.2, appendix B. Differs: negative evidence is counted (released
        code does not).
        """
        self._layout.check_furniture(furniture)
        for sighting in seen:
            if not isinstance(sighting, Sighting):
                raise TypeError(
                    f"seen must hold Sighting objects, got {sighting!r} at "
                    f"{self.describe(furniture)}. Write Sighting('milk', relation='in')."
                )
        if not 0 < coverage <= 1:
            raise ValueError(
                f"coverage must be above 0 and at most 1, got {coverage!r} at "
                f"{self.describe(furniture)}. Give the share in view, or leave out the look."
            )
        with self._lock:
            self._step.begin(self.batch)
            rows = [self._ensure_object(sighting.description) for sighting in seen]
            self.batch.observe(
                _HOME,
                np.array([self.furniture_ids.index(furniture)]),
                np.array(rows, dtype=np.int64),
                np.array([RELATIONS.index(sighting.relation) for sighting in seen], dtype=np.int64),
                np.array([coverage], dtype=float),
                np.array([sighting.confidence for sighting in seen], dtype=float),
            )
            self._step.add(StepLook(furniture, tuple(seen), coverage), Counter(rows))
            at_once = self.batch.objects["num_at_once"]
            for row in set(rows):
                at_once[row] = max(at_once[row], self._step.count_at_once(row))
                words = read_words("description", self._descriptions[row])
                self._sought.pop((words, furniture), None)

    def note_absent(self, furniture: int, description: str, coverage: float = 1.0) -> None:
        """Note that a look for one thing did not find it, and say nothing of all others there.

        Args:
            furniture: id from `add_furniture`.
            description: what was looked for, seen before or not.
            coverage: share of the furniture that was in view.

        Raises:
            KeyError: if `furniture` is not a furniture node of this memory.
            ValueError: if the description is no name, or the coverage out of range.
        """
        self._layout.check_furniture(furniture)
        key = (read_words("description", description), furniture)
        if not 0 < coverage <= 1:
            raise ValueError(
                f"coverage must lie above 0 and at most at 1, got {coverage} at "
                f"{self.describe(furniture)}. Give the share of it that was in view."
            )
        with self._lock:
            count, time = self._sought.get(key, (0.0, self.time))
            if time < self.time:  # from now on: what was in vain before is long ago
                count = 0.0
            self._sought[key] = (count + coverage, self.time)

    def step(self, num_steps: int = 1) -> None:
        """Let time pass.

        Args:
            num_steps: time steps, 0 or more. The shipped network was trained on homes where one
                object in twenty moves in a step.

        Raises:
            ValueError: if it is negative, no whole number, or time would exceed `MAX_TIME`.
        """
        if not isinstance(num_steps, (int, np.integer)) or num_steps < 0:
            raise ValueError(
                f"num_steps must be a whole number, 0 or more, got {num_steps!r}. Time only goes "
                "forward."
            )
        if self.time + num_steps > MAX_TIME:
            raise ValueError(
                f"time must be at most {MAX_TIME}, got {num_steps} steps at time {self.time}. "
                "Choose a longer time step."
            )
        if num_steps:
            with self._lock:
                self._forget_questions()
                self.batch.step()
                self.batch.time += int(num_steps) - 1
                self._asked = None
                self._step = StepLog()

    def step_to(self, time: datetime) -> None:
        """Let time pass until a date and time: the last step that has begun by then.

        Args:
            time: local, not before the present step.

        Raises:
            ValueError: if the memory has no clock, or the time lies before the present step.
        """
        if self.clock is None:
            raise ValueError(
                "memory must have a clock for step_to, got none. Make it with "
                "SceneGraphMemory(clock=Clock(datetime.now(), step_seconds=600))."
            )
        seconds = (time - self.clock.start).total_seconds()
        num_steps = math.floor(seconds / self.clock.step_seconds + 1e-9) - self.time
        if num_steps < 0:
            raise ValueError(
                f"time must not be before the present step, got {time} at "
                f"{self.clock.shift(self.time * self.clock.step_seconds).start}. Time only goes "
                "forward."
            )
        self.step(num_steps)

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph.

        A place that is looked at meanwhile, and does not show it, is remembered as one where it
        was not.

        Args:
            description: what to look for, whether it was seen before or not.

        Returns:
            One query, for `Policy.scores(memory.batch, query)`, which gives (1, F).

        Raises:
            ValueError: if the description is no name (`read_words`), or there is no furniture yet.
        """
        read_words("description", description)
        if not self._layout.furniture:
            raise ValueError(
                "memory must have furniture before a query, got none. Call add_furniture first."
            )
        row = self._asked = self._ensure_object(description)
        return self._ask(row)

    def rank(self, policy: Policy, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first.

        Args:
            policy: who judges, for example `simulator.policies.heuristics.Bayesian()`.
            description: what to look for.

        Returns:
            (furniture id, score) for every furniture node; -inf where there is no opinion.
        """
        asked = self.ask([description], before_looks=False)
        scores = policy.scores(asked.batch, asked.queries)[0]
        order = np.argsort(-scores, kind="stable")
        return [(asked.furniture_ids[place], float(scores[place])) for place in order]

    def resolve(self, description: str, similarity: Similarity | None = None) -> Resolution:
        """Say which of the things that were seen a name means; `NameIndex` has the rules.

        Args:
            description: such as "the red mug".
            similarity: how alike labels are; None to go by words alone.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        with self._lock:
            self._names.update(self._descriptions)
            return self._names.resolve(description, similarity)

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge".

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        index = NameIndex(node.label for node in self._layout.furniture.values())
        index.update([node.description for node in self._layout.furniture.values()])
        matches = set(index.resolve(name).matches)
        return tuple(
            number for number, node in self._layout.furniture.items() if node.description in matches
        )

    def ask(self, descriptions: Sequence[str], before_looks: bool = True) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes.

        Args:
            descriptions: one or more, seen before or not; each means the object of that name.
            before_looks: whether policies are asked of the memory before the looks of this step,
                which then say for themselves what they say.

        Raises:
            ValueError: if a description is no name (`read_words`), or there is no furniture yet.
        """
        words = [read_words("description", description) for description in descriptions]
        if not self._layout.furniture:
            raise ValueError(
                "memory must have furniture before a query, got none. Call add_furniture first."
            )
        with self._lock:
            current, step = self.batch.copy(), self._step
            batch, num_known = current.copy(), len(self._descriptions)
            if before_looks and step.before is not None:
                batch, num_known = step.before.copy(), step.num_objects
            known = np.array([self._find_row(description) for description in descriptions])
            vocabulary = Vocabulary(self._prior, batch.labels)
            kinds = np.array([vocabulary.find_type(description) for description in descriptions])
            batch.labels = vocabulary.labels
            new = num_known + np.arange(len(words))
            keys = np.where((known >= 0) & (known < num_known), known, new)
            queries = batch.query(
                np.zeros(len(words), dtype=np.int64), keys, kinds[:, 0], kinds[:, 1]
            )
            ids = self.furniture_ids
            at_once = np.append(current.objects["num_at_once"], 0)
            return Asked(
                batch=batch,
                queries=queries,
                current=current,
                rows=known,
                descriptions=tuple(self._descriptions),
                looks=tuple(
                    self._list_looks(batch, key if key < num_known else -1, row, own)
                    for key, row, own in zip(keys.tolist(), known.tolist(), words, strict=True)
                ),
                num_instances=np.maximum(at_once[known], 1),
                sightings=tuple(
                    sorted(
                        (seen for row in known if row >= 0 for seen in self._list_places(row)),
                        key=lambda seen: -seen.time,
                    )
                ),
                furniture_ids=ids,
                furniture_names=tuple(map(self._layout.describe, ids)),
            )

    def places_of(self, description: str) -> list[SeenAt]:
        """Return every place where an object was ever seen, the latest sighting first.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        matches = self.resolve(description).matches
        rows = [self._find_row(match) for match in matches]
        found = [seen for row in rows for seen in self._list_places(row)]
        return sorted(found, key=lambda seen: -seen.time)

    def last_seen(self, description: str) -> SeenAt | None:
        """Return where and when an object was last seen; None if it never was.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return next(iter(self.places_of(description)), None)

    def to_dict(self) -> dict[str, Any]:
        """Return rooms > furniture > objects as JSON values.

        Under each furniture node stand the objects that were ever seen there: "is_there" says
        whether the last look at it found them. "unplaced" lists objects that were last seen at
        furniture that was removed.
        """
        return list_home(self.batch, self._layout, self._descriptions)

    def to_frame(self) -> DataFrame:
        """Return a table of every object at every place where it was ever seen (needs pandas).

        Columns: object, relation, furniture, room, is_there, last_seen, times_seen, times_looked.
        """
        from pandas import DataFrame  # an extra: only this needs it

        return DataFrame(list_rows(self.to_dict()))

    def _ensure_object(self, description: str) -> int:
        """Return the row of an object node, adding the node if it is new."""
        known = self._rows_as_written.get(description)
        if known is not None:  # most things are called the same every time
            return known
        row = self._rows.setdefault(read_name(description), len(self._descriptions))
        if row == len(self._descriptions):
            self._descriptions.append(description)
        label, object_type = self._vocabulary.find_type(description)
        rows = self.batch.ensure_objects(
            _HOME, np.array([row]), np.array([label]), np.array([object_type])
        )
        assert rows[0] == row
        self._rows_as_written[description] = row
        return row

    def _find_row(self, description: str) -> int:
        """Return the row of an object node, -1 if there is none of that name."""
        return self._rows.get(read_name(description), -1)

    def _list_places(self, row: int) -> list[SeenAt]:
        return list_places(self.batch, self.furniture_ids, row)

    def _list_looks(self, batch: MemoryBatch, row: int, row_now: int, words: str) -> Looks:
        """List what all looks say about an object.

        Args:
            batch: the memory before the looks of this step.
            row: of the object in it, -1 for what was not seen until then.
            row_now: its row now.
            words: of its description.
        """
        in_vain, seen = np.zeros((2, self.num_furniture))
        steps_ago = list_looks_before(batch, row, self.time)
        sought_ago = np.full(self.num_furniture, np.inf)
        sought = np.zeros(self.num_furniture)
        position = {number: index for index, number in enumerate(self.furniture_ids)}
        if self._step.before is not None and batch.time == self.time:
            for furniture, count in self._step.sum_in_vain(row_now).items():
                in_vain[position[furniture]] += count
        edges = self.batch.edges
        now = (edges["object"] == row_now) & (edges["last_true"] == self.time)
        np.maximum.at(seen, edges["furniture"][now], edges["confidence"][now])
        for (name, furniture), (count, time) in self._sought.items():
            if name == words and time == self.time:
                in_vain[position[furniture]] += count
            elif name == words:
                sought[position[furniture]] = count
                sought_ago[position[furniture]] = self.time - time
        return Looks(
            in_vain=in_vain,
            steps_ago=np.column_stack([steps_ago, sought_ago]),
            weight=np.column_stack([np.ones(steps_ago.shape), sought]),
            seen=seen,
        )

    def _forget_questions(self) -> None:
        """Leave out objects that were asked for in this step and neither seen nor looked for."""
        is_there = self.batch.objects["num_observed"] > 0
        is_there[self.batch.edges["object"]] = True
        never = np.flatnonzero(~is_there)
        if len(never):
            self._set_content(self._get_content().remove(objects=never.tolist()))

    def _ask(self, row: int) -> Queries:
        objects = self.batch.objects
        return self.batch.query(
            _HOME, np.array([row]), objects["label"][[row]], objects["type"][[row]]
        )

    def _note_new(self, label: str) -> None:
        self._vocabulary.number(label)  # now: labels are numbered in the order they come up
        self._is_layout_new = True
        self._asked = None
        self._step = StepLog()  # what was looked at in another home says nothing of this one

    def _update_layout(self) -> None:
        arrays = self._layout.make_arrays(self._vocabulary, self._prior)
        self._batch.set_layout(
            arrays.room_label, arrays.furniture_label, arrays.furniture_room, arrays.place_prior
        )
        self._is_layout_new = False

    def _get_content(self, batch: MemoryBatch | None = None) -> MemoryContent:
        """Return what the memory holds, or held when a copy of its batch was made."""
        batch = self.batch if batch is None else batch
        return MemoryContent(
            time=batch.time,
            prior=self._prior.checksum,
            labels=tuple(batch.labels),
            layout=self._layout,
            descriptions=tuple(self._descriptions[: len(batch.objects)]),
            furniture_counters={
                name: getattr(batch, f"furniture_{name}")[0] for name in FURNITURE_COUNTERS
            },
            objects={name: batch.objects[name] for name in OBJECT_COLUMNS},
            edges={name: batch.edges[name] for name in EDGE_COLUMNS},
            history=batch.history,
            asked=self._asked,
            clock=self.clock,
            sought=dict(self._sought),
        )

    def _set_content(self, content: MemoryContent) -> None:
        """Become a memory of that content; prior weights are looked up again."""
        self._vocabulary = Vocabulary(self._prior, content.labels)
        self._layout = content.layout
        self._descriptions: list[str] = []
        self._rows: dict[tuple[str, ...], int] = {}  # by `read_name` of the description
        self._rows_as_written: dict[str, int] = {}
        arrays = self._layout.make_arrays(self._vocabulary, self._prior)
        self.clock = content.clock
        batch = self._batch = MemoryBatch(
            [], arrays.room_label, arrays.furniture_label, arrays.furniture_room,
            arrays.place_prior,
            clock=make_clock_rows([content.clock]),
        )  # fmt: skip
        self._is_layout_new = False
        batch.labels = self._vocabulary.labels  # one list: grows with the vocabulary
        batch.time = content.time
        for name, column in content.furniture_counters.items():
            getattr(batch, f"furniture_{name}")[0] = column
        for description in content.descriptions:
            self._ensure_object(description)
        for name, column in content.objects.items():
            batch.objects[name][:] = column
        batch.edges.append(len(content.edges["object"]), **content.edges)
        self._update_layout()  # the batch looks up the prior of every edge
        self._asked = content.asked
        if content.asked is not None:
            self._ask(content.asked)
        batch.history = content.history  # now: to ask again is no new question
        self._sought = dict(content.sought)
        self._step = StepLog()
        for look in content.looks:
            self.observe(look.furniture, look.seen, look.coverage)
