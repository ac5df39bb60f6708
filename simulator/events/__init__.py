"""What robots saw as streams of events: one row per look at a thing's possible place."""

from simulator.events.files import load_events, save_events
from simulator.events.recorder import EventRecorder, collect_events
from simulator.events.table import EventTable

__all__ = ["EventRecorder", "EventTable", "collect_events", "load_events", "save_events"]
