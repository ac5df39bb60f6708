"""Recorded homes: traces that are read, checked, written and replayed like simulated homes."""

from sgm.layout.furniture import Furniture, Room
from sgm.layout.layout import Layout
from simulator.trace.episode import Episode, make_episode, split_days
from simulator.trace.events import Event
from simulator.trace.record import TraceRecorder, record_homes
from simulator.trace.recorded_homes import RecordedHomes
from simulator.trace.source import RecordedSource
from simulator.trace.trace import Trace, find_traces, load_trace, save_trace

__all__ = [
    "Episode",
    "Event",
    "Furniture",
    "Layout",
    "RecordedHomes",
    "RecordedSource",
    "Room",
    "Trace",
    "TraceRecorder",
    "find_traces",
    "load_trace",
    "make_episode",
    "record_homes",
    "save_trace",
    "split_days",
]
