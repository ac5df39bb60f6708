"""Calls of a memory that say which thing is which: what it is called, which two are one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NoReturn

import numpy as np

from sgm.memory.memory_questions import MemoryQuestions
from sgm.memory.memory_state import MemoryState
from sgm.memory.statement import ROBOT
from sgm.memory.thing import ThingName
from sgm.messages import shorten
from sgm.names.words import read_words


class MemoryIdentities(MemoryQuestions):
    """The part of `SceneGraphMemory` for names.

    Things are named as people name them, or by the id of a tracker: a name must mean one thing.
    """

    @property
    def carried(self) -> tuple[str, ...]:
        """Descriptions of what the robot carries."""
        with self._lock:
            return tuple(self._state.things[row].description for row in self._list_carried())

    def list_ids(self, thing: str) -> tuple[str, ...]:
        """Return the ids of the things that a name means; none where words alone tell them apart.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        matches = self._match(thing)
        with self._lock:
            state = self._state
            rows = state.find_rows(thing) or state.find_rows(*matches)
            ids = (state.things[row].id for row in rows)
            return tuple(dict.fromkeys(own for own in ids if own))

    def rename(self, thing: str, name: str, by: str = ROBOT) -> None:
        """Call a thing otherwise: "that is no cup, it is a bowl".

        Args:
            thing: name or id.
            name: description from now on.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if the name means several things, or another thing has the new one.
        """
        read_words("by", by)
        matches = self._match(thing)
        read_words("name", name)
        with self._lock:
            own = self._get_one(thing, matches)
            self._rename(own, name, by)

    def merge(self, thing: str, other: str, by: str = ROBOT) -> None:
        """Note that two things are one: "this is the same mug"; `split` undoes it.

        Looks go on to be kept under the name and id that each sighting has. Answers are about one
        thing, which is called as the first one.

        Args:
            thing: name or id.
            other: name or id of the other one.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if a name means several things, both are one already, or one is carried.
        """
        read_words("by", by)
        matches = [self._match(name) for name in (thing, other)]
        with self._lock:
            first, second = (
                self._get_one(name, own) for name, own in zip((thing, other), matches, strict=True)
            )
            self._merge(first, second, by)

    def split(self, thing: str, place: int | None = None, name: str = "", by: str = ROBOT) -> None:
        """Note that what was held to be one thing is two; `merge` undoes it.

        Args:
            thing: name or id, of a thing that was merged: it is one of its own again, or, where it
                is the one that stands for others, all of them are.
            place: furniture id, to tell apart what words did not: what was seen there is another
                thing.
            name: description of that other thing.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing or place.
            ValueError: if a name means several things, nothing was merged, the thing was seen at
                no other place or not there, or another thing has the new name.
        """
        read_words("by", by)
        matches = self._match(thing)
        if place is not None:
            read_words("name", name)
        with self._lock:
            if place is not None:
                self._split_off(self._get_one(thing, matches), place, name, by)
                return
            nodes = self._state.things.find_rows(thing)
            if len(nodes) == 1:
                own = self._state.things[nodes[0]].name
            else:
                own = self._get_one(thing, matches)
            self._split(own, by)

    def _rename(self, own: ThingName, name: str, by: str) -> None:
        with self._lock:
            row = self._get_row(own)
            if not own.id and self._state.things.get_row(name) not in (-1, row):
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)} for "
                    f"{shorten(own.description)}. Merge the two, if they are one."
                )
            self._write("rename", **own.to_json(), name=name, by=by)
            self._state.take(self._state.get_content().rename(row, name))

    def _merge(self, own: ThingName, other: ThingName, by: str) -> None:
        with self._lock:
            row, second = self._get_row(own), self._get_row(other)
            carried = self._list_carried()
            members = [*self._state.list_members(row), *self._state.list_members(second)]
            if row == second or any(member in carried for member in members):
                raise ValueError(
                    f"two things must be two, and not carried, to be merged, got "
                    f"{shorten(own.description)} and {shorten(other.description)}. Put them down "
                    "first, or leave it out."
                )
            self._write("merge", **own.to_json(), other=other.to_json(), by=by)
            self._state.link([second], row)

    def _split(self, own: ThingName, by: str) -> None:
        with self._lock:
            row = self._get_row(own)
            same_as = self._state.batch.objects["same_as"]
            rows = [row] if same_as[row] >= 0 else np.flatnonzero(same_as == row).tolist()
            if not rows:
                raise ValueError(
                    f"thing must have been merged to be split, got {shorten(own.description)}. Say "
                    "place and name, to tell apart what was seen at several places."
                )
            self._write("split", **own.to_json(), by=by)
            self._state.link(rows, -1)

    def _split_off(self, own: ThingName, place: int, name: str, by: str) -> None:
        with self._lock:
            row = self._get_row(own)
            self._state.layout.check_furniture(place)
            batch = self._state.batch
            own_edges = (batch.edges["object"] == row) & (batch.edges["num_true"] > 0)
            at = self._state.furniture.ids.index(place)
            is_there = batch.edges["furniture"][own_edges] == at
            if is_there.all() or not is_there.any():
                raise ValueError(
                    f"thing must have been seen there and elsewhere to be split, got "
                    f"{shorten(own.description)} at {self._state.layout.describe(place)}. Rename "
                    "it, or name another place."
                )
            if self._state.things.get_row(name) >= 0:
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)}. Choose another one."
                )
            self._write("split_off", **own.to_json(), furniture=int(place), name=name, by=by)
            _split_off_seen(self._state, row, int(place), name)

    def _list_carried(self) -> list[int]:
        return np.flatnonzero(self._state.batch.objects["carried_since"] >= 0).tolist()

    def _match(self, thing: str) -> tuple[str, ...]:
        """Return the descriptions that a name may mean; no call waits for text vectors."""
        read_words("thing", thing)
        return self.resolve(thing).matches

    def _choose(
        self, thing: str, matches: Sequence[str], only: Sequence[int] | None = None
    ) -> ThingName | None:
        """Return the one thing that is meant, among some rows or all; None if it is a new one."""
        state = self._state
        rows = state.find_rows(thing) or state.find_rows(*matches)
        if only is not None:
            rows = [row for row in rows if row in only]
        if len(rows) > 1:
            names = ", ".join(str(state.things[row].name) for row in rows)
            raise ValueError(
                f"thing must be one, got {shorten(thing)}, which may be {names}. Name the one that "
                "is meant, or give its id."
            )
        return state.things[rows[0]].name if rows else None

    def _get_one(self, thing: str, matches: Sequence[str]) -> ThingName:
        """Return the one thing that is meant."""
        own = self._choose(thing, matches)
        return own if own is not None else self._refuse(thing)

    def _get_row(self, own: ThingName) -> int:
        row = self._state.things.get_row(own.description, own.id)
        return row if row >= 0 else self._refuse(own.id or own.description)

    def _refuse(self, thing: str) -> NoReturn:
        raise KeyError(
            f"description must be one that was seen or asked for, got {shorten(thing)}; there are "
            f"{len(self._state.things)} objects. Check its words."
        )


def _split_off_seen(state: MemoryState, row: int, furniture: int, name: str) -> None:
    """Let what was seen of an object at a place be another thing, of a new name."""
    other = state.ensure_object(name)
    batch, place = state.batch, state.furniture.ids.index(furniture)
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
    said = state.things[row].statements
    state.things[other] = replace(
        state.things[other], statements=tuple(one for one in said if one.furniture == furniture)
    )
    state.things[row] = replace(
        state.things[row], statements=tuple(one for one in said if one.furniture != furniture)
    )
    batch.look_up_prior()  # of the new thing
    state.begin_anew()
