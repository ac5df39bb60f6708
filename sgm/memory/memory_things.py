"""The part of a memory that says what things there are, and where each was seen."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import TYPE_CHECKING, Any

import numpy as np

from sgm.memory.home_rows import make_key
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_state import MemoryState
from sgm.memory.merged_things import find_roots
from sgm.memory.noticed_changes import (
    ThingChange,
    ThingEvent,
    list_arrivals,
    list_changes,
    list_events,
    list_sighted,
    read_past,
    read_since,
)
from sgm.memory.seen_places import (
    SeenRows,
    add_picture,
    list_home,
    list_places,
    list_rows,
    list_said_by,
    sort_places,
)
from sgm.memory.sighting import SeenAt, read_embedding
from sgm.memory.spark_graph import make_spark_graph
from sgm.memory.thing import Thing, ThingName
from sgm.messages import needed_to, shorten
from sgm.schema import NEVER
from sgm.store.past import Past

if TYPE_CHECKING:  # pandas is an extra
    from pandas import DataFrame


class MemoryThings:
    """Things and their places; `SceneGraphMemory` says what each call does, takes and raises."""

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state

    @property
    def batch(self) -> MemoryBatch:
        """The memory as a batch of one home."""
        with self._state.lock:
            return self._state.batch

    @property
    def descriptions(self) -> tuple[str, ...]:
        """Descriptions of all objects seen or asked for, (O,)."""
        with self._state.lock:
            return self._state.things.descriptions

    def list_ids(self, thing: str) -> tuple[str, ...]:
        """Return the ids of the things of a name; none where words alone tell them apart."""
        matches = self._state.match(thing)
        with self._state.lock:
            state = self._state
            rows = state.find_rows(thing) or state.find_rows(*matches.matches)
            ids = (state.things[object_row].id for object_row in rows)
            return tuple(dict.fromkeys(thing_id for thing_id in ids if thing_id))

    def list_named(self, *names: str, place: int | None = None) -> tuple[ThingName, ...]:
        """Return the things of some names or ids, as files name them; what was merged is one."""
        with self._state.lock:
            state = self._state
            rows = state.find_rows(*names)
            if place is not None:
                state.layout.check_furniture(place)
                fused, position = state.fuse_batch(), state.furniture.position[int(place)]
                edges = np.flatnonzero(fused.edges["furniture"] == position)
                present = set(fused.edges["object"][edges[fused.find_present(edges)]].tolist())
                rows = [object_row for object_row in rows if object_row in present]
            return tuple(state.things[object_row].name for object_row in rows)

    def find_nearest(
        self, embedding: Sequence[float] | np.ndarray, k: int = 3
    ) -> list[tuple[str, float]]:
        """Return the things that look most like something, by the embeddings of their sightings."""
        vector = np.array(read_embedding(embedding))
        if not len(vector) or not isinstance(k, (int, np.integer)) or k < 1:
            raise ValueError(
                f"embedding and k must be a vector and at least 1, got {shorten(embedding)} and "
                f"{shorten(k)}. Give what the sightings had."
            )
        with self._state.lock:
            things = [thing for thing in self._state.things if len(thing.embedding) == len(vector)]
        embeddings = np.array([thing.embedding for thing in things]).reshape(-1, len(vector))
        cosines = (
            embeddings @ vector / (np.linalg.norm(embeddings, axis=1) * np.linalg.norm(vector))
        )
        order = np.argsort(-cosines, kind="stable")[:k]
        return [(things[n].id or things[n].description, float(cosines[n])) for n in order]

    def places_of(self, description: str) -> list[SeenAt]:
        """Return every place where an object was ever seen, the latest sighting first."""
        matches = self._state.resolve(description).matches
        with self._state.lock:
            state = self._state
            fused = state.fuse_batch()
            rows = state.find_rows(*matches)
            found: list[tuple[SeenAt, int]] = []
            for object_row in rows:
                said = state.get_said(object_row)
                places = list_places(fused, object_row, said, state.furniture.ids)
                found += state.number_looks(said.members, places)
        return sort_places(found)

    def last_seen(self, description: str) -> SeenAt | None:
        """Return where and when an object was last seen; None if it never was."""
        return next(iter(self.places_of(description)), None)

    def history(self, thing: str) -> list[ThingEvent]:
        """Return what is kept of a thing over time, the latest first."""
        matches = self._state.resolve(thing).matches
        with self._state.lock:
            state = self._state
            fused = state.fuse_batch()
            found: list[ThingEvent] = []
            for object_row in state.find_rows(thing) or state.find_rows(*matches):
                said, ids = state.get_said(object_row), state.furniture.ids
                places = list_places(fused, object_row, said, ids)
                past, kept = None, _get_past(state)
                if kept is not None:
                    is_single = bool(fused.objects["num_at_once"][object_row] <= 1)
                    runs = kept.list_runs(_list_keys(state, object_row), is_single=is_single)
                    past = read_past(runs, state.layout.furniture)
                found += list_events(fused, said.thing, object_row, places, ids, past)
        return sorted(found, key=lambda event: -event.time)

    def list_known(self, thing: str, begin: int, end: int) -> list[ThingEvent]:
        """Return where a thing is known to have been around a time, the earliest first."""
        state = self._state
        with state.lock:
            kept = _get_past(state)
            if kept is not None:
                near = [
                    row
                    for object_row in state.find_rows(thing)
                    for row in kept.list_near(_list_keys(state, object_row), begin, end)
                ]
                return list_sighted(read_past(near, state.layout.furniture))
            return list_arrivals(self.history(thing), self.changes(0), thing)

    def changes(self, since: datetime | int) -> list[ThingChange]:
        """Return what is new, was moved or is gone, as looks have shown and people have said."""
        with self._state.lock:
            state = self._state
            first = read_since(since, state.clock)
            return list_changes(
                state.fuse_batch(),
                state.get_thing,
                state.list_spoken_of(),
                state.furniture.ids,
                first,
            )

    def to_dict(self) -> dict[str, Any]:
        """Return rooms > furniture > objects as JSON values."""
        with self._state.lock:
            state = self._state
            fused = state.fuse_batch()
            ids = state.furniture.ids
            said_by = {
                object_row: list_said_by(fused, object_row, state.get_said(object_row), ids)
                for object_row in state.list_spoken_of()
            }
            pictured = _list_pictured(state)
            return list_home(fused, state.layout, state.things.descriptions, said_by, pictured)

    def list_seen(
        self, things: Sequence[str] | None = None, furniture: int | None = None, most: int = 20
    ) -> tuple[list[tuple[str, SeenAt]], int]:
        """List where things are by the last looks, or else were seen last."""
        with self._state.lock:
            state = self._state
            fused = state.fuse_batch()
            asked = None
            if things is not None:
                wanted = set(things)
                texts = enumerate(state.things.descriptions)
                asked = np.array(
                    [object_row for object_row, text in texts if text in wanted], dtype=np.int64
                )
            seen, ids = SeenRows.of_things(fused, asked), state.furniture.ids
            if furniture is None:
                seen = seen.take(seen.find_current(state.things.number_descriptions()))
            else:
                place = state.furniture.position.get(furniture, -2)
                seen = seen.take((seen.furniture == place) & seen.is_there)
            num_all, seen = len(seen.time), seen.take(seen.choose_latest(most))
            pictured = _list_pictured(state)
            told = [
                (
                    state.things[thing].description,
                    add_picture(seen_at, pictured.get(thing, state.things[thing])),
                    is_last,
                )
                for thing, seen_at, is_last in zip(
                    seen.thing.tolist(), seen.tell(fused, ids), seen.is_last.tolist(), strict=True
                )
            ]
        rows = sorted(told, key=lambda row: (-row[1].time, row[0], not row[2]))
        return [(name, place) for name, place, _ in rows[:most]], num_all

    def count_things(self) -> dict[int, tuple[int, int | None]]:
        """Count what the last look showed at each place, by furniture id."""
        with self._state.lock:
            state = self._state
            fused = state.fuse_batch()
            places = fused.edges["furniture"][fused.find_present(np.arange(fused.edges.num_rows))]
            counts = np.bincount(places, minlength=fused.num_furniture).tolist()
            last = fused.furniture_last_observed[0].tolist()
            return {
                number: (count, None if looked == NEVER else looked)
                for number, count, looked in zip(state.furniture.ids, counts, last, strict=True)
            }

    def to_frame(self) -> DataFrame:
        """Return a table of every object at every place where it was ever seen (needs pandas)."""
        with needed_to("make a table", extra="frame"):
            from pandas import DataFrame

        return DataFrame(list_rows(self.to_dict()))

    def to_spark_dsg(self) -> Any:
        """Return what is there by the last looks as a graph of spark_dsg, the format of Hydra."""
        with self._state.lock:
            batch = self._state.batch
            kinds = [batch.labels[index] for index in batch.objects["label"]]
            labels = dict(zip(self._state.things.descriptions, kinds, strict=True))
            home, layout = self.to_dict(), self._state.layout.copy()
        return make_spark_graph(home, layout, labels)


def _list_pictured(state: MemoryState) -> dict[int, Thing]:
    """Return by row the things of which there are pictures; what was merged is one."""
    rows = [row for row, thing in enumerate(state.things) if thing.pictures]
    if rows and state.has_merged:
        rows = np.unique(find_roots(state.batch.objects["same_as"])[rows]).tolist()
    return {row: state.get_thing(row) for row in rows}


def _get_past(state: MemoryState) -> Past | None:
    """What knows where things were before; None where that is this memory alone."""
    return state.file if state.file is not None and state.file.is_held else state.reader


def _list_keys(state: MemoryState, object_row: int) -> list[str]:
    """Return by what a file tells a thing, and what was merged with it, from others."""
    return [make_key(state.things[row].name) for row in state.list_members(object_row)]
