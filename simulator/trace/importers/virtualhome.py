"""A scene graph of VirtualHome as a trace: the JSON object of its `environment_graph`.

Source: Puig et al., "VirtualHome: Simulating Household Activities via Programs" (CVPR 2018), and
the graphs that its simulator gives: `nodes` with id, class_name, category, properties and
bounding_box, and `edges` with from_id, relation_type and to_id.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from functools import cache
from pathlib import Path
from typing import Any

from sgm.files import make_read_error, read_json, read_table
from sgm.layout.box import LEAST_METRES, Box
from sgm.memory.sighting import Point
from sgm.messages import shorten
from sgm.schema import MOST_METRES
from simulator.priors.types import ROOMS, load_types
from simulator.trace.importers.home_builder import HomeBuilder
from simulator.trace.trace import Trace

_ROOM, _FURNITURE = "rooms", ("furniture", "appliances")
# Parts of the building, and who lives there: nothing lies in or on them but on floors.
_FLOORS = ("floor", "floors")
_NO_PLACES = ("walls", "ceiling", "doors", "windows", "characters", *_FLOORS)
_WRAPPED = ("init_graph", "graph", "environment_graph")  # of data sets with programs
_RELATIONS = {"INSIDE": "in", "ON": "onTop"}
_GRABBABLE = "GRABBABLE"  # of clothes, too, whose category is Furniture
# Words of its names that no table of a household has.
_WORDS = (
    "buns", "chinese", "condiment", "cpu", "minced", "pancake", "pile", "pound", "whipped",
)  # fmt: skip


def read_virtualhome(
    path: Path, furniture_labels: Collection[str] = ()
) -> tuple[Trace, HomeBuilder]:
    """Read a graph; "coffeetable" becomes "coffee table".

    Furniture is what is called so in the household's table, what is of the category Furniture or
    Appliances, cannot be grabbed and lies on nothing, and what holds something and lies on nothing.
    What lies on the floor is at a place "floor" of its room. A box of Unity (y is up) becomes one
    of the map, z up.

    Args:
        path: a JSON file.
        furniture_labels: labels that are furniture besides those.

    Raises:
        ValueError: if it cannot be read, is no such file, or nothing of it can be placed.
    """
    try:
        graph = read_json(path)
    except OSError as error:
        where = f"for {path}. Check the path."
        raise make_read_error(error, "graph must be a file that can be read", where) from error
    except ValueError as error:
        raise ValueError(
            f"graph must be one JSON object, got {error} in {path}. Save what environment_graph() "
            "of VirtualHome returns."
        ) from None
    if isinstance(graph, list) and len(graph) == 2 and isinstance(graph[0], bool):
        graph = graph[1]  # whether the simulator could answer stands before its graph
    for name in _WRAPPED:
        if isinstance(graph, Mapping) and isinstance(graph.get(name), Mapping):
            graph = graph[name]
    if not isinstance(graph, Mapping) or not all(
        isinstance(graph.get(name), list) for name in ("nodes", "edges")
    ):
        raise ValueError(
            f"graph must have the lists 'nodes' and 'edges', got neither in {path}. Save what "
            "environment_graph() of VirtualHome returns."
        )
    reader = _VirtualHomeReader(HomeBuilder(furniture_labels))
    reader.read(graph)
    return reader.builder.build(path.stem), reader.builder


class _VirtualHomeReader:
    """Reads one graph into a builder."""

    def __init__(self, builder: HomeBuilder) -> None:
        self.builder = builder
        self._nodes: dict[Any, Mapping[str, Any]] = {}
        self._parents: dict[Any, dict[Any, str]] = defaultdict(dict)  # relation by id of the parent
        self._holders: set[Any] = set()
        self._rooms: dict[Any, int] = {}  # index by id
        self._places: dict[Any, int] = {}  # index by id of what is furniture
        self._floors: dict[int, int] = {}  # index of the furniture by that of the room

    def read(self, graph: Mapping[str, Any]) -> None:
        """Read nodes and edges, then rooms, then furniture, then what is on it."""
        for node in graph["nodes"]:
            if _is_node(node):
                self._nodes[node["id"]] = node
            else:
                self.builder.leave_out("a node without id and class_name", shorten(node, 40))
        for edge in graph["edges"]:
            self._read_edge(edge)
        for number, node in self._nodes.items():
            if _find_category(node) == _ROOM:
                self._rooms[number] = self.builder.add_room(split_name(node["class_name"]))
        things = [
            number
            for number, node in self._nodes.items()
            if _find_category(node) not in (_ROOM, *_NO_PLACES)
        ]
        is_furniture = {number: self._is_furniture(number) for number in things}
        for number in things:
            if is_furniture[number]:
                self._add_furniture(number)
        for number in things:
            if not is_furniture[number]:
                self._add_object(number)

    def _read_edge(self, edge: Any) -> None:
        names = ("from_id", "relation_type", "to_id")
        is_edge = isinstance(edge, Mapping) and all(
            isinstance(edge.get(name), (int, str)) for name in names
        )
        if not is_edge:
            self.builder.leave_out("an edge without ids and relation_type", shorten(edge, 40))
            return
        relation = str(edge["relation_type"]).upper()
        child, parent = edge["from_id"], edge["to_id"]
        if relation in _RELATIONS and child in self._nodes and parent in self._nodes:
            self._parents[child].setdefault(parent, _RELATIONS[relation])
            self._holders.add(parent)

    def _is_furniture(self, number: Any) -> bool:
        node = self._nodes[number]
        name = split_name(node["class_name"])
        if self.builder.find_furniture(name) is not None:
            return True
        if self._list_holders(number):  # it lies on or in something
            return False
        if number in self._holders:
            return True
        return _find_category(node) in _FURNITURE and _GRABBABLE not in _list_properties(node)

    def _list_holders(self, number: Any) -> list[Any]:
        """List what a thing lies on or in, other than rooms and parts of the building."""
        return [
            parent
            for parent in self._parents[number]
            if _find_category(self._nodes[parent]) not in (_ROOM, *_NO_PLACES)
        ]

    def _list_above(self, number: Any) -> dict[Any, str]:
        """List all that holds a thing, the nearest first, with the relation to it."""
        found: dict[Any, str] = {}
        waiting = [number]
        while waiting:
            child = waiting.pop(0)
            for parent in self._list_holders(child):
                if parent not in found and parent != number:
                    found[parent] = self._parents[child][parent]
                    waiting.append(parent)
        # VirtualHome also says that what lies in a box in a cabinet is in the cabinet.
        return dict(sorted(found.items(), key=lambda row: -len(self._list_ancestors(row[0]))))

    def _list_ancestors(self, number: Any) -> set[Any]:
        above, waiting = set[Any](), [number]
        while waiting:
            for parent in self._list_holders(waiting.pop()):
                if parent not in above:
                    above.add(parent)
                    waiting.append(parent)
        return above

    def _find_room(self, number: Any) -> int | None:
        for holder in (number, *self._list_above(number)):
            for parent in self._parents[holder]:
                if parent in self._rooms:
                    return self._rooms[parent]
        return None

    def _add_furniture(self, number: Any) -> None:
        node, room = self._nodes[number], self._find_room(number)
        name = split_name(node["class_name"])
        if room is None:
            self.builder.leave_out("in no room", name)
            return
        label = self.builder.find_furniture(name) or name
        self._places[number] = self.builder.add_furniture(label, room, name, box=_read_box(node))

    def _add_object(self, number: Any) -> None:
        node = self._nodes[number]
        name = split_name(node["class_name"])
        center = _read_center(node)
        above = self._list_above(number)
        for holder, relation in above.items():
            if holder in self._places:
                self.builder.add_object(
                    name,
                    self._places[holder],
                    is_nested=holder != next(iter(above)),
                    relation=relation,
                    position=center,
                )
                return
        room = self._find_room(number)
        on_floor = any(
            _find_category(self._nodes[parent]) in _FLOORS for parent in self._parents[number]
        )
        if room is None or not on_floor:
            reason = "in no room" if room is None else "on no furniture and no floor"
            self.builder.leave_out(reason, name)
            return
        if room not in self._floors:
            self._floors[room] = self.builder.add_furniture("floor", room)
        self.builder.add_object(name, self._floors[room], relation="onTop", position=center)


def _is_node(node: Any) -> bool:
    return (
        isinstance(node, Mapping)
        and isinstance(node.get("id"), (int, str))
        and isinstance(node.get("class_name"), str)
        and bool(split_name(node["class_name"]))
    )


def _find_category(node: Mapping[str, Any]) -> str:
    return str(node.get("category", "")).lower()


def _read_center(node: Mapping[str, Any]) -> Point | None:
    """Return the middle of a node in the map: x, z, y of Unity; None if it is unknown."""
    return _read_vector(node, "center")


def _read_vector(node: Mapping[str, Any], name: str) -> Point | None:
    box = node.get("bounding_box")
    values = box.get(name) if isinstance(box, Mapping) else None
    if not isinstance(values, list) or len(values) != 3:
        return None
    if not all(isinstance(value, (int, float)) and abs(value) <= MOST_METRES for value in values):
        return None
    x, height, y = map(float, values)
    return x, y, height


def _read_box(node: Mapping[str, Any]) -> Box | None:
    center, size = _read_vector(node, "center"), _read_vector(node, "size")
    if center is None or size is None or min(size) < LEAST_METRES:
        return None
    known = _list_properties(node)
    interior = "none"
    if "CONTAINERS" in known:
        interior = "door" if "CAN_OPEN" in known else "open"
    return Box(center, size, interior=interior)


def _list_properties(node: Mapping[str, Any]) -> set[str]:
    properties = node.get("properties")
    return set(map(str, properties)) if isinstance(properties, list) else set()


def split_name(class_name: str) -> str:
    """Split "coffeetable" and "home_office" into words, by those that the household knows."""
    name = " ".join(class_name.replace("_", " ").lower().split())
    known, words = _load_words()
    if " " in name or name in words:
        return name
    if name in known:
        return known[name]
    best: list[list[str] | None] = [[], *[None] * len(name)]  # fewest words of each beginning
    for end in range(1, len(name) + 1):
        for begin in range(max(end - 20, 0), end):
            start = best[begin]
            least = 4 if 0 < begin and end < len(name) else 3  # letters: no "pro" in "hairproduct"
            if start is not None and end - begin >= least and name[begin:end] in words:
                found = best[end]
                if found is None or len(start) + 1 < len(found):
                    best[end] = [*start, name[begin:end]]
    return " ".join(best[-1] or [name])


@cache
def _load_words() -> tuple[dict[str, str], set[str]]:
    """Names by their letters without spaces, and all words of names."""
    types = load_types()
    names = {*types.furniture, *types.objects, *ROOMS, "home office", "dining room"}
    for row in read_table("sgm.names", "en/aliases.csv"):
        names.update((row["name"], *row["aliases"].split("|")))
    for row in read_table("sgm.prior", "household_furniture.csv"):
        names.update((row["label"], *row["also"].split("|")))
    known = {name.replace(" ", ""): name for name in sorted(names)}
    return known, {*_WORDS, *(word for name in names for word in name.split())}
