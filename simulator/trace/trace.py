"""A trace: what was where in a home, and when. A folder of `layout.json` and `events.csv`.

Beside them a simulator writes what only it knows of the home: `simulation.json`.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from sgm.files import VERSION, VersionError, check_version, read_json, write_whole
from sgm.layout.layout import Layout
from sgm.memory.clock import Clock
from sgm.memory.scene_graph_memory import SceneGraphMemory
from sgm.memory.sighting import Sighting
from sgm.messages import shorten, shorten_values
from sgm.names.words import read_words
from sgm.prior.prior_graph import PriorGraph
from sgm.schema import RELATIONS, PlaceCode
from simulator.trace.events import EVENTS_FILE, GONE, Event, load_events, make_events_csv
from simulator.trace.layout import LAYOUT_FILE, load_layout, make_layout_json
from simulator.world.config import HomeConfig

TRUTH_FILE = "simulation.json"
MAX_SLOTS = 100_000  # of a home
_BROKEN = (
    OSError,
    ValueError,
    TypeError,
    KeyError,
    AttributeError,
    OverflowError,
    RecursionError,
)

# Weights of places by the text of what lies there: {"mug": {"3": 0.25, ...}, ...}
Weights = Mapping[str, Mapping[int, float]]
_MOST_ENTRIES = 10_000  # of a folder that is searched for traces


@dataclass(frozen=True)
class Truth:
    """The rules and dynamics of a simulated home; a recorded one has none.

    Attributes:
        config: the rules.
        step_seconds: length of a time step.
        num_slots: most objects that the home can hold; detection draws one number for each.
        transitions: true dynamics T by description: weight by place (2 x furniture + relation).
        place_weights: class weights by object label: weight by place.
    """

    config: HomeConfig
    step_seconds: float
    num_slots: int
    transitions: Weights
    place_weights: Weights


def list_weights(weights: np.ndarray) -> dict[int, float]:
    """List the places of a row of weights (P,) that are not zero."""
    return {int(place): float(weights[place]) for place in np.flatnonzero(weights)}


def fill_row(weights: Mapping[int, float], num_place_codes: int) -> np.ndarray:
    """Return a row of weights, float32 (P,)."""
    filled = np.zeros(num_place_codes, dtype=np.float32)
    filled[list(weights)] = list(weights.values())
    return filled


def make_truth_json(truth: Truth) -> str:
    """Write the text of a `simulation.json`; numbers come back as the same float32."""
    data = {
        "version": VERSION,
        "step_seconds": truth.step_seconds,
        "num_slots": truth.num_slots,
        "rules": truth.config.describe(),
        "transitions": truth.transitions,
        "place_weights": truth.place_weights,
    }
    return json.dumps(data, ensure_ascii=False) + "\n"


def load_truth(path: Path, num_place_codes: int) -> Truth | None:
    """Read a `simulation.json` beside a layout of P places; None if there is none.

    Raises:
        ValueError: if the file is broken; it is named.
    """
    if not path.exists():
        return None
    try:
        data = read_json(path)
        check_version("simulation", data["version"], path)
        truth = Truth(
            HomeConfig.from_json(data["rules"]),
            float(data["step_seconds"]),
            int(data["num_slots"]),
            _read_weights(data["transitions"], num_place_codes),
            _read_weights(data["place_weights"], num_place_codes),
        )
        if not 0 < truth.step_seconds < math.inf:
            raise ValueError(f"step_seconds {truth.step_seconds}")
        if not 1 <= truth.num_slots <= MAX_SLOTS:
            raise ValueError(
                f"num_slots {shorten(truth.num_slots)}, which must lie in 1 to {MAX_SLOTS}"
            )
    except VersionError:
        raise
    except _BROKEN as error:
        raise ValueError(
            f"{path}: simulation must be whole, got {type(error).__name__}: "
            f"{shorten_values(str(error))}. Record the home again, or delete the file to replay it "
            "like any recorded home."
        ) from None
    return truth


def _read_weights(data: Any, num_place_codes: int) -> Weights:
    weights = {
        str(text): {int(place): float(weight) for place, weight in places.items()}
        for text, places in data.items()
    }
    for text, places in weights.items():
        if not all(
            0 <= place < num_place_codes and weight >= 0 for place, weight in places.items()
        ):
            raise ValueError(
                f"a place outside the layout, or a negative weight, for {shorten(text)}"
            )
    return weights


@dataclass(frozen=True)
class Trace:
    """One recorded home.

    Attributes:
        name: of its folder.
        layout: rooms and furniture, numbered from 0, which never change; all have names.
        events: what happened, in order of time; none in a map of the furniture alone, which can be
            remembered (`remember_trace`) and not be played.
        truth: the rules and dynamics of a simulated home, None for any other.
        start: local date and time of time 0; None if it is unknown.
        until_s: until when the home was watched, in seconds; None for the last event.
    """

    name: str
    layout: Layout
    events: tuple[Event, ...]
    truth: Truth | None = None
    start: datetime | None = None
    until_s: float | None = None

    @property
    def start_s(self) -> float:
        """Time of the first event: the home is known from then on."""
        return self.events[0].time_s if self.events else 0.0

    @property
    def end_s(self) -> float:
        """Time until which the home was watched."""
        last = self.events[-1].time_s if self.events else 0.0
        return last if self.until_s is None else self.until_s

    @cached_property
    def num_slots(self) -> int:
        """Most objects that are in the home at once."""
        present: set[str] = set()
        most = 1 if self.truth is None else self.truth.num_slots
        for event in self.events:
            if event.furniture == GONE:
                present.discard(event.object)
            else:
                present.add(event.object)
            most = max(most, len(present))
        return most

    @cached_property
    def arrivals(self) -> Mapping[str, Counter[int]]:
        """How often an object of a description (its words) was put at a place, at first included.

        Changing the relation at the same furniture is no arrival.
        """
        counts: dict[str, Counter[int]] = defaultdict(Counter)
        place_of: dict[str, int] = {}
        for event in self.events:
            if event.furniture not in (GONE, place_of.get(event.object, GONE)):
                place = PlaceCode.of(event.furniture, event.relation)
                counts[read_words("description", event.description)][place] += 1
            place_of[event.object] = event.furniture
        return counts

    @cached_property
    def checksum(self) -> str:
        """SHA-256 of everything but the name."""
        digest = hashlib.sha256()
        for text in _make_files(self).values():
            digest.update(hashlib.sha256(text.encode()).digest())
        return digest.hexdigest()


def load_trace(folder: str | Path) -> Trace:
    """Read the folder of a trace.

    Raises:
        ValueError: if a file is missing or broken; names the file and the row.
    """
    folder = Path(folder)
    layout, start, until_s = load_layout(folder / LAYOUT_FILE)
    events = load_events(folder / EVENTS_FILE, layout, start)
    if until_s is not None and events and until_s < events[-1].time_s:
        raise ValueError(
            f"{folder / LAYOUT_FILE}: end_s must not be before the last event, got "
            f"{until_s:g} before {events[-1].time_s:g}. Raise it, or leave it out."
        )
    truth = load_truth(folder / TRUTH_FILE, PlaceCode.count(len(layout.furniture)))
    return Trace(folder.resolve().name, layout, events, truth, start, until_s)


def save_trace(trace: Trace, folder: str | Path) -> None:
    """Write a trace into a folder, which is made if needed.

    A folder that holds this very trace is left as it is: a command may be run again.

    Raises:
        ValueError: if the folder holds another trace.
        OSError: if it cannot be made, or the disk does not take the files.
    """
    folder = Path(folder)
    files = _make_files(trace)
    if (folder / LAYOUT_FILE).exists():
        if all(_holds(folder / name, text) for name, text in files.items()):
            return
        raise ValueError(
            f"folder must not hold another trace, got {LAYOUT_FILE} in {folder}. "
            "Choose another one."
        )
    folder.mkdir(parents=True, exist_ok=True)
    for name in reversed(files):  # the layout last: a folder with one holds a whole trace
        write_whole(folder / name, files[name].encode())


def _holds(path: Path, text: str) -> bool:
    content = text.encode()
    return path.is_file() and path.stat().st_size == len(content) and path.read_bytes() == content


def find_traces(folders: Sequence[str | Path]) -> list[Path]:
    """List the folders of traces among folders, or one level below them, in order of name.

    Raises:
        ValueError: if a folder holds none, or is too large to be searched.
    """
    found = []
    for folder in map(Path, folders):
        inside = [folder] if (folder / LAYOUT_FILE).exists() else _find_inside(folder)
        if not inside:
            raise ValueError(
                f"trace must be a folder with {LAYOUT_FILE} and {EVENTS_FILE}, or one of such "
                f"folders, got {folder}. Check the path."
            )
        found += inside
    return found


def _find_inside(folder: Path) -> list[Path]:
    """List the folders of traces in a folder, in order of name; none if it is no folder."""
    if not folder.is_dir():
        return []
    with os.scandir(folder) as entries:
        names = sorted(entry.name for entry in islice(entries, _MOST_ENTRIES + 1))
    if len(names) > _MOST_ENTRIES:
        raise ValueError(
            f"folder must be a trace, or hold at most {_MOST_ENTRIES} files and folders to search "
            f"for traces, got more in {folder}. Name the folder of a trace."
        )
    return [folder / name for name in names if os.path.exists(folder / name / LAYOUT_FILE)]


def _make_files(trace: Trace) -> dict[str, str]:
    files = {
        LAYOUT_FILE: make_layout_json(trace.layout, trace.start, trace.until_s),
        EVENTS_FILE: make_events_csv(trace.events, trace.layout),
    }
    if trace.truth is not None:
        files[TRUTH_FILE] = make_truth_json(trace.truth)
    return files


def remember_trace(trace: Trace, prior: PriorGraph | None = None) -> SceneGraphMemory:
    """Look once at all furniture of a recorded home at its end, without missing anything.

    Things are at the positions that their last events have, if any.

    A home without events is a map: its memory knows the furniture, and has looked at none of it.

    Room and furniture ids are their indices in the layout. If that says when it starts, the memory
    has a clock, with steps of an hour from the time of the looks on. The prior is the household
    prior if left out.
    """
    start = trace.start
    memory = SceneGraphMemory(prior, None if start is None else Clock(start).shift(trace.end_s))
    for room in trace.layout.rooms.values():
        memory.add_room(room.label)
    for piece in trace.layout.furniture.values():
        description = piece.name if piece.description == piece.label else piece.description
        memory.add_furniture(
            piece.label, piece.room, description, piece.position, piece.box, piece.open_cost
        )
    if not trace.events:
        return memory
    where = {event.object: event for event in trace.events}
    for furniture in trace.layout.furniture:
        seen = [
            Sighting(event.description, RELATIONS[event.relation], position=event.position)
            for event in where.values()
            if event.furniture == furniture
        ]
        memory.observe(furniture, seen)
    return memory
