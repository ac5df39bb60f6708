"""The part of a memory for statements: people correct it, and the robot says what it did."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from sgm.memory.look import StepLook
from sgm.memory.memory_state import MemoryState
from sgm.memory.merged_things import split_counts
from sgm.memory.sighting import read_relation
from sgm.memory.thing import ROBOT, SaidOf, Statement, ThingName, read_confidence
from sgm.messages import shorten
from sgm.names.name import Name
from sgm.names.name_index import NameIndex
from sgm.names.resolution import Resolution
from sgm.names.words import read_words

_MOST_NAMED = 5  # things that may be meant, in an error


class MemoryStatements:
    """What is said of things; `SceneGraphMemory` says what each call does, takes and raises.

    Things are named exactly, or by the id of a tracker: see `resolve_exact`. A name that is less
    than that, or means several things, is an error that says what may be meant. A file names nodes
    (`ThingName`).

    What was said counts as a sighting of that thing alone, whose confidence is the one of who said
    it, and later looks outweigh it. It stays in the file and in the evidence of finders.
    """

    def __init__(self, state: MemoryState) -> None:
        """Begin with the state that all parts share."""
        self._state = state

    @property
    def carried(self) -> tuple[str, ...]:
        """Descriptions of what the robot carries."""
        with self._state.lock:
            return tuple(
                self._state.things[object_row].description
                for object_row in self._state.list_carried()
            )

    def list_statements(self) -> list[tuple[ThingName, Statement]]:
        """Return what was said of things, or done with them, the oldest first."""
        with self._state.lock:
            state = self._state
            found = [
                (state.things[object_row].name, statement)
                for object_row in state.list_spoken_of()
                for statement in state.get_thing(object_row).statements
            ]
        return sorted(found, key=lambda spoken: spoken[1].time)

    def note_moved(
        self,
        thing: str,
        place: int,
        by: str,
        relation: str = "in",
        confidence: float | None = None,
        was_at: int | None = None,
    ) -> None:
        """Note where a thing is now, as a person says: "I put the keys in the drawer"."""
        self._say("moved", thing, (place, relation), by, confidence, was_at)

    def picked_up(
        self, thing: str, was_at: int | None = None, confidence: float | None = None
    ) -> None:
        """Note that the robot has taken a thing, and carries it until it is put down."""
        self._say("picked_up", thing, None, ROBOT, confidence, was_at)

    def put_down(
        self, thing: str, place: int, relation: str = "onTop", confidence: float | None = None
    ) -> None:
        """Note that the robot has put down what it carried."""
        self._say("put_down", thing, (place, relation), ROBOT, confidence, None)

    def find_carried(self, thing: str) -> str:
        """Return the description of the one thing that the robot carries and a name means."""
        carried = self.carried
        if not carried or self._state.resolve_exact(thing).matches:
            return ""
        index = NameIndex()  # without a table, so no synonym and no kind
        index.update(list(dict.fromkeys(carried)))
        found = index.resolve(thing)
        is_meant = len(found.matches) == 1 and found.how == "any of the kind"
        return found.matches[0] if is_meant and carried.count(found.matches[0]) == 1 else ""

    def rename(self, thing: str | ThingName, name: str, by: str = ROBOT) -> None:
        """Call a thing otherwise: "that is no cup, it is a bowl"."""
        read_words("by", by)
        matches = self._state.match(thing)
        read_words("name", name)
        with self._state.lock:
            node, object_row = self._get_named(thing, matches)
            if not node.id and self._state.things.get_row(Name.read(name)) not in (-1, object_row):
                raise ValueError(
                    f"name must be of no other thing, got {shorten(name)} for "
                    f"{shorten(node.description)}. Merge the two, if they are one."
                )
            self._state.write("rename", **node.to_json(), name=name, by=by)
            self._state.rename(object_row, name)

    def merge(self, thing: str | ThingName, other: str | ThingName, by: str = ROBOT) -> None:
        """Note that two things are one: "this is the same mug"; `split` undoes it."""
        read_words("by", by)
        matches = [(name, self._state.match(name)) for name in (thing, other)]
        with self._state.lock:
            (node, object_row), (other_node, other_row) = (
                self._get_named(*pair) for pair in matches
            )
            carried = self._state.list_carried()
            members = [*self._state.list_members(object_row), *self._state.list_members(other_row)]
            if object_row == other_row or any(member in carried for member in members):
                raise ValueError(
                    f"two things must be two, and not carried, to be merged, got "
                    f"{shorten(node.description)} and {shorten(other_node.description)}. "
                    "Put them down first, or leave it out."
                )
            self._state.write("merge", **node.to_json(), other=other_node.to_json(), by=by)
            self._state.link([other_row], object_row)

    def split(
        self, thing: str | ThingName, place: int | None = None, name: str = "", by: str = ROBOT
    ) -> None:
        """Note that what was held to be one thing is two; `merge` undoes it."""
        read_words("by", by)
        matches = self._state.match(thing)
        if place is not None:
            read_words("name", name)
        with self._state.lock:
            nodes = self._state.things.find_rows(str(thing)) if place is None else []
            if len(nodes) == 1 and isinstance(thing, str):  # one that was merged, too
                node, object_row = self._state.things[nodes[0]].name, nodes[0]
            else:
                node, object_row = self._get_named(thing, matches)
            if place is not None:
                self._split_off(node, object_row, place, name, by)
                return
            same_as = self._state.batch.objects["same_as"]
            rows = (
                [object_row]
                if same_as[object_row] >= 0
                else np.flatnonzero(same_as == object_row).tolist()
            )
            if not rows:
                raise ValueError(
                    f"thing must have been merged to be split, got {shorten(node.description)}. "
                    "Say place and name, to tell apart what was seen at several places."
                )
            self._state.write("split", **node.to_json(), by=by)
            self._state.link(rows, -1)

    def forget(self, thing: str, by: str = ROBOT) -> None:
        """Forget a thing that is not there at all: "there is no vase"."""
        read_words("by", by)
        found = self._state.match(thing)
        with self._state.lock:
            name, _ = self._get_named(thing, found)
            self.remove_object(name.description, name.id, by)

    def _say(
        self,
        kind: str,
        thing: str,
        put: tuple[int, str] | None,
        speaker: str,
        confidence: float | None,
        was_at: int | None,
    ) -> None:
        """Log a statement, and take it over; it was `put` at furniture, in a relation to it."""
        read_words("by", speaker)
        sure = read_confidence(confidence, speaker)
        relation = None if put is None else read_relation(put[1])
        if kind == "put_down":
            thing = self.find_carried(thing) or thing
        found = self._state.match(thing)
        with self._state.lock:
            if put is not None:
                self._state.layout.check_furniture(put[0])
            if was_at is not None:
                self._state.layout.check_furniture(was_at)
            only = self._state.list_carried() if kind == "put_down" else None
            known = self._choose(thing, found.matches, only)
            if known is None and (only or kind == "picked_up"):
                _check_no_doubt(found)
            name = known or ThingName(thing)
            object_row = self._state.things.get_row(Name.read(name.description), name.id)
            if only is not None and object_row not in only:
                held = ", ".join(
                    self._state.things[carried_row].description for carried_row in only
                )
                raise ValueError(
                    f"thing must be one that the robot carries to be put down, got {shorten(thing)}"
                    f"; it carries {held or 'nothing'}. Call picked_up first, or note_moved."
                )
            place = None if put is None else int(put[0])
            statement = Statement(self._state.time, kind, place, relation, speaker, sure)
            self.note(name, statement, None if was_at is None else int(was_at))

    def note(self, name: ThingName, statement: Statement, was_at: int | None) -> None:
        """Log a statement about a node, and take it over."""
        with self._state.lock:
            self._state.write(
                statement.kind,
                **name.to_json(),
                furniture=statement.furniture,
                relation=statement.relation,
                by=statement.by,
                confidence=statement.confidence,
                was_at=was_at,
            )
            self._state.say(SaidOf(name, statement, was_at))

    def remove_object(self, description: str, id: str = "", by: str | None = None) -> None:
        """Log that a node is forgotten, and forget it."""
        with self._state.lock:
            name, state = ThingName(description, id), self._state
            object_row = self._get_row(name)
            self._state.write("remove_object", **name.to_json(), by=by)
            state.remove(objects=state.list_members(object_row))

    def _split_off(
        self, node: ThingName, object_row: int, place: int, name: str, speaker: str
    ) -> None:
        """Let what was seen of an object at a place be another thing, of a new name."""
        state = self._state
        state.layout.check_furniture(place)
        place, batch, position = int(place), state.batch, state.furniture.ids.index(place)
        edges = batch.edges
        is_there = (
            edges["furniture"][(edges["object"] == object_row) & (edges["num_true"] > 0)]
            == position
        )
        if is_there.all() or not is_there.any():
            raise ValueError(
                f"thing must have been seen there and elsewhere to be split, got "
                f"{shorten(node.description)} at {state.layout.describe(place)}. Rename it, "
                "or name another place."
            )
        if state.things.get_row(Name.read(name)) >= 0:
            raise ValueError(
                f"name must be of no other thing, got {shorten(name)}. Choose another one."
            )
        self._state.write("split_off", **node.to_json(), furniture=place, name=name, by=speaker)
        before = {look: state.list_seen_rows(look) for look in state.step.looks}
        other = state.ensure_object(Name.read(name))
        thing = state.things[object_row]
        for row, is_split in ((other, True), (object_row, False)):
            state.things[row] = replace(
                state.things[row],
                statements=tuple(
                    said for said in thing.statements if (said.furniture == place) == is_split
                ),
                pictures=tuple(
                    shown for shown in thing.pictures if (shown.furniture == place) == is_split
                ),
            )
        batch = state.open_looks(knows_all=True)
        for table in (batch.edges, batch.positions):
            is_split_off = (table["object"] == object_row) & (table["furniture"] == position)
            table["object"][is_split_off] = other
        split_counts(batch.objects, batch.edges, object_row, other)
        batch.look_up_prior()  # of the new thing

        def rename_in(look: StepLook) -> StepLook:
            if look.furniture != place:
                return look
            seen = tuple(
                replace(sighting, description=name, owner=None, id=None)
                if row == object_row
                else sighting
                for sighting, row in zip(look.seen, before[look], strict=True)
            )
            return replace(look, seen=seen)

        state.rename_said(node, ThingName(name), place)
        state.close_looks(rename_in)

    def _choose(
        self, thing: str, matches: Sequence[str], only: Sequence[int] | None = None
    ) -> ThingName | None:
        """Return the one thing that is named, among some rows or all; None if there is none."""
        state = self._state
        rows = state.find_rows(thing) or state.find_rows(*matches)
        if only is not None:
            rows = [object_row for object_row in rows if object_row in only]
        if len(rows) > 1:
            names = ", ".join(str(state.things[object_row].name) for object_row in rows)
            raise ValueError(
                f"thing must be one, got {shorten(thing)}, which may be {names}. Name the one that "
                "is meant, or give its id."
            )
        return state.things[rows[0]].name if rows else None

    def _get_named(self, thing: str | ThingName, found: Resolution) -> tuple[ThingName, int]:
        """Return the one thing that is named, and its row."""
        if isinstance(thing, str):
            known = self._choose(thing, found.matches)
            if known is None:
                _check_no_doubt(found)
            thing = known or ThingName(thing)
        return thing, self._get_row(thing)

    def _get_row(self, node: ThingName) -> int:
        things = self._state.things
        object_row = things.get_row(Name.read(node.description), node.id)
        if object_row < 0:
            raise KeyError(
                f"description must be one that was seen or asked for, got "
                f"{shorten(node.id or node.description)}; there are {len(things)} objects. Check "
                "its words."
            )
        return object_row


def _check_no_doubt(found: Resolution) -> None:
    """Raise ValueError if a name is not exactly that of a thing, and may be meant for one."""
    if not found.matches and found.doubtful:
        names = ", ".join(found.doubtful[:_MOST_NAMED])
        raise ValueError(
            f"thing must be named exactly, got {shorten(found.question)}, which may be {names}. "
            "Say its whole name, or give its id."
        )
