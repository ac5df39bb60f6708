"""Calls of a memory that say which thing is which: what it is called, which two are one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sgm.memory.memory_questions import MemoryQuestions
from sgm.memory.thing import ROBOT, ThingName
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.resolution import Resolution
from sgm.names.words import read_words

_MOST_NAMED = 5  # things that may be meant, in an error


class MemoryIdentities(MemoryQuestions):
    """The part of `SceneGraphMemory` for names.

    Things are named exactly, or by the id of a tracker: see `resolve_exact`. A name that is less
    than that, or means several things, is an error that says what may be meant. A log names nodes
    (`ThingName`).
    """

    @property
    def carried(self) -> tuple[str, ...]:
        """Descriptions of what the robot carries."""
        with self._lock:
            return tuple(self._state.things[row].description for row in self._list_carried())

    def list_ids(self, thing: str) -> tuple[str, ...]:
        """Return the ids of the things of a name; none where words alone tell them apart.

        Args:
            thing: name or id.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        matches = self._match(thing)
        with self._lock:
            state = self._state
            rows = state.find_rows(thing) or state.find_rows(*matches.matches)
            ids = (state.things[row].id for row in rows)
            return tuple(dict.fromkeys(own for own in ids if own))

    def list_named(self, *names: str, at: int | None = None) -> tuple[ThingName, ...]:
        """Return the things of some names or ids, as logs name them; what was merged is one.

        Args:
            names: descriptions or ids, of exactly these things.
            at: furniture id: only what is there by the last looks; None for all.

        Raises:
            KeyError: if there is no such furniture.
            ValueError: if a name is none (`read_words`).
        """
        with self._lock:
            state = self._state
            rows = state.find_rows(*names)
            if at is not None:
                state.layout.check_furniture(at)
                edges, place = state.batch.edges, state.furniture.position[int(at)]
                there = edges["object"][edges["is_true"] & (edges["furniture"] == place)]
                rows = [row for row in rows if np.isin(state.list_members(row), there).any()]
            return tuple(state.things[row].name for row in rows)

    def rename(self, thing: str | ThingName, name: str, by: str = ROBOT) -> None:
        """Call a thing otherwise: "that is no cup, it is a bowl".

        Args:
            thing: name or id.
            name: description from now on.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if the name is not exactly that of one thing, or another thing has the new
                one.
        """
        read_words("by", by)
        matches = self._match(thing)
        read_words("name", name)
        with self._lock:
            own, row = self._get_one(thing, matches)
            if not own.id and self._state.things.get_row(Name.read(name)) not in (-1, row):
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)} for "
                    f"{shorten(own.description)}. Merge the two, if they are one."
                )
            self._write("rename", **own.to_json(), name=name, by=by)
            self._state.rename(row, name)

    def merge(self, thing: str | ThingName, other: str | ThingName, by: str = ROBOT) -> None:
        """Note that two things are one: "this is the same mug"; `split` undoes it.

        Looks go on to be kept under the name and id that each sighting has. Answers are about one
        thing, which is called as the first one.

        Args:
            thing: name or id.
            other: name or id of the other one.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing.
            ValueError: if a name is not exactly that of one thing, both are one already, or one is
                carried.
        """
        read_words("by", by)
        matches = [(name, self._match(name)) for name in (thing, other)]
        with self._lock:
            (own, row), (second, second_row) = (self._get_one(*one) for one in matches)
            carried = self._list_carried()
            members = [*self._state.list_members(row), *self._state.list_members(second_row)]
            if row == second_row or any(member in carried for member in members):
                raise ValueError(
                    f"two things must be two, and not carried, to be merged, got "
                    f"{shorten(own.description)} and {shorten(second.description)}. Put them down "
                    "first, or leave it out."
                )
            self._write("merge", **own.to_json(), other=second.to_json(), by=by)
            self._state.link([second_row], row)

    def split(
        self, thing: str | ThingName, place: int | None = None, name: str = "", by: str = ROBOT
    ) -> None:
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
            ValueError: if a name is not exactly that of one thing, nothing was merged, the thing
                was seen at no other place or not there, or another thing has the new name.
        """
        read_words("by", by)
        matches = self._match(thing)
        if place is not None:
            read_words("name", name)
        with self._lock:
            nodes = self._state.things.find_rows(str(thing)) if place is None else []
            if len(nodes) == 1 and isinstance(thing, str):  # one that was merged, too
                own, row = self._state.things[nodes[0]].name, nodes[0]
            else:
                own, row = self._get_one(thing, matches)
            if place is not None:
                self._split_off(own, row, place, name, by)
                return
            same_as = self._state.batch.objects["same_as"]
            rows = [row] if same_as[row] >= 0 else np.flatnonzero(same_as == row).tolist()
            if not rows:
                raise ValueError(
                    f"thing must have been merged to be split, got {shorten(own.description)}. Say "
                    "place and name, to tell apart what was seen at several places."
                )
            self._write("split", **own.to_json(), by=by)
            self._state.link(rows, -1)

    def _split_off(self, own: ThingName, row: int, place: int, name: str, by: str) -> None:
        """Let what was seen of an object at a place be another thing, of a new name."""
        state = self._state
        state.layout.check_furniture(place)
        place, batch, at = int(place), state.batch, state.furniture.ids.index(place)
        edges, objects = batch.edges, batch.objects
        is_there = edges["furniture"][(edges["object"] == row) & (edges["num_true"] > 0)] == at
        if is_there.all() or not is_there.any():
            raise ValueError(
                f"thing must have been seen there and elsewhere to be split, got "
                f"{shorten(own.description)} at {state.layout.describe(place)}. Rename it, or name "
                "another place."
            )
        if state.things.get_row(Name.read(name)) >= 0:
            raise ValueError(
                f"name must be of no other thing, got {shorten(name)}. Choose another one."
            )
        self._write("split_off", **own.to_json(), furniture=place, name=name, by=by)
        other = state.ensure_object(Name.read(name))
        for table in (edges, batch.positions):
            table["object"][(table["object"] == row) & (table["furniture"] == at)] = other
        for number in (row, other):
            true = np.flatnonzero((edges["object"] == number) & (edges["num_true"] > 0))
            seen = true[np.argsort(edges["last_true"][true], kind="stable")]
            objects["num_observed"][number] = max(int(edges["num_true"][true].sum()), 1)
            objects["last_observed"][number] = edges["last_true"][seen[-1]]
            objects["last_furniture"][number] = edges["furniture"][seen[-1]]
        objects["first_observed"][other] = objects["first_observed"][row]
        objects["num_at_once"][other] = 1
        objects["num_at_once"][row] = max(int(objects["num_at_once"][row]) - 1, 1)
        said = state.things[row].statements
        there = tuple(one for one in said if one.furniture == place)
        elsewhere = tuple(one for one in said if one.furniture != place)
        state.things[other] = replace(state.things[other], statements=there)
        state.things[row] = replace(state.things[row], statements=elsewhere)
        batch.look_up_prior()  # of the new thing
        state.begin_anew()

    def _list_carried(self) -> list[int]:
        return np.flatnonzero(self._state.batch.objects["carried_since"] >= 0).tolist()

    def _match(self, thing: str | ThingName) -> Resolution:
        """Say which descriptions are exactly of a name, and what else may be meant."""
        if isinstance(thing, ThingName):
            return Resolution(str(thing), (), "unknown")
        read_words("thing", thing)
        return self.resolve_exact(thing)

    def _choose(
        self, thing: str, matches: Sequence[str], only: Sequence[int] | None = None
    ) -> ThingName | None:
        """Return the one thing that is named, among some rows or all; None if there is none."""
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

    def _get_one(self, thing: str | ThingName, found: Resolution) -> tuple[ThingName, int]:
        """Return the one thing that is named, and its row."""
        if isinstance(thing, str):
            own = self._choose(thing, found.matches)
            if own is None:
                check_no_doubt(found)
            thing = own or ThingName(thing)
        return thing, self._get_row(thing)

    def _get_row(self, own: ThingName) -> int:
        things = self._state.things
        row = things.get_row(Name.read(own.description), own.id)
        if row < 0:
            raise KeyError(
                f"description must be one that was seen or asked for, got "
                f"{shorten(own.id or own.description)}; there are {len(things)} objects. Check its "
                "words."
            )
        return row


def check_no_doubt(found: Resolution) -> None:
    """Raise ValueError if a name is not exactly that of a thing, and may be meant for one."""
    if not found.matches and found.doubtful:
        names = ", ".join(found.doubtful[:_MOST_NAMED])
        raise ValueError(
            f"thing must be named exactly, got {shorten(found.question)}, which may be {names}. "
            "Say its whole name, or give its id."
        )
