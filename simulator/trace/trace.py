"""A trace: what was where in a home, and when. A folder of `layout.json` and `events.csv`."""

from __future__ import annotations

import hashlib
import os
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from itertools import islice
from pathlib import Path

from sgm.arrays.relations import NUM_RELATIONS
from sgm.files import write_whole
from sgm.layout.layout import Layout
from sgm.names.words import read_words
from simulator.trace.events import EVENTS_FILE, GONE, Event, load_events, make_events_csv
from simulator.trace.layout import LAYOUT_FILE, load_layout, make_layout_json
from simulator.trace.simulation_file import TRUTH_FILE, Truth, load_truth, make_truth_json

_MOST_ENTRIES = 10_000  # of a folder that is searched for traces


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
        at: dict[str, int] = {}
        for event in self.events:
            if event.furniture not in (GONE, at.get(event.object, GONE)):
                place = event.furniture * NUM_RELATIONS + event.relation
                counts[read_words("description", event.description)][place] += 1
            at[event.object] = event.furniture
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
    truth = load_truth(folder / TRUTH_FILE, len(layout.furniture) * NUM_RELATIONS)
    return Trace(folder.resolve().name, layout, events, truth, start, until_s)


def save_trace(trace: Trace, folder: str | Path) -> None:
    """Write a trace into a folder, which is made if needed.

    Raises:
        ValueError: if the folder holds a trace already.
        OSError: if it cannot be made, or the disk does not take the files.
    """
    folder = Path(folder)
    if (folder / LAYOUT_FILE).exists():
        raise ValueError(
            f"folder must not hold a trace yet, got {LAYOUT_FILE} in {folder}. Choose another one."
        )
    folder.mkdir(parents=True, exist_ok=True)
    files = _make_files(trace)
    for name in reversed(files):  # the layout last: a folder with one holds a whole trace
        write_whole(folder / name, files[name].encode())


def find_traces(folders: Sequence[str | Path]) -> list[Path]:
    """List the folders of traces among folders, or one level below them, in order of name.

    Raises:
        ValueError: if a folder holds none, or is too large to be searched.
    """
    found = []
    for folder in map(Path, folders):
        if (folder / LAYOUT_FILE).exists():
            found.append(folder)
            continue
        inside = _find_inside(folder) if folder.is_dir() else []
        if not inside:
            raise ValueError(
                f"trace must be a folder with {LAYOUT_FILE} and {EVENTS_FILE}, or one of such "
                f"folders, got {folder}. Check the path."
            )
        found += inside
    return found


def _find_inside(folder: Path) -> list[Path]:
    """List the folders of traces in a folder, in order of name."""
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
