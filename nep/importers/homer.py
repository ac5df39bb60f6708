"""Households of HOMER and HOMER+ as traces: days of scene graphs at steps of some minutes.

Source: Patel and Chernova, "Proactive Robot Assistance via Spatio-Temporal Object Modeling"
(CoRL 2022), and the folders published with it; the successor HOMER+ stores the same in other files.
"""

from __future__ import annotations

import re
from collections import Counter, defaultdict
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
import torch

from nep.tensor_file import read_tensors
from sgm.arrays.week import DAY_SECONDS
from sgm.files import read_json
from sgm.messages import shorten, shorten_text
from sgm.schema import RELATIONS, USUAL_RELATION
from simulator.priors.types import load_types
from simulator.trace import Event, Furniture, Layout, Room, Trace
from simulator.trace.layout import number_names

# Days have no date; they are laid on one clock from a Monday.
FIRST_DAY = datetime(2024, 5, 6)
_COMMON = "common_data.json"
# Times the size of a file that its values may have: a snapshot stands in all samples of its hours.
_MOST_REPEATS = 250


@dataclass(frozen=True, slots=True)
class _Day:
    """One day: minutes since midnight (T,), and the parent of every node, -1 for none, (T, N)."""

    minutes: np.ndarray
    parent: np.ndarray


@dataclass(slots=True)
class _Nodes:
    """The nodes of a household, (N,) each: class names, which are rooms, and which lie about."""

    names: list[str]
    is_room: np.ndarray
    is_object: np.ndarray


@dataclass(slots=True)
class HomerSummary:
    """What was read and what was left out, for the command line."""

    num_days: int
    num_places: int
    num_objects: int
    left_out: dict[str, Counter[str]]

    def summarise(self) -> str:
        """Say what was placed and what was not, a line each."""
        lines = [
            f"placed: {self.num_objects} objects at {self.num_places} places, {self.num_days} days"
        ]
        for reason, names in self.left_out.items():
            counts = ", ".join(f"{name} x {count}" for name, count in names.most_common())
            lines.append(f"not placed, {reason}: {counts}")
        return "\n".join(lines)


def read_homer(folder: Path, furniture_labels: Collection[str] = ()) -> tuple[Trace, HomerSummary]:
    """Read a household: `common_data.json` with `train/NNN.pt` and `test/NNN.pt`.

    What lies in an object is at that object's place; a room that holds things itself has a place
    named "floor". Days follow each other, those of `train` first; at night nothing is recorded,
    and each day begins as its own first snapshot says. Nodes that never hold an object are left
    out. A file of HOMER is a list of samples, dictionaries with `prev_edges` and `edges` (N, N),
    row = child, column = parent, and `time`, minutes since midnight; or a list of four tensors:
    edges (T, N, N); nodes; activity; minutes (T,). A file of HOMER+ is a dictionary with `edges`,
    `times`, `node_ids` and `class_names`, whose tree has the root "home"; without
    `common_data.json`, what stands in a room is furniture.

    Args:
        folder: the household's folder.
        furniture_labels: labels of nodes that are furniture although the source says otherwise.

    Raises:
        ValueError: if a file is missing or broken; it is named.
    """
    files = [path for part in ("train", "test") for path in sorted((folder / part).glob("*.pt"))]
    if not files:
        raise ValueError(
            f"household must be a folder with train/*.pt or test/*.pt, got none in {folder}. "
            "Name the folder of one household, such as .../household0/processed."
        )
    contents = [_load(path) for path in files]
    read = _read_dictionaries if isinstance(contents[0], dict) else _read_lists
    nodes, days = read(folder, contents, files)
    wanted = {label.replace("_", " ").lower() for label in furniture_labels}
    nodes.is_object &= np.array([name not in wanted for name in nodes.names])
    return _build(folder, nodes, days)


def _load(path: Path) -> Any:
    try:
        return read_tensors(path, _MOST_REPEATS)
    except (OSError, ValueError) as error:
        text = shorten_text(str(error))
        raise _make_error("day must be a file of tensors", text, path) from None


def _make_error(rule: str, got: object, file: Path) -> ValueError:
    return ValueError(f"{rule}, got {got} in {file}. Copy it again.")


def _read_common(path: Path) -> tuple[list[str], list[str]]:
    """Return the class and the category of each node."""
    try:
        common = read_json(path)
        names, categories = common["node_classes"], common["node_categories"]
        if not all(isinstance(name, str) for name in [*names, *categories]):
            raise ValueError("a class that is no text")
        if len(names) != len(categories):
            raise ValueError(f"{len(names)} classes and {len(categories)} categories")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"common data must be JSON with node_classes and node_categories, got "
            f"{type(error).__name__}: {error} in {path}. Copy the household again."
        ) from None
    return names, categories


def _read_lists(
    folder: Path, contents: Sequence[Any], files: Sequence[Path]
) -> tuple[_Nodes, list[_Day]]:
    """Read the files of HOMER."""
    names, categories = _read_common(folder / _COMMON)
    days = [
        _make_day(*_split_day(content, file), len(names), file)
        for content, file in zip(contents, files, strict=True)
    ]
    return _sort_nodes(names, categories, days), days


def _split_day(content: Any, file: Path) -> tuple[Any, Any]:
    """Return the edges and the times of a day: four tensors, or samples with those before."""
    samples = _expect_list(content)
    try:
        if not samples or not all(isinstance(sample, dict) for sample in samples):
            edges, _, _, minutes = samples
            return edges, minutes
        edges = [sample["edges"] for sample in samples]
        minutes = [float(sample["time"]) for sample in samples]
        if len(samples) > 1:  # one step before the first one
            edges.insert(0, samples[0]["prev_edges"])
            minutes.insert(0, 2 * minutes[0] - minutes[1])
    except (TypeError, ValueError, KeyError, RuntimeError, OverflowError) as error:
        rule = "day must be a list of four tensors, or of samples with prev_edges, edges and time"
        found = error if isinstance(error, KeyError) else type(content).__name__
        raise _make_error(rule, found, file) from None
    return edges, minutes


def _read_dictionaries(
    folder: Path, contents: Sequence[Any], files: Sequence[Path]
) -> tuple[_Nodes, list[_Day]]:
    """Read the files of HOMER+."""
    days = []
    names = [str(name) for name in _expect_list(contents[0].get("class_names"))]
    for content, file in zip(contents, files, strict=True):
        try:
            edges, minutes = content["edges"], content["times"]
            listed = [str(name) for name in _expect_list(content["class_names"])]
        except (TypeError, KeyError) as error:
            rule = "day must be a dictionary with edges, times and class_names"
            raise _make_error(rule, error, file) from None
        if listed != names:
            raise _make_error("days must have equal class_names", "others", file)
        days.append(_make_day(edges, minutes, len(names), file))
    if "home" not in names:
        raise _make_error("tree must have the root 'home'", "none", files[0])
    if (folder / _COMMON).exists():
        known = dict(zip(*_read_common(folder / _COMMON), strict=True))
        if known.keys() >= set(names):
            return _sort_nodes(names, [known[name] for name in names], days), days
    return _sort_tree(names, days), days


def _sort_nodes(names: Sequence[str], categories: Sequence[str], days: Sequence[_Day]) -> _Nodes:
    """Return which nodes are rooms and objects, by their categories; what moves is an object."""
    is_room = np.array([category == "Rooms" for category in categories])
    is_object = np.array([category == "placable_objects" for category in categories])
    return _Nodes(_clean(names), is_room, (is_object | _find_movers(days)) & ~is_room)


def _sort_tree(names: Sequence[str], days: Sequence[_Day]) -> _Nodes:
    """Return the same by the tree: rooms hang on "home", furniture is what stays in a room."""
    root = names.index("home")
    first = days[0].parent[0]
    is_room = first == root
    depth_two = np.isin(first, np.flatnonzero(is_room))
    is_object = (~depth_two & ~is_room) | _find_movers(days)
    is_object[root] = is_room[root] = False
    return _Nodes(_clean(names), is_room, is_object & ~is_room)


def _expect_list(value: Any) -> list[Any]:
    """Return a list, or an empty one of anything else."""
    return list(value) if isinstance(value, (list, tuple)) else []


def _make_day(edges: Any, minutes: Any, num_nodes: int, file: Path) -> _Day:
    try:  # tensors of any type, or lists
        minutes = _to_numbers(minutes)
        snapshots = [torch.as_tensor(snapshot) for snapshot in edges]
        num_minutes = len(minutes)
    except (TypeError, ValueError, RuntimeError) as error:
        found = type(error).__name__
        raise _make_error("edges and times must be numbers", found, file) from None
    if not np.isfinite(minutes).all():
        raise _make_error("times must be finite", shorten(minutes), file)
    wanted = (num_nodes, num_nodes)
    shapes = {tuple(snapshot.shape) for snapshot in snapshots}
    if shapes != {wanted} or num_minutes != len(snapshots):
        rule = f"edges must be times x nodes x nodes, {(num_minutes, *wanted)}"
        shape = next(iter(shapes - {wanted}), wanted)
        raise _make_error(rule, (len(snapshots), *shape), file)
    parents = []
    for snapshot in map(_to_numbers, snapshots):  # one by one: many may be the same tensor
        parents.append(np.where(snapshot.any(axis=1), snapshot.argmax(axis=1), -1))
    return _Day(minutes, np.stack(parents))


def _to_numbers(values: Any) -> np.ndarray:
    return torch.as_tensor(values).to(torch.float64).numpy()


def _find_movers(days: Sequence[_Day]) -> np.ndarray:
    """Mark the nodes whose parent ever changes, within a day or between days, bool (N,)."""
    first = days[0].parent[0]
    return np.any([(day.parent != first).any(axis=0) for day in days], axis=0)


def _clean(names: Sequence[str]) -> list[str]:
    return [re.sub(r"^food ", "", name.replace("_", " ").lower().strip()) for name in names]


def _build(folder: Path, nodes: _Nodes, days: Sequence[_Day]) -> tuple[Trace, HomerSummary]:
    """Put places, rooms and events together."""
    objects = np.flatnonzero(nodes.is_object)
    places = np.stack(
        [_find_places(nodes, parent)[objects] for day in days for parent in day.parent]
    )
    used = np.unique(places)  # of (T, O)
    used = used[used >= 0]
    if not len(used):
        raise ValueError(
            f"household must hold an object at a place, got none in {folder}. Check it."
        )
    room_of = {node: _find_room(nodes, days[0].parent[0], node) for node in used.tolist()}
    left_out: dict[str, Counter[str]] = defaultdict(Counter)
    for outside in [key for key, room in room_of.items() if room < 0]:
        left_out["in no room"][nodes.names[outside]] += 1
        del room_of[outside]
    rooms = sorted(set(room_of.values()))
    order = sorted(room_of, key=lambda node: (rooms.index(room_of[node]), node))
    room_names = number_names([nodes.names[room] for room in rooms])
    labels = ["floor" if nodes.is_room[node] else nodes.names[node] for node in order]
    in_room = [rooms.index(room_of[node]) for node in order]
    names = number_names(
        [
            f"{room_names[room]} floor" if nodes.is_room[node] else nodes.names[node]
            for node, room in zip(order, in_room, strict=True)
        ]
    )
    layout = Layout.of(
        map(Room, (nodes.names[room] for room in rooms), room_names),
        map(Furniture, labels, in_room, labels, names),
    )
    known = load_types().furniture  # the source does not tell "in" from "on": the usual relation
    relations = [
        RELATIONS.index(known[label].relation if label in known else USUAL_RELATION)
        for label in labels
    ]
    texts = number_names([nodes.names[node] for node in objects])
    number_of = np.full(len(nodes.names) + 1, -1)  # of a place, by node; the last for node -1
    number_of[order] = np.arange(len(order))
    times = np.concatenate([n * DAY_SECONDS + day.minutes * 60 for n, day in enumerate(days)])
    times[0] = 0.0
    events = []
    for text, item, column in zip(texts, objects, number_of[places].T, strict=True):
        last_place = -1
        for time, now in zip(times.tolist(), column.tolist(), strict=True):
            if now >= 0 and now != last_place:
                events.append(Event(time, text, nodes.names[item], now, relations[now]))
                last_place = now
    events.sort(key=lambda event: event.time_s)
    placed = {event.object for event in events}
    if unseen := sorted(set(texts) - placed):
        left_out["never at a place"].update(unseen)
    name, until_s = folder.resolve().name, len(days) * DAY_SECONDS
    trace = Trace(name, layout, tuple(events), start=FIRST_DAY, until_s=until_s)
    return trace, HomerSummary(len(days), len(order), len(placed), left_out)


def _find_places(nodes: _Nodes, parent: np.ndarray) -> np.ndarray:
    """Return the place of every node: its nearest ancestor that is no object, or -1, (N,)."""
    place = parent.copy()
    for _ in range(len(parent)):  # a chain has no more links than there are nodes
        is_in_object = (place >= 0) & nodes.is_object[np.maximum(place, 0)]
        if not is_in_object.any():
            return place
        place[is_in_object] = parent[place[is_in_object]]
    return np.where(nodes.is_object[np.maximum(place, 0)], -1, place)  # a circle of objects


def _find_room(nodes: _Nodes, parent: np.ndarray, node: int) -> int:
    """Return the room that a place is in, itself if it is one, -1 if it is in none."""
    for _ in range(len(parent)):
        if node < 0 or nodes.is_room[node]:
            return node
        node = int(parent[node])
    return -1
