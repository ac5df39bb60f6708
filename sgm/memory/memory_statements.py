"""The part of a memory for statements: people correct it, and the robot says what it did."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from sgm.memory.given_names import rename_given
from sgm.memory.look import StepLook
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.memory_state import MemoryState
from sgm.memory.merged_things import find_roots, split_counts
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
                for object_row in _list_carried(self._state)
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
            _rename(self._state, object_row, name)

    def merge(self, thing: str | ThingName, other: str | ThingName, by: str = ROBOT) -> None:
        """Note that two things are one: "this is the same mug"; `split` undoes it."""
        read_words("by", by)
        matches = [(name, self._state.match(name)) for name in (thing, other)]
        with self._state.lock:
            (node, object_row), (other_node, other_row) = (
                self._get_named(*pair) for pair in matches
            )
            carried = _list_carried(self._state)
            members = [*self._state.list_members(object_row), *self._state.list_members(other_row)]
            if object_row == other_row or any(member in carried for member in members):
                raise ValueError(
                    f"two things must be two, and not carried, to be merged, got "
                    f"{shorten(node.description)} and {shorten(other_node.description)}. "
                    "Put them down first, or leave it out."
                )
            self._state.write("merge", **node.to_json(), other=other_node.to_json(), by=by)
            _link(self._state, [other_row], object_row)

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
                self._split_seen(node, object_row, place, name, by)
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
            _link(self._state, rows, -1)

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
            only = _list_carried(self._state) if kind == "put_down" else None
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

    def _split_seen(
        self, node: ThingName, object_row: int, place: int, name: str, speaker: str
    ) -> None:
        """Let what was seen of an object at a place be another thing, of a new name."""
        state = self._state
        state.layout.check_furniture(place)
        place, edges = int(place), state.batch.edges
        position = state.furniture.ids.index(place)
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
        _split_off(state, object_row, place, name)

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


def _list_carried(state: MemoryState) -> list[int]:
    """Return the rows of what the robot carries."""
    return np.flatnonzero(state.batch.objects["carried_since"] >= 0).tolist()


def _rename(state: MemoryState, object_row: int, name: str) -> None:
    """Call an object otherwise, in looks of this step, too; of the others nothing changes."""
    kind, looks = state.vocabulary.find_type(name), tuple(state.step.looks)
    called = [state.list_called(look) for look in looks]
    before_name = state.things[object_row].name
    batches = _list_changed(state)
    _note_renamed(state, object_row, name)
    state.things.rename(object_row, name)
    for batch in batches:
        if object_row < batch.objects.num_rows:  # or it comes up in a look
            batch.set_type(object_row, *kind)
    state.take_sought([object_row])
    if state.before is not None:
        if object_row < state.before.batch.objects.num_rows:
            state.move_sought(state.before.sought, state.before.batch, [object_row])
        called_by = dict(zip(looks, called, strict=True))
        _rename_said(state, before_name, state.things[object_row].name)
        state.close_looks(lambda look: _rename_in(state, look, called_by[look], object_row, name))


def _rename_said(
    state: MemoryState, before: ThingName, after: ThingName, furniture: int | None = None
) -> None:
    """Let what was said of a node be of another name: of all, or that it is at furniture."""
    between = state.step.between
    for index, (number, event) in enumerate(between):
        if not isinstance(event, SaidOf) or not event.name.is_same(before):
            continue
        said_at = None if event.statement is None else event.statement.furniture
        if furniture in (None, said_at):
            between[index] = number, replace(event, name=after)


def _rename_in(
    state: MemoryState,
    look: StepLook,
    called: tuple[list[int], list[list[int]]],
    object_row: int,
    name: str,
) -> StepLook:
    """Return a look in which an object is called otherwise, of what `list_called` said."""
    rows, others = called
    seen = [
        replace(sighting, description=name, owner=None) if row == object_row else sighting
        for sighting, row in zip(look.seen, rows, strict=True)
    ]
    is_meant = [rows == [object_row] for rows in others]
    hidden = [
        Name.read(name) if is_one else before
        for before, is_one in zip(look.hidden, is_meant, strict=False)
    ]
    is_sought = bool(look.sought) and is_meant[-1] and not state.things.has_id(look.sought)
    sought = name if is_sought else look.sought
    return replace(look, seen=tuple(seen), hidden=tuple(hidden), sought=sought)


def _note_renamed(state: MemoryState, object_row: int, name: str) -> None:
    """Note that what detectors call an object, where it was seen, is called otherwise.

    Not of several things of one name: ids alone tell which of them that is.
    """
    batch, thing = state.batch, state.things[object_row]
    if thing.id:
        return
    edges, places = batch.edges, set[int]()
    if batch.objects["num_at_once"][object_row] <= 1:
        is_seen = (edges["object"] == object_row) & (edges["num_true"] > 0)
        places = {state.furniture.ids[place] for place in edges["furniture"][is_seen].tolist()}
    state.renamed = rename_given(state.renamed, thing.description, name, places)


def _link(state: MemoryState, rows: Collection[int], root: int) -> None:
    """Let objects be one with another from now on, or, with -1, things of their own."""
    # Of what was one until now, each was looked for when one of them was.
    parted = {*rows, *find_roots(state.batch.objects["same_as"])[list(rows)].tolist()}
    names = [state.things[row].id or state.things[row].description for row in sorted(parted)]
    of_all = {
        look: [look, *(replace(look, sought=name) for name in names if name != look.sought)]
        for look in state.step.looks
        if root < 0 and look.sought and not parted.isdisjoint(state.find_rows(look.sought))
    }
    for batch in _list_changed(state, [*rows, root]):
        batch.objects["same_as"][list(rows)] = root
    state.has_merged = bool((state.batch.objects["same_as"] >= 0).any())
    state.close_looks(lambda look: of_all.get(look, [look]))


def _list_changed(state: MemoryState, rows: Collection[int] = ()) -> list[MemoryBatch]:
    """Return the batches in which to make a change that is no look: now and before the looks.

    Of that before the looks of this step it is a copy, which knows objects of these `rows`. It
    is left out where an object was asked for, which further looks are about: then the looks
    so far are of what was known before.
    """
    batch = state.batch
    if not state.keep_looks():
        return [batch]
    before = state.copy_before()
    if max(rows, default=-1) >= before.objects.num_rows:
        state.add_to(before)
    return [batch, before]


def _split_off(state: MemoryState, object_row: int, place: int, name: str) -> None:
    """Let what was seen of an object at furniture, by its id, be another thing, of a new name."""
    position, node = state.furniture.ids.index(place), state.things[object_row].name
    rows_of = {look: state.list_called(look)[0] for look in state.step.looks}
    other = state.ensure_object(Name.read(name))
    _part_said(state, object_row, other, place)
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
            for sighting, row in zip(look.seen, rows_of[look], strict=True)
        )
        return replace(look, seen=seen)

    _rename_said(state, node, ThingName(name), place)
    state.close_looks(rename_in)


def _part_said(state: MemoryState, object_row: int, other: int, place: int) -> None:
    """Let another thing have what was said of one at furniture, and its pictures there."""
    thing = state.things[object_row]
    for row, is_split in ((other, True), (object_row, False)):
        said = (said for said in thing.statements if (said.furniture == place) == is_split)
        shown = (shown for shown in thing.pictures if (shown.furniture == place) == is_split)
        state.things[row] = replace(
            state.things[row], statements=tuple(said), pictures=tuple(shown)
        )
