"""Calls of a memory by which people correct it, and by which the robot says what it did."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from sgm.memory.memory_identities import MemoryIdentities, check_no_doubt
from sgm.memory.memory_state import MemoryState
from sgm.memory.seen_positions import forget_positions
from sgm.memory.sighting import read_relation
from sgm.memory.thing import ROBOT, Statement, ThingName, read_confidence
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.name_matching import NameIndex
from sgm.names.words import read_words
from sgm.schema import RELATIONS


class MemoryCorrections(MemoryIdentities):
    """The part of `SceneGraphMemory` for statements, rather than looks.

    Things are named exactly, or by the id of a tracker: see `resolve_exact`. What was said counts
    as a sighting of that thing alone, whose confidence is the one of who said it, and later looks
    outweigh it. It stays in the log and in the evidence of finders.
    """

    def list_statements(self) -> list[tuple[ThingName, Statement]]:
        """Return what was said of things, or done with them, the oldest first.

        Kept are the last eight statements about each; the log has all.
        """
        with self._lock:
            state = self._state
            found = [
                (state.things[row].name, one)
                for row in state.list_spoken_of()
                for one in state.get_thing(row).statements
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
            thing: name or id; a name that no thing has exactly is a new thing.
            place: furniture id.
            by: who says so, such as "anna".
            relation: "in" or "onTop" it.
            confidence: probability that it is right, at least 0.5; None for 0.9, since people err.
            was_at: furniture id from which one of several of its kind was taken; the others stay
                where they are. None for the only one of its description, wherever it was.

        Raises:
            KeyError: if a place is no furniture node of this memory.
            ValueError: if several things have the name, or another argument is out of range.
        """
        self._say("moved", thing, place, by, relation, confidence, was_at)

    def picked_up(
        self, thing: str, was_at: int | None = None, confidence: float | None = None
    ) -> None:
        """Note that the robot has taken a thing, and carries it until it is put down.

        Args:
            thing: name or id; a name that is like none that is known is a new thing.
            was_at: furniture id, where there are several of its kind; None for the only one.
            confidence: probability that it has it, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the name is not exactly that of one thing and may be meant for one, or
                another argument is out of range.
        """
        self._say("picked_up", thing, None, ROBOT, None, confidence, was_at)

    def put_down(
        self, thing: str, place: int, relation: str = "onTop", confidence: float | None = None
    ) -> None:
        """Note that the robot has put down what it carried.

        Args:
            thing: name or id, among what it carries; fewer properties will do: "mug" for the only
                one carried, a "red mug".
            place: furniture id.
            relation: "in" or "onTop" it.
            confidence: probability that it lies there, at least 0.5; None for 0.97.

        Raises:
            KeyError: if the place is no furniture node of this memory.
            ValueError: if the robot carries no such thing, or another argument is out of range.
        """
        self._say("put_down", thing, place, ROBOT, relation, confidence, None)

    def find_carried(self, thing: str) -> str:
        """Return the description of the one thing that the robot carries and a name means.

        Fewer properties will do: "mug" for a "red mug". Empty if it carries none such, or several.

        Raises:
            ValueError: if the name is none (`read_words`).
        """
        carried = self.carried
        if not carried or self.resolve_exact(thing).matches:
            return ""
        index = NameIndex()  # without a table, so no synonym and no kind
        index.update(list(dict.fromkeys(carried)))
        found = index.resolve(thing)
        is_meant = len(found.matches) == 1 and found.how == "any of the kind"
        return found.matches[0] if is_meant and carried.count(found.matches[0]) == 1 else ""

    def forget(self, what: str | int, by: str = ROBOT) -> None:
        """Forget a thing that is not there at all, "there is no vase", or a place that is gone.

        A thing is forgotten as if it had never been seen; it comes back when it is seen again.

        Args:
            what: name or id of a thing, or a furniture id.
            by: who says so; it stands in the log.

        Raises:
            KeyError: if there is no such thing or furniture.
            ValueError: if the name is not exactly that of one thing, or `by` is no name.
        """
        read_words("by", by)
        if not isinstance(what, str):
            self._remove_furniture(what, by)
            return
        found = self._match(what)
        with self._lock:
            name, _ = self._get_one(what, found)
            self._remove_object(name.description, name.id, by)

    def remove_object(self, description: str) -> None:
        """Forget an object with all its edges, as if it had never been seen or asked for.

        Raises:
            KeyError: if this memory has no object of that description.
            ValueError: if the description is no name (`read_words`).
        """
        self._remove_object(description)

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
        if kind == "put_down":
            thing = self.find_carried(thing) or thing
        found = self._match(thing)
        with self._lock:
            for furniture in (place, was_at):
                if furniture is not None:
                    self._state.layout.check_furniture(furniture)
            only = self._list_carried() if kind == "put_down" else None
            known = self._choose(thing, found.matches, only)
            if known is None and (only or kind == "picked_up"):
                check_no_doubt(found)
            name = known or ThingName(thing)
            row = self._state.things.get_row(Name.read(name.description), name.id)
            if only is not None and row not in only:
                held = ", ".join(self._state.things[own].description for own in only)
                raise ValueError(
                    f"thing must be one that the robot carries to be put down, got {shorten(thing)}"
                    f"; it carries {held or 'nothing'}. Call picked_up first, or note_moved."
                )
            place, was_at = (None if at is None else int(at) for at in (place, was_at))
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
            _take_statement(self._state, name, statement, was_at)

    def _remove_object(self, description: str, id: str = "", by: str | None = None) -> None:
        """Log that a node is forgotten, and forget it."""
        with self._lock:
            name, state = ThingName(description, id), self._state
            row = self._get_row(name)
            self._write("remove_object", **name.to_json(), by=by)
            state.take(state.get_content().remove(objects=state.list_members(row)))


def _take_statement(
    state: MemoryState, name: ThingName, statement: Statement, was_at: int | None
) -> None:
    """Take over what was said of a thing, or what the robot did with it.

    Of several things of one description, it is no longer at `was_at`; None for all its places.
    """
    row = state.ensure_object(Name.read(name.description), name.id)
    batch, ids = state.batch, state.furniture.ids
    edges = batch.edges
    is_left = np.isin(edges["object"], state.list_members(row)) & edges["is_true"]
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
    forget_positions(
        batch.positions, state.list_members(row), {place, *edges["furniture"][left].tolist()}
    )
    if place < 0:
        batch.note_carried(row)
    else:
        batch.note_place(row, place, relation, statement.confidence)
    num_observed = int(batch.objects["num_observed"][row])
    statement = replace(statement, was_at=tuple(places), num_observed=num_observed)
    state.things[row] = state.things[row].add(statement)
    if state.sought and statement.furniture is not None:
        words = read_words("description", state.things[row].description)
        state.sought.pop((words, statement.furniture), None)
    state.begin_anew()
