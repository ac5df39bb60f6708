"""Homes that things leave and come back to, simulated and recorded."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from sgm.layout.layout import Layout
from sgm.messages import shorten
from sgm.prior.prior_graph import PriorGraph
from simulator.trace.events import GONE
from simulator.trace.source import RecordedSource
from simulator.trace.trace import Trace, find_traces, load_trace, save_trace
from simulator.world.config import HomeConfig
from simulator.world.routine.dynamics import RoutineDynamics
from simulator.world.source import SampledSource
from tools.bench.robot_life import LivedHome

STEP_SECONDS = 1800.0
_CARRIES = {"carry_share": 0.9, "away_share": 0.75, "home_office_share": 0.1}
# Kinds of simulated homes, by what their residents carry out of them.
KINDS: dict[str, tuple[str, dict[str, Any]]] = {
    "carrying": ("people who carry things out", _CARRIES),
    "anything": (
        "people who carry out things that no name tells",
        {**_CARRIES, "carries_anything": True},
    ),
    "routine": ("people with routines, as in the other tables", {}),
}
RECORDED = "recorded"


def list_simulated(group: str, num_homes: int, looks: int, seed: int) -> list[LivedHome]:
    """List simulated homes of 12 to 36 places; their prior is the household prior.

    Raises:
        ValueError: if there is no such kind.
    """
    if group not in KINDS:
        raise ValueError(
            f"kinds must be some of {', '.join(KINDS)}, got {shorten(group)}. Choose among these."
        )
    homes = []
    for number in range(num_homes):
        rules = HomeConfig(
            furniture_per_room=(3, 6, 9)[number % 3],
            objects_per_furniture=3,
            looks="random",
            looks_per_step=looks,
            dynamics=RoutineDynamics(step_seconds=STEP_SECONDS, **KINDS[group][1]),
        )
        source = SampledSource(PriorGraph.household(), rules)
        name = f"{group} {number}"
        homes.append(LivedHome(name, source, number, seed, name, group))
    return homes


def list_recorded(
    folders: Sequence[str], outside: Sequence[str], looks: int, folder: Path, seed: int
) -> list[LivedHome]:
    """List recorded homes, each without the furniture that stands outside of it.

    Args:
        folders: traces, or folders of traces.
        outside: names of furniture; what is there has left the home.
        looks: in each time step.
        folder: where copies without it are written.
        seed: of the looks.
    """
    rules = HomeConfig(looks="random", looks_per_step=looks)
    homes = []
    for path in find_traces(folders):
        trimmed = folder / path.name
        if not trimmed.exists():
            save_trace(leave_out(load_trace(path), outside), trimmed)
        source = RecordedSource(PriorGraph.household(), rules, [str(trimmed)], STEP_SECONDS)
        homes.append(LivedHome(path.name, source, 0, seed, path.name, RECORDED))
    return homes


def leave_out(trace: Trace, outside: Sequence[str]) -> Trace:
    """Return a trace in which some furniture is out of the home: what is there has left."""
    layout = trace.layout
    kept = [number for number, node in layout.furniture.items() if node.name not in outside]
    new_furniture = {number: position for position, number in enumerate(kept)}
    rooms = sorted({layout.furniture[number].room for number in kept})
    new_room = {room: number for number, room in enumerate(rooms)}
    events, present = [], set[str]()
    for event in trace.events:
        furniture = new_furniture.get(event.furniture, GONE)
        if furniture == GONE and event.object not in present:
            continue  # it comes into the home later
        present.discard(event.object)
        if furniture != GONE:
            present.add(event.object)
        events.append(replace(event, furniture=furniture))
    nodes = [layout.furniture[number] for number in kept]
    return replace(
        trace,
        layout=Layout.of(
            [layout.rooms[room] for room in rooms],
            [replace(node, room=new_room[node.room]) for node in nodes],
        ),
        events=tuple(events),
    )
