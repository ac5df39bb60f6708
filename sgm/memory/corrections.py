"""Calls of a memory by which people correct it, and by which the robot says what it did."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from threading import RLock
from typing import Any, NoReturn

import numpy as np

from sgm.memory.memory_state import MemoryState
from sgm.memory.sighting import read_relation
from sgm.memory.statement import ROBOT, Statement, read_confidence
from sgm.messages import shorten
from sgm.names.names import Resolution
from sgm.names.words import read_words


@dataclass(frozen=True, slots=True)
class ThingName:
    """Which node of a memory is meant: by its id, or, where it has none, by its words."""

    description: str
    id: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return JSON values for a log."""
        return {"description": self.description, **({"id": self.id} if self.id else {})}

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> ThingName:
        """Read JSON values of a log."""
        return cls(str(data["description"]), str(data.get("id", "")))


class MemoryCorrections(ABC):
    """The part of `SceneGraphMemory` for statements, rather than looks.

    Things are named as people name them, or by the id of a tracker: a name must mean one thing.
    What was said counts as a sighting of that thing alone, whose confidence is the one of who said
    it, and later looks outweigh it. It stays in the log and in the evidence of finders.
    """

    _lock: RLock
    _state: MemoryState

    @abstractmethod
    def resolve(self, description: str) -> Resolution:
        """Say which of the things that were seen a name means."""

    @abstractmethod
    def _write(self, kind: str, time: int | None = None, **values: Any) -> None:
        """Append a change to the log, if there is one, before it is made."""

    @property
    def carried(self) -> tuple[str, ...]:
        """Descriptions of what the robot carries."""
        with self._lock:
            is_carried = self._state.batch.objects["carried_since"] >= 0
            return tuple(self._state.things[row].description for row in np.flatnonzero(is_carried))

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
            rows = state.find_rows(thing) or [r for name in matches for r in state.find_rows(name)]
            ids = (state.things[row].id for row in rows)
            return tuple(dict.fromkeys(own for own in ids if own))

    def list_statements(self) -> list[tuple[ThingName, Statement]]:
        """Return what was said of things, or done with them, the oldest first.

        Kept are the last eight statements about each; the log has all.
        """
        with self._lock:
            state = self._state
            found = [
                (ThingName(state.things[row].description, state.things[row].id), one)
                for row in state.list_spoken_of()
                for one in state.get_statements(row).statements
            ]
        return sorted(found, key=lambda row: row[1].time)

    def note_moved(
        self,
        thing: str,
        place: int,
        by: str,
        relation: str = "in",
        confidence: float | None = None,
        was_at: int | None = None,
    ) -> None:
        """Note where a thing is now, as a person says: "I put the keys in the drawer".

        Args:
            thing: name or id, of a thing that was seen before or not.
            place: furniture id.
            by: who says so, such as "anna".
            relation: "in" or "onTop" it.
            confidence: probability that it is right, at least 0.5; None for 0.9, since people err.
            was_at: furniture id from which one of several of its kind was taken; the others stay
                where they are. None for the only one of its description, wherever it was.

        Raises:
            KeyError: if a place is no furniture node of this memory.
            ValueError: if the name means several things, or another argument is out of range.
        """
        self._say("moved", thing, place, by, relation, confidence, was_at)

    def picked_up(
        self, thing: str, was_at: int | None = None, confidence: float | None = None
    ) -> None:
        """Note that the robot has taken a thing, and carries it until it is put down.

        Args:
            thing: name or id.
            was_at: furniture id, where there are several of its kind; None for the only one.
            confidence: probability that it has it, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the name means several things, or another argument is out of range.
        """
        self._say("picked_up", thing, None, ROBOT, None, confidence, was_at)

    def put_down(
        self, thing: str, place: int, relation: str = "onTop", confidence: float | None = None
    ) -> None:
        """Note that the robot has put down what it carried.

        Args:
            thing: name or id, among what it carries.
            place: furniture id.
            relation: "in" or "onTop" it.
            confidence: probability that it lies there, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the robot carries no such thing, or another argument is out of range.
        """
        self._say("put_down", thing, place, ROBOT, relation, confidence, None)

    def forget(self, what: str | int, by: str = ROBOT) -> None:
        """Forget a thing that is not there at all, "there is no vase", or a place that is gone.

        A thing is forgotten as if it had never been seen; it comes back when it is seen again.

        Args:
            what: name or id of a thing, or a furniture id.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing or furniture.
            ValueError: if the name means several things, or `by` is no name.
        """
        read_words("by", by)
        if not isinstance(what, str):
            self._remove_furniture(what, by)
            return
        matches = self._match(what)
        with self._lock:
            name = self._choose(what, matches) or ThingName(what)
            self._remove_object(name.description, name.id, by)

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
            nodes = self._state.find_nodes(thing)
            if len(nodes) == 1:
                node = self._state.things[nodes[0]]
                own = ThingName(node.description, node.id)
            else:
                own = self._get_one(thing, matches)
            self._split(own, by)

    def _rename(self, own: ThingName, name: str, by: str) -> None:
        with self._lock:
            row = self._get_row(own)
            if not own.id and self._state.get_row(name) not in (-1, row):
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)} for "
                    f"{shorten(own.description)}. Merge the two, if they are one."
                )
            self._write("rename", **own.to_json(), name=name, by=by)
            self._state.rename(row, name)

    def _merge(self, own: ThingName, other: ThingName, by: str) -> None:
        with self._lock:
            row, second = self._get_row(own), self._get_row(other)
            carried = self._state.list_carried()
            members = [*self._state.list_members(row), *self._state.list_members(second)]
            if row == second or any(member in carried for member in members):
                raise ValueError(
                    f"two things must be two, and not carried, to be merged, got "
                    f"{shorten(own.description)} and {shorten(other.description)}. Put them down "
                    "first, or leave it out."
                )
            self._write("merge", **own.to_json(), other=other.to_json(), by=by)
            self._state.merge(row, second)

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
            self._state.split(rows)

    def _split_off(self, own: ThingName, place: int, name: str, by: str) -> None:
        with self._lock:
            row = self._get_row(own)
            self._state.layout.check_furniture(place)
            batch = self._state.batch
            own_edges = (batch.edges["object"] == row) & (batch.edges["num_true"] > 0)
            at = self._state.furniture_ids.index(place)
            is_there = batch.edges["furniture"][own_edges] == at
            if is_there.all() or not is_there.any():
                raise ValueError(
                    f"thing must have been seen there and elsewhere to be split, got "
                    f"{shorten(own.description)} at {self._state.layout.describe(place)}. Rename "
                    "it, or name another place."
                )
            if self._state.get_row(name) >= 0:
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)}. Choose another one."
                )
            self._write("split_off", **own.to_json(), furniture=int(place), name=name, by=by)
            self._state.split_off(row, int(place), name)

    def _get_one(self, thing: str, matches: Sequence[str]) -> ThingName:
        """Return the one thing that is meant.

        Raises:
            KeyError: if there is none.
            ValueError: if there are several.
        """
        own = self._choose(thing, matches)
        return own if own is not None else self._refuse(thing)

    def _get_row(self, own: ThingName) -> int:
        row = self._state.get_row(own.description, own.id)
        return row if row >= 0 else self._refuse(own.id or own.description)

    def _refuse(self, thing: str) -> NoReturn:
        raise KeyError(
            f"description must be one that was seen or asked for, got {shorten(thing)}; there are "
            f"{len(self._state.things)} objects. Check its words."
        )

    def _say(
        self,
        kind: str,
        thing: str,
        place: int | None,
        by: str,
        relation: str | None,
        confidence: float | None,
        was_at: int | None,
    ) -> None:
        """Log a statement, and take it over."""
        read_words("by", by)
        sure = read_confidence(confidence, by)
        relation = None if relation is None else read_relation(relation)
        matches = self._match(thing)
        with self._lock:
            for furniture in (place, was_at):
                if furniture is not None:
                    self._state.layout.check_furniture(furniture)
            only = self._state.list_carried() if kind == "put_down" else None
            name = self._choose(thing, matches, only) or ThingName(thing)
            if only is not None and self._state.get_row(name.description, name.id) not in only:
                held = ", ".join(self._state.things[row].description for row in only)
                raise ValueError(
                    f"thing must be one that the robot carries to be put down, got {shorten(thing)}"
                    f"; it carries {held or 'nothing'}. Call picked_up first, or note_moved."
                )
            place = None if place is None else int(place)
            was_at = None if was_at is None else int(was_at)
            statement = Statement(self._state.time, kind, place, relation, by, sure)
            self._note(name, statement, was_at)

    def _note(self, name: ThingName, statement: Statement, was_at: int | None) -> None:
        """Log a statement about a node, and take it over."""
        with self._lock:
            self._write(
                statement.kind, **name.to_json(), furniture=statement.furniture,
                relation=statement.relation, by=statement.by, confidence=statement.confidence,
                was_at=was_at,
            )  # fmt: skip
            self._state.state(name.description, name.id, statement, was_at)

    def _remove_object(self, description: str, id: str = "", by: str | None = None) -> None:
        """Log that a node is forgotten, and forget it.

        Raises:
            KeyError: if there is none.
        """
        with self._lock:
            row = self._get_row(ThingName(description, id))
            self._write("remove_object", **ThingName(description, id).to_json(), **_tell(by))
            self._state.remove(objects=self._state.list_members(row))

    def _remove_furniture(self, furniture: int, by: str | None = None) -> None:
        """Log that furniture is gone, and forget it.

        Raises:
            KeyError: if there is none.
        """
        with self._lock:
            self._state.layout.check_furniture(furniture)
            self._write("remove_furniture", furniture=furniture, **_tell(by))
            self._state.remove(furniture=[furniture])

    def _match(self, thing: str) -> tuple[str, ...]:
        """Return the descriptions that a name may mean; no call waits for text vectors."""
        read_words("thing", thing)
        return self.resolve(thing).matches

    def _choose(
        self, thing: str, matches: Sequence[str], only: Sequence[int] | None = None
    ) -> ThingName | None:
        """Return the one thing that is meant, None if it is a new one.

        Args:
            thing: its name or id.
            matches: descriptions that it may mean.
            only: rows among which it is; None for all.

        Raises:
            ValueError: if there are several.
        """
        state = self._state
        rows = state.find_rows(thing) or list(
            dict.fromkeys(row for name in matches for row in state.find_rows(name))
        )
        if only is not None:
            rows = [row for row in rows if row in only]
        if len(rows) > 1:
            names = ", ".join(_describe(state.things[row].description, state.things[row].id)
                              for row in rows)  # fmt: skip
            raise ValueError(
                f"thing must be one, got {shorten(thing)}, which may be {names}. Name the one that "
                "is meant, or give its id."
            )
        if not rows:
            return None
        return ThingName(state.things[rows[0]].description, state.things[rows[0]].id)


def _tell(by: str | None) -> dict[str, Any]:
    """Return who said it, for a log, if a person did."""
    return {} if by is None else {"by": by}


def _describe(description: str, number: str) -> str:
    return f"{description} (id {number})" if number else description
