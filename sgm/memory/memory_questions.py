"""Calls of a memory that say what it holds."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from threading import Lock
from typing import TYPE_CHECKING, Any

import numpy as np

from sgm.memory.asking import Asked, Scorer, ask
from sgm.memory.clock import count_steps
from sgm.memory.memory_layout import MemoryLayout
from sgm.memory.queries import Queries
from sgm.memory.seen_places import SeenRows, list_home, list_places, list_rows, list_said_by
from sgm.memory.sighting import SeenAt, read_embedding
from sgm.memory.spark_graph import make_spark_graph
from sgm.memory.thing_changes import ThingChange, ThingEvent, list_changes, list_events, read_since
from sgm.messages import shorten
from sgm.names.aliases import AliasTable
from sgm.names.name import Name
from sgm.names.name_encoder import NameEncoder
from sgm.names.name_matching import NameIndex, Similarity
from sgm.names.resolution import Resolution
from sgm.names.words import read_words, strip_question
from sgm.schema import NEVER

if TYPE_CHECKING:  # pandas is an extra
    from pandas import DataFrame

_SAME_NAME = ("exact", "same words")  # how a thing is meant that no other name comes before


class MemoryQuestions(MemoryLayout):
    """The part of `SceneGraphMemory` for questions: what a name means, and where things were."""

    _names: NameIndex
    _naming: Lock  # never waited for while the lock of the state is held
    _table: AliasTable
    _encoder: NameEncoder | None

    def resolve(
        self,
        description: str,
        similarity: Similarity | None = None,
        among: Sequence[str] | None = None,
    ) -> Resolution:
        """Say which of the things that were seen a question means; `NameIndex` has the rules.

        What acts on a thing asks `resolve_exact`.

        Args:
            description: such as "the red mug".
            similarity: how alike labels are, where the memory has no encoder; None to go by words
                alone.
            among: names to choose from, such as those of one look; None for all that were seen.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        if among is not None:
            index = NameIndex((), self._table, self._encoder)
            index.update(list(among))
            return index.resolve(description, similarity)
        with self._lock:
            descriptions = self._state.things.names
            if self._state.things.has_id(description):
                return Resolution(description, (description,), "exact")
        with self._naming:  # no other call waits for text vectors
            self._names.update(descriptions)
            return self._names.resolve(description, similarity)

    def resolve_exact(self, name: str, among: Sequence[str] | None = None) -> Resolution:
        """Say which of the things that were seen is exactly of a name, or has that id.

        Case, articles, plural, accents and spelling aside: `NameIndex.resolve_exact` has the rules,
        and aliases of one's own count. Every call that acts on a thing uses it.

        Args:
            name: such as "the red mug".
            among: names to choose from; None for all that were seen.

        Returns:
            Matches; without any, `doubtful` has what may be meant.

        Raises:
            ValueError: if it is no name (`read_words`).
        """
        if among is not None:
            index = NameIndex((), self._table)
            index.update(list(among))
            return index.resolve_exact(name)
        with self._lock:
            descriptions = self._state.things.names
            if self._state.things.has_id(name):
                return Resolution(name, (name,), "exact")
        with self._naming:
            self._names.update(descriptions)
            return self._names.resolve_exact(name)

    def find_nearest(
        self, embedding: Sequence[float] | np.ndarray, k: int = 3
    ) -> list[tuple[str, float]]:
        """Return the things that look most like something, by the embeddings of their sightings.

        Args:
            embedding: of what is seen, (D,), of the same maker as those of the sightings.
            k: most things to return.

        Returns:
            Ids, or descriptions of things without one, and cosines, the nearest first.

        Raises:
            ValueError: if the embedding is no vector, or `k` is below 1.
        """
        vector = np.array(read_embedding(embedding))
        if not len(vector) or not isinstance(k, (int, np.integer)) or k < 1:
            raise ValueError(
                f"embedding and k must be a vector and at least 1, got {shorten(embedding)} and "
                f"{shorten(k)}. Give what the sightings had."
            )
        with self._lock:
            things = [one for one in self._state.things if len(one.embedding) == len(vector)]
        own = np.array([one.embedding for one in things]).reshape(-1, len(vector))
        cosines = own @ vector / (np.linalg.norm(own, axis=1) * np.linalg.norm(vector))
        order = np.argsort(-cosines, kind="stable")[:k]
        return [(things[n].id or things[n].description, float(cosines[n])) for n in order]

    def find_furniture(self, name: str) -> tuple[int, ...]:
        """Return the ids of the furniture that a name means, such as "the fridge".

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        furniture = self.layout.furniture
        names = [node.description for node in furniture.values()]
        matches = self.resolve(name, among=names).matches
        return tuple(number for number, node in furniture.items() if node.description in matches)

    def find_places(
        self, name: str, resolution: Resolution | None = None
    ) -> tuple[str, tuple[int, ...]]:
        """Return the furniture that a question is about, if it is about furniture or a room.

        Args:
            name: such as "the fridge", "kitchen table", "the kitchen".
            resolution: what `resolve` gave for it, where that was asked for.

        Returns:
            "place" and the ids of the furniture of that name, "room" and those of what stands in
            it; else "thing" and none. A thing that was seen under exactly that name comes first,
            and any thing of the name before a place that is less than exactly so called.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        if resolution is None or resolution.how not in _SAME_NAME:
            resolution = self.resolve(name)
        if resolution.how in _SAME_NAME:
            return "thing", ()
        layout = self.layout
        asked = Name.read(strip_question(name) or name)
        found = self.find_called(asked)
        if not found and not resolution.matches:
            names = [node.description for node in layout.furniture.values()]
            likely = self.resolve(name, among=names)
            if likely.is_sure and not likely.says_less:
                found = [n for n, node in layout.furniture.items()
                         if node.description in likely.matches]  # fmt: skip
        if found:
            return "place", tuple(found)
        rooms = [n for n, room in layout.rooms.items() if Name.read(room.label).is_same(asked)]
        within = tuple(n for n, node in layout.furniture.items() if node.room in rooms)
        return ("room", within) if within and not resolution.matches else ("thing", ())

    def ask(
        self,
        descriptions: Sequence[str],
        before_looks: bool = True,
        at: datetime | int | None = None,
        question: str | None = None,
    ) -> Asked:
        """Ask for objects, and leave the memory as it is; safe beside a thread that observes.

        Args:
            descriptions: one or more, seen before or not; each means the object of that name.
            before_looks: whether policies are asked of the memory before the looks of this step,
                which then say for themselves what they say.
            at: when: a time step, or a date and time by the clock; not before the present step,
                None for it.
            question: what they were asked for as: looks for that which did not find it count, too.

        Raises:
            ValueError: if a description is no name (`read_words`), there is no furniture yet, or
                the time has passed.
        """
        words = "" if question is None else read_words("question", question)
        with self._lock:
            self._check_furniture()
            state = self._state
            later = 0 if at is None else count_steps(at, state.time, state.clock, "at")
            return ask(state, descriptions, before_looks, later, words)

    def rank(self, policy: Scorer, description: str) -> list[tuple[int, float]]:
        """Order all furniture by how likely it holds an object, the best first.

        Args:
            policy: who judges, for example `sgm.policies.heuristics.Bayesian()`.
            description: what to look for.

        Returns:
            (furniture id, score) for every furniture node; -inf where there is no opinion.
        """
        asked = self.ask([description], before_looks=False)
        scores = policy.scores(asked.batch, asked.queries)[0]
        order = np.argsort(-scores, kind="stable")
        return [(asked.furniture_ids[place], float(scores[place])) for place in order]

    def query(self, description: str) -> Queries:
        """Ask for an object; until the next `step` its hypothetical edges are in the graph.

        A place that is looked at meanwhile, and does not show it, is remembered as one where it
        was not. So this changes the memory, as `rank` and `ask` do not, and is logged.

        Args:
            description: what to look for, whether it was seen before or not.

        Returns:
            One query, for `Policy.scores(memory.batch, query)`, which gives (1, F).

        Raises:
            ValueError: if the description is no name (`read_words`), or there is no furniture yet.
        """
        read_words("description", description)
        with self._lock:
            self._check_furniture()
            self._write("query", description=description)
            return self._state.query(description)

    def places_of(self, description: str) -> list[SeenAt]:
        """Return every place where an object was ever seen, the latest sighting first.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        matches = self.resolve(description).matches
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            rows = state.find_rows(*matches)
            found: list[SeenAt] = []
            for row in rows:
                found += list_places(fused, row, state.get_said(row), state.furniture.ids)
        return sorted(found, key=lambda seen: -seen.time)

    def last_seen(self, description: str) -> SeenAt | None:
        """Return where and when an object was last seen; None if it never was.

        Raises:
            ValueError: if the description is no name (`read_words`).
        """
        return next(iter(self.places_of(description)), None)

    def history(self, thing: str) -> list[ThingEvent]:
        """Return what is kept of a thing over time, the latest first; the log has all.

        That is the last sighting at each place, the look that missed it there first since, and the
        last things that were said of it. Of several things that a name means, all.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        matches = self.resolve(thing).matches
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            found: list[ThingEvent] = []
            for row in state.find_rows(thing) or state.find_rows(*matches):
                said, ids = state.get_said(row), state.furniture.ids
                places = list_places(fused, row, said, ids)
                found += list_events(fused, said.thing, row, places, ids)
        return sorted(found, key=lambda event: -event.time)

    def changes(self, since: datetime | int) -> list[ThingChange]:
        """Return what is new, was moved or is gone, as looks have shown and people have said.

        Args:
            since: time step, or date and time by the clock, from which on it was noticed.

        Returns:
            The last changes of each thing, the latest first; a thing that was moved twice since
            stands there once, with its last move.

        Raises:
            ValueError: if `since` is neither, or a date and the memory has no clock.
        """
        with self._lock:
            state = self._state
            first = read_since(since, state.clock)
            return list_changes(
                state.fuse_batch(), state.get_thing, state.list_spoken_of(),
                state.furniture.ids, first,
            )  # fmt: skip

    def to_dict(self) -> dict[str, Any]:
        """Return rooms > furniture > objects as JSON values.

        Under each furniture node stand the objects that were ever seen there: "is_there" says
        whether the last look at it found them; "by" is who said last that they are there, where no
        look has shown it. "unplaced" lists objects that were last seen at furniture that was
        removed.
        """
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            ids = state.furniture.ids
            said_by = {
                row: list_said_by(fused, row, state.get_said(row), ids)
                for row in state.list_spoken_of()
            }
            return list_home(fused, state.layout, state.things.descriptions, said_by)

    def list_seen(
        self, things: Sequence[str] | None = None, furniture: int | None = None, most: int = 20
    ) -> tuple[list[tuple[str, SeenAt]], int]:
        """List where things are by the last looks, or else were seen last, the latest seen first.

        Args:
            things: names; then every place where one was ever seen is looked at. None for all.
            furniture: id of a place, to list what is there alone; None for all places.
            most: rows to return.

        Returns:
            Descriptions and places, and how many there are in all.
        """
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            asked = None
            if things is not None:
                wanted = set(things)
                texts = enumerate(state.things.descriptions)
                asked = np.array([row for row, text in texts if text in wanted], dtype=np.int64)
            seen, ids = SeenRows.of_things(fused, asked), state.furniture.ids
            if furniture is None:
                seen = seen.take(seen.find_current(state.things.number_descriptions()))
            else:
                place = state.furniture.position.get(furniture, -2)
                seen = seen.take((seen.furniture == place) & seen.is_there)
            num_all, seen = len(seen.time), seen.take(seen.choose_latest(most))
            whose = [state.things[thing].description for thing in seen.thing.tolist()]
            rows = list(zip(whose, seen.tell(fused, ids), strict=True))
        rows.sort(key=lambda row: (-row[1].time, row[0]))
        return rows[:most], num_all

    def count_things(self) -> dict[int, tuple[int, int | None]]:
        """Count what the last look showed at each place, by furniture id.

        Returns:
            How many things, and the time step of that look, None without one.
        """
        with self._lock:
            state = self._state
            fused = state.fuse_batch()
            there = fused.edges["furniture"][fused.edges["is_true"]]
            counts = np.bincount(there, minlength=fused.num_furniture).tolist()
            last = fused.furniture_last_observed[0].tolist()
            return {
                number: (count, None if looked == NEVER else looked)
                for number, count, looked in zip(state.furniture.ids, counts, last, strict=True)
            }

    def to_frame(self) -> DataFrame:
        """Return a table of every object at every place where it was ever seen (needs pandas).

        Columns: object, relation, furniture, room, is_there, last_seen, times_seen, times_looked.
        """
        from pandas import DataFrame  # an extra: only this needs it

        return DataFrame(list_rows(self.to_dict()))

    def to_spark_dsg(self) -> Any:
        """Return what is there by the last looks as a graph of spark_dsg, the format of Hydra.

        Example:
            >>> memory.to_spark_dsg().save("home.json")

        Raises:
            ModuleNotFoundError: if spark_dsg is not installed.
        """
        with self._lock:
            batch = self._state.batch
            kinds = [batch.labels[index] for index in batch.objects["label"]]
            labels = dict(zip(self._state.things.descriptions, kinds, strict=True))
            home, layout = self.to_dict(), self.layout
        return make_spark_graph(home, layout, labels)

    def _check_furniture(self) -> None:
        if not self._state.layout.furniture:
            raise ValueError(
                "memory must have furniture before a query, got none. Call add_furniture first."
            )
