"""Events of Frigate as looks: a camera's zones are places, and what it tracks are things.

Source: the events of Frigate, as its HTTP API lists them (`/api/events`) and as its topic
`frigate/events` of MQTT sends them, a message a line.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, TypeGuard

from sgm.checks import is_finite
from sgm.files import make_read_error, parse_json, read_file
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.messages import shorten
from sgm.names.words import is_name
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.importers.imported_looks import ImportedLooks, TimeOptions
from simulator.yaml_text import load_yaml

_MOST_BYTES = 1 << 30
_END_OF_TIME = 253402300800.0  # seconds: the year 10000, where dates end
_FLOOR = "floor"  # the place of what is in no zone of its camera


class _View(NamedTuple):
    """A place that a camera sees: its name, and a zone of it or "" for the rest."""

    camera: str
    zone: str


@dataclass(frozen=True, slots=True)
class _Change:
    """From a time on a tracked thing is in a view, or in none any more."""

    time: float
    track: str
    view: _View | None
    name: str
    score: float


@dataclass(frozen=True, slots=True)
class FrigatePlace:
    """What a zone or a camera looks at.

    Attributes:
        room: label of the room.
        furniture: label of the furniture.
    """

    room: str
    furniture: str


def load_places(path: Path) -> dict[str, FrigatePlace]:
    """Read what zones and cameras look at (YAML): `counter: {room: kitchen, furniture: counter}`.

    Raises:
        ValueError: if it cannot be read, or an entry is another one.
    """
    data = load_yaml("places", path)
    places = {}
    for name, entry in data.items() if isinstance(data, Mapping) else [("", data)]:
        is_place = isinstance(entry, Mapping) and set(entry) == {"room", "furniture"}
        if not (is_place and all(map(is_name, entry.values()))):
            raise ValueError(
                f"places must be room and furniture by zone or camera, got {shorten(entry)} for "
                f"{shorten(str(name))} in {path}. Write counter: {{room: kitchen, furniture: "
                "counter}."
            )
        places[str(name)] = FrigatePlace(entry["room"], entry["furniture"])
    return places


def read_frigate(
    path: Path,
    places: Mapping[str, FrigatePlace] | None = None,
    options: TimeOptions | None = None,
    *,
    ignore: Collection[str] = ("person",),
    prior: PriorGraph | None = None,
    file: Path | None = None,
) -> ImportedLooks:
    """Let a memory look at what cameras have tracked.

    Whenever a thing appears in a view, moves to another one, or is gone, that view is looked at:
    what is tracked there at that time is seen, and nothing else. So a thing that is gone is missed.
    Tracks are no identities: a cup that is seen anew has another one, and things differ by
    their names.

    Args:
        path: events as a list of JSON, or messages of MQTT, one a line.
        places: what zones and cameras look at; what is not named is a room called as the camera,
            with furniture called as the zone, and a "floor" for what is in no zone.
        options: how times become steps.
        ignore: labels that are no things.
        prior: of the memory; None for the household prior.
        file: new file in which the memory is kept; None for none.

    Raises:
        ValueError: if it cannot be read, is no such file, or has no event of a thing.
    """
    options = TimeOptions() if options is None else options
    counts: Counter[str] = Counter()
    reader = _EventReader(frozenset(ignore), counts)
    for entry in _list_entries(path):
        reader.read(entry)
    changes = sorted(reader.changes, key=lambda change: change.time)
    if not changes:
        said = ", ".join(f"{number} {name}" for name, number in sorted(counts.items()))
        raise ValueError(
            f"events must have one of a thing, got {said or 'none'} in {path}. Save what "
            "/api/events of Frigate lists, or messages of frigate/events, one a line."
        )
    memory = SceneGraphMemory(prior, options.make_clock(changes[0].time), path=file)
    looks = _Looks(memory, places or {})
    for change in changes:
        step = int((change.time - changes[0].time) // options.step_seconds)
        if step > memory.time:
            memory.step(step - memory.time, accept_jump=True)
        looks.take(change)
    return ImportedLooks(memory, looks.num_looks, counts)


def _list_entries(path: Path) -> list[Any]:
    """Read a list of events, or messages a line each."""
    try:
        content = read_file(path, _MOST_BYTES)
    except OSError as error:
        where = f"for {path}. Check the path."
        raise make_read_error(error, "events must be a file that can be read", where) from error
    entries, where = [], ""
    try:
        if content.lstrip()[:1] == b"[":
            return list(parse_json(content))
        for number, line in enumerate(content.splitlines(), 1):
            where = f"line {number} of "
            if line.strip():
                entries.append(parse_json(line))
    except ValueError as error:
        raise ValueError(
            f"events must be a list of JSON, or one message of MQTT a line, got {error} in "
            f"{where}{path}. Save what /api/events of Frigate lists, or mend the line."
        ) from None
    return entries


class _EventReader:
    """Reads events into changes.

    Attributes:
        changes: in the order of the file.
    """

    def __init__(self, ignore: frozenset[str], counts: Counter[str]) -> None:
        self.changes: list[_Change] = []
        self._ignore, self._counts = ignore, counts
        self._views: dict[str, _View | None] = {}  # of tracks, by messages

    def read(self, entry: Any) -> None:
        """Read an event, or a message, and count it."""
        is_message = isinstance(entry, Mapping) and isinstance(entry.get("after"), Mapping)
        event = entry["after"] if is_message else entry
        fault = _find_fault(event, self._ignore)
        if fault:
            self._counts[fault] += 1
        elif is_message:
            self._counts["messages"] += 1
            self._read_message(entry, event)
        else:
            self._counts["events"] += 1
            self._read_event(event)

    def _read_event(self, event: Mapping[str, Any]) -> None:
        """Read an event of the API, which is over or goes on; the last zone that it entered."""
        zones = event.get("zones", event.get("entered_zones"))
        self._add(event, event["start_time"], _find_view(event, zones))
        if _is_time(event.get("end_time")):
            self._add(event, event["end_time"], None)

    def _read_message(self, message: Mapping[str, Any], event: Mapping[str, Any]) -> None:
        """Read a message of MQTT, which says where the thing is now."""
        is_over = message.get("type") == "end"
        time = event.get("end_time") if is_over else event.get("frame_time")
        view = None if is_over else _find_view(event, event.get("current_zones"))
        if str(event["id"]) not in self._views or self._views[str(event["id"])] != view:
            self._views[str(event["id"])] = view
            self._add(event, time if _is_time(time) else event["start_time"], view)

    def _add(self, event: Mapping[str, Any], time: float, view: _View | None) -> None:
        change = _Change(float(time), str(event["id"]), view, _find_name(event), _find_score(event))
        self.changes.append(change)


def _find_fault(event: Any, ignore: frozenset[str]) -> str:
    """Return why an event is left out; "" where it is not."""
    if not isinstance(event, Mapping):
        return "entries that are no events"
    texts = (event.get("id"), event.get("camera"), event.get("label"))
    start = event.get("start_time")
    if not all(map(_is_spelt, texts)) or not _is_time(start):
        return "events without id, camera, label or start_time"
    data = event.get("data")
    if isinstance(data, Mapping) and data.get("type") not in (None, "object"):
        return "events of no tracked object"  # of a sound, or made by hand
    if event["label"] in ignore:
        return f"events of {shorten(event['label'], 30)}"
    return "false positives" if event.get("false_positive") is True else ""


def _find_view(event: Mapping[str, Any], zones: Any) -> _View:
    """Return the last of some zones of the camera, or the camera alone."""
    names = [zone for zone in zones if _is_spelt(zone)] if isinstance(zones, list) else []
    return _View(camera=event["camera"], zone=names[-1] if names else "")


def _find_name(event: Mapping[str, Any]) -> str:
    """Return what a thing is called: its own name, where Frigate has recognised it."""
    name = event.get("sub_label")
    if isinstance(name, list) and name:
        name = name[0]
    return _spell(name if _is_spelt(name) else event["label"])


def _find_score(event: Mapping[str, Any]) -> float:
    """Return the best score of a thing, from .5 to 1: it was seen, or there were no event."""
    data = event.get("data")
    known = {**(data if isinstance(data, Mapping) else {}), **event}
    scores = [known.get(name) for name in ("top_score", "score")]
    score = max((float(value) for value in scores if is_finite(value)), default=1.0)
    return min(max(score, 0.5), 1.0)


def _spell(name: str) -> str:
    return name.replace("_", " ")


def _is_spelt(text: object) -> TypeGuard[str]:
    """Tell whether a text is a name as it is spelt here."""
    return isinstance(text, str) and is_name(_spell(text))


def _is_time(value: object) -> TypeGuard[float]:
    """Tell whether a value is a time of Unix that has a date."""
    return is_finite(value) and 0 <= value < _END_OF_TIME


class _Looks:
    """Tells a memory what is in each view, as it changes."""

    def __init__(self, memory: SceneGraphMemory, places: Mapping[str, FrigatePlace]) -> None:
        self._memory, self._places = memory, places
        self._rooms: dict[str, int] = {}
        self._furniture: dict[tuple[str, str], int] = {}
        self._tracked: dict[str, _Change] = {}
        self._things: dict[int, dict[str, _Change]] = defaultdict(dict)  # by furniture and track
        self.num_looks = 0

    def take(self, change: _Change) -> None:
        """Take a change: look at where the thing was, and at where it is."""
        before = self._tracked.pop(change.track, None)
        looked_at = []
        if before is not None and before.view is not None:
            place = self._find_place(before.view)
            del self._things[place][change.track]
            looked_at.append(place)
        if change.view is not None:
            place = self._find_place(change.view)
            self._things[place][change.track] = self._tracked[change.track] = change
            looked_at.append(place)
        for place in dict.fromkeys(looked_at):
            seen = [
                Sighting(thing.name, "onTop", thing.score) for thing in self._things[place].values()
            ]
            self._memory.observe(place, seen)
            self.num_looks += 1

    def _find_place(self, view: _View) -> int:
        known = self._places.get(view.zone) or self._places.get(view.camera)
        if known is None:
            known = FrigatePlace(_spell(view.camera), _spell(view.zone) or _FLOOR)
        if known.room not in self._rooms:
            self._rooms[known.room] = self._memory.add_room(known.room)
        key = known.room, known.furniture
        if key not in self._furniture:
            self._furniture[key] = self._memory.add_furniture(
                known.furniture, self._rooms[known.room]
            )
        return self._furniture[key]
