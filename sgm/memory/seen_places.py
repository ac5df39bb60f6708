"""Where the things of a memory were seen and missed, and who said that they are somewhere."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import mul
from typing import Any, TypeAlias

import numpy as np

from sgm.layout.layout import Layout
from sgm.memory.look import StepLog
from sgm.memory.memory_batch import MemoryBatch
from sgm.memory.seen_positions import Told, tell_positions
from sgm.memory.sighting import SeenAt
from sgm.memory.thing import Said, Thing
from sgm.names.name import Name
from sgm.schema import NEVER, RELATIONS

# Of a row: place, relation, whether it is there, time, times seen and looked, Told.
Values: TypeAlias = tuple[int, int, bool, int, int, int, Told]


@dataclass(frozen=True, slots=True)
class SeenRows:
    """Each place where each thing was ever seen, n of them.

    Where the last place of a thing was removed, it is once more there, without a place.

    Attributes:
        edge: row of the edge, -1 for a place that was removed, (n,).
        thing: row of the thing, (n,).
        furniture: position of the place, -1 for one that was removed, (n,).
        relation: by number in `RELATIONS`, (n,).
        is_there: whether it is there by the last looks (`MemoryBatch.find_present`), bool (n,).
        time: time step of the last sighting, (n,).
        times_seen, times_looked: looks that showed it there, and looks, (n,).
        is_last: whether it was seen there last of all; of one time step that is one place, (n,).
    """

    edge: np.ndarray
    thing: np.ndarray
    furniture: np.ndarray
    relation: np.ndarray
    is_there: np.ndarray
    time: np.ndarray
    times_seen: np.ndarray
    times_looked: np.ndarray
    is_last: np.ndarray

    @classmethod
    def of_things(cls, memory: MemoryBatch, things: np.ndarray | None = None) -> SeenRows:
        """List those of some things by row, of all for None; what was merged is one already."""
        edges, objects = memory.edges, memory.objects
        is_asked = objects["same_as"] < 0  # others stand under another name
        if things is not None:
            is_asked &= np.isin(np.arange(objects.num_rows), things)
        seen = np.flatnonzero((edges["num_true"] > 0) & is_asked[edges["object"]])
        last = np.full(objects.num_rows, NEVER)
        np.maximum.at(last, edges["object"][seen], edges["last_true"][seen])
        return cls.of_edges(
            memory, seen, np.flatnonzero(is_asked & (objects["last_observed"] > last))
        )

    @classmethod
    def of_edges(cls, memory: MemoryBatch, seen: np.ndarray, left: np.ndarray) -> SeenRows:
        """List those of edges that were ever true (n,), and things whose last place was removed."""
        names = ("object", "furniture", "relation", "is_true", "last_true", "num_true")
        columns = [memory.edges[name][seen] for name in (*names, "num_observed")]
        columns[names.index("is_true")] = memory.find_present(seen)
        if len(left):
            none = np.zeros(len(left), dtype=np.int64)
            last = memory.objects["last_observed"][left]
            of_left = (left, none - 1, none, none > 0, last, none, none)
            columns = [np.append(*pair) for pair in zip(columns, of_left, strict=True)]
            seen = np.append(seen, none - 1)
        last = memory.objects["last_furniture"][columns[0]]
        is_latest = columns[4] == memory.objects["last_observed"][columns[0]]
        columns = [seen, *columns, is_latest & (columns[1] == last)]
        return cls(*columns)

    def take(self, rows: np.ndarray) -> SeenRows:
        """Return some of the rows, by index or mark."""
        return SeenRows(*(getattr(self, name)[rows] for name in SeenRows.__slots__))

    def find_current(self, name_of: np.ndarray) -> np.ndarray:
        """Find of each name where it is, or if it is nowhere, where it was seen last, ascending.

        `name_of` numbers the names of all things, (O,).
        """
        name = name_of[self.thing]
        is_placed = np.zeros(len(name_of), dtype=bool)
        is_placed[name[self.is_there]] = True
        nowhere = np.flatnonzero(~is_placed[name])
        order = nowhere[np.lexsort((~self.is_last[nowhere], -self.time[nowhere]))]
        latest = order[np.unique(name[order], return_index=True)[1]]
        return np.sort(np.append(np.flatnonzero(self.is_there), latest))

    def choose_latest(self, most: int) -> np.ndarray:
        """Return the `most` rows that were seen last, and all of the same time as the last one."""
        if len(self.time) <= most:
            return np.arange(len(self.time))
        least = -np.partition(-self.time, most - 1)[most - 1]
        return np.flatnonzero(self.time >= least)

    def tell(self, memory: MemoryBatch, furniture_ids: Sequence[int]) -> list[SeenAt]:
        """Return what each row says, with positions in the map where they are known."""
        return [
            SeenAt(
                time=time,
                steps_ago=memory.time - time,
                furniture=None if place < 0 else furniture_ids[place],
                relation=None if place < 0 else RELATIONS[relation],
                is_there=is_there,
                times_seen=times_seen,
                times_looked=times_looked,
                position=position,
                position_sd=position_sd,
                usual_position=usual,
            )
            for place, relation, is_there, time, times_seen, times_looked, (
                position,
                position_sd,
                usual,
            ) in self.list_values(memory)
        ]

    def list_values(self, memory: MemoryBatch) -> Iterator[Values]:
        """List the place, relation, ..., `times_looked` of each row, and what `Told` says of it."""
        told: list[Told] = [(None, None, None)] * len(self.time)
        has_edge = np.flatnonzero(self.edge >= 0)
        if memory.positions.num_rows:
            positions = tell_positions(memory, self.edge[has_edge], self.is_there[has_edge])
            for number, position in zip(has_edge.tolist(), positions, strict=True):
                told[number] = position
        columns = (
            self.furniture,
            self.relation,
            self.is_there,
            self.time,
            self.times_seen,
            self.times_looked,
        )
        return zip(*(column.tolist() for column in columns), told, strict=True)


def list_home(
    memory: MemoryBatch,
    layout: Layout,
    descriptions: Sequence[str],
    said_by: Mapping[int, Mapping[tuple[int, int | None], str]],
    pictured: Mapping[int, Thing],
) -> dict[str, Any]:
    """List rooms > furniture > objects as JSON values.

    `said_by` has for objects of which something was said, by row, who said that they are at
    places, by time step and furniture; `pictured` has those of which there are pictures.
    """
    objects: dict[int, list[dict[str, Any]]] = {number: [] for number in layout.furniture}
    unplaced = []
    furniture_ids = tuple(layout.furniture)
    seen = SeenRows.of_things(memory)
    order = (~seen.is_last, -seen.time, seen.thing)  # of each object, the latest first
    seen = seen.take(np.lexsort(order))
    for object_row, values in zip(seen.thing.tolist(), seen.list_values(memory), strict=True):
        place, relation, is_there, time, times_seen, times_looked, (position, _, _) = values
        if place < 0:
            unplaced.append({"description": descriptions[object_row], "last_seen": time})
            continue
        furniture = furniture_ids[place]
        thing: dict[str, Any] = {
            "description": descriptions[object_row],
            "relation": RELATIONS[relation],
            "is_there": is_there,
            "last_seen": time,
            "times_seen": times_seen,
            "times_looked": times_looked,
        }
        if (
            object_row in said_by
            and (speaker := said_by[object_row].get((time, furniture))) is not None
        ):
            thing["by"] = speaker
        if position is not None:
            thing["position"] = list(position)
        if object_row in pictured:
            picture = pictured[object_row].find_picture(furniture, RELATIONS[relation])
            if picture is not None:
                thing["picture"] = picture
        objects[furniture].append(thing)
    last_looked = memory.furniture_last_observed[0].tolist()
    furniture_in: dict[int, list[dict[str, Any]]] = {room: [] for room in layout.rooms}
    for (number, node), looked in zip(layout.furniture.items(), last_looked, strict=True):
        where: dict[str, Any] = {}
        if node.location is not None:
            where["position"] = list(node.location)
        if node.box is not None:
            where["box"] = node.box.to_json()
        furniture_in[node.room].append(
            {
                "id": number,
                "label": node.label,
                "description": node.description,
                "last_looked": None if looked == NEVER else looked,
                **where,
                "objects": objects[number],
            }
        )
    return {
        "time": memory.time,
        "rooms": [
            {"id": room, "label": node.label, "furniture": furniture_in[room]}
            for room, node in layout.rooms.items()
        ],
        "unplaced": unplaced,
    }


def list_rows(home: Mapping[str, Any]) -> list[dict[str, Any]]:
    """List what `list_home` gave as one row for each object at each place."""
    counts = ("is_there", "last_seen", "times_seen", "times_looked")
    return [
        {
            "object": seen["description"],
            "relation": seen["relation"],
            "furniture": furniture["description"],
            "room": room["label"],
            **{name: seen[name] for name in counts},
            **dict(zip("xyz", _find_point(seen, furniture), strict=True)),
        }
        for room in home["rooms"]
        for furniture in room["furniture"]
        for seen in furniture["objects"]
    ]


def _find_point(seen: Mapping[str, Any], furniture: Mapping[str, Any]) -> Sequence[float | None]:
    """Return where an object is, or else its furniture, x, y, z; None of each if unknown."""
    point: Sequence[float | None]
    point = seen.get("position") or furniture.get("position") or (None, None, None)
    return point


def list_places(
    memory: MemoryBatch,
    object_row: int,
    said: Said,
    furniture_ids: Sequence[int],
    edges: np.ndarray | None = None,
) -> list[SeenAt]:
    """List every place where an object was ever seen, the latest first.

    Of one time step, the place where it was seen last comes first, or that of which was spoken
    last, after one that a look has shown since.

    Args:
        memory: what was merged is one.
        object_row: of the object.
        said: of it.
        furniture_ids: by position.
        edges: rows among which its edges are; None for all.
    """
    among = np.arange(memory.edges.num_rows) if edges is None else edges
    thing_edges = among[memory.edges["object"][among] == object_row]
    seen = thing_edges[memory.edges["num_true"][thing_edges] > 0]
    last_seen = int(memory.objects["last_observed"][object_row])
    is_left = last_seen > memory.edges["last_true"][seen].max(initial=NEVER)
    rows = SeenRows.of_edges(memory, seen, np.array([object_row])[: int(is_left)])
    rows = rows.take(np.lexsort((~rows.is_there, ~rows.is_last, -rows.time)))
    places = rows.tell(memory, furniture_ids)
    if said.thing.pictures:
        places = [add_picture(seen_at, said.thing) for seen_at in places]
    if not said.thing.statements:
        return places
    told = said.thing.order_places()
    last = int(memory.objects["last_furniture"][object_row])
    if last != NEVER and said.last is None:
        told[last_seen, furniture_ids[last]] = len(told)
    places.sort(
        key=lambda seen_at: (-seen_at.time, -told.get((seen_at.time, seen_at.furniture), -1))
    )
    said_by = list_said_by(memory, object_row, said, furniture_ids)
    return [
        replace(seen_at, by=said_by.get((seen_at.time, seen_at.furniture), ""))
        for seen_at in places
    ]


def add_picture(seen_at: SeenAt, thing: Thing) -> SeenAt:
    """Return where a thing was seen with the picture that shows it there, if there is one."""
    picture = thing.find_picture(seen_at.furniture, seen_at.relation)
    return seen_at if picture is None else replace(seen_at, picture=picture)


def sort_places(places: Iterable[tuple[SeenAt, int]]) -> list[SeenAt]:
    """Return places of several things, the latest sighting first, by step and the looks of this."""
    return [seen for seen, _ in sorted(places, key=lambda place: (-place[0].time, -place[1]))]


def list_said_by(
    memory: MemoryBatch, object_row: int, said: Said, furniture_ids: Sequence[int]
) -> dict[tuple[int, int | None], str]:
    """Return who said that an object is somewhere, by time step and furniture.

    Where a look has shown it there in the same time step, it was seen. Arguments as of
    `list_places`.
    """
    if not said.thing.statements:
        return {}
    last, edges = said.last, memory.edges
    said_by: dict[tuple[int, int | None], str] = {}
    if last is not None and last.furniture is not None:
        said_by[last.time, last.furniture] = last.by
    thing_edges = np.flatnonzero((edges["object"] == object_row) & (edges["num_true"] > 0))
    columns = (
        edges[name][thing_edges].tolist() for name in ("last_true", "furniture", "confidence")
    )
    known = {(time, furniture_ids[place]): sure for time, place, sure in zip(*columns, strict=True)}
    for (
        statement
    ) in said.thing.statements:  # a sighting of that step would have left its own confidence
        place = statement.time, statement.furniture
        if place[1] is not None and known.get(place) == np.float32(statement.confidence):
            said_by.setdefault(place, statement.by)
    return said_by


@dataclass(frozen=True, slots=True)
class Looks:
    """What the looks at F furniture nodes say about V objects.

    Attributes:
        negative: looks of this time step that did not show it, since it was seen there in this step
            or all, each weighed by how much of the furniture was in view, (V, F).
        sought: looks for what no thing was called, which did not find it, in L time steps each,
            (V, F, L); policies know nothing of them.
        sought_ago: time steps since then, infinite where that never was, (V, F, L).
        seen: confidence with which it was seen there in this step, 0 where it was not, (V, F).
        num_seen: how many of its description were seen there at once in this step, (V, F).
    """

    negative: np.ndarray
    sought: np.ndarray
    sought_ago: np.ndarray
    seen: np.ndarray
    num_seen: np.ndarray

    def take(self, rows: Sequence[int], is_another: Sequence[bool]) -> Looks:
        """Return those about some of the objects, of one perhaps several times, (n,).

        Where one `is_another` of that description, its like was seen, not it.
        """
        looks = Looks(*(getattr(self, name)[rows] for name in Looks.__slots__))
        if any(is_another):
            looks.negative[is_another] += looks.seen[is_another] > 0
            looks.seen[is_another] = looks.num_seen[is_another] = 0
        return looks


def sum_negative(
    step: StepLog,
    object_row: int,
    name: Name,
    share: np.ndarray | None,
    position: Mapping[int, int],
) -> dict[int, float]:
    """Return the coverage of the looks of a step that did not show an object, by furniture id.

    Where it was seen in this step, surely or not, these are the looks since. `share` is how
    likely it lies in each relation to furniture that it is at, (F, relations) by `position`; None
    where no look was `looks_by_relation`.
    """
    found = step.num_until_seen.get(object_row, {})
    negative: dict[int, float] = {}
    places: Iterable[int] = step.of_place
    if step.is_plain:  # most things miss all looks
        negative = dict(step.coverage)
        for furniture in found:
            negative.pop(furniture, None)
        places = found
    for furniture in places:
        first = found.get(furniture, 0)
        for number in step.of_place.get(furniture, ()):
            look = step.looks[number]
            if number < first or name.key in {hidden.key for hidden in look.hidden}:
                continue
            coverage = look.coverage
            if isinstance(coverage, tuple):
                assert share is not None
                expected = share[position[furniture]].tolist()
                coverage = sum(map(mul, expected, coverage))
            negative[furniture] = negative.get(furniture, 0.0) + coverage
    return negative
